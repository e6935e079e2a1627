"""Tilt readings that a user gives, one a frame, and checked to be degrees."""

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
