"""Tilt from a raw accelerometer and gyro, with the robot's own acceleration taken out.

An accelerometer alone tilts by ``atan(a / g)`` when the robot accelerates: 2.9 degrees at
0.5 m/s². So what the wheels say of that acceleration is subtracted first, what still does not have
the length of gravity is left out, and the gyro carries the angles over (a complementary filter).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bearcub.clock import Clock
from bearcub.devices.driver import Conversation, Driver, Measured
from bearcub.devices.framing import Parser
from bearcub.devices.protocols import Reading
from bearcub.messages import Inertial, Tilt, WheelState

GRAVITY = 9.80665  # [m/s²]


@dataclass(frozen=True, slots=True, kw_only=True)
class Acceleration:
    """The robot's own, in ``base_link`` [m/s²]: ahead, and to the left as in a left bend."""

    ahead: float = 0.0
    left: float = 0.0


AT_REST = Acceleration()


class Complementary:
    """The filter; pitch and roll are those of REP-103.

    Parameters
    ----------
    tau : float
        Time constant [s]: slower motion is the accelerometer's, faster the gyro's.
    gate : float
        How far the length of a specific force may be from gravity's for it to be used [m/s²].

    Examples
    --------
    A level robot that accelerates ahead by 0.5 m/s², and knows it:

    >>> inertial = Inertial(acceleration=(0.5, 0.0, GRAVITY), rate=(0.0, 0.0, 0.0))
    >>> Complementary().update(inertial, dt=0.0, own=Acceleration(ahead=0.5)).pitch == 0
    True
    """

    def __init__(self, *, tau: float = 1.0, gate: float = 1.0) -> None:
        self._tau = tau
        self._gate = gate
        self._pitch = self._roll = math.nan

    def update(self, inertial: Inertial, *, dt: float, own: Acceleration = AT_REST) -> Tilt:
        """Take one reading and return the tilt.

        Parameters
        ----------
        inertial : Inertial
        dt : float
            Since the previous one [s]; after more than `tau` the filter starts anew.
        own : Acceleration
            The robot's, as its wheels tell.
        """
        ax, ay, az = inertial.acceleration
        ax, ay = ax - own.ahead, ay - own.left
        pitch = math.atan2(-ax, math.hypot(ay, az))
        roll = math.atan2(ay, az)
        usable = abs(math.hypot(ax, ay, az) - GRAVITY) <= self._gate
        if math.isnan(self._pitch) or dt > self._tau:
            self._pitch, self._roll = pitch, roll
        else:
            self._turn(inertial, dt)
            if usable:
                share = dt / (self._tau + dt)
                self._pitch += share * (pitch - self._pitch)
                self._roll += share * math.remainder(roll - self._roll, math.tau)
        self._roll = math.remainder(self._roll, math.tau)
        return Tilt(pitch=self._pitch, roll=self._roll)

    def _turn(self, inertial: Inertial, dt: float) -> None:
        """Integrate the gyro by the rates of roll and pitch (Euler angles about x and y)."""
        p, q, r = inertial.rate
        # Within half a degree of straight up or down the roll has no meaning.
        limited = max(-1.56, min(1.56, self._pitch))
        sine, cosine = math.sin(self._roll), math.cos(self._roll)
        self._roll += (p + math.tan(limited) * (q * sine + r * cosine)) * dt
        self._pitch += (q * cosine - r * sine) * dt


class OwnAcceleration:
    """The robot's acceleration, from what its wheels say of speed and turning.

    Parameters
    ----------
    feedback : callable
        A drive's ``feedback``.
    smoothing : float
        Over how long the speed's change is averaged [s]; encoders make it jump.
    """

    def __init__(
        self, feedback: Callable[[], Reading[WheelState] | None], *, smoothing: float = 0.1
    ) -> None:
        self._feedback = feedback
        self._smoothing = smoothing
        self._last: Reading[WheelState] | None = None
        self._ahead = 0.0

    def __call__(self) -> Acceleration:
        """Return it now; none when the wheels say nothing that is fresh."""
        reading = self._feedback()
        if reading is None or not reading.fresh:
            self._last, self._ahead = None, 0.0
            return AT_REST
        state, last = reading.value, self._last
        dt = 0.0 if last is None else (reading.stamp_ns - last.stamp_ns) * 1e-9
        if last is not None and dt > 0:
            share = dt / (self._smoothing + dt)
            self._ahead += share * ((state.speed - last.value.speed) / dt - self._ahead)
        if last is None or dt > 0:
            self._last = reading
        return Acceleration(ahead=self._ahead, left=state.speed * state.turn_rate)


class Fused:
    """A driver of accelerations and rates, turned into a driver of `Tilt`.

    Parameters
    ----------
    driver : Driver
        Of `Inertial` values: `vectornav.VectorNavInertial`, `mip.MipInertial`,
        `xsens.XsensInertial`.
    clock : Clock
    own : callable
        The robot's own acceleration: an `OwnAcceleration`.
    tau, gate : float
        As for `Complementary`.
    """

    def __init__(
        self,
        driver: Driver[Any, Inertial],
        *,
        clock: Clock,
        own: Callable[[], Acceleration] = lambda: AT_REST,
        tau: float = 1.0,
        gate: float = 1.0,
    ) -> None:
        self._driver = driver
        self._clock = clock
        self._own = own
        self._filter = Complementary(tau=tau, gate=gate)
        self._last_ns: int | None = None

    @property
    def parser(self) -> Parser[Any]:
        """That of the driver inside."""
        return self._driver.parser

    def value(self, telegram: Any) -> Measured[Tilt] | None:
        """Return the tilt after one more reading."""
        measured = self._driver.value(telegram)
        if measured is None:
            return None
        now_ns = self._clock.now_ns()
        dt = 0.0 if self._last_ns is None else (now_ns - self._last_ns) * 1e-9
        self._last_ns = now_ns
        tilt = self._filter.update(measured.value, dt=dt, own=self._own())
        return Measured(tilt, measured.latency)

    def conversation(self) -> Conversation[Any]:
        """Return that of the driver inside."""
        return self._driver.conversation()

    def farewell(self) -> bytes:
        """Return that of the driver inside."""
        return self._driver.farewell()
