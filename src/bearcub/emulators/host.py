"""Lines from emulators to drivers: a pty, a loopback TCP port, or directly, without any thread."""

import contextlib
import os
import select
import socket
import struct
import termios
import threading
from collections.abc import Callable
from pathlib import Path

from bearcub.clock import Clock
from bearcub.devices.protocols import Closing
from bearcub.emulators.emulator import Emulator
from bearcub.emulators.faults import garbled
from bearcub.errors import DeviceDisconnected, DeviceError

_TICK = 0.002  # how often an emulator is asked what it sends [s]
_AT_ONCE = 65536
_KEPT_NS = 100_000_000  # a line keeps no bytes: those that nobody takes for so long are lost
_SET_UP_NS = 500_000_000  # within which who opens a port sets it up

_SPEEDS = {
    getattr(termios, f"B{baud}"): baud
    for baud in (2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000)
}


class PtyHost(Closing):
    """Serves an emulator on a pseudo-terminal, which a driver opens as its serial port.

    A pty takes every speed and ignores it, so the host looks which one the driver has set and
    garbles all bytes when it is not the emulator's.

    Parameters
    ----------
    emulator : Emulator
    clock : Clock
    link : Path, optional
        A symbolic link to make to the pty, for a name that stays when it is served anew.

    Attributes
    ----------
    path : str
        What the driver opens.
    baud : int or None
        The speed at which the emulator talks first [baud].

    Raises
    ------
    DeviceError
        If there is no pty, or the link cannot be made.
    """

    def __init__(self, emulator: Emulator, *, clock: Clock, link: Path | None = None) -> None:
        self.baud = emulator.baud
        self._emulator = emulator
        self._clock = clock
        self._link = link
        try:
            self._master, slave = os.openpty()
            self.path = os.ttyname(slave)
            # Held by nobody but a driver, so that its coming and going can be seen.
            os.close(slave)
            if link is not None:
                link.unlink(missing_ok=True)
                link.symlink_to(self.path)
                self.path = str(link)
        except OSError as error:
            raise DeviceError(f"no pty for an emulator: {error.strerror or error}") from error
        os.set_blocking(self._master, False)
        self._opened_ns: int | None = None  # by the driver; None while nobody has it open
        self._waiting, self._taken_ns = b"", 0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=self.path, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Hang up, as when the plug is pulled; a second call does nothing."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        self._thread.join()
        os.close(self._master)
        if self._link is not None:
            self._link.unlink(missing_ok=True)

    def _run(self) -> None:
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        while not self._stopping.is_set():
            events = sum(event for _, event in poll.poll(_TICK * 1e3))
            now_ns = self._clock.now_ns()
            if events & select.POLLHUP:
                self._opened_ns = None
                self._stopping.wait(_TICK)
            elif self._opened_ns is None:
                self._opened_ns = now_ns
            if events & select.POLLIN:
                heard = self._heard()
                self._emulator.receive(heard if self._same_speed() else garbled(heard))
            with contextlib.suppress(ConnectionResetError):  # a serial line has no connection
                self._send(self._emulator.poll(now_ns), now_ns)

    def _heard(self) -> bytes:
        try:
            return os.read(self._master, _AT_ONCE)
        except OSError:  # EIO: the driver has closed it since
            return b""

    def _send(self, said: bytes, now_ns: int) -> None:
        """Put bytes on the line; they are lost where nobody listens."""
        if self._opened_ns is None or not self._is_set_up(now_ns):
            self._waiting = b""
            return
        self._waiting += said if self._same_speed() else garbled(said)
        try:
            if self._waiting:
                self._waiting = self._waiting[os.write(self._master, self._waiting) :]
            self._taken_ns = now_ns
        except BlockingIOError:
            if now_ns - self._taken_ns > _KEPT_NS:
                self._waiting = b""

    def _is_set_up(self, now_ns: int) -> bool:
        """Tell whether the driver has made it a line for bytes, or does not do so at all.

        Until then the pty would send back what it gets.
        """
        echoes = termios.tcgetattr(self._master)[3] & termios.ECHO
        return not echoes or now_ns - (self._opened_ns or 0) > _SET_UP_NS

    def _same_speed(self) -> bool:
        return self._emulator.baud in (None, _SPEEDS.get(termios.tcgetattr(self._master)[5]))


class TcpHost(Closing):
    """Serves an emulator on a TCP port of the loopback interface, one connection at a time.

    Parameters
    ----------
    emulator : Emulator
    clock : Clock
    port : int, optional
        0 takes any that is free.

    Attributes
    ----------
    port : int
        Where it listens, on 127.0.0.1.

    Raises
    ------
    DeviceError
        If the port is taken.
    """

    def __init__(self, emulator: Emulator, *, clock: Clock, port: int = 0) -> None:
        self._emulator = emulator
        self._clock = clock
        try:
            self._listener = socket.create_server(("127.0.0.1", port))
        except OSError as error:
            raise DeviceError(f"127.0.0.1:{port}: cannot listen: {error.strerror}") from error
        self.port: int = self._listener.getsockname()[1]
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"port {self.port}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Break off the connection and stop listening; a second call does nothing."""
        self._stopping.set()
        self._thread.join()
        self._listener.close()

    def _run(self) -> None:
        while not self._stopping.is_set():
            if select.select([self._listener], [], [], _TICK)[0]:
                peer = self._listener.accept()[0]
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._emulator.connect()
                try:
                    self._serve(peer)
                except ConnectionError:
                    # Closing with no time to linger sends a reset.
                    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                finally:
                    peer.close()

    def _serve(self, peer: socket.socket) -> None:
        while not self._stopping.is_set():
            if select.select([peer], [], [], _TICK)[0]:
                heard = peer.recv(_AT_ONCE)
                if not heard:
                    return
                self._emulator.receive(heard)
            said = self._emulator.poll(self._clock.now_ns())
            if said:
                peer.sendall(said)


class DirectLink:
    """A `bearcub.devices.link.Link` straight into an emulator: no thread, no socket, no waiting.

    With a manual clock a driver and its device can be followed step by step: a read that finds
    nothing passes the time through `wait`.

    Parameters
    ----------
    emulator : Emulator
    clock : Clock
    wait : callable
        What passes the time, given in seconds: a `ManualClock`'s ``advance``.
    baud : int, optional
        The speed of the driver's end when it is opened [baud]; by default the emulator's.

    Attributes
    ----------
    plugged : bool
        False pulls the plug.
    """

    def __init__(
        self,
        emulator: Emulator,
        *,
        clock: Clock,
        wait: Callable[[float], object],
        baud: int | None = None,
    ) -> None:
        self.name = "emulator"
        self.plugged = True
        self._emulator = emulator
        self._clock = clock
        self._wait = wait
        self._first_baud = baud or emulator.baud
        self._baud = self._first_baud

    def open(self) -> None:
        """Connect, if the plug is in."""
        if not self.plugged:
            raise DeviceError("cannot be opened: no such device")
        self._baud = self._first_baud
        self._emulator.connect()

    def read(self, timeout: float) -> bytes:
        """Return what the emulator sends within `timeout` [s]."""
        until_ns = self._clock.now_ns() + round(timeout * 1e9)
        while True:
            self._require_plug()
            try:
                data = self._emulator.poll(self._clock.now_ns())
            except ConnectionResetError:
                raise DeviceDisconnected("broke the connection off") from None
            left = (until_ns - self._clock.now_ns()) * 1e-9
            if data or left <= 0:
                return data if self._baud == self._emulator.baud else garbled(data)
            self._wait(min(left, _TICK))

    def write(self, data: bytes) -> None:
        """Hand it to the emulator."""
        self._require_plug()
        same = self._baud == self._emulator.baud
        self._emulator.receive(data if same else garbled(data))

    def set_baud(self, baud: int) -> None:
        """Set the speed of the driver's end [baud]; a device on TCP has none."""
        if self._emulator.baud is not None:
            self._baud = baud

    def close(self) -> None:
        """Do nothing: nothing is held."""

    def _require_plug(self) -> None:
        if not self.plugged:
            raise DeviceDisconnected("went away: unplugged")
