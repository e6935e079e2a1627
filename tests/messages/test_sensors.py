"""What sensors measure: scans are checked once, when they are made."""

import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import BeamFlag, Orientation, Scan, Tilt


def scan(n: int = 3, **changes: object) -> Scan:
    values: dict[str, object] = {
        "ranges": np.array([1.0, np.nan, -np.inf], dtype=np.float32)[:n],
        "angles": np.array([-0.1, 0.0, 0.1]),
    }
    return Scan(**(values | changes))  # type: ignore[arg-type]


def test_a_scan_has_as_many_beams_as_ranges_and_cannot_be_changed() -> None:
    found = scan(flags=np.array([0, BeamFlag.DAZZLED, 0], dtype=np.uint8))
    assert len(found) == 3
    for array in (found.ranges, found.angles, found.flags):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_arrays_of_different_lengths_are_refused() -> None:
    with pytest.raises(InputError, match=r"arrays of shapes \(2,\), \(3,\); expected one length"):
        scan(n=2)
    with pytest.raises(InputError, match="expected one length"):
        scan(intensities=np.zeros(4, dtype=np.float32))


@pytest.mark.parametrize(
    "angles", [[0.1, 0.0, -0.1], [0.0, 0.0, 0.1], [np.nan, 0.0, 0.1], [0.0, 0.1, np.inf]]
)
def test_beams_that_are_not_counter_clockwise_are_refused(angles: list[float]) -> None:
    with pytest.raises(InputError, match="angles do not ascend"):
        scan(angles=np.array(angles))


def test_an_orientation_is_a_tilt_that_knows_its_heading() -> None:
    found = Orientation(pitch=0.1, roll=0.2, yaw=0.3)
    assert isinstance(found, Tilt)
    assert found != Tilt(pitch=0.1, roll=0.2)
    assert (found.pitch, found.roll) == (0.1, 0.2)
