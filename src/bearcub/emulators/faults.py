"""What goes wrong on real lines, as wrappers that fit every emulator.

Each fault is on while a function of the time says so, so that a test, a command line and a
simulator can all switch it. Faults of one kind of device only (a NAK, a rejected command) are
made of `Rewritten` and `Unheard` by that device's module.
"""

import random
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from bearcub.emulators.emulator import Emulator

Switch = Callable[[int], bool]
"""Whether the fault is on at a time [ns]."""

Fault = Callable[[Emulator, Switch], "Faulty"]
"""Puts a fault between an emulator and its line."""


@runtime_checkable
class Restarting(Protocol):
    """An emulator of a device whose settings do not outlive a loss of power."""

    def restart(self) -> None:
        """Forget what a loss of power makes it forget, and say so if the device does."""
        ...


class Faulty:
    """An emulator behind a line without fault; the faults change one method each.

    Parameters
    ----------
    emulator : Emulator
        May be faulty itself: faults add up.
    on : callable
        Whether the fault is on at a time [ns].
    """

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        self._emulator = emulator
        self._on = on
        self._now_ns = 0

    @property
    def baud(self) -> int | None:
        """The line speed of the device behind it [baud]."""
        return self._emulator.baud

    def connect(self) -> None:
        """Pass it on."""
        self._emulator.connect()

    def receive(self, data: bytes) -> None:
        """Pass them on."""
        self._emulator.receive(data)

    def poll(self, now_ns: int) -> bytes:
        """Return what the device sends, as the fault changes it."""
        self._now_ns = now_ns
        data = self._emulator.poll(now_ns)
        return self.spoil(data) if self._on(now_ns) else data

    def spoil(self, data: bytes) -> bytes:
        """Return what becomes of the bytes while the fault is on."""
        return data


class Split(Faulty):
    """Bytes arrive in small pieces, as from a dribbling adapter or in TCP segments.

    A short telegram comes in pieces of one to three bytes, a long one in larger ones, so that the
    device does not fall behind for ever.
    """

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._waiting = b""
        self._random = random.Random(0)  # noqa: S311 (the same pieces every time)

    def poll(self, now_ns: int) -> bytes:
        """Return a piece; all that waits once the fault is over."""
        self._waiting += self._emulator.poll(now_ns)
        most = max(3, len(self._waiting) // 16)
        size = self._random.randint(1, most) if self._on(now_ns) else len(self._waiting)
        piece, self._waiting = self._waiting[:size], self._waiting[size:]
        return piece


class Merged(Faulty):
    """Bytes are held back for 0.15 s and arrive together: several telegrams in one read."""

    HELD_NS = 150_000_000

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._waiting = b""
        self._since_ns = 0

    def poll(self, now_ns: int) -> bytes:
        """Return nothing, or everything since the last time."""
        if not self._waiting:
            self._since_ns = now_ns
        self._waiting += self._emulator.poll(now_ns)
        if self._on(now_ns) and now_ns - self._since_ns < self.HELD_NS:
            return b""
        data, self._waiting = self._waiting, b""
        return data


class Corrupt(Faulty):
    """One bit of each telegram is flipped, so that its checksum is wrong."""

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._random = random.Random(0)  # noqa: S311 (the same bits every time)

    def spoil(self, data: bytes) -> bytes:
        """Return the bytes with one bit flipped."""
        if not data:
            return data
        place, bit = self._random.randrange(len(data)), self._random.randrange(8)
        return data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :]


class Stuck(Faulty):
    """The device sends nothing and hears nothing; the line stays open."""

    def receive(self, data: bytes) -> None:
        """Let the bytes go unheard."""
        if not self._on(self._now_ns):
            super().receive(data)

    def spoil(self, data: bytes) -> bytes:
        """Return nothing."""
        return data[:0]


class Half(Stuck):
    """Half a telegram, then silence, as when a cable is pulled in the middle of one."""

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._begun = False

    def poll(self, now_ns: int) -> bytes:
        """Note when the fault is over, so that the next one begins with half a telegram again."""
        if not self._on(now_ns):
            self._begun = False
        return super().poll(now_ns)

    def spoil(self, data: bytes) -> bytes:
        """Return half of the first telegram and nothing after it."""
        if self._begun or not data:
            return b""
        self._begun = True
        return data[: max(1, len(data) // 2)]


class Noise(Faulty):
    """Random bytes between the telegrams, and now and then in the middle of one."""

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._random = random.Random(0)  # noqa: S311 (the same noise every time)

    def spoil(self, data: bytes) -> bytes:
        """Return the bytes with up to 20 random ones put in somewhere."""
        if not data:
            return data
        place = self._random.randrange(len(data))
        return data[:place] + self._random.randbytes(self._random.randint(1, 20)) + data[place:]


class Reset(Faulty):
    """The device breaks every connection off."""

    def spoil(self, data: bytes) -> bytes:
        """Raise instead of answering."""
        raise ConnectionResetError(f"{len(data)} bytes are lost")


class WrongBaud(Faulty):
    """The device talks at another speed than the host: all that arrives at either is garbage."""

    def receive(self, data: bytes) -> None:
        """Garble what the host has sent."""
        on = self._on(self._now_ns)
        super().receive(garbled(data) if on else data)

    def spoil(self, data: bytes) -> bytes:
        """Garble what the device sends."""
        return garbled(data)


class Unheard(Faulty):
    r"""What the host sends does not reach the device; a fixed answer comes instead.

    Parameters
    ----------
    emulator, on
        As for `Faulty`.
    answer : bytes
        To each piece that the host sends: ``b"\x15"`` is a NAK, ``b"?"`` a controller's refusal.
    """

    def __init__(self, emulator: Emulator, on: Switch, *, answer: bytes) -> None:
        super().__init__(emulator, on)
        self._answer = answer
        self._pending = b""

    def receive(self, data: bytes) -> None:
        """Answer instead of the device."""
        if self._on(self._now_ns):
            self._pending += self._answer
        else:
            super().receive(data)

    def spoil(self, data: bytes) -> bytes:
        """Return the answers, then what the device sends by itself."""
        pending, self._pending = self._pending, b""
        return pending + data


class Rewritten(Faulty):
    """What the device sends passes through a function while the fault is on.

    Parameters
    ----------
    emulator, on
        As for `Faulty`.
    rewrite : callable
        From the bytes of one poll to those that arrive; it is not called without bytes. Keeping
        ``data[:1]`` of a LADAR's reply is an acknowledgement without reply.
    """

    def __init__(
        self, emulator: Emulator, on: Switch, *, rewrite: Callable[[bytes], bytes]
    ) -> None:
        super().__init__(emulator, on)
        self._rewrite = rewrite

    def spoil(self, data: bytes) -> bytes:
        """Return the rewritten bytes."""
        return self._rewrite(data) if data else data


class Restarted(Faulty):
    """The device loses its power for a moment, once per switching on, and starts anew."""

    def __init__(self, emulator: Emulator, on: Switch) -> None:
        super().__init__(emulator, on)
        self._done = False

    def poll(self, now_ns: int) -> bytes:
        """Restart a device that can, when the fault begins."""
        if not self._on(now_ns):
            self._done = False
        elif not self._done and isinstance(self._emulator, Restarting):
            self._done = True
            self._emulator.restart()
        return super().poll(now_ns)


class Interrupted(Faulty):
    """Bytes that belong elsewhere come in the middle of a telegram, once per switching on.

    Parameters
    ----------
    emulator, on
        As for `Faulty`.
    intruder : bytes
        For example a LADAR's power-on telegram.
    """

    def __init__(self, emulator: Emulator, on: Switch, *, intruder: bytes) -> None:
        super().__init__(emulator, on)
        self._intruder = intruder
        self._done = False

    def poll(self, now_ns: int) -> bytes:
        """Note when the fault is over, so that the next one interrupts again."""
        if not self._on(now_ns):
            self._done = False
        return super().poll(now_ns)

    def spoil(self, data: bytes) -> bytes:
        """Return the bytes with the intruder in their middle; what it cut off does not follow."""
        if self._done or not data:
            return data
        self._done = True
        return data[: len(data) // 2] + self._intruder


FAULTS: dict[str, Fault] = {
    "split": Split,
    "merged": Merged,
    "corrupt": Corrupt,
    "noise": Noise,
    "stuck": Stuck,
    "half": Half,
    "reset": Reset,
    "wrong-baud": WrongBaud,
}
"""Faults that fit every emulator, by the name that the command line gives them."""


def garbled(data: bytes) -> bytes:
    r"""Return what a receiver at another speed makes of bytes: as many, all different.

    Examples
    --------
    >>> garbled(b"\x00$C12").hex()
    'fe8afff9e4'
    """
    return bytes((byte * 107 + 254) & 0xFF | 0x80 for byte in data)


def between(start_ns: int, end_ns: int) -> Switch:
    """Return a switch that is on from `start_ns` until before `end_ns`."""
    return lambda now_ns: start_ns <= now_ns < end_ns
