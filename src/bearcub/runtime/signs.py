"""The signs of a device, tried by a person who moves the robot."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bearcub.messages import Tilt, WheelState
from bearcub.runtime.verdict import Grade, Remark


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What a person is asked to do, and which number has to grow by it.

    Attributes
    ----------
    request : str
    quantity : str
    least : float
        Change that is surely meant [rad] or [m].
    shown : str
        The same for people.
    read : callable
        Returns the number of a value.
    key : str
        Of the device's table, to set where the number falls instead.
    """

    request: str
    quantity: str
    least: float
    shown: str
    read: Callable[[Any], float]
    key: str


_TILT = tuple(
    Trial(
        request=request,
        quantity=angle,
        least=math.radians(3.0),
        shown="3°",
        read=read,
        key=f"invert_{angle}",
    )
    for request, angle, read in (
        ("tilt the nose down", "pitch", lambda tilt: tilt.pitch),
        ("tilt the right side down", "roll", lambda tilt: tilt.roll),
    )
)
_WHEELS = tuple(
    Trial(
        request="push the robot ahead by hand",
        quantity=f"the {side} wheel's way",
        least=0.05,
        shown="5 cm",
        read=read,
        key=f"invert_{side}",
    )
    for side, read in (
        ("left", lambda wheels: wheels.left),
        ("right", lambda wheels: wheels.right),
    )
)


def trials_of(value: object) -> tuple[Trial, ...]:
    """Return the trials for a device that measures such values; none for one without signs."""
    if isinstance(value, Tilt):
        return _TILT
    if isinstance(value, WheelState) and math.isfinite(value.left) and not value.enabled:
        return _WHEELS  # motors that are on would hold the wheels
    return ()


def judge(trial: Trial, change: float) -> Remark:
    """Return whether the number went the way that the conventions say.

    Examples
    --------
    >>> nose_down, _ = trials_of(Tilt(pitch=0.0, roll=0.0))
    >>> print(judge(nose_down, 0.1))
    tilt the nose down: pitch went up, good
    """
    if change > 0:
        return Remark(f"{trial.request}: {trial.quantity} went up, good")
    return Remark(
        f"{trial.request}: {trial.quantity} went down",
        grade=Grade.FAULT,
        advice=f"change {trial.key} in its table",
    )


def unmoved(trial: Trial, seconds: float) -> Remark:
    """Return that nothing happened."""
    return Remark(
        f"{trial.request}: {trial.quantity} did not change by {trial.shown} within {seconds:g} s",
        grade=Grade.FAULT,
        advice="move it farther, or look how the sensor is mounted and connected",
    )
