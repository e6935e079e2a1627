"""A simulated sensor behind the protocol that every real one has."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from bearcub.devices.health import Health, silence_limit
from bearcub.devices.protocols import Reading, Source

T = TypeVar("T")


class SimulatedSource(Source[T]):
    """A `Source` that asks a simulation; its time is the simulation's.

    Parameters
    ----------
    read : callable
        Returns the sensor's latest reading: ``simulation.tilt``.
    rate_hz : float
        At which values are expected [Hz].
    role : str
        What it is for, as in ``tilt (simulated)``.

    Attributes
    ----------
    plugged : bool
        False pulls the plug: nothing new comes, as from a dead device.

    Examples
    --------
    >>> reading = Reading(value=7, stamp_ns=0, age=0.02, fresh=True, count=1)
    >>> with SimulatedSource(lambda: reading, rate_hz=50.0, role="tilt") as source:
    ...     source.latest().value, source.health().good
    (7, True)
    """

    def __init__(self, read: Callable[[], Reading[T] | None], *, rate_hz: float, role: str) -> None:
        self._name = f"{role} (simulated)"
        self._read = read
        self._rate_hz = rate_hz
        self._limit = silence_limit(rate_hz)
        self._first: Reading[T] | None = None
        self._kept: Reading[T] | None = None
        self._started = self._closed = False
        self.plugged = True

    @property
    def name(self) -> str:
        """What it is called in messages: ``tilt (simulated)``."""
        return self._name

    def start(self) -> None:
        """Begin to listen to the simulation."""
        self._started = True
        self.latest()

    def close(self) -> None:
        """End it; the latest value grows old."""
        self.latest()
        self._closed = True

    def latest(self) -> Reading[T] | None:
        """Return the latest value; None before the first."""
        found = self._read() if self._started else None
        if found is None:
            return None
        now_ns = found.stamp_ns + round(found.age * 1e9)
        if self.plugged and not self._closed:
            self._kept = found
            self._first = self._first or found
        if self._kept is None:
            return None
        age = (now_ns - self._kept.stamp_ns) * 1e-9
        return replace(self._kept, age=age, fresh=age <= self._limit)

    def health(self) -> Health:
        """Return how it is; it is good while the simulation measures and the plug is in."""
        reading = self.latest()
        return Health(
            name=self._name,
            problem=self._problem(reading),
            connected=self._started and not self._closed and self.plugged,
            rate_hz=self._measured_rate_hz(reading),
            age=math.inf if reading is None else reading.age,
            values=0 if reading is None else reading.count,
        )

    def _measured_rate_hz(self, reading: Reading[T] | None) -> float:
        """Return the values per second since the first one that was seen [Hz]."""
        first = self._first
        if first is None or reading is None or reading.count == first.count:
            return math.nan
        return (reading.count - first.count) / ((reading.stamp_ns - first.stamp_ns) * 1e-9)

    def _problem(self, reading: Reading[T] | None) -> str:
        if not self._started or self._closed:
            return f"{self._name}: closed"
        if reading is None:
            return f"{self._name}: no value yet"
        if reading.fresh:
            return ""
        return (
            f"{self._name}: no value for {reading.age:.2f} s, expected {self._rate_hz:g} a second"
        )
