"""What a driver is: a pure parser, what its telegrams mean, and how one talks to the device.

Nothing here moves bytes; `bearcub.devices.stream.Streaming` does, over any
`bearcub.devices.link.Link`.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from bearcub.clock import Clock
from bearcub.devices.framing import Parser
from bearcub.devices.link import Link

T_co = TypeVar("T_co", covariant=True)
M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class Measured(Generic[T_co]):
    """A value and how long before the arrival of its telegram's last byte it was taken [s]."""

    value: T_co
    latency: float = 0.0


def on_the_line(n_bytes: int, baud: int) -> float:
    """Return how long bytes take over a serial line with 8 data bits, start and stop bit [s].

    Examples
    --------
    >>> on_the_line(96, 9600)
    0.1
    """
    return n_bytes * 10 / baud


@dataclass(frozen=True, slots=True)
class Ask(Generic[M]):
    """Send `data` and wait for the telegram that `wanted` picks, or None after `timeout` [s]."""

    data: bytes
    wanted: Callable[[M], bool]
    timeout: float


@dataclass(frozen=True, slots=True)
class Pause:
    """Wait [s]; telegrams are decoded meanwhile."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Every:
    """Wait until this long [s] after the last such step was due: an even beat for polling."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Baud:
    """Set the line's speed [baud]; nothing happens on a TCP link."""

    baud: int


Step = Ask[M] | Pause | Every | Baud
Conversation = Generator[Step[M], M | None, None]
"""Steps to take one after another; an `Ask` evaluates to the telegram, or None.

It raises `DeviceError` to give up: the line is closed and everything begins anew. It returns when
the device sends by itself from then on, or never returns where the device is polled.
"""


class Driver(Protocol[M, T_co]):
    """One device's language; it is used again after a reconnect."""

    @property
    def parser(self) -> Parser[M]:
        """From bytes to telegrams."""
        ...

    def value(self, telegram: M) -> Measured[T_co] | None:
        """Return what a telegram measures; None for one that measures nothing.

        Raises
        ------
        FormatError
            If its content is impossible: counted, and the stream goes on.
        DeviceError
            If the device says that it cannot go on, or has started anew: the line is closed and
            the conversation begins again.
        """
        ...

    def conversation(self) -> Conversation[M]:
        """Return the steps that make the device send, from its power-up state or any other."""
        ...

    def farewell(self) -> bytes:
        """Return what to send before the line is closed on purpose; may be nothing."""
        ...


class Listening:
    """Mixed into the driver of a device that sends by itself: nothing to say to it."""

    def conversation(self) -> Conversation[Any]:
        """Return no steps."""
        yield from ()

    def farewell(self) -> bytes:
        """Return nothing."""
        return b""


class Overheard(Listening, Generic[M, T_co]):
    """A driver that only listens: to a recording, or to a line on which another program talks.

    Parameters
    ----------
    driver : Driver
        What the bytes mean.
    """

    def __init__(self, driver: Driver[M, T_co]) -> None:
        self.parser = driver.parser
        self.value = driver.value


class Talk(Generic[M]):
    """Takes a conversation's steps when their time has come.

    Parameters
    ----------
    conversation : Conversation
    link : Link
        An open one.
    clock : Clock
    """

    def __init__(self, conversation: Conversation[M], link: Link, clock: Clock) -> None:
        self._steps = conversation
        self._link = link
        self._clock = clock
        self._asked: Ask[M] | None = None
        self._until_ns = 0
        self._beat_ns = 0
        self.over = False
        self._go_on(None)

    @property
    def patience(self) -> float:
        """Seconds until the next step is due; infinite when there is none."""
        return float("inf") if self.over else (self._until_ns - self._clock.now_ns()) * 1e-9

    def hear(self, telegram: M) -> None:
        """Go on if this telegram is what was asked for."""
        if self._asked is not None and self._asked.wanted(telegram):
            self._go_on(telegram)

    def tick(self) -> None:
        """Go on if the time of the present step is up."""
        if not self.over and self._clock.now_ns() >= self._until_ns:
            self._go_on(None)

    def _go_on(self, telegram: M | None) -> None:
        """Take steps until one takes time."""
        self._asked = None
        while True:
            try:
                step = self._steps.send(telegram)
            except StopIteration:
                self.over = True
                return
            telegram = None
            if isinstance(step, Baud):
                self._link.set_baud(step.baud)
                continue
            self._until_ns = self._end(step)
            if isinstance(step, Ask):
                self._asked = step
                if step.data:
                    self._link.write(step.data)
            return

    def _end(self, step: Ask[M] | Pause | Every) -> int:
        """Return when a step's time is up [ns]."""
        now_ns = self._clock.now_ns()
        if isinstance(step, Every):
            # A beat that was missed is left out, not made up for.
            self._beat_ns = max(self._beat_ns + round(step.seconds * 1e9), now_ns)
            return self._beat_ns
        seconds = step.seconds if isinstance(step, Pause) else step.timeout
        return now_ns + round(seconds * 1e9)
