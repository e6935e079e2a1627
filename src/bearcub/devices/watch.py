"""Who watches a device: counts what comes, tells what is wrong, has each change logged."""

import math
from enum import StrEnum

from bearcub.clock import Clock
from bearcub.devices.framing import Tally
from bearcub.devices.health import Arrivals, Health, silence_limit
from bearcub.devices.journal import Journal

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
        self._journal = Journal(name, clock=clock)
        self._connected = False
        self._silent_since_ns = 0  # from when on a value may be expected
        self._ready = False
        self._values_before = 0  # this connection
        self._bytes = 0  # since the last value
        self._cut_before = 0  # telegrams that the parser refused, up to the last value
        self._impossible = 0  # values refused for their content, since the last good one

    @property
    def delivering(self) -> bool:
        """Whether the present connection has brought a value."""
        return self._connected and self.arrivals.count > self._values_before

    def connecting(self) -> None:
        """Note the first attempt; trying again later is no news."""
        if self._state is State.CLOSED:
            self._state = State.CONNECTING
            self._journal.note(State.CONNECTING)

    def connected(self) -> None:
        """Note that the line is open; values are expected once the device is `ready`."""
        self._connected = True
        self._ready = False
        self._silent_since_ns = self._clock.now_ns()
        self._values_before = self.arrivals.count
        self._forget()

    def ready(self) -> None:
        """Note that the device was told all it needs: from now on its silence counts."""
        if not self._ready:
            self._ready = True
            self._silent_since_ns = self._clock.now_ns()

    def heard(self, n_bytes: int) -> None:
        """Note that bytes came."""
        self._bytes += n_bytes

    def value(self, now_ns: int) -> None:
        """Note that a value came."""
        self.arrivals.add(now_ns)
        self._silent_since_ns = now_ns
        self._forget()
        self._reason = ""
        if self._state is not State.STREAMING:
            self._state = State.STREAMING
            self._journal.note(State.STREAMING)
        self._journal.well()

    def refused(self, error: Exception) -> None:
        """Note that a telegram's content was impossible."""
        self._errors += 1
        self._impossible += 1
        self._last_error = f"{self._name}: {error}"

    def lost(self, error: Exception) -> None:
        """Note that the line failed or was given up."""
        self._connected = False
        self._reason = f"{self._name}: {error}"
        self._errors += 1
        self._last_error = self._reason
        # A device that is given up for its silence was in the log already.
        if self._state in (State.LOST, State.SILENT):
            self._journal.still(self._reason)
        else:
            self._journal.fault(self._reason)
        self._state = State.LOST

    def closed(self) -> None:
        """Note that it was closed on purpose."""
        self._connected = False
        if self._state is not State.CLOSED:
            self._state = State.CLOSED
            self._journal.note(State.CLOSED)

    def silence(self) -> str:
        """Return why the device should be started anew; nothing while it may yet come.

        A silence beyond the limit is logged once; only a longer one is a reason.
        """
        silent = (self._clock.now_ns() - self._silent_since_ns) * 1e-9
        if silent > self.limit and self._state is State.STREAMING and self.delivering:
            self._state = State.SILENT
            self._journal.fault(f"{self._name}: {self._missing(silent)}")
        return self._missing(silent) if silent > max(_RESTART, 2 * self.limit) else ""

    def health(self) -> Health:
        """Return how the device is now; from any thread."""
        now_ns = self._clock.now_ns()
        return Health(
            name=self._name,
            problem=self._problem(now_ns),
            connected=self._connected,
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
        if not self.delivering:  # a value of an earlier connection says nothing of this one
            missing = self._missing(math.inf) if self._connected else "connecting"
            return self._reason or f"{self._name}: {missing}"
        age = self.arrivals.age(now_ns)
        return f"{self._name}: {self._missing(age)}" if age > self.limit else ""

    def _missing(self, seconds: float) -> str:
        """Return what is missing, and what has come instead since the last value."""
        if math.isinf(seconds):
            what = "connected, no value yet"
        else:
            what = f"no value for {seconds:.2f} s, expected {self._rate_hz:g} a second"
        refused = self._tally.errors - self._cut_before
        if self._impossible:
            said = self._last_error.removeprefix(f"{self._name}: ")
            return f"{what}: {self._impossible} values refused, the last one for: {said}"
        if refused:
            return f"{what}: {refused} telegrams refused, the last one for: {self._tally.last}"
        if self._bytes:
            return f"{what}: {self._bytes} bytes came and no value in them"
        return f"{what}: nothing comes; check its power and its cable"

    def _forget(self) -> None:
        self._bytes = self._impossible = 0
        self._cut_before = self._tally.errors
