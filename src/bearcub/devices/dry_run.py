"""A drive without wheels: it answers as an ideal robot would, for trials on the desk."""

import math

from bearcub.clock import Clock
from bearcub.devices.health import Health
from bearcub.devices.protocols import Drive, Reading
from bearcub.devices.target import Target
from bearcub.errors import ConfigError
from bearcub.messages import WheelState


class DryRunDrive(Drive):
    """Follows every command with a limited acceleration and reports the way it would have gone.

    Parameters
    ----------
    clock : Clock
    track : float
        Between the wheels [m].
    acceleration : float
        Of the robot, also when it stops [m/s²]; it turns with as much at the wheels.
    command_limit : float
        How long a command counts [s].
    role : str
        What it is called in messages.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        track: float = 0.5,
        acceleration: float = 1.0,
        command_limit: float = 0.3,
        role: str = "drive",
    ) -> None:
        for name, value in (("track", track), ("acceleration", acceleration)):
            if not 0 < value < math.inf:
                raise ConfigError(f"dry run {name} = {value}: must be more than 0")
        self._name = f"{role} (dry run)"
        self._clock = clock
        self._target = Target(clock, limit=command_limit)
        self._limit_ns = round(command_limit * 1e9)
        self._track = track
        self._acceleration = acceleration
        self._wheels = [0.0, 0.0]  # left and right: m/s
        self._ways = [0.0, 0.0]
        self._commanded = (0.0, 0.0)
        self._commanded_ns = self._now_ns = clock.now_ns()
        self._count = 0
        self._started = False

    @property
    def name(self) -> str:
        """What it is called in messages: ``drive (dry run)``."""
        return self._name

    def start(self) -> None:
        """Begin."""
        self._started = True

    def command(self, speed: float, turn_rate: float) -> None:
        """Drive at `speed` [m/s] and `turn_rate` [rad/s]."""
        self._target.set(speed, turn_rate)
        self._advance()
        half = turn_rate * self._track / 2
        self._commanded = (speed - half, speed + half)
        self._commanded_ns = self._now_ns

    def stop(self) -> None:
        """Stop."""
        self._advance()
        self._target.clear()
        self._commanded = (0.0, 0.0)

    def feedback(self) -> Reading[WheelState] | None:
        """Return what ideal wheels would do now."""
        if not self._started:
            return None
        self._advance()
        self._count += 1
        left, right = self._wheels
        state = WheelState(
            left=self._ways[0],
            right=self._ways[1],
            speed=(left + right) / 2,
            turn_rate=(right - left) / self._track,
            enabled=True,
        )
        return Reading(value=state, stamp_ns=self._now_ns, age=0.0, fresh=True, count=self._count)

    def health(self) -> Health:
        """Return that all is well, once it is started."""
        problem = "" if self._started else f"{self._name}: closed"
        return Health(name=self._name, problem=problem, connected=self._started, age=0.0)

    def close(self) -> None:
        """Stop and end."""
        self.stop()
        self._started = False

    def _advance(self) -> None:
        """Live through the time since the last call: first under the command, then without."""
        now_ns = self._clock.now_ns()
        expiry_ns = max(self._now_ns, min(now_ns, self._commanded_ns + self._limit_ns))
        for wheel in (0, 1):
            self._roll(wheel, self._commanded[wheel], (expiry_ns - self._now_ns) * 1e-9)
            self._roll(wheel, 0.0, (now_ns - expiry_ns) * 1e-9)
        self._now_ns = now_ns

    def _roll(self, wheel: int, target: float, seconds: float) -> None:
        speed = self._wheels[wheel]
        ramp = min(seconds, abs(target - speed) / self._acceleration)
        end = speed + math.copysign(self._acceleration * ramp, target - speed)
        self._ways[wheel] += (speed + end) / 2 * ramp + end * (seconds - ramp)
        self._wheels[wheel] = end
