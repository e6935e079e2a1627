"""What a V4L2 camera is set to reaches the device, in its order and units, and is read back."""

import cv2
import pytest

from bearcub.clock import ManualClock
from bearcub.devices.cameras.opencv import VideoDevice, VideoSettings
from bearcub.errors import DeviceError


class Webcam:
    """A capture that notes what it is set to; what it cannot do it leaves as it is."""

    def __init__(self, *, only: dict[int, float] | None = None) -> None:
        self.only = only or {}
        self.calls: list[tuple[int, float]] = []
        self.released = False

    def isOpened(self) -> bool:  # noqa: N802 (OpenCV's name)
        return True

    def set(self, key: int, value: float) -> bool:
        self.calls.append((key, value))
        return key not in self.only

    def get(self, key: int) -> float:
        return self.only.get(key, dict(self.calls).get(key, 0.0))

    def release(self) -> None:
        self.released = True


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch) -> Webcam:
    webcam = Webcam()
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: webcam)
    return webcam


def device(settings: VideoSettings) -> VideoDevice:
    return VideoDevice("/dev/video7", clock=ManualClock(), settings=settings)


def test_format_comes_first_as_it_decides_which_sizes_there_are(plugged: Webcam) -> None:
    device(VideoSettings(width=1280, height=480, pixel_format="MJPG", rate_hz=30)).open()
    code = cv2.VideoWriter.fourcc(*"MJPG")
    assert plugged.calls[:4] == [
        (cv2.CAP_PROP_FOURCC, code),
        (cv2.CAP_PROP_FRAME_WIDTH, 1280),
        (cv2.CAP_PROP_FRAME_HEIGHT, 480),
        (cv2.CAP_PROP_FPS, 30),
    ]


def test_fixed_exposure_is_manual_and_in_tenths_of_a_millisecond(plugged: Webcam) -> None:
    device(VideoSettings(exposure_ms=5.0, gain=16.0)).open()
    told = dict(plugged.calls)
    assert told[cv2.CAP_PROP_AUTO_EXPOSURE] == 1
    assert told[cv2.CAP_PROP_EXPOSURE] == 50
    assert told[cv2.CAP_PROP_GAIN] == 16.0
    order = [key for key, _ in plugged.calls]
    assert order.index(cv2.CAP_PROP_AUTO_EXPOSURE) < order.index(cv2.CAP_PROP_EXPOSURE)


def test_what_is_not_set_is_left_alone_but_exposure_is_automatic(plugged: Webcam) -> None:
    device(VideoSettings()).open()
    told = dict(plugged.calls)
    assert told[cv2.CAP_PROP_AUTO_EXPOSURE] == 3
    left = {cv2.CAP_PROP_FOURCC, cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_GAIN}
    assert not left & set(told)


@pytest.mark.parametrize(
    ("only", "said"),
    [
        (
            {cv2.CAP_PROP_FOURCC: float(cv2.VideoWriter.fourcc(*"YUYV"))},
            "gives pictures as YUYV, not MJPG",
        ),
        (
            {cv2.CAP_PROP_FRAME_WIDTH: 640.0, cv2.CAP_PROP_FRAME_HEIGHT: 480.0},
            "gives 640 x 480 pixels, not 1280 x 480",
        ),
    ],
)
def test_a_camera_that_cannot_says_what_it_gives(
    plugged: Webcam, only: dict[int, float], said: str
) -> None:
    plugged.only = only
    camera = device(VideoSettings(width=1280, height=480, pixel_format="MJPG"))
    with pytest.raises(DeviceError, match=said):
        camera.open()
    camera.close()
    assert plugged.released
