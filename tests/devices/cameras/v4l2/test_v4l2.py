"""OpenCV's own V4L2 code on cameras that answer the system calls as Linux does."""

import importlib.util
import re
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.cli.main import main
from bearcub.clock import MonotonicClock
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras import opencv as under_test
from bearcub.devices.cameras.opencv import PairCapture, SingleCapture, VideoDevice, VideoSettings
from bearcub.errors import DeviceDisconnected, DeviceError
from bearcub.messages import UInt8
from bearcub.runtime.devices import build_devices

WIDTH, HEIGHT = 256, 48
BLUE, RED, GREEN = (220, 40, 20), (20, 40, 220), (40, 180, 40)
EXPOSURE_AUTO, EXPOSURE, GAIN = "009a0901", "009a0902", "00980913"  # V4L2_CID_..., Camera, User
CONTROLS = {EXPOSURE_AUTO: "1 3 2 3", EXPOSURE: "1 5000 1 156", GAIN: "0 255 1 32"}
MODES = (
    "YUYV 256 48 1/30 1/15 2/15",
    "MJPG 256 48 1/30 1/15",
    "MJPG 320 240 1/30",
    "GREY 256 48 1/30",
    "UYVY 256 48 1/30",
)
CLOCK = MonotonicClock()


def halves(left: tuple[int, int, int], right: tuple[int, int, int]) -> UInt8:
    picture = np.empty((HEIGHT, WIDTH, 3), dtype=np.uint8)
    picture[:, : WIDTH // 2], picture[:, WIDTH // 2 :] = left, right
    return picture


class Camera:
    """An emulated camera as `emulated_v4l2.c` describes it."""

    def __init__(
        self, base: Path, number: int, *, controls: dict[str, str], phase_ms: float
    ) -> None:
        self.path = f"/dev/video{number}"
        self.folder = base / f"video{number}"
        self.folder.mkdir()
        lines = [f"mode {mode}" for mode in MODES]
        lines += [f"control {key} {values}" for key, values in controls.items()]
        self.write("camera", "\n".join(lines).encode())
        self.write("phase_ns", str(round(phase_ms * 1e6)).encode())
        self.sees(halves(BLUE, RED))

    def write(self, name: str, data: bytes) -> None:
        (self.folder / "new").write_bytes(data)
        (self.folder / "new").replace(self.folder / name)

    def sees(self, picture: UInt8) -> None:
        self.write("MJPG-256x48", cv2.imencode(".jpg", picture)[1].tobytes())
        self.write("GREY-256x48", cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).tobytes())
        self.write("YUYV-256x48", cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_YUYV).tobytes())
        self.write("UYVY-256x48", cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_UYVY).tobytes())

    def stall(self, *, stalled: bool) -> None:
        if stalled:
            (self.folder / "stalled").touch()
        else:
            (self.folder / "stalled").unlink()

    def unplug(self) -> None:
        self.folder.rename(self.folder.with_suffix(".unplugged"))

    def plug(self) -> None:
        self.folder.with_suffix(".unplugged").rename(self.folder)

    def told(self) -> list[str]:
        """What reached the camera since it was given its format for the last time."""
        lines = (self.folder / "log").read_text().splitlines()
        last = max(at for at, line in enumerate(lines) if line.startswith("S_FMT"))
        return lines[last:]


PlugIn = Callable[..., Camera]


@pytest.fixture
def plug_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PlugIn:
    monkeypatch.setenv("EMULATED_V4L2", str(tmp_path))

    def plug(number: int, *, without: str = "", phase_ms: float = 0.0) -> Camera:
        controls = {key: CONTROLS[key] for key in CONTROLS if key != without}
        return Camera(tmp_path, number, controls=controls, phase_ms=phase_ms)

    return plug


@pytest.fixture
def camera(plug_in: PlugIn) -> Camera:
    return plug_in(0)


@pytest.fixture
def opened() -> Iterator[Callable[..., VideoDevice]]:
    """Return what opens a device, which is closed at the end."""
    devices = []

    def open_device(camera: Camera, settings: VideoSettings | None = None) -> VideoDevice:
        devices.append(VideoDevice(camera.path, clock=CLOCK, settings=settings))
        devices[-1].open()
        return devices[-1]

    yield open_device
    for device in devices:
        device.close()


Opened = Callable[..., VideoDevice]


def test_settings_reach_the_camera_in_its_order_and_units(camera: Camera, opened: Opened) -> None:
    settings = VideoSettings(
        width=WIDTH, height=HEIGHT, pixel_format="MJPG", rate_hz=15, exposure_ms=5.0, gain=16
    )
    opened(camera, settings).grab()
    assert camera.told() == [
        "S_FMT MJPG 256x48 gives MJPG 256x48",
        "S_PARM 1/30 gives 1/30",
        "REQBUFS 4",
        "S_PARM 1/15 gives 1/15",
        f"S_CTRL {EXPOSURE_AUTO} 1 gives 1",  # manual: only then an exposure is taken
        f"S_CTRL {EXPOSURE} 50 gives 50",  # units of 100 µs
        f"S_CTRL {GAIN} 16 gives 16",
        "STREAMON",
    ]


def test_exposure_is_automatic_and_gain_left_alone_by_default(
    camera: Camera, opened: Opened
) -> None:
    opened(camera, VideoSettings(exposure_ms=5.0)).close()
    opened(camera)
    controls = [line for line in camera.told() if line.startswith("S_CTRL")]
    assert controls == [f"S_CTRL {EXPOSURE_AUTO} 3 gives 3"]


def test_a_rate_that_is_no_whole_number_stays(camera: Camera, opened: Opened) -> None:
    opened(camera, VideoSettings(rate_hz=7.5)).grab()
    assert [line for line in camera.told() if "S_PARM" in line][-1] == "S_PARM 1/8 gives 2/15"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (VideoSettings(width=640, height=480), "gives 256 x 48 pixels, not 640 x 480"),
        (
            VideoSettings(width=1280, height=480, pixel_format="MJPG"),
            "gives 320 x 240 pixels, not 1280 x 480",
        ),
        (VideoSettings(exposure_ms=600.0), "takes exposure_ms = 500, not 600"),
        (VideoSettings(gain=300.0), "takes gain = 255, not 300"),
    ],
)
def test_what_a_camera_cannot_is_told_with_values(
    camera: Camera, opened: Opened, settings: VideoSettings, said: str
) -> None:
    with pytest.raises(DeviceError, match=said):
        opened(camera, settings)


def test_a_format_that_it_has_not_is_told(camera: Camera, opened: Opened) -> None:
    left_out = "\n".join(f"mode {mode}" for mode in MODES if "MJPG" not in mode)
    camera.write("camera", left_out.encode())
    with pytest.raises(DeviceError, match="gives pictures as YUYV, not MJPG"):
        opened(camera, VideoSettings(pixel_format="MJPG"))


def test_a_control_that_it_has_not_is_told(plug_in: PlugIn, opened: Opened) -> None:
    with pytest.raises(DeviceError, match="does not take gain = 16; leave it out"):
        opened(plug_in(0, without=GAIN), VideoSettings(gain=16))


def test_a_camera_that_another_program_reads_is_told(camera: Camera, opened: Opened) -> None:
    opened(camera)
    with pytest.raises(DeviceError, match="busy; check which program uses it: fuser /dev/video0"):
        opened(camera)


@pytest.mark.parametrize("pixel_format", ["YUYV", "UYVY", "MJPG"])
def test_pictures_are_blue_left_and_red_right(
    camera: Camera, opened: Opened, pixel_format: str
) -> None:
    device = opened(camera, VideoSettings(width=WIDTH, height=HEIGHT, pixel_format=pixel_format))
    device.grab()
    picture = device.retrieve()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert picture[24, 60] == pytest.approx(np.array(BLUE), abs=4)  # rounding of Y, Cb, Cr
    assert picture[24, 200] == pytest.approx(np.array(RED), abs=4)


def test_grey_pictures_keep_their_levels(camera: Camera, opened: Opened) -> None:
    camera.sees(halves((50, 50, 50), (200, 200, 200)))
    device = opened(camera, VideoSettings(pixel_format="GREY"))
    device.grab()
    picture = device.retrieve()
    assert picture[24, 60].tolist() == [50, 50, 50]
    assert picture[24, 200].tolist() == [200, 200, 200]


def test_side_by_side_is_split_in_the_middle(camera: Camera) -> None:
    single = SingleCapture(VideoDevice(camera.path, clock=CLOCK), side_by_side=True)
    single.open()
    taken = single.take()
    single.close()
    assert taken.right is not None
    assert taken.left.shape == taken.right.shape == (HEIGHT, WIDTH // 2, 3)
    for column in (0, WIDTH // 2 - 1):
        assert taken.left[24, column] == pytest.approx(np.array(BLUE), abs=4)
        assert taken.right[24, column] == pytest.approx(np.array(RED), abs=4)


def beside_the_beat(stamp_ns: int, *, rate_hz: int, phase_ns: int = 0) -> int:
    """How far a stamp is from the moments at which the camera takes pictures [ns]."""
    period_ns = 1_000_000_000 // rate_hz
    return abs((stamp_ns - phase_ns + period_ns // 2) % period_ns - period_ns // 2)


def test_stamps_are_the_driver_s_of_when_the_picture_was_taken(
    plug_in: PlugIn, opened: Opened
) -> None:
    device = opened(plug_in(0, phase_ms=7.0), VideoSettings(rate_hz=15))
    for _ in range(4):
        stamp_ns = device.grab()
        assert CLOCK.now_ns() - stamp_ns >= 0.9e9 / 15  # it was on the wire so long
        beside_ns = beside_the_beat(stamp_ns, rate_hz=15, phase_ns=7_000_000)
        assert beside_ns < 3000  # V4L2 tells microseconds


def test_no_picture_is_lost_while_one_is_decoded(camera: Camera, opened: Opened) -> None:
    device, stamps = opened(camera, VideoSettings(rate_hz=30)), []
    for _ in range(10):
        stamps.append(device.grab())
        threading.Event().wait(0.5 / 30)
        device.retrieve()
    assert np.median(np.diff(stamps)) == pytest.approx(1e9 / 30, abs=2000)


def test_pictures_that_waited_are_left_out_for_the_newest(
    camera: Camera, opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(under_test, "_YOUNG_NS", 200_000_000)  # older ones wait below
    device = opened(camera, VideoSettings(rate_hz=30))
    device.grab()
    device.retrieve()
    threading.Event().wait(0.3)
    stamp_ns = device.grab()
    assert CLOCK.now_ns() - stamp_ns < 100_000_000
    assert beside_the_beat(stamp_ns, rate_hz=30) < 3000


def pair_of(left: Camera, right: Camera, *, largest_skew: float = 0.01) -> PairCapture:
    settings = VideoSettings(rate_hz=30)
    devices = [VideoDevice(each.path, clock=CLOCK, settings=settings) for each in (left, right)]
    return PairCapture(*devices, largest_skew=largest_skew)


def test_two_cameras_pair_by_their_own_stamps_and_a_late_one_is_waited_for(
    plug_in: PlugIn,
) -> None:
    left, right = plug_in(0), plug_in(1, phase_ms=4.0)
    right.sees(halves(GREEN, RED))
    pair = pair_of(left, right)
    pair.open()
    taken = [pair.take() for _ in range(3)]
    right.stall(stalled=True)
    threading.Timer(0.15, right.stall, kwargs={"stalled": False}).start()
    taken += [pair.take() for _ in range(3)]
    pair.close()
    for each in taken:
        assert each.skew == pytest.approx(0.004, abs=3e-6)
        assert each.right is not None
        assert each.left[24, 60] == pytest.approx(np.array(BLUE), abs=4)
        assert each.right[24, 60] == pytest.approx(np.array(GREEN), abs=4)
    assert sum(each.dropped for each in taken[:3]) == 0
    assert 1 <= sum(each.dropped for each in taken[3:]) <= 6  # what the left one took meanwhile


def test_cameras_half_a_period_apart_are_no_pair(plug_in: PlugIn) -> None:
    pair = pair_of(plug_in(0), plug_in(1, phase_ms=16.0))
    pair.open()
    with pytest.raises(DeviceError, match="no partner within 10 ms"):
        pair.take()
    pair.close()


def test_the_one_of_two_cameras_that_is_pulled_out_is_named(plug_in: PlugIn) -> None:
    left, right = plug_in(0), plug_in(1)
    pair = pair_of(left, right)
    pair.open()
    pair.take()
    right.unplug()
    with pytest.raises(DeviceDisconnected, match=r"^/dev/video1: sends no pictures"):
        pair.take()
    pair.close()


def seen(source: CameraSource, *, good: bool, within: float) -> float:
    """Wait until the camera is well, or not; return how long it took [s]."""
    start_ns = CLOCK.now_ns()
    while source.health().good != good:
        assert CLOCK.now_ns() - start_ns < within * 1e9, source.health()
        threading.Event().wait(0.005)
    return (CLOCK.now_ns() - start_ns) * 1e-9


@pytest.fixture
def source(camera: Camera, tmp_path: Path) -> Iterator[CameraSource]:
    """A stereo camera as a robot's file describes it, well."""
    table = {
        "kind": "camera",
        "source": camera.path,
        "side_by_side": True,
        "width": WIDTH,
        "height": HEIGHT,
        "format": "MJPG",
        "rate_hz": 30.0,
        "exposure_ms": 4.0,
    }
    (device,) = build_devices({"eyes": table}, clock=CLOCK, folder=tmp_path)
    assert isinstance(device.part, CameraSource)
    with device.part:
        seen(device.part, good=True, within=2.0)
        yield device.part


def test_a_plug_pulled_is_named_at_once_and_put_back_all_is_set_again(
    camera: Camera, source: CameraSource, capfd: pytest.CaptureFixture[str]
) -> None:
    camera.unplug()
    seen(source, good=False, within=0.5)
    problem = source.health().problem
    assert problem == "eyes (/dev/video0): sends no pictures any more; check its cable"
    threading.Event().wait(0.25)
    stale = source.latest()
    assert stale is not None
    assert not stale.fresh
    (camera.folder.with_suffix(".unplugged") / "log").unlink()
    camera.plug()
    seen(source, good=True, within=2.0)
    assert f"S_CTRL {EXPOSURE} 40 gives 40" in camera.told()
    found = source.latest()
    assert found is not None
    assert found.fresh
    assert found.value.right is not None
    assert capfd.readouterr().err == ""


def test_a_camera_that_stalls_is_named_soon_and_opened_anew(
    camera: Camera, source: CameraSource
) -> None:
    camera.stall(stalled=True)
    seen(source, good=False, within=0.5)
    assert "no value for" in source.health().problem
    start_ns = CLOCK.now_ns()
    while "sends no pictures any more" not in source.health().problem:
        assert CLOCK.now_ns() - start_ns < 2.5e9
        threading.Event().wait(0.02)
    camera.stall(stalled=False)
    seen(source, good=True, within=2.0)


def test_a_damaged_picture_is_refused_and_not_the_last_one_given_again(
    camera: Camera, source: CameraSource
) -> None:
    camera.write("MJPG-256x48", b"\xff\xd8 damaged on its way")
    seen(source, good=False, within=0.5)
    assert "values refused, the last one for: sent a picture that is no JPEG" in (
        source.health().problem
    )
    latest = source.latest()
    assert latest is not None
    assert not latest.fresh
    camera.sees(halves(BLUE, RED))
    seen(source, good=True, within=0.5)


def test_the_doctor_finds_the_camera_well(
    camera: Camera, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(
        f'[devices.eyes]\nkind = "camera"\nsource = "{camera.path}"\nside_by_side = true\n'
        "rate_hz = 30.0\n"
    )
    assert main(["doctor", str(robot), "--seconds", "0.3", "--no-bench"]) == 0
    said = capsys.readouterr().out
    assert "eyes (/dev/video0), camera: good" in said
    rate = re.search(r"([\d.]+) a second", said)
    assert rate
    assert float(rate[1]) == pytest.approx(30, rel=0.2)  # of a third of a second


def test_what_a_real_camera_has_to_do_is_what_this_one_does(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(__file__).parents[1] / "test_real_camera.py"
    spec = importlib.util.spec_from_file_location("real_camera", path)
    assert spec is not None
    assert spec.loader is not None
    real = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(real)
    monkeypatch.setattr(real, "CAMERA", camera.path)
    real.test_it_gives_a_format_and_a_size_that_it_is_set_to()
    real.test_pictures_come_at_its_rate_with_stamps_of_when_they_were_taken()
    real.test_a_fixed_exposure_is_taken_and_the_automatic_one_again()
