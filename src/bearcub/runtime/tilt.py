"""Tilt readings that a user gives: parsed, and checked to be degrees."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from bearcub.errors import InputError
from bearcub.geometry import Attitude, camera_attitude
from bearcub.messages import Ground, Tilt
from bearcub.rig import Mount

_OFF = math.radians(3.0)  # a reading this far from the floor in the image is suspect
_FITS = math.radians(1.5)  # and its number in radians has to come this close


def parse_degrees(text: str) -> float:
    """Return an angle that a user wrote in degrees.

    Raises
    ------
    InputError
        If it is not a plain number, or not between -90 and 90.

    Examples
    --------
    >>> parse_degrees(" -12.5")
    -12.5
    >>> parse_degrees("0.2rad")
    Traceback (most recent call last):
    bearcub.errors.InputError: '0.2rad': expected degrees as a plain number such as 12.5
    """
    try:
        degrees = float(text)
    except ValueError:
        raise InputError(f"{text!r}: expected degrees as a plain number such as 12.5") from None
    if not abs(degrees) <= 90.0:
        raise InputError(f"{text.strip()}: expected degrees between -90 and 90")
    return degrees


def tilt_from_degrees(pitch: float | None, roll: float | None) -> Tilt | None:
    """Return the tilt of a body [deg]; an axis that is not given is level, neither is no reading.

    Examples
    --------
    >>> tilt_from_degrees(None, 90)
    Tilt(pitch=0.0, roll=1.5707963267948966)
    """
    if pitch is None and roll is None:
        return None
    return Tilt(pitch=math.radians(pitch or 0.0), roll=math.radians(roll or 0.0))


def read_tilts(path: Path) -> list[Tilt | None]:
    """Read one tilt a frame from a CSV of pitch and roll in degrees.

    A line is ``pitch,roll``; a line whose two fields are empty (``,``) is a frame without a
    reading. A first line that holds names, blank lines and lines after ``#`` are left out.

    Raises
    ------
    InputError
        If the file cannot be read or a line is neither, naming the line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not text (UTF-8)") from error
    rows = [(number, line.strip()) for number, line in enumerate(lines, 1)]
    rows = [(number, line) for number, line in rows if line and not line.startswith("#")]
    if rows and rows[0][1].replace(" ", "").casefold() in {"pitch,roll", "pitch_deg,roll_deg"}:
        rows = rows[1:]
    if not rows:
        raise InputError(f"{path}: expected lines 'pitch,roll' in degrees, found none")
    return [_tilt_of_line(line, where=f"{path}: line {number}") for number, line in rows]


def _tilt_of_line(line: str, *, where: str) -> Tilt | None:
    values = [field.strip() for field in line.split(",")]
    if len(values) != 2:
        raise InputError(f"{where}: {line!r}: expected 'pitch,roll' in degrees")
    if values == ["", ""]:
        return None
    try:
        pitch, roll = map(parse_degrees, values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return tilt_from_degrees(pitch, roll)


def tilt_per_frame(tilts: list[Tilt | None], *, source: Path) -> Iterator[Tilt | None]:
    """Give out the tilt of every frame.

    Raises
    ------
    InputError
        If there are more frames than readings.
    """
    yield from tilts
    raise InputError(
        f"{source}: holds {len(tilts)} readings, expected one for every frame: "
        f"frame {len(tilts) + 1} has none"
    )


def same_tilt(tilt: Tilt | None) -> Iterator[Tilt | None]:
    """Give out one tilt for all frames."""
    return itertools.repeat(tilt)


def require_degrees(tilt: Tilt | None, ground: Ground, mount: Mount, *, prefix: str = "--") -> None:
    """Raise when the floor in the image says that a tilt was given in radians.

    Parameters
    ----------
    tilt : Tilt or None
        As understood: what the user wrote, taken for degrees [rad].
    ground : Ground
        As fitted with it.
    mount : Mount
        Of the camera.
    prefix : str
        What the name of the axis follows in the message.

    Raises
    ------
    InputError
        If the reading is 3 deg or more from the floor seen, and with one or both of its numbers
        taken for radians it is within 1.5 deg.
    """
    if tilt is None or not ground.seen:
        return
    written = {"pitch": math.degrees(tilt.pitch), "roll": math.degrees(tilt.roll)}
    if max(map(abs, written.values())) > math.pi / 2:
        return
    # Both numbers, else one alone: the other may be wrong, or mean the camera with its mount.
    for axes in (("pitch", "roll"), ("pitch",), ("roll",)):
        in_radians = replace(tilt, **{axis: written[axis] for axis in axes})
        if _fits_in_radians(tilt, in_radians, ground, mount):
            axis = max(axes, key=lambda name: abs(written[name]))
            raise InputError(
                f"{prefix}{axis} {written[axis]:g}: the floor in the image shows "
                f"{math.degrees(written[axis]):.1f} deg, so this seems to be in radians: "
                "give degrees"
            )


def _fits_in_radians(tilt: Tilt, in_radians: Tilt, ground: Ground, mount: Mount) -> bool:
    """Tell whether the floor contradicts the one reading and agrees with the other."""
    seen = Attitude(roll=ground.roll, pitch=ground.pitch)
    one, other = (
        camera_attitude(body=Attitude(roll=t.roll, pitch=t.pitch), mount=mount.attitude)
        for t in (tilt, in_radians)
    )
    contradicted = min(_angle_between(one, seen), _angle_between(one, other)) > _OFF
    return contradicted and _angle_between(other, seen) < _FITS


def _angle_between(one: Attitude, other: Attitude) -> float:
    """Return the angle [rad] between the two directions to the ground."""
    cosine = float(one.down() @ other.down())
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))
