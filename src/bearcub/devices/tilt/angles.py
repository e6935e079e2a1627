"""From a device's own angles to those of REP-103."""

import math
from dataclasses import dataclass

from bearcub.errors import FormatError
from bearcub.messages import Orientation, Tilt


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """What a device means by its signs, as it is mounted with its front ahead.

    The default is that of aircraft and of every device here but Xsens: x ahead, y right, z down.

    Attributes
    ----------
    nose_up : bool
        Whether its pitch is positive with the nose up; REP-103 has the nose down positive.
    right_down : bool
        Whether its roll is positive with the right side down, as in REP-103.
    to_level : bool
        Whether its roll is the angle between its y axis and the level plane, as sensors with two
        separate axes measure it, not the angle turned about x, which is larger once it is pitched.
    compass : bool
        Whether its heading counts clockwise from north; REP-103 counts the other way from east.
    """

    nose_up: bool = True
    right_down: bool = True
    to_level: bool = False
    compass: bool = True


AIRCRAFT = Convention()
REP_103 = Convention(nose_up=False, compass=False)


def tilt_from(
    convention: Convention, *, pitch: float, roll: float, heading: float = math.nan
) -> Tilt:
    """Return a device's angles [rad]: a `Tilt`, with a heading an `Orientation`, yaw within ±pi.

    Raises
    ------
    FormatError
        If pitch or roll is not a number or beyond what the angle can be (90 and 180 degrees; less
        for a roll `to_level` of a sensor that is pitched).

    Examples
    --------
    A robot facing north-east, nose down, right side down, as an aircraft's instrument says it:

    >>> tilt_from(AIRCRAFT, pitch=-0.1, roll=0.2, heading=math.pi / 4)
    Orientation(pitch=0.1, roll=0.2, yaw=0.785...)
    """
    if convention.to_level and math.isfinite(pitch):
        sine = math.sin(roll) / max(math.cos(pitch), 1e-9)
        roll = math.asin(sine) if abs(sine) <= 1 else math.nan
    if not (abs(pitch) <= math.pi / 2 + 1e-6 and abs(roll) <= math.pi + 1e-6):
        raise FormatError(
            f"pitch {math.degrees(pitch):g} and roll {math.degrees(roll):g} degrees: "
            "expected at most 90 and 180"
        )
    pitch = -pitch if convention.nose_up else pitch
    roll = roll if convention.right_down else -roll
    if math.isnan(heading):
        return Tilt(pitch=pitch, roll=roll)
    yaw = math.pi / 2 - heading if convention.compass else heading
    return Orientation(pitch=pitch, roll=roll, yaw=math.remainder(yaw, math.tau))
