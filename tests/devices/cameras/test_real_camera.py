"""A camera that is plugged in: `BEARCUB_CAMERA=/dev/video0 pytest -m device`."""

import os

import cv2
import numpy as np
import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.cameras.opencv import VideoDevice, VideoSettings
from bearcub.errors import DeviceError

pytestmark = pytest.mark.device

CAMERA = os.environ.get("BEARCUB_CAMERA", "/dev/video0")
PICTURES = 30


@pytest.fixture(autouse=True)
def camera() -> None:
    """Skip without a camera."""
    try:
        os.close(os.open(CAMERA, os.O_RDWR | os.O_NONBLOCK))
    except OSError as error:
        pytest.skip(f"{CAMERA}: {error.strerror}; BEARCUB_CAMERA names another camera")


def opened(settings: VideoSettings | None = None) -> VideoDevice:
    device = VideoDevice(CAMERA, clock=MonotonicClock(), settings=settings)
    try:
        device.open()
    except DeviceError:
        device.close()
        raise
    return device


def told(device: VideoDevice, key: int) -> float:
    """What the camera says that it is set to."""
    assert device._capture is not None
    return device._capture.get(key)


def size() -> tuple[int, int]:
    """A width and height that it has."""
    device = opened()
    device.grab()
    height, width = device.retrieve().shape[:2]
    device.close()
    return width, height


def test_it_gives_a_format_and_a_size_that_it_is_set_to() -> None:
    (width, height), given = size(), []
    for pixel_format in ("YUYV", "MJPG", "GREY", "UYVY"):
        settings = VideoSettings(width=width, height=height, pixel_format=pixel_format)
        try:
            device = opened(settings)
        except DeviceError:
            continue
        device.grab()
        assert device.retrieve().shape == (height, width, 3)
        assert round(told(device, cv2.CAP_PROP_FOURCC)) == cv2.VideoWriter.fourcc(*pixel_format)
        device.close()
        given.append(pixel_format)
    assert given


def test_pictures_come_at_its_rate_with_stamps_of_when_they_were_taken() -> None:
    clock = MonotonicClock()
    device = opened(VideoSettings(rate_hz=30.0, exposure_ms=10.0))
    rate = told(device, cv2.CAP_PROP_FPS)
    device.grab()
    stamps, ages = [], []
    for _ in range(PICTURES):
        stamps.append(device.grab())
        ages.append((clock.now_ns() - stamps[-1]) * 1e-9)
        device.retrieve()
    device.close()
    periods = np.diff(stamps) * 1e-9
    assert periods.min() > 0
    assert np.median(periods) == pytest.approx(1 / rate, rel=0.1)
    assert 0.2 / rate < np.median(ages) < 0.2  # a picture takes its time on the wire


def test_a_fixed_exposure_is_taken_and_the_automatic_one_again() -> None:
    device = opened(VideoSettings(exposure_ms=10.0))
    assert told(device, cv2.CAP_PROP_AUTO_EXPOSURE) == 1
    assert told(device, cv2.CAP_PROP_EXPOSURE) == pytest.approx(100, rel=0.1)
    device.close()
    device = opened()
    assert told(device, cv2.CAP_PROP_AUTO_EXPOSURE) == 3
    device.close()
