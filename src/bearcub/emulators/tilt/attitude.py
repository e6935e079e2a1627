"""What an emulated tilt sensor measures unless a simulated world stands behind it."""

import math
from collections.abc import Callable

from bearcub.devices.tilt.complementary import GRAVITY
from bearcub.messages import Inertial, Orientation, Tilt

Attitude = Callable[[int], Tilt]
"""The body's true attitude at a time [ns]."""

_STEP_NS = 1_000_000


def rocking(now_ns: int) -> Orientation:
    """Return a robot that pitches by 5 degrees and rolls by 3, once in 8 and 5 seconds."""
    seconds = now_ns * 1e-9
    return Orientation(
        pitch=math.radians(5.0) * math.sin(math.tau * seconds / 8.0),
        roll=math.radians(3.0) * math.sin(math.tau * seconds / 5.0),
        yaw=0.0,
    )


def inertial(attitude: Attitude, now_ns: int) -> Inertial:
    """Return what an accelerometer and a gyro measure of an attitude, standing still in place.

    Axes of ``base_link``. The rates are the change over two milliseconds around that time.
    """
    tilt = attitude(now_ns)
    before, after = attitude(now_ns - _STEP_NS), attitude(now_ns + _STEP_NS)
    seconds = 2 * _STEP_NS * 1e-9
    pitching = (after.pitch - before.pitch) / seconds
    rolling = (after.roll - before.roll) / seconds
    up = (
        -math.sin(tilt.pitch),
        math.cos(tilt.pitch) * math.sin(tilt.roll),
        math.cos(tilt.pitch) * math.cos(tilt.roll),
    )
    return Inertial(
        acceleration=(GRAVITY * up[0], GRAVITY * up[1], GRAVITY * up[2]),
        rate=(rolling, pitching * math.cos(tilt.roll), -pitching * math.sin(tilt.roll)),
    )


def heading_deg(tilt: Tilt) -> float:
    """Return the compass heading, clockwise from north, 0 to 360 degrees; east if not known."""
    yaw = tilt.yaw if isinstance(tilt, Orientation) else 0.0
    return math.degrees(math.pi / 2 - yaw) % 360
