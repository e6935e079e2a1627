"""Tilt readings: degrees, radians by mistake, and one line a frame."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bearcub.devices.tilt_csv import parse_degrees, read_tilts
from bearcub.errors import InputError
from bearcub.geometry import Attitude, camera_attitude
from bearcub.messages import Ground, Tilt
from bearcub.rig import Mount
from bearcub.runtime.tilt import require_degrees, tilt_from_degrees, tilt_per_frame

MOUNT = Mount(height=1.2, pitch=math.radians(5.9))


def _floor(*, pitch_deg: float, roll_deg: float, seen: bool = True) -> Ground:
    """The ground a camera on `MOUNT` sees when the body is truly inclined so."""
    body = Attitude(pitch=math.radians(pitch_deg), roll=math.radians(roll_deg))
    camera = camera_attitude(body=body, mount=MOUNT.attitude)
    return Ground(
        plane=np.zeros(3),
        covariance=np.zeros((3, 3)),
        height=1.2,
        pitch=camera.pitch,
        roll=camera.roll,
        sigma_height=0.01,
        sigma_pitch=0.002,
        sigma_roll=0.002,
        noise=0.2,
        source="tilt+image",
        seen=seen,
        residual=0.2,
        tilt_disagreement=0.0,
    )


@pytest.mark.parametrize("text", ["90.1", "-91", "inf", "nan", "12deg", "0.2rad", "", "1,5"])
def test_what_is_no_angle_in_degrees_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="expected degrees"):
        parse_degrees(text)


def test_a_reading_that_is_not_there_is_none_and_a_missing_axis_level() -> None:
    assert tilt_from_degrees(None, None) is None
    assert tilt_from_degrees(None, 12.0) == Tilt(pitch=0.0, roll=math.radians(12.0))
    assert tilt_from_degrees(0.0, None) == Tilt(pitch=0.0, roll=0.0)


@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(0.0, 12.0), (7.0, -12.0), (-9.0, 0.0)])
def test_radians_are_told_when_they_fit_the_floor(pitch_deg: float, roll_deg: float) -> None:
    mistaken = tilt_from_degrees(math.radians(pitch_deg), math.radians(roll_deg))
    larger = "roll" if abs(roll_deg) > abs(pitch_deg) else "pitch"
    with pytest.raises(InputError, match=f"--{larger} .* in radians: give degrees"):
        require_degrees(mistaken, _floor(pitch_deg=pitch_deg, roll_deg=roll_deg), MOUNT)


def test_one_axis_in_radians_tells_when_the_other_is_wrong() -> None:
    # 0.2094 rad are the 12 deg of the floor; 0.1 rad would be 5.7 deg of pitch, not 0
    mistaken = tilt_from_degrees(0.1, 0.2094)
    with pytest.raises(InputError, match=r"--roll 0.2094: .* shows 12.0 deg.* in radians"):
        require_degrees(mistaken, _floor(pitch_deg=0.0, roll_deg=12.0), MOUNT)


@pytest.mark.parametrize(
    ("pitch_deg", "roll_deg", "true_pitch_deg"),
    [
        (0.2, 12.0, 0.2),  # right
        (0.2, 12.0, 5.2),  # 5 deg off, but not by a wrong unit
        (0.05, 0.0, 5.0),  # 5 deg off, and 0.05 rad is only 2.9 deg
        (0.03, 0.0, 1.7),  # less than 3 deg between both readings does not matter
    ],
)
def test_degrees_are_accepted_however_biased(
    pitch_deg: float, roll_deg: float, true_pitch_deg: float
) -> None:
    floor = _floor(pitch_deg=true_pitch_deg, roll_deg=roll_deg)
    require_degrees(tilt_from_degrees(pitch_deg, roll_deg), floor, MOUNT)


def test_no_floor_and_no_reading_tell_nothing() -> None:
    floor = _floor(pitch_deg=0.0, roll_deg=12.0)
    require_degrees(None, floor, MOUNT)
    require_degrees(tilt_from_degrees(0.0, 0.2094), replace(floor, seen=False), MOUNT)


def test_a_tilt_file_has_names_comments_and_frames_without_a_reading(tmp_path: Path) -> None:
    path = tmp_path / "tilts.csv"
    path.write_text("pitch, roll\n# standing\n0, 90\n\n,\n-45,0\n")
    first, second, third = read_tilts(path)
    assert first == Tilt(pitch=0.0, roll=math.pi / 2)
    assert second is None
    assert third == Tilt(pitch=-math.pi / 4, roll=0.0)


def test_more_frames_than_readings_are_told() -> None:
    tilts = tilt_per_frame([None], source=Path("tilts.csv"))
    assert next(tilts) is None
    with pytest.raises(InputError, match=r"tilts.csv: holds 1 readings.* frame 2 has none"):
        next(tilts)
