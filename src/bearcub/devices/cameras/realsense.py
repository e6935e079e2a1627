"""Intel RealSense D400 cameras through pyrealsense2: the two infrared cameras, unmatched."""

from dataclasses import replace
from typing import Any

import numpy as np

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken
from bearcub.devices.cameras.plugins import PluginSettings, import_sdk
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import UInt8

_SIZE = (640, 480)  # px
_RATES = (6, 15, 30, 60, 90)  # Hz; the camera has no others
_PATIENCE_MS = 2000


def convert(left: UInt8, right: UInt8, *, numbers: tuple[int, int], stamp_ns: int) -> Taken:
    """Return the two infrared frames of a frame set as taken pictures.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Of ``frame.get_data``, format Y8; the library's memory, which is copied.
    numbers : tuple of int
        Of ``frame.get_frame_number``.
    stamp_ns : int
        When the set arrived [ns].

    Raises
    ------
    FormatError
        If they are not two 8-bit pictures of one size and one shutter release.
    """
    if left.shape != right.shape or left.ndim != 2 or left.dtype != np.uint8:
        raise FormatError(
            f"RealSense: infrared frames of shapes {left.shape} and {right.shape} and type "
            f"{left.dtype}: expected two of format Y8 and one size"
        )
    if numbers[0] != numbers[1]:
        raise FormatError(f"RealSense: left frame {numbers[0]} with right frame {numbers[1]}")
    return Taken(left=np.array(left), right=np.array(right), stamp_ns=stamp_ns, skew=0.0)


class RealsenseCapture:
    """A D400 camera; one clock drives both of its infrared sensors.

    Parameters
    ----------
    settings : PluginSettings
    clock : Clock
        Stamps a pair on arrival.
    """

    def __init__(self, settings: PluginSettings, clock: Clock) -> None:
        self.name = f"RealSense {settings.device}".strip()
        self._settings = settings
        self._clock = clock
        self._pipeline: Any = None
        self._number = -1

    def open(self) -> None:
        """Start both sensors."""
        sdk: Any = import_sdk("pyrealsense2", package="pyrealsense2")
        settings = self._settings
        width, height = (settings.width, settings.height) if settings.width else _SIZE
        rate = min(_RATES, key=lambda known: abs(known - settings.rate_hz))
        config = sdk.config()
        if settings.device:
            config.enable_device(settings.device)
        for index in (1, 2):
            config.enable_stream(sdk.stream.infrared, index, width, height, sdk.format.y8, rate)
        pipeline = sdk.pipeline()
        try:
            profile = pipeline.start(config)
            if settings.exposure_ms:
                sensor = profile.get_device().first_depth_sensor()
                sensor.set_option(sdk.option.enable_auto_exposure, 0)
                sensor.set_option(sdk.option.exposure, settings.exposure_ms * 1e3)
        except RuntimeError as error:  # what the library raises for anything
            raise DeviceError(f"cannot be opened: {error}") from error
        self._pipeline, self._number = pipeline, -1

    def take(self) -> Taken:
        """Wait for the next pair."""
        if self._pipeline is None:
            raise DeviceDisconnected("is not open")
        try:
            frames = self._pipeline.wait_for_frames(_PATIENCE_MS)
        except RuntimeError as error:
            raise DeviceTimeout(f"no picture within {_PATIENCE_MS} ms: {error}") from error
        left, right = (frames.get_infrared_frame(index) for index in (1, 2))
        number = left.get_frame_number()
        dropped = number - self._number - 1 if self._number >= 0 else 0
        self._number = number
        taken = convert(
            np.asanyarray(left.get_data()),
            np.asanyarray(right.get_data()),
            numbers=(number, right.get_frame_number()),
            stamp_ns=self._clock.now_ns(),
        )
        return replace(taken, dropped=max(0, dropped))

    def close(self) -> None:
        """Stop the sensors."""
        pipeline, self._pipeline = self._pipeline, None
        if pipeline is not None:
            pipeline.stop()


def build(settings: PluginSettings, clock: Clock) -> RealsenseCapture:
    """Return the camera of the settings."""
    return RealsenseCapture(settings, clock)
