"""What the images say of a claim off the floor."""

import cv2
import numpy as np
import pytest

from bearcub.geometry import Float64
from bearcub.messages import Float32, UInt8
from bearcub.obstacles.verify import ALONG, AROUND, Witness

CLAIM = np.s_[20:34, 60:74]
FLOOR, STANDS = 5.25, 8.0  # [px]
COLUMNS = np.arange(160)


def taken(*, claim: float, dark: slice | None = None) -> Witness:
    """Return a textured pair, as `claim` disparity there and of the floor's elsewhere.

    `dark` columns of both images show nothing.
    """
    rng = np.random.default_rng(4)
    right = cv2.GaussianBlur(rng.normal(128, 60, (50, 160)), (0, 0), 1.0)
    d = np.full(right.shape, FLOOR)
    d[CLAIM] = claim
    rows = [np.interp(COLUMNS - k, COLUMNS, row) for k, row in zip(d, right, strict=True)]
    left = np.asarray(rows, dtype=np.float64) + rng.normal(0, 4, right.shape)

    def grey(image: Float64) -> UInt8:
        shown = image.clip(0, 255).astype(np.uint8)
        if dark is not None:
            shown[:, dark] = 0
        return shown

    return Witness(left=grey(left), right=grey(np.asarray(right, dtype=np.float64)))


def supported(witness: Witness, *, sure: float, window: tuple[int, int] = AROUND) -> bool:
    v, u = (k.ravel() for k in np.mgrid[CLAIM])

    def everywhere(disparity: float) -> Float32:
        return np.full(u.shape, disparity, dtype=np.float32)

    return witness.supports(u, v, everywhere(STANDS), everywhere(FLOOR), sure=sure, window=window)


@pytest.mark.parametrize("window", [AROUND, ALONG])
def test_what_stands_is_supported_and_what_lies_on_the_floor_is_not(
    window: tuple[int, int],
) -> None:
    assert supported(taken(claim=STANDS), sure=2.0, window=window)
    assert not supported(taken(claim=FLOOR), sure=0.0, window=window)


def test_what_is_elsewhere_in_a_row_has_no_say() -> None:
    # a match lies 8 px to the left at most, and a neighbourhood reaches 5 px farther
    certainties = np.arange(2.0, 8.0, 0.05)
    whole = [supported(taken(claim=STANDS), sure=sure) for sure in certainties]
    assert True in whole
    assert False in whole
    for dark in (np.s_[:47], np.s_[79:]):
        part = taken(claim=STANDS, dark=dark)
        assert [supported(part, sure=sure) for sure in certainties] == whole
