"""Emulators on real lines: ptys and loopback TCP, with the threads and sockets of a robot."""

import socket
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.link import SerialLink, TcpLink
from bearcub.devices.nmea import encode
from bearcub.devices.stream import Streaming
from bearcub.devices.tilt.cxtilt import Cxtilt
from bearcub.devices.tilt.vectornav import VectorNav
from bearcub.emulators import PtyHost, TcpHost
from bearcub.emulators.emulator import Ticker
from bearcub.emulators.tilt.cxtilt import CxtiltEmulator
from bearcub.emulators.tilt.vectornav import VectorNavEmulator
from bearcub.errors import DeviceDisconnected, DeviceError
from bearcub.messages import Tilt

CLOCK = MonotonicClock()
LEANING = Tilt(pitch=0.1, roll=-0.2)


def wait(until: Callable[[], bool], seconds: float = 5.0) -> float:
    """Wait for something to become true; return how long that took [s]."""
    start_ns, tick = CLOCK.now_ns(), threading.Event()
    while not until():
        passed = (CLOCK.now_ns() - start_ns) * 1e-9
        assert passed < seconds
        tick.wait(0.005)
    return (CLOCK.now_ns() - start_ns) * 1e-9


def cxtilt(path: str, *, baud: int = 9600) -> Streaming[Tilt]:
    link = SerialLink(path, baud=baud)
    return Streaming(link, Cxtilt(), clock=CLOCK, rate_hz=20.0, role="tilt")


class Echo:
    """Says back what it hears, breaks the connection off at ``!``, and counts on its own."""

    baud: int | None = None

    def __init__(self) -> None:
        self.connections = 0
        self.heard = b""
        self.ticker = Ticker(1000.0)

    def connect(self) -> None:
        self.connections += 1

    def receive(self, data: bytes) -> None:
        self.heard += data

    def poll(self, now_ns: int) -> bytes:
        self.ticker.due(now_ns)
        heard, self.heard = self.heard, b""
        if b"!" in heard:
            raise ConnectionResetError
        return heard


def read(link: TcpLink | SerialLink, n_bytes: int) -> bytes:
    data = b""
    while len(data) < n_bytes and (piece := link.read(2.0)):
        data += piece
    return data


def test_a_driver_reads_an_emulator_over_a_pty() -> None:
    emulator = CxtiltEmulator(lambda _: LEANING)
    with PtyHost(emulator, clock=CLOCK) as host, cxtilt(host.path) as source:
        wait(lambda: source.health().values >= 3)
        reading = source.latest()
        assert reading is not None
        assert reading.value.pitch == pytest.approx(0.1, abs=1e-4)
        assert reading.value.roll == pytest.approx(-0.2, abs=1e-4)
        assert 0 < reading.age < 0.5
        assert source.health().good
        assert source.name == f"tilt ({host.path})"


def test_a_driver_at_the_wrong_speed_gets_nothing_and_at_the_right_one_all() -> None:
    with PtyHost(CxtiltEmulator(), clock=CLOCK) as host:
        with cxtilt(host.path, baud=19200) as source:
            wait(lambda: source.health().errors >= 1)
            assert source.latest() is None
        link = SerialLink(host.path, baud=19200)
        link.open()
        link.write(b"G")
        assert link.read(0.1) == b""
        link.set_baud(9600)
        link.write(b"G")
        assert len(read(link, 6)) == 6
        link.close()


def test_a_pulled_plug_is_named_at_once_heals_and_does_not_touch_the_others(tmp_path: Path) -> None:
    name = tmp_path / "tilt"
    with (
        PtyHost(VectorNavEmulator(), clock=CLOCK) as other_host,
        Streaming(
            SerialLink(other_host.path, baud=115200),
            VectorNav(),
            clock=CLOCK,
            rate_hz=40.0,
            role="imu",
        ) as other,
    ):
        host = PtyHost(CxtiltEmulator(), clock=CLOCK, link=name)
        with cxtilt(str(name)) as source:
            wait(lambda: source.health().good and other.health().good)
            host.close()
            beats = other.health().values
            assert wait(lambda: not source.health().good) < 0.5
            assert source.health().problem.startswith(f"tilt ({name}): ")
            with PtyHost(CxtiltEmulator(), clock=CLOCK, link=name):
                before = source.health().values
                assert wait(lambda: source.health().values > before) < 2.0
                assert source.health().good
                reading = source.latest()
                assert reading is not None
                assert reading.fresh
            assert other.health().good
            assert other.health().values > beats
            assert other.health().errors == 0


def test_a_host_that_is_closed_twice_is_closed(tmp_path: Path) -> None:
    host = PtyHost(CxtiltEmulator(), clock=CLOCK, link=tmp_path / "tilt")
    assert (tmp_path / "tilt").is_symlink()
    host.close()
    host.close()
    assert not (tmp_path / "tilt").is_symlink()


def test_a_pty_that_nobody_reads_does_not_stop_its_emulator() -> None:
    emulator = VectorNavEmulator()
    with PtyHost(emulator, clock=CLOCK) as host:
        link = SerialLink(host.path, baud=115200)
        link.open()
        link.write(encode("VNWRG,06,14") + encode("VNWRG,07,200"))
        assert read(link, 100).startswith(b"$VNWRG,06,14*")
        threading.Event().wait(0.3)
        assert len(read(link, 2000)) >= 2000
        link.close()


def test_bytes_go_both_ways_over_tcp_and_a_reset_is_noticed() -> None:
    emulator = Echo()
    with TcpHost(emulator, clock=CLOCK) as host:
        link = TcpLink("127.0.0.1", host.port)
        assert link.name == f"127.0.0.1:{host.port}"
        link.open()
        link.write(b"hello")
        assert read(link, 5) == b"hello"
        assert link.read(0.01) == b""
        link.write(b"!")
        with pytest.raises(DeviceDisconnected, match="went away: connection reset by peer"):
            read(link, 1)
        link.close()
        link.close()
        link.open()
        link.write(b"again")
        assert read(link, 5) == b"again"
        assert emulator.connections == 2
        host.close()
        with pytest.raises(DeviceDisconnected, match="closed the connection"):
            read(link, 1)
        link.close()
        with pytest.raises(DeviceError, match="no connection: connection refused"):
            link.open()


def test_what_is_closed_or_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(DeviceDisconnected, match="is not open"):
        TcpLink("127.0.0.1", 1).read(0.0)
    with pytest.raises(DeviceDisconnected, match="is not open"):
        SerialLink("/dev/null").write(b"G")
    with pytest.raises(DeviceError, match="cannot be opened: no such file or directory"):
        SerialLink(str(tmp_path / "ttyUSB7")).open()
    (tmp_path / "file").write_text("no terminal")
    with pytest.raises(DeviceError, match=r"cannot be opened: .*Inappropriate ioctl"):
        SerialLink(str(tmp_path / "file")).open()


def test_a_port_that_is_taken_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(DeviceError, match=f"127.0.0.1:{port}: cannot listen: "):
            TcpHost(Echo(), clock=CLOCK, port=port)


def test_one_port_is_for_one_program() -> None:
    with PtyHost(CxtiltEmulator(), clock=CLOCK) as host:
        first, second = SerialLink(host.path), SerialLink(host.path)
        first.open()
        with pytest.raises(DeviceError, match="cannot be opened: "):
            second.open()
        first.close()


class Stamps:
    """Says the time, a thousand times a second."""

    baud: int | None = None

    def __init__(self) -> None:
        self.ticker = Ticker(1000.0)

    def connect(self) -> None:
        pass

    def receive(self, data: bytes) -> None:
        pass

    def poll(self, now_ns: int) -> bytes:
        return f"{now_ns}\n".encode() if self.ticker.due(now_ns) else b""


def test_what_a_pty_was_told_while_nobody_listened_is_not_heard_later() -> None:
    with PtyHost(Stamps(), clock=CLOCK) as host:
        for _ in range(2):
            threading.Event().wait(0.2)  # long enough to fill the system's buffers
            link = SerialLink(host.path, baud=9600)
            opened_ns = CLOCK.now_ns()
            link.open()
            first = read(link, 40).splitlines()[0]
            link.close()
            assert int(first) >= opened_ns
