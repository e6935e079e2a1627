"""What every emulated device has in common."""

from typing import Protocol


class Emulator(Protocol):
    """A device as it is seen from the other end of its line; knows no thread and no socket."""

    @property
    def baud(self) -> int | None:
        """The line speed it talks at now [baud]; None for a device on TCP."""
        ...

    def connect(self) -> None:
        """Note that a host has connected anew; a serial device cannot tell and does nothing."""
        ...

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has sent, in whatever pieces."""
        ...

    def poll(self, now_ns: int) -> bytes:
        """Return what the device sends up to now: replies, and what it sends by itself.

        Raises
        ------
        ConnectionResetError
            If the device breaks the connection off; the host then does so.
        """
        ...


class Ticker:
    """Says when a device sends by itself: at a rate, at even times, none made up after a pause.

    Parameters
    ----------
    rate_hz : float

    Examples
    --------
    >>> ticker = Ticker(10.0)
    >>> [ticker.due(ms * 10**6) for ms in (0, 50, 99, 100, 350, 399, 400)]
    [True, False, False, True, True, False, True]
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(1e9 / rate_hz)
        self._next_ns: int | None = None

    def due(self, now_ns: int) -> bool:
        """Return whether a time to send has come since the last call."""
        next_ns = now_ns if self._next_ns is None else self._next_ns
        if now_ns < next_ns:
            return False
        missed = (now_ns - next_ns) // self._period_ns
        self._next_ns = next_ns + (missed + 1) * self._period_ns
        return True


class Serial:
    """Mixed into an emulator of a device on a serial line: it does not see who connects."""

    baud: int | None = 9600

    def connect(self) -> None:
        """Do nothing."""
