"""One motor axis of an emulated Galil controller: jog with a trapezoid, limits, following error."""

import math
from dataclasses import dataclass

_WRAP = 2**31
_AVERAGING = 0.25  # seconds over which TV averages


@dataclass(slots=True, kw_only=True)
class Axis:
    """What an axis is doing; times in seconds, everything else in counts.

    Attributes
    ----------
    commanded, actual : float
        Positions, unwrapped.
    speed : float
        Commanded [counts/s].
    jammed : bool
        The wheel is held: the commanded position runs away from the actual one.
    """

    commanded: float = 0.0
    actual: float = 0.0
    speed: float = 0.0
    measured_speed: float = 0.0
    jog: float = 25000.0
    acceleration: float = 256000.0
    deceleration: float = 256000.0
    motor_off: bool = True
    moving: bool = False
    stopping: bool = False
    stop_code: int = 1
    pending_code: int = 4
    error_limit: int = 16384
    off_on_error: bool = False
    forward_limit: bool = False
    reverse_limit: bool = False
    jammed: bool = False

    @property
    def position(self) -> int:
        """The encoder as TP tells it, wrapped at plus and minus 2^31."""
        return (round(self.actual) + _WRAP) % (2 * _WRAP) - _WRAP

    @property
    def error(self) -> int:
        """The position error as TE tells it."""
        return round(self.commanded - self.actual)

    def servo(self) -> None:
        """Hold the present position (SH)."""
        self.motor_off = False
        self.commanded = self.actual

    def off(self) -> None:
        """Let go (MO)."""
        self.motor_off = True
        self._stand(self.stop_code if not self.moving else self.pending_code)

    def begin(self) -> None:
        """Start to jog (BG)."""
        self.moving, self.stopping, self.stop_code = True, False, 0

    def stop(self, code: int = 4) -> None:
        """Decelerate to a stand (ST)."""
        if self.moving and not self.stopping:
            self.stopping, self.pending_code = True, code

    def abort(self) -> None:
        """Stop at once (AB)."""
        if self.moving:
            self._stand(7)

    def blocked(self, direction: float) -> bool:
        """Tell whether a limit switch forbids a motion in that direction."""
        return (self.forward_limit and direction > 0) or (self.reverse_limit and direction < 0)

    def advance(self, seconds: float) -> None:
        """Let time pass; a change of speed is linear, so the way is exact."""
        if seconds <= 0:
            return
        if self.moving and not self.stopping and self.blocked(self.speed or self.jog):
            self.stop(2 if self.forward_limit else 3)
        before = self.commanded
        if self.moving:
            self._ramp(seconds)
        way = self.commanded - before
        if not self.jammed:
            self.actual += way
        share = 1 - math.exp(-seconds / _AVERAGING)
        true_speed = 0.0 if self.jammed else way / seconds
        self.measured_speed += (true_speed - self.measured_speed) * share
        if self.off_on_error and not self.motor_off and abs(self.error) > self.error_limit:
            self.motor_off = True
            self._stand(8)

    def _ramp(self, seconds: float) -> None:
        target = 0.0 if self.stopping else self.jog
        faster = abs(target) > abs(self.speed) and target * self.speed >= 0
        rate = self.acceleration if faster else self.deceleration
        needed = abs(target - self.speed) / rate
        ramp = min(seconds, needed)
        end = (
            target
            if needed <= seconds
            else self.speed + math.copysign(rate * ramp, target - self.speed)
        )
        self.commanded += (self.speed + end) / 2 * ramp + end * (seconds - ramp)
        self.speed = end
        if self.stopping and end == 0.0:
            self._stand(self.pending_code)

    def _stand(self, code: int) -> None:
        self.moving, self.stopping, self.speed, self.stop_code = False, False, 0.0, code
