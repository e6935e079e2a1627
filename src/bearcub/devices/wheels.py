"""A robot on two driven wheels: its motion, its wheels' encoder counts, and where it went.

Frame: ``base_link``, x ahead; `omega` about z, left positive (REP-103).
"""

import math
from dataclasses import dataclass

from bearcub.errors import ConfigError

_COUNTER = 2**32  # encoder counts wrap at plus and minus 2^31


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheels:
    """What turns motion into encoder counts and back.

    Attributes
    ----------
    radius : float
        Of a wheel under load [m].
    track : float
        Between the middles of the two wheels' tyres [m].
    counts : float
        Encoder counts per turn of the wheel, gear included.
    left_sign, right_sign : int
        1 where counts go up when the wheel drives ahead, else -1.
    """

    radius: float
    track: float
    counts: float
    left_sign: int = 1
    right_sign: int = 1

    def __post_init__(self) -> None:
        for name in ("radius", "track", "counts"):
            if not 0 < getattr(self, name) < math.inf:
                raise ConfigError(f"wheels.{name} = {getattr(self, name)}: must be more than 0")
        for name in ("left_sign", "right_sign"):
            if getattr(self, name) not in (-1, 1):
                raise ConfigError(f"wheels.{name} = {getattr(self, name)}: must be 1 or -1")

    @property
    def counts_per_metre(self) -> float:
        """Encoder counts per metre that a wheel rolls."""
        return self.counts / (2 * math.pi * self.radius)

    def rates(self, v: float, omega: float) -> tuple[float, float]:
        """Return the left and right encoder's rates [counts/s] of a motion.

        Examples
        --------
        A wheel of 1 m circumference with 1000 counts:

        >>> wheels = Wheels(radius=0.5 / math.pi, track=0.5, counts=1000)
        >>> [round(rate) for rate in wheels.rates(1.0, 0.4)]  # left bend: the right wheel leads
        [900, 1100]
        """
        half = omega * self.track / 2
        scale = self.counts_per_metre
        return self.left_sign * (v - half) * scale, self.right_sign * (v + half) * scale

    def motion(self, left: float, right: float) -> tuple[float, float]:
        """Return (v [m/s], omega [rad/s]) of the encoder rates, or (way, angle) of steps."""
        left_way = self.left_sign * left / self.counts_per_metre
        right_way = self.right_sign * right / self.counts_per_metre
        return (left_way + right_way) / 2, (right_way - left_way) / self.track

    def limited(self, v: float, omega: float, *, speed: float) -> tuple[float, float]:
        """Return the motion slowed until no wheel exceeds `speed` [m/s]; its bend is kept."""
        fastest = abs(v) + abs(omega) * self.track / 2
        share = min(1.0, speed / fastest) if fastest > 0 else 1.0
        return v * share, omega * share


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """Where the robot is in the frame it started in: `x`, `y` [m], `yaw` [rad], left positive."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def moved(self, way: float, angle: float) -> "Pose":
        """Return the pose after an arc of length `way` [m] that turns by `angle` [rad].

        Examples
        --------
        A quarter of a circle of radius 1 m to the left:

        >>> end = Pose().moved(math.pi / 2, math.pi / 2)
        >>> print(f"{end.x:.3f} {end.y:.3f} {math.degrees(end.yaw):.0f}")
        1.000 1.000 90
        """
        half = angle / 2
        chord = way * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        yaw = self.yaw + angle
        return Pose(
            x=self.x + chord * math.cos(self.yaw + half),
            y=self.y + chord * math.sin(self.yaw + half),
            yaw=math.remainder(yaw, 2 * math.pi),
        )


class Odometry:
    """Adds up the ways of the two wheels to a pose, each step as an arc.

    Parameters
    ----------
    track : float
        Between the wheels [m].
    pose : Pose, optional
        Where to begin.

    Attributes
    ----------
    pose : Pose

    Examples
    --------
    On the spot to the left, wheels 0.5 m apart:

    >>> odometry = Odometry(track=0.5)
    >>> _ = odometry.update(10.0, 20.0)
    >>> end = odometry.update(10.0 - math.pi / 8, 20.0 + math.pi / 8)
    >>> print(f"{math.degrees(end.yaw):.0f}")
    90
    """

    def __init__(self, *, track: float, pose: Pose | None = None) -> None:
        self.pose = pose or Pose()
        self._track = track
        self._last: tuple[float, float] | None = None

    def update(self, left: float, right: float) -> Pose:
        """Return the pose when the wheels have rolled `left` and `right` [m] in all."""
        if self._last is not None:
            left_step, right_step = left - self._last[0], right - self._last[1]
            self.pose = self.pose.moved(
                (left_step + right_step) / 2, (right_step - left_step) / self._track
            )
        self._last = (left, right)
        return self.pose


class Rolled:
    """How far each wheel has rolled, from encoder counters that wrap and that may be reset.

    Parameters
    ----------
    wheels : Wheels

    Attributes
    ----------
    left, right : float
        [m], ahead positive.
    """

    def __init__(self, wheels: Wheels) -> None:
        self.left = self.right = 0.0
        self._wheels = wheels
        self._last: tuple[int, int] | None = None

    def restart(self) -> None:
        """Take the next counts as a new beginning: a controller that restarted counts from 0."""
        self._last = None

    def update(self, left: int, right: int) -> None:
        """Take the encoders' counts."""
        if self._last is not None:
            scale = self._wheels.counts_per_metre
            self.left += self._wheels.left_sign * _step(left, self._last[0]) / scale
            self.right += self._wheels.right_sign * _step(right, self._last[1]) / scale
        self._last = (left, right)


def _step(now: int, before: int) -> int:
    return (now - before + _COUNTER // 2) % _COUNTER - _COUNTER // 2
