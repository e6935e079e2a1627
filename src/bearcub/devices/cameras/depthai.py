"""Luxonis OAK cameras through DepthAI (version 3): the two grey cameras, unmatched.

The camera could match by itself; here it only takes pictures, so that the disparity and its errors
are the same as with any other camera.
"""

import threading
from dataclasses import replace
from typing import Any

import numpy as np

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken
from bearcub.devices.cameras.plugins import PluginSettings, import_sdk
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import UInt8

_SIZE = (640, 400)  # px; the sensors are 1280 x 800
_PATIENCE = 2.0  # s
_STEP = 0.002  # between two looks for a picture [s]
_ISO = 400  # of a fixed exposure


def convert(
    left: UInt8, right: UInt8, *, stamps: tuple[float, float], numbers: tuple[int, int]
) -> Taken:
    """Return a pair of DepthAI messages as taken pictures.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Of ``ImgFrame.getCvFrame``.
    stamps : tuple of float
        Of ``ImgFrame.getTimestamp``, by the host's steady clock [s].
    numbers : tuple of int
        Of ``ImgFrame.getSequenceNum``.

    Raises
    ------
    FormatError
        If the two are not of one size or not of one shutter release.
    """
    if left.shape != right.shape or left.dtype != np.uint8:
        raise FormatError(
            f"DepthAI: pictures of shapes {left.shape} and {right.shape} and type {left.dtype}: "
            "expected two 8-bit ones of one size"
        )
    if numbers[0] != numbers[1]:
        raise FormatError(f"DepthAI: left picture {numbers[0]} with right picture {numbers[1]}")
    return Taken(
        left=np.array(left),
        right=np.array(right),
        stamp_ns=round(sum(stamps) / 2 * 1e9),
        skew=stamps[1] - stamps[0],
    )


class DepthaiCapture:
    """An OAK camera with two grey sensors.

    Parameters
    ----------
    settings : PluginSettings
    clock : Clock
        For the patience alone: the pictures' stamps are by the host's monotonic clock already.
    """

    def __init__(self, settings: PluginSettings, clock: Clock) -> None:
        self.name = f"OAK {settings.device}".strip()
        self._settings = settings
        self._clock = clock
        self._pipeline: Any = None
        self._queues: tuple[Any, Any] | None = None
        self._number = -1

    def open(self) -> None:
        """Start both sensors."""
        sdk: Any = import_sdk("depthai", package="depthai")
        settings = self._settings
        size = (settings.width, settings.height) if settings.width else _SIZE
        try:
            which = [sdk.DeviceInfo(settings.device)] if settings.device else []
            self._pipeline = sdk.Pipeline(sdk.Device(*which))
            queues = []
            for socket in (sdk.CameraBoardSocket.CAM_B, sdk.CameraBoardSocket.CAM_C):
                camera = self._pipeline.create(sdk.node.Camera).build(socket)
                if settings.exposure_ms:
                    exposure_us = round(settings.exposure_ms * 1e3)
                    camera.initialControl.setManualExposure(exposure_us, _ISO)
                output = camera.requestOutput(
                    size, type=sdk.ImgFrame.Type.GRAY8, fps=settings.rate_hz
                )
                queues.append(output.createOutputQueue(maxSize=2, blocking=False))
            self._pipeline.start()
        except RuntimeError as error:  # what the library raises for anything
            raise DeviceError(f"cannot be opened: {error}") from error
        self._queues = (queues[0], queues[1])
        self._number = -1

    def take(self) -> Taken:
        """Wait for the next pair of one shutter release."""
        if self._queues is None:
            raise DeviceDisconnected("is not open")
        try:
            messages = [self._next(queue) for queue in self._queues]
            while messages[0].getSequenceNum() != messages[1].getSequenceNum():
                numbers = [message.getSequenceNum() for message in messages]
                late = int(numbers[1] < numbers[0])
                messages[late] = self._next(self._queues[late])
        except RuntimeError as error:
            raise DeviceDisconnected(f"went away: {error}") from error
        left, right = messages
        number = left.getSequenceNum()
        dropped = number - self._number - 1 if self._number >= 0 else 0
        self._number = number
        taken = convert(
            left.getCvFrame(),
            right.getCvFrame(),
            stamps=(left.getTimestamp().total_seconds(), right.getTimestamp().total_seconds()),
            numbers=(number, right.getSequenceNum()),
        )
        return replace(taken, dropped=max(0, dropped))

    def close(self) -> None:
        """Stop the sensors."""
        pipeline, self._pipeline, self._queues = self._pipeline, None, None
        if pipeline is not None:
            pipeline.stop()

    def _next(self, queue: Any) -> Any:
        until_ns = self._clock.now_ns() + round(_PATIENCE * 1e9)
        while (message := queue.tryGet()) is None:
            if self._clock.now_ns() > until_ns:
                raise DeviceTimeout(f"no picture within {_PATIENCE:g} s; check its cable")
            threading.Event().wait(_STEP)
        return message


def build(settings: PluginSettings, clock: Clock) -> DepthaiCapture:
    """Return the camera of the settings."""
    return DepthaiCapture(settings, clock)
