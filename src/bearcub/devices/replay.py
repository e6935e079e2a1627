"""Recorded values as a source: no thread, no device."""

import bisect
import math
from collections.abc import Sequence
from typing import TypeVar

from bearcub.clock import Clock
from bearcub.devices.health import Health, silence_limit
from bearcub.devices.protocols import Reading, Source

T = TypeVar("T")


class Replay(Source[T]):
    """Values of a recording, each from its time on; their times count from the start.

    Parameters
    ----------
    values : sequence of (float, T)
        Seconds since the start of the recording, ascending, and the value.
    clock : Clock
    rate_hz : float
        At which the device sent them [Hz].
    name : str
        What it is called in messages.
    """

    def __init__(
        self, values: Sequence[tuple[float, T]], *, clock: Clock, rate_hz: float, name: str
    ) -> None:
        self._values = values
        self._times = [time for time, _ in values]
        self._clock = clock
        self._rate_hz = rate_hz
        self._limit = silence_limit(rate_hz)
        self._name = name
        self._start_ns: int | None = None
        self._closed_ns: int | None = None

    @property
    def name(self) -> str:
        """What it is called in messages."""
        return self._name

    def start(self) -> None:
        """Begin to count the time."""
        if self._start_ns is None:
            self._start_ns = self._clock.now_ns()

    def close(self) -> None:
        """End it; the latest value grows old."""
        if self._closed_ns is None:
            self._closed_ns = self._clock.now_ns()

    def latest(self) -> Reading[T] | None:
        """Return the value whose time came last; None before the first."""
        count = self._count()
        if not count:
            return None
        stamp_ns = self._stamp_ns(count)
        age = (self._clock.now_ns() - stamp_ns) * 1e-9
        return Reading(
            value=self._values[count - 1][1],
            stamp_ns=stamp_ns,
            age=age,
            fresh=age <= self._limit,
            count=count,
        )

    def health(self) -> Health:
        """Return how it is: good while the recording lasts and is not silent."""
        now_ns, count = self._clock.now_ns(), self._count()
        age = (now_ns - self._stamp_ns(count)) * 1e-9 if count else math.inf
        span = self._times[count - 1] - self._times[0] if count > 1 else 0.0
        return Health(
            name=self._name,
            problem=self._problem(count, age),
            connected=self._start_ns is not None and self._closed_ns is None,
            rate_hz=(count - 1) / span if span else math.nan,
            age=age,
            values=count,
        )

    def _count(self) -> int:
        if self._start_ns is None:
            return 0
        until = self._clock.now_ns() if self._closed_ns is None else self._closed_ns
        return bisect.bisect_right(self._times, (until - self._start_ns) * 1e-9)

    def _stamp_ns(self, count: int) -> int:
        return (self._start_ns or 0) + round(self._times[count - 1] * 1e9)

    def _problem(self, count: int, age: float) -> str:
        if self._start_ns is None or self._closed_ns is not None:
            return f"{self._name}: closed"
        if count == 0:
            return f"{self._name}: no value yet"
        if age <= self._limit:
            return ""
        if count == len(self._times):
            return f"{self._name}: the recording is at its end"
        return f"{self._name}: the recording has no value for {age:.2f} s"
