"""From frames to shots: sizes, scales, depth, rigs."""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bearcub.devices import Frame
from bearcub.devices.protocols import Closing
from bearcub.errors import InputError
from bearcub.rig import Camera, Mount, Rig
from bearcub.runtime.feed import Decoding, Feed

RIG = Rig(
    camera=Camera(width=64, height=48, fx=40.0, fy=40.0, cx=31.5, cy=23.5, baseline=0.1, doffs=2.0),
    mount=Mount(height=1.0),
)


class Frames(Closing):
    """Frames out of memory."""

    rate_hz: float | None = None

    def __init__(self, *frames: Frame) -> None:
        self._frames = frames
        self.count: int | None = len(frames)

    def __iter__(self) -> Iterator[Frame]:
        return iter(self._frames)

    def close(self) -> None:
        """Nothing is open."""


def _saved(folder: Path, disparity: NDArray[Any], *, name: str = "map") -> Frame:
    path = folder / f"{name}.npy"
    np.save(path, disparity)
    return Frame(name=name, index=0, stamp_ns=7, disparity_path=path)


def _feed(*frames: Frame, scale: float = 1.0, decoding: Decoding | None = None) -> Feed:
    return Feed(
        Frames(*frames),
        RIG,
        tilts=itertools.repeat(None),
        source="the input",
        scale=scale,
        decoding=decoding,
    )


def test_pictures_shrink_by_area_and_the_rig_by_pixel_centres() -> None:
    image = np.zeros((48, 64), dtype=np.uint8)
    image[::2] = 200
    (shot,) = _feed(Frame(name="a", index=0, stamp_ns=7, left=image, right=image), scale=0.5)
    assert shot.snapshot.left is not None
    assert shot.snapshot.left.shape == (24, 32)
    assert (shot.snapshot.left == 100).all()
    camera = shot.rig.camera
    assert (camera.width, camera.fx, camera.cx, camera.doffs) == (32, 20.0, 15.5, 1.0)
    assert shot.snapshot.stamp_ns == 7
    assert shot.source == "the input"


def test_a_rig_of_another_size_is_scaled_and_that_is_said_once() -> None:
    image = np.zeros((96, 128), dtype=np.uint8)
    frames = [Frame(name=n, index=0, stamp_ns=0, left=image, right=image) for n in "ab"]
    first, second = _feed(*frames)
    assert first.notes == ("the rig: is for 64 x 48 px and scaled to the images' 128 x 96",)
    assert second.notes == ()
    assert second.rig.camera.fx == 80.0
    (shrunk,) = _feed(frames[0], scale=0.5)  # it is the size before shrinking that counts
    assert shrunk.notes == first.notes


def test_disparity_shrinks_without_mixing_near_and_far(tmp_path: Path) -> None:
    disparity = np.full((48, 64), 8.0, dtype=np.float32)
    disparity[:, 32:] = 2.0
    disparity[:10] = np.nan
    (shot,) = _feed(_saved(tmp_path, disparity), scale=0.5)
    found = shot.snapshot.disparity
    assert found is not None
    assert set(np.unique(found[~np.isnan(found)])) == {4.0, 1.0}
    assert np.isnan(found).mean() == pytest.approx(10 / 48)


def test_depth_becomes_disparity_before_doffs(tmp_path: Path) -> None:
    # d + doffs = fx B / Z = 40 * 0.1 / 0.5 = 8
    frame = _saved(tmp_path, np.full((48, 64), 0.5, dtype=np.float32))
    (shot,) = _feed(frame, decoding=Decoding(encoding="depth_m"))
    assert shot.snapshot.disparity is not None
    np.testing.assert_allclose(shot.snapshot.disparity, 6.0, rtol=1e-6)


def test_depth_of_half_the_size_has_half_the_focal_length(tmp_path: Path) -> None:
    frame = _saved(tmp_path, np.full((24, 32), 0.5, dtype=np.float32))
    (shot,) = _feed(frame, decoding=Decoding(encoding="depth_m"))
    assert shot.snapshot.disparity is not None
    np.testing.assert_allclose(shot.snapshot.disparity, 3.0, rtol=1e-6)


def test_what_was_guessed_is_noted_with_the_file(tmp_path: Path) -> None:
    frame = _saved(tmp_path, np.full((48, 64), 32, dtype=np.int16))
    (shot,) = _feed(frame)
    assert shot.notes == (f"{frame.disparity_path}: int16 read as OpenCV's sixteenths of a pixel",)


def test_a_map_of_another_size_than_the_first_is_named(tmp_path: Path) -> None:
    frames = [
        _saved(tmp_path, np.ones(shape, dtype=np.float32), name=name)
        for name, shape in (("one", (48, 64)), ("two", (24, 32)))
    ]
    with pytest.raises(InputError, match=r"two.npy: 32 x 24 pixels, expected 64 x 48"):
        list(_feed(*frames))


@pytest.mark.parametrize("scale", [0.0, -1.0, 1.5, float("nan")])
def test_a_scale_that_is_none_is_refused(scale: float) -> None:
    with pytest.raises(InputError, match=r"scale .* expected 0.05 to 1"):
        _feed(scale=scale)


def test_shots_of_a_sequence_are_named_by_their_frames() -> None:
    image = np.zeros((48, 64), dtype=np.uint8)
    frames = [Frame(name=n, index=i, stamp_ns=0, left=image) for i, n in enumerate("ab")]
    assert [shot.source for shot in _feed(*frames)] == [
        "frame a of the input",
        "frame b of the input",
    ]
