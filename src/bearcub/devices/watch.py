"""Who watches a device: counts what comes, tells what is wrong, logs each change in one line."""

import logging
import math
from enum import StrEnum

from bearcub.clock import Clock
from bearcub.devices.framing import Tally
from bearcub.devices.health import Arrivals, Health, silence_limit

_log = logging.getLogger(__name__)

_RESTART = 1.0  # a connected device that sends no value for this long is started anew [s]


class State(StrEnum):
    """What a source is about; each change is one line in the log."""

    CLOSED = "closed"
    CONNECTING = "connecting"
    STREAMING = "streaming"
    SILENT = "silent"
    LOST = "lost"


class Watch:
    """What is known of one device's line; told by the one thread that reads it.

    Parameters
    ----------
    name : str
        Of the device, in every sentence.
    rate_hz : float
        At which values are expected [Hz].
    tally : Tally
        Of the device's parser.
    clock : Clock
    """

    def __init__(self, name: str, *, rate_hz: float, tally: Tally, clock: Clock) -> None:
        self.limit = silence_limit(rate_hz)
        self.arrivals = Arrivals(rate_hz)
        self._name = name
        self._rate_hz = rate_hz
        self._tally = tally
        self._clock = clock
        self._state = State.CLOSED
        self._reason = ""
        self._errors = 0
        self._last_error = ""
        self._connected_ns: int | None = None
        self._values_before = 0  # this connection
        self._bytes = 0  # since the last value
        self._refused_before = 0  # up to the last value

    @property
    def delivering(self) -> bool:
        """Whether the present connection has brought a value."""
        return self._connected_ns is not None and self.arrivals.count > self._values_before

    def connecting(self) -> None:
        """Note the first attempt; trying again later is no news."""
        if self._state is State.CLOSED:
            self._change(State.CONNECTING)

    def connected(self) -> None:
        """Note that the line is open."""
        self._connected_ns = self._clock.now_ns()
        self._values_before = self.arrivals.count
        self._forget()

    def heard(self, n_bytes: int) -> None:
        """Note that bytes came."""
        self._bytes += n_bytes

    def value(self, now_ns: int) -> None:
        """Note that a value came."""
        self.arrivals.add(now_ns)
        self._forget()
        self._change(State.STREAMING)

    def refused(self, error: Exception) -> None:
        """Note that a telegram's content was impossible."""
        self._errors += 1
        self._last_error = f"{self._name}: {error}"

    def lost(self, error: Exception) -> None:
        """Note that the line failed or was given up."""
        self._connected_ns = None
        self._reason = f"{self._name}: {error}"
        self._errors += 1
        self._last_error = self._reason
        self._change(State.LOST, self._reason)

    def closed(self) -> None:
        """Note that it was closed on purpose."""
        self._connected_ns = None
        self._change(State.CLOSED)

    def silence(self) -> str:
        """Return why the device should be started anew; nothing while it may yet come.

        A silence beyond the limit is logged once; only a longer one is a reason.
        """
        now_ns = self._clock.now_ns()
        since_ns = now_ns if self._connected_ns is None else self._connected_ns
        silent = min(self.arrivals.age(now_ns), (now_ns - since_ns) * 1e-9)
        if silent > self.limit and self._state is State.STREAMING:
            self._change(State.SILENT, f"{self._name}: {self._missing(silent)}")
        return self._missing(silent) if silent > max(_RESTART, 2 * self.limit) else ""

    def health(self) -> Health:
        """Return how the device is now; from any thread."""
        now_ns = self._clock.now_ns()
        return Health(
            name=self._name,
            problem=self._problem(now_ns),
            connected=self._connected_ns is not None,
            rate_hz=self.arrivals.rate_hz(now_ns),
            age=self.arrivals.age(now_ns),
            values=self.arrivals.count,
            errors=self._errors + self._tally.errors,
            drops=self._tally.drops,
            resyncs=self._tally.resyncs,
            last_error=self._last_error,
        )

    def _problem(self, now_ns: int) -> str:
        if self._state is State.CLOSED:
            return f"{self._name}: closed"
        if self._connected_ns is None:
            return self._reason or f"{self._name}: connecting"
        age = self.arrivals.age(now_ns)
        return f"{self._name}: {self._missing(age)}" if age > self.limit else ""

    def _missing(self, seconds: float) -> str:
        """Return what is missing, and what the bytes that came since the last value tell of it."""
        if math.isinf(seconds):
            what = "connected, no value yet"
        else:
            what = f"no value for {seconds:.2f} s, expected {self._rate_hz:g} a second"
        refused = self._tally.errors - self._refused_before
        if refused:
            return f"{what}: {refused} telegrams refused, the last one for: {self._tally.last}"
        if self._bytes:
            return f"{what}: {self._bytes} bytes came and no value in them; check its settings"
        return f"{what}: nothing comes; check its power and its cable"

    def _forget(self) -> None:
        self._bytes = 0
        self._refused_before = self._tally.errors

    def _change(self, state: State, reason: str = "") -> None:
        before, self._state = self._state, state
        if state is before or (state is State.LOST and before is State.SILENT):
            return  # a device that is given up for its silence was in the log already
        level = logging.WARNING if state in (State.LOST, State.SILENT) else logging.INFO
        _log.log(level, "%s", reason or f"{self._name}: {state}")
