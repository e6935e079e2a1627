"""The motion that a drive was last told to make, and whether it still counts."""

import math

from bearcub.clock import Clock
from bearcub.errors import ConfigError, InputError


class Target:
    """One slot between the loop that commands and the thread that talks to the wheels.

    A command counts for `limit` seconds. A loop that hangs therefore stops the robot even though
    the thread lives on.

    Parameters
    ----------
    clock : Clock
    limit : float
        [s].
    """

    def __init__(self, clock: Clock, *, limit: float) -> None:
        if not 0 < limit <= 5.0:
            raise ConfigError(f"command_limit = {limit}: must be more than 0 and at most 5 seconds")
        self._clock = clock
        self._limit_ns = round(limit * 1e9)
        self._given: tuple[float, float, int] | None = None

    def set(self, speed: float, turn_rate: float) -> None:
        """Take a command [m/s], [rad/s].

        Raises
        ------
        InputError
            If a number is not finite.
        """
        if not (math.isfinite(speed) and math.isfinite(turn_rate)):
            raise InputError(
                f"drive command of {speed} m/s and {turn_rate} rad/s: expected finite numbers"
            )
        self._given = (float(speed), float(turn_rate), self._clock.now_ns())

    def clear(self) -> None:
        """Forget the command: stop."""
        self._given = None

    def current(self) -> tuple[float, float] | None:
        """Return the command that counts now; None is the command to stop."""
        given = self._given  # one load: the other thread may replace it at any time
        if given is None or self._clock.now_ns() - given[2] > self._limit_ns:
            return None
        return given[:2]
