"""Cameras as sources: pairing by stamps, files as live cameras, a stream over loopback HTTP."""

import http.server
import logging
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock, MonotonicClock
from bearcub.devices import open_frames
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras.files import FileCapture
from bearcub.devices.cameras.opencv import (
    PairCapture,
    SingleCapture,
    VideoDevice,
    VideoSettings,
)
from bearcub.errors import ConfigError, DeviceDisconnected
from bearcub.messages import UInt8

MS = 1_000_000


class Scripted:
    """A camera that takes pictures at given times [ms]; the grey level tells which one it was."""

    def __init__(self, name: str, times_ms: list[int], *, width: int = 20) -> None:
        self.name = name
        self._times = list(enumerate(times_ms))
        self._width = width
        self._level = 0

    def open(self) -> None:
        pass

    def grab(self) -> int:
        if not self._times:
            raise DeviceDisconnected("sends no pictures any more")
        self._level, at = self._times.pop(0)
        return at * MS

    def retrieve(self) -> UInt8:
        return np.full((16, self._width), self._level, dtype=np.uint8)

    def close(self) -> None:
        pass


def test_pictures_taken_together_are_a_pair_and_their_skew_is_known() -> None:
    left, right = Scripted("l", [0, 66, 132]), Scripted("r", [4, 70, 135])
    pair = PairCapture(left, right, largest_skew=0.01)
    first, second = pair.take(), pair.take()
    assert (first.skew, second.skew) == pytest.approx((0.004, 0.003))
    assert first.stamp_ns == 68 * MS
    assert first.dropped == 0


def test_a_picture_without_partner_is_dropped_and_counted() -> None:
    # The right camera misses one period; the left one's picture 2 has no partner.
    left, right = Scripted("l", [0, 66, 132, 198, 264]), Scripted("r", [2, 68, 200, 266])
    pair = PairCapture(left, right, largest_skew=0.01)
    assert pair.take().dropped == 0
    taken = pair.take()
    assert taken.right is not None
    assert (taken.left[0, 0], taken.right[0, 0], taken.dropped) == (3, 2, 1)
    assert pair.take().dropped == 0


def test_what_a_camera_took_while_the_other_one_began_is_no_loss() -> None:
    left, right = Scripted("l", [0, 66, 132, 198, 264]), Scripted("r", [134, 200, 266])
    taken = PairCapture(left, right, largest_skew=0.01).take()
    assert taken.right is not None
    assert (taken.left[0, 0], taken.right[0, 0], taken.dropped) == (4, 2, 0)


def test_cameras_that_never_meet_are_a_fault_with_advice() -> None:
    left = Scripted("l", [100 * k for k in range(20)])
    right = Scripted("r", [100 * k + 50 for k in range(20)])
    source = CameraSource(
        PairCapture(left, right, largest_skew=0.01), clock=ManualClock(), rate_hz=10, role="stereo"
    )
    source.step()
    assert "connect their triggers" in source.health().problem
    assert source.latest() is None


def test_cameras_of_two_sizes_are_a_fault() -> None:
    left, right = Scripted("l", [0, 66]), Scripted("r", [0, 66], width=24)
    pair = PairCapture(left, right, largest_skew=0.01)
    source = CameraSource(pair, clock=ManualClock(), rate_hz=10, role="stereo")
    source.step()
    assert "set both cameras to one size" in source.health().problem


def test_skew_and_drops_are_told_by_the_source() -> None:
    left = Scripted("l", [0, 66, 132, 198, 264])
    right = Scripted("r", [2, 70, 200, 265])
    pair = PairCapture(left, right, largest_skew=0.01)
    clock = ManualClock()
    source = CameraSource(pair, clock=clock, rate_hz=15, role="stereo")
    for _ in range(3):
        source.step()
        clock.advance(0.066)
    assert source.skew.median == pytest.approx(0.002)
    assert source.skew.largest == pytest.approx(0.004)
    assert source.health().drops == 1
    assert source.health().values == 3
    reading = source.latest()
    assert reading is not None
    assert reading.value.left is not None
    assert not reading.value.left.flags.writeable


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"pixel_format": "H264"}, "MJPG"),
        ({"width": 640}, "two numbers"),
        ({"exposure_ms": -1.0}, "exposure_ms"),
        ({"rate_hz": 0.0}, "rate_hz"),
    ],
)
def test_impossible_settings_are_refused(wrong: dict[str, object], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        VideoSettings(**wrong)  # type: ignore[arg-type]


def test_a_camera_that_is_not_there_says_where_to_look() -> None:
    device = VideoDevice("/dev/no-such-camera", clock=ManualClock())
    source = CameraSource(
        SingleCapture(device, side_by_side=False), clock=ManualClock(), rate_hz=10, role="colour"
    )
    source.step()
    assert source.health().problem == (
        "colour (/dev/no-such-camera): cannot be opened as a camera: no such file or directory; "
        "see: bearcub devices"
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for index in range(4):
        picture = np.full((20, 40), 10 * index, dtype=np.uint8)
        picture[:, 20:] += 5
        cv2.imwrite(str(tmp_path / f"{index}.png"), picture)
    return tmp_path


def live(folder: Path, clock: ManualClock) -> CameraSource:
    capture = FileCapture(
        lambda: open_frames(folder, side_by_side=True),
        name=folder.name,
        clock=clock,
        rate_hz=10.0,
        wait=clock.advance,
    )
    return CameraSource(capture, clock=clock, rate_hz=10.0, role="stereo")


def test_files_come_at_their_rate_and_end(folder: Path) -> None:
    clock = ManualClock(50)
    source, stamps = live(folder, clock), []
    for _ in range(4):
        source.step()
        reading = source.latest()
        assert reading is not None
        stamps.append((reading.stamp_ns, clock.now_ns()))
        assert reading.fresh
    assert stamps == [(50 + k * 100 * MS, 50 + k * 100 * MS) for k in range(4)]
    frame = source.latest()
    assert frame is not None
    assert frame.value.left is not None
    assert frame.value.right is not None
    assert (frame.value.left[0, 0], frame.value.right[0, 0]) == (30, 35)
    for _ in range(9):
        clock.advance(0.1)
        source.step()
    assert "the recording is at its end" in source.health().problem
    stale = source.latest()
    assert stale is not None
    assert not stale.fresh


def test_frames_whose_time_has_passed_are_dropped_and_counted(folder: Path) -> None:
    clock = ManualClock()
    source = live(folder, clock)
    source.step()
    clock.advance(0.25)
    source.step()
    reading = source.latest()
    assert reading is not None
    assert reading.value.left is not None
    assert reading.value.left[0, 0] == 20
    assert source.health().drops == 1


class _Pictures(http.server.BaseHTTPRequestHandler):
    """Motion JPEG as network cameras send it."""

    off = threading.Event()

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
        self.end_headers()
        picture = np.full((48, 128, 3), 40, dtype=np.uint8)
        picture[:, 64:] = 200
        jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
        head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
        try:
            while not self.off.wait(0.02):
                self.wfile.write(head.encode() + jpeg + b"\r\n")
        except ConnectionError:
            return

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 (the base's name)
        pass


class Server:
    """A network camera that can be switched off and on at one address."""

    def __init__(self) -> None:
        self.port = 0
        self.switch_on()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/camera.mjpg"

    def switch_on(self) -> None:
        _Pictures.off.clear()
        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", self.port), _Pictures)
        self._server.daemon_threads = True
        self.port = self._server.server_port
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.02,), daemon=True
        )
        self._thread.start()

    def switch_off(self) -> None:
        _Pictures.off.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


@pytest.fixture
def server() -> Iterator[Server]:
    served = Server()
    yield served
    served.switch_off()


def seen(source: CameraSource, *, good: bool, within: float) -> None:
    """Wait until the camera is well, or not."""
    clock = MonotonicClock()
    until_ns = clock.now_ns() + round(within * 1e9)
    while source.health().good != good:
        assert clock.now_ns() < until_ns, source.health()
        threading.Event().wait(0.01)


def test_a_network_camera_is_read_lost_and_found_again(
    server: Server, caplog: pytest.LogCaptureFixture
) -> None:
    clock = MonotonicClock()
    capture = SingleCapture(VideoDevice(server.address, clock=clock), side_by_side=True)
    with CameraSource(capture, clock=clock, rate_hz=20, role="stereo") as source:
        seen(source, good=True, within=5.0)
        reading = source.latest()
        assert reading is not None
        left, right = reading.value.left, reading.value.right
        assert left is not None
        assert right is not None
        assert (left.shape, right.shape) == ((48, 64, 3), (48, 64, 3))
        assert abs(int(left[24, 20, 0]) - 40) < 6
        assert abs(int(right[24, 50, 0]) - 200) < 6
        server.switch_off()
        seen(source, good=False, within=0.5)
        threading.Event().wait(0.5)
        stale = source.latest()
        assert stale is not None
        assert not stale.fresh
        warnings = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
        assert len(warnings) == 1
        assert "sends no pictures any more" in warnings[0]
        server.switch_on()
        seen(source, good=True, within=2.0)
        found = source.latest()
        assert found is not None
        assert found.fresh
