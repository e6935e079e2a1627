"""Lines to devices: files at their pace, and what is said when a line cannot be had."""

import sys
from pathlib import Path

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.link import FileLink, SerialLink
from bearcub.errors import DeviceDisconnected, DeviceError


def test_a_file_gives_its_bytes_at_the_pace_of_the_device(tmp_path: Path) -> None:
    path = tmp_path / "sent.bin"
    path.write_bytes(bytes(range(100)))
    clock = ManualClock(7)
    link = FileLink(path, clock=clock, bytes_per_second=1000.0, wait=clock.advance)
    link.open()
    assert link.read(0.5) == bytes(range(10))  # of 10 ms
    clock.advance(0.02)
    assert link.read(0.0) == bytes(range(10, 30))
    link.write(b"nobody listens")
    link.set_baud(9600)
    link.close()
    link.open()
    clock.advance(10.0)
    assert link.read(0.0) == bytes(range(30, 100))
    with pytest.raises(DeviceDisconnected, match="the recording is at its end"):
        link.read(0.0)
    with pytest.raises(DeviceDisconnected, match="the recording is at its end"):
        link.open()


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    link = FileLink(tmp_path / "none.bin", clock=ManualClock(), bytes_per_second=1.0)
    assert link.name == str(tmp_path / "none.bin")
    with pytest.raises(DeviceError, match="cannot be read: no such file or directory"):
        link.open()


def test_a_serial_line_without_pyserial_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(DeviceError, match=r"need pyserial; run: pip install 'bearcub\[devices\]'"):
        SerialLink("/dev/ttyUSB0").open()
