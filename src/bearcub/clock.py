"""Time, passed in: the only module that asks the machine what time it is."""

import time
from typing import Protocol


class Clock(Protocol):
    """Anything that tells monotonic time in nanoseconds."""

    def now_ns(self) -> int:
        """Return a time that never goes back [ns]."""
        ...


class MonotonicClock:
    """The machine's monotonic clock."""

    def now_ns(self) -> int:
        """Return the machine's monotonic time [ns]."""
        return time.perf_counter_ns()


class ManualClock:
    """A clock that moves only when told to, for tests.

    Examples
    --------
    >>> clock = ManualClock()
    >>> clock.advance(0.5)
    >>> clock.now_ns()
    500000000
    """

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the time set so far [ns]."""
        return self._now_ns

    def advance(self, seconds: float) -> None:
        """Move the clock forward by `seconds`."""
        self._now_ns += round(seconds * 1e9)


def elapsed_ms(clock: Clock, since_ns: int) -> float:
    """Return the milliseconds that `clock` counted since `since_ns`."""
    return (clock.now_ns() - since_ns) * 1e-6
