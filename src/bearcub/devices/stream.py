"""The one source behind every driver: moves bytes, reconnects, watches, never blocks the loop."""

import contextlib
import threading
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from bearcub.clock import Clock
from bearcub.devices.driver import Driver, Talk
from bearcub.devices.health import Health
from bearcub.devices.link import Link
from bearcub.devices.protocols import Reading, Source
from bearcub.devices.watch import Watch
from bearcub.errors import DeviceError, DeviceTimeout, FormatError

T = TypeVar("T")

_PATIENCE = 0.05  # how long a read waits at most, so that closing and watching are prompt [s]
_GAP = 0.1  # a line that pauses this long will not complete its telegram [s]
_FIRST_RETRY, _LAST_RETRY = 0.05, 0.5  # the pause before reconnecting doubles in between [s]


@dataclass(frozen=True, slots=True)
class _Taken(Generic[T]):
    """A value with its stamp and number."""

    value: T
    stamp_ns: int
    arrived_ns: int
    count: int


class Streaming(Source[T]):
    """A `Source` made of a link and a driver, read by a thread of its own.

    The stamp of a value is the arrival of its telegram's last byte less the latency that the
    driver knows of. Bytes that waited in a buffer of the system make it late by that time.

    It reconnects by itself, 0.05 s after a failure and 0.5 s apart after several.

    Parameters
    ----------
    link : Link
    driver : Driver
    clock : Clock
    rate_hz : float
        At which values are expected [Hz]; a silence of `health.silence_limit` is a fault.
    role : str
        What it is for, as in ``tilt (/dev/ttyUSB0)``.
    """

    def __init__(
        self, link: Link, driver: Driver[Any, T], *, clock: Clock, rate_hz: float, role: str
    ) -> None:
        self._name = f"{role} ({link.name})"
        self._link = link
        self._driver = driver
        self._clock = clock
        self._watch = Watch(self._name, rate_hz=rate_hz, tally=driver.parser.tally, clock=clock)
        self._latest: _Taken[T] | None = None
        self._talk: Talk[Any] | None = None
        self._heard_ns = 0
        self._failures = 0  # since the last value
        self._retry_ns = 0
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def name(self) -> str:
        """What it is called in messages: ``tilt (/dev/ttyUSB0)``."""
        return self._name

    @property
    def identity(self) -> str:
        """What the device says that it is; empty where it does not say, or not yet."""
        return str(getattr(self._driver, "identity", ""))  # most devices cannot tell

    @property
    def complaints(self) -> tuple[str, ...]:
        """What the device said was wrong with it when it was first met."""
        return tuple(getattr(self._driver, "complaints", ()))

    def start(self) -> None:
        """Start the thread; it connects when it can."""
        if self._thread is None and not self._stopping.is_set():
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Say farewell to the device and let go of it; it cannot be started again."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        if self._talk is not None:
            self._talk = None
            with contextlib.suppress(DeviceError):  # it may be gone already
                self._link.write(self._driver.farewell())
        self._link.close()
        self._watch.closed()

    def latest(self) -> Reading[T] | None:
        """Return the latest value with its age; None before the first."""
        taken = self._latest  # one load: the thread may replace it at any time
        if taken is None:
            return None
        now_ns = self._clock.now_ns()
        return Reading(
            value=taken.value,
            stamp_ns=taken.stamp_ns,
            age=(now_ns - taken.stamp_ns) * 1e-9,
            fresh=(now_ns - taken.arrived_ns) * 1e-9 <= self._watch.limit,
            count=taken.count,
        )

    def health(self) -> Health:
        """Return how it is now."""
        health = self._watch.health()
        if self._thread is None or self._thread.is_alive() or self._stopping.is_set():
            return health
        problem = f"{self._name}: its reader failed by an error of this program; see stderr"
        return replace(health, problem=problem)

    def step(self) -> float:
        """Do what is due now and return for how long [s] there is nothing to do.

        The thread calls it again and again. Tests call it themselves, with a clock and a link that
        pass the time only when they are told to.
        """
        try:
            if self._talk is None:
                pause = (self._retry_ns - self._clock.now_ns()) * 1e-9
                if pause > 0:
                    return min(pause, _PATIENCE)
                self._talk = self._connect()
            self._exchange(self._talk)
        except DeviceError as error:
            self._lose(error)
        return 0.0

    def _run(self) -> None:
        while not self._stopping.is_set():
            self._stopping.wait(self.step())

    def _connect(self) -> Talk[Any]:
        self._watch.connecting()
        self._link.open()
        self._driver.parser.reset()
        self._watch.connected()
        self._heard_ns = self._clock.now_ns()
        return Talk(self._driver.conversation(), self._link, self._clock)

    def _exchange(self, talk: Talk[Any]) -> None:
        """Read once, decode, take the conversation's next step, watch for silence."""
        talk.tick()
        data = self._link.read(max(0.0, min(_PATIENCE, talk.patience)))
        now_ns = self._clock.now_ns()
        for telegram in self._telegrams(data, now_ns):
            self._take(telegram, now_ns)
            talk.hear(telegram)
        if talk.over:
            self._watch.ready()
        if talk.over or self._watch.delivering:  # before that, the conversation has its time-outs
            missing = self._watch.silence()
            if missing:
                raise DeviceTimeout(missing)

    def _telegrams(self, data: bytes, now_ns: int) -> list[Any]:
        parser = self._driver.parser
        if data:
            self._heard_ns = now_ns
            self._watch.heard(len(data))
            return parser.feed(data)
        return parser.silence() if now_ns - self._heard_ns > _GAP * 1e9 else []

    def _take(self, telegram: Any, now_ns: int) -> None:
        try:
            measured = self._driver.value(telegram)
        except FormatError as error:
            self._watch.refused(error)
            return
        if measured is None:
            return
        self._watch.value(now_ns)
        self._failures = 0
        stamp_ns = now_ns - round(measured.latency * 1e9)
        self._latest = _Taken(measured.value, stamp_ns, now_ns, self._watch.arrivals.count)

    def _lose(self, error: DeviceError) -> None:
        """Let go of the line and plan the next attempt."""
        self._talk = None
        self._link.close()
        self._watch.lost(error)
        pause = min(_FIRST_RETRY * 2 ** min(self._failures, 8), _LAST_RETRY)
        self._failures += 1
        self._retry_ns = self._clock.now_ns() + round(pause * 1e9)
