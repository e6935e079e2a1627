"""Lines to devices: serial, TCP, or the bytes of a file. They move bytes and know no protocol."""

import contextlib
import os
import select
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from bearcub.clock import Clock
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout

if TYPE_CHECKING:
    from serial import Serial

Opened = TypeVar("Opened")

_AT_ONCE = 65536  # bytes taken by one read
_CONNECT = 1.0  # a robot's own network answers in milliseconds [s]
_WRITE = 1.0
_PIECE = 0.01  # a file gives what came in this time at once [s]


class Link(Protocol):
    """A line to one device; not open when it is made, and used again after a reconnect.

    Its errors do not repeat its name: who uses it puts ``tilt (/dev/ttyUSB0): `` in front.
    """

    @property
    def name(self) -> str:
        """What it is called in messages: ``/dev/ttyUSB0``, ``192.168.0.1:2112``."""
        ...

    def open(self) -> None:
        """Connect.

        Raises
        ------
        DeviceError
            If that is not possible now, within about a second.
        """
        ...

    def read(self, timeout: float) -> bytes:
        """Return what has come, at the latest after `timeout` [s]; empty when nothing has.

        Raises
        ------
        DeviceDisconnected
            If the other end went away.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of it.

        Raises
        ------
        DeviceDisconnected
            If the other end went away.
        DeviceTimeout
            If it takes nothing for a second.
        """
        ...

    def set_baud(self, baud: int) -> None:
        """Set the speed of a serial line; other lines have none and do nothing."""
        ...

    def close(self) -> None:
        """Disconnect; a second call does nothing."""
        ...


class SerialLink:
    """A serial port, 8 data bits, 1 stop bit, no flow control.

    Parameters
    ----------
    port : str
        ``/dev/ttyUSB0``, better its name that stays: ``/dev/serial/by-id/...``.
    baud : int
        With which it is opened.
    parity : str
        "N", "E" or "O".
    """

    def __init__(self, port: str, *, baud: int = 9600, parity: str = "N") -> None:
        self.name = port
        self._baud = baud
        self._parity = parity
        self._serial: Serial | None = None

    def open(self) -> None:
        """Open the port, for this program alone."""
        try:
            import serial  # noqa: PLC0415 (only who has a serial device needs it)
        except ImportError:
            raise DeviceError(
                "serial lines need pyserial; run: pip install 'bearcub[devices]'"
            ) from None
        try:
            self._serial = serial.Serial(
                self.name,
                self._baud,
                parity=self._parity,
                timeout=0,
                write_timeout=_WRITE,
                exclusive=True,
            )
        except (OSError, ValueError) as error:  # pyserial's own error is an OSError
            raise DeviceError(f"cannot be opened: {reason(error)}") from error

    def read(self, timeout: float) -> bytes:
        """Return what has come within `timeout` [s]."""
        port = _require_open(self._serial)
        with self._watched():
            return bytes(port.read(_AT_ONCE)) if _readable(port.fileno(), timeout) else b""

    def write(self, data: bytes) -> None:
        """Send all of it."""
        port = _require_open(self._serial)
        with self._watched():
            port.write(data)

    def set_baud(self, baud: int) -> None:
        """Set the line's speed [baud] once what was sent is out."""
        port = _require_open(self._serial)
        with self._watched():
            port.flush()
            port.baudrate = baud

    def close(self) -> None:
        """Close the port."""
        port, self._serial = self._serial, None
        if port is not None:
            with contextlib.suppress(OSError):  # it may be unplugged
                port.close()

    @contextlib.contextmanager
    def _watched(self) -> Iterator[None]:
        import serial  # noqa: PLC0415 (as above; loaded by now)

        try:
            yield
        except serial.SerialTimeoutException:
            raise DeviceTimeout(f"took nothing for {_WRITE:g} s") from None
        except (OSError, TypeError) as error:  # pyserial's fd is None once it is unplugged
            raise DeviceDisconnected(f"went away: {reason(error)}") from error


class TcpLink:
    """A TCP connection to a device that listens.

    Parameters
    ----------
    host : str
    port : int
    """

    def __init__(self, host: str, port: int) -> None:
        self.name = f"{host}:{port}"
        self._address = (host, port)
        self._socket: socket.socket | None = None

    def open(self) -> None:
        """Connect, without delaying small telegrams."""
        try:
            self._socket = socket.create_connection(self._address, timeout=_CONNECT)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            raise DeviceError(f"no connection: {reason(error)}") from error

    def read(self, timeout: float) -> bytes:
        """Return what has come within `timeout` [s]."""
        peer = _require_open(self._socket)
        with self._watched():
            if not _readable(peer.fileno(), timeout):
                return b""
            data = peer.recv(_AT_ONCE)
        if not data:
            raise DeviceDisconnected("closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Send all of it."""
        peer = _require_open(self._socket)
        with self._watched():
            peer.sendall(data)

    def set_baud(self, baud: int) -> None:
        """Do nothing: TCP has no speed to set."""

    def close(self) -> None:
        """Disconnect."""
        peer, self._socket = self._socket, None
        if peer is not None:
            peer.close()

    @contextlib.contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except TimeoutError:
            raise DeviceTimeout(f"took nothing for {_CONNECT:g} s") from None
        except OSError as error:
            raise DeviceDisconnected(f"went away: {reason(error)}") from error


class FileLink:
    """The bytes that a device once sent, at the pace at which it sent them; takes no bytes.

    Parameters
    ----------
    path : Path
    clock : Clock
    bytes_per_second : float
        A tenth of the line's baud rate, or the telegram's length times the device's rate.
    wait : callable
        What passes the time, given in seconds.
    """

    def __init__(
        self,
        path: Path,
        *,
        clock: Clock,
        bytes_per_second: float,
        wait: Callable[[float], object] | None = None,
    ) -> None:
        self.name = str(path)
        self._path = path
        self._clock = clock
        self._rate = bytes_per_second
        self._wait = wait or threading.Event().wait
        self._data: bytes | None = None
        self._taken = 0
        self._start_ns = 0

    def open(self) -> None:
        """Read the file, once; it does not begin anew after its end."""
        if self._data is None:
            try:
                self._data = self._path.read_bytes()
            except OSError as error:
                raise DeviceError(f"cannot be read: {reason(error)}") from error
            self._start_ns = self._clock.now_ns()
        self._require_more()

    def read(self, timeout: float) -> bytes:
        """Return the bytes whose time has come."""
        self._require_more()
        self._wait(min(timeout, _PIECE))
        passed = (self._clock.now_ns() - self._start_ns) * 1e-9
        start, self._taken = self._taken, max(self._taken, int(passed * self._rate))
        return (self._data or b"")[start : self._taken]

    def write(self, data: bytes) -> None:
        """Do nothing: nobody listens."""

    def set_baud(self, baud: int) -> None:
        """Do nothing: a file has no speed to set."""

    def close(self) -> None:
        """Do nothing: the file was closed when it had been read."""

    def _require_more(self) -> None:
        if self._taken >= len(self._data or b""):
            raise DeviceDisconnected("the recording is at its end")


def _readable(descriptor: int, timeout: float) -> bool:
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(timeout * 1e3))


def _require_open(opened: Opened | None) -> Opened:
    if opened is None:
        raise DeviceDisconnected("is not open")
    return opened


def reason(error: Exception) -> str:
    """Return why an operation on a line failed, in the system's words."""
    if isinstance(error, TimeoutError):
        return "timed out"
    number = getattr(error, "errno", None)  # pyserial wraps the system's words in its own
    if isinstance(number, int) and number > 0:
        return os.strerror(number).lower()
    text = str(error)
    if isinstance(number, int):  # the resolver's are negative and have texts of their own
        return (getattr(error, "strerror", None) or text).lower()
    return "hung up" if "returned no data" in text else text
