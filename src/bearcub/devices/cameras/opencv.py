"""Cameras that OpenCV opens: V4L2/UVC devices, and streams such as RTSP by their address."""

import math
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken, split_side_by_side
from bearcub.devices.images import quiet_opencv
from bearcub.errors import ConfigError, DeviceDisconnected, DeviceError
from bearcub.messages import UInt8

_MANUAL, _AUTOMATIC = 1, 3  # V4L2_CID_EXPOSURE_AUTO: manual, aperture priority
_OPEN_MS = _READ_MS = 2000  # a network stream that takes longer is given up
_YOUNG_NS = 1_000_000_000  # a device's own stamp older than that is none
_MOST_ALONE = 10
_FORMATS = ("", "MJPG", "YUYV", "GREY", "UYVY")


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoSettings:
    """What a V4L2 camera is set to.

    Attributes
    ----------
    width, height : int
        Of the whole picture, both halves of a side-by-side one [px]; 0 leaves it as it is.
    rate_hz : float
        [Hz].
    pixel_format : str
        FOURCC such as MJPG or YUYV; empty leaves it as it is.
    exposure_ms : float
        [ms]; 0 is automatic. A fixed short exposure keeps pictures sharp while driving.
    gain : float
        In the camera's own scale; NaN leaves it as it is.
    """

    width: int = 0
    height: int = 0
    rate_hz: float = 15.0
    pixel_format: str = ""
    exposure_ms: float = 0.0
    gain: float = math.nan

    def __post_init__(self) -> None:
        if self.pixel_format not in _FORMATS:
            raise ConfigError(
                f"camera format {self.pixel_format!r}: must be one of {', '.join(_FORMATS[1:])}"
            )
        if self.width < 0 or self.height < 0 or (self.width == 0) != (self.height == 0):
            raise ConfigError(
                f"camera size {self.width} x {self.height}: must be two numbers above 0, or both 0"
            )
        if self.exposure_ms < 0 or not self.rate_hz > 0:
            raise ConfigError(
                f"camera exposure_ms = {self.exposure_ms} and rate_hz = {self.rate_hz}: "
                "must be 0 or more, and more than 0"
            )

    @property
    def of_device(self) -> list[str]:
        """Names of what only a camera at this computer can be set to, and is."""
        wanted = {
            "width": self.width,
            "format": self.pixel_format,
            "exposure_ms": self.exposure_ms,
            "gain": not math.isnan(self.gain),
        }
        return [name for name, value in wanted.items() if value]


class Grabbing(Protocol):
    """A camera whose pictures are first grabbed, in an instant, and then decoded."""

    @property
    def name(self) -> str:
        """What it is called in messages."""
        ...

    def open(self) -> None:
        """Open it; raises `DeviceError`."""
        ...

    def grab(self) -> int:
        """Wait for the next picture; return when it was taken [ns]."""
        ...

    def retrieve(self) -> UInt8:
        """Decode the picture grabbed last."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class VideoDevice:
    """One camera or stream.

    Parameters
    ----------
    source : str
        ``/dev/video0``, ``/dev/v4l/by-id/...``, ``rtsp://...``, ``http://...``.
    clock : Clock
        The machine's monotonic clock, which V4L2 stamps pictures by too.
    settings : VideoSettings, optional
    """

    def __init__(self, source: str, *, clock: Clock, settings: VideoSettings | None = None) -> None:
        self.name = source
        self._clock = clock
        self._settings = settings or VideoSettings()
        self._stream = "://" in source
        if self._stream and self._settings.of_device:
            raise ConfigError(
                f"{source}: {' and '.join(self._settings.of_device)} of a network camera cannot be "
                "set from here; set it on the camera's own page"
            )
        self._capture: cv2.VideoCapture | None = None

    def open(self) -> None:
        """Open and set it.

        Raises
        ------
        DeviceError
            If it cannot be opened, or gives pictures of another format or size than was set.
        """
        with quiet_opencv():
            if self._stream:
                limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS]
                limits += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
                capture = cv2.VideoCapture(self.name, cv2.CAP_FFMPEG, limits)
            else:
                capture = cv2.VideoCapture(self.name, cv2.CAP_V4L2)
        if not capture.isOpened():
            capture.release()
            hint = "check its address and network" if self._stream else "see: bearcub devices"
            raise DeviceError(f"cannot be opened as a camera; {hint}")
        self._capture = capture
        if not self._stream:
            self._set(capture)

    def grab(self) -> int:
        """Wait for the next picture without decoding it; return when it was taken [ns]."""
        capture = self._require_open()
        with quiet_opencv():
            if not capture.grab():
                raise DeviceDisconnected("sends no pictures any more; check its cable")
        now_ns = self._clock.now_ns()
        stamp_ns = 0 if self._stream else round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        return stamp_ns if 0 <= now_ns - stamp_ns < _YOUNG_NS else now_ns

    def retrieve(self) -> UInt8:
        """Decode the picture grabbed last, shape (H, W) or (H, W, 3), BGR."""
        decoded, picture = self._require_open().retrieve()
        if not decoded:
            raise DeviceDisconnected("sent a picture that cannot be decoded")
        return np.asarray(picture, dtype=np.uint8)

    def close(self) -> None:
        """Let go of it."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()

    def _require_open(self) -> cv2.VideoCapture:
        if self._capture is None:
            raise DeviceDisconnected("is not open")
        return self._capture

    def _set(self, capture: cv2.VideoCapture) -> None:
        settings = self._settings
        if settings.pixel_format:
            code = cv2.VideoWriter.fourcc(*settings.pixel_format)
            capture.set(cv2.CAP_PROP_FOURCC, code)  # first: it decides which sizes there are
        if settings.width:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, settings.width)
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, settings.height)
        capture.set(cv2.CAP_PROP_FPS, settings.rate_hz)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # the newest picture, not the oldest of four
        if settings.exposure_ms:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
            capture.set(cv2.CAP_PROP_EXPOSURE, settings.exposure_ms * 10)  # units of 100 µs
        else:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _AUTOMATIC)
        if not math.isnan(settings.gain):
            capture.set(cv2.CAP_PROP_GAIN, settings.gain)
        self._check(capture)

    def _check(self, capture: cv2.VideoCapture) -> None:
        """Raise `DeviceError` where the camera does not give what was set."""
        settings = self._settings
        code = round(capture.get(cv2.CAP_PROP_FOURCC))
        if settings.pixel_format and code != cv2.VideoWriter.fourcc(*settings.pixel_format):
            given = code.to_bytes(4, "little", signed=code < 0).decode("ascii", "replace")
            raise DeviceError(
                f"gives pictures as {given}, not {settings.pixel_format}; "
                "v4l2-ctl --list-formats-ext shows its formats"
            )
        found = tuple(
            round(capture.get(key)) for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        if settings.width and found != (settings.width, settings.height):
            raise DeviceError(
                f"gives {found[0]} x {found[1]} pixels, not {settings.width} x {settings.height}; "
                "v4l2-ctl --list-formats-ext shows its sizes"
            )


class SingleCapture:
    """One camera, whose picture may be two side by side.

    Parameters
    ----------
    device : VideoDevice
    side_by_side : bool
        Whether its left half is the left and its right half the right picture.
    """

    def __init__(self, device: VideoDevice, *, side_by_side: bool) -> None:
        self.name = device.name
        self._device = device
        self._side_by_side = side_by_side

    def open(self) -> None:
        """Open the camera."""
        self._device.open()

    def take(self) -> Taken:
        """Wait for the next picture."""
        stamp_ns = self._device.grab()
        picture = self._device.retrieve()
        if not self._side_by_side:
            return Taken(left=picture, stamp_ns=stamp_ns)
        left, right = split_side_by_side(picture, name=self.name)
        return Taken(left=left, right=right, stamp_ns=stamp_ns, skew=0.0)

    def close(self) -> None:
        """Let go of the camera."""
        self._device.close()


class PairCapture:
    """Two cameras as one stereo camera, with the skew between them measured for every pair.

    Parameters
    ----------
    left, right : Grabbing
        As `VideoDevice` is.
    largest_skew : float
        Farther apart [s], two pictures are no pair: they are dropped and counted. A robot that
        turns at 1 rad/s moves the picture by ``f`` pixels a second: 4 px in 10 ms at f = 400.
    """

    def __init__(self, left: Grabbing, right: Grabbing, *, largest_skew: float) -> None:
        if not largest_skew > 0:
            raise ConfigError(f"camera largest_skew = {largest_skew}: must be more than 0 seconds")
        self.name = f"{left.name} and {right.name}"
        self._devices = (left, right)
        self._largest_skew = largest_skew

    def open(self) -> None:
        """Open both cameras; the error names the one that fails."""
        for device in self._devices:
            try:
                device.open()
            except DeviceError as error:
                raise DeviceError(f"{device.name}: {error}") from error

    def take(self) -> Taken:
        """Wait for the next pair."""
        left_ns, right_ns, dropped = self._grab_pair()
        left, right = (device.retrieve() for device in self._devices)
        if left.shape != right.shape:
            raise DeviceError(
                f"pictures of shapes {left.shape} and {right.shape}: set both cameras to one size"
            )
        return Taken(
            left=left,
            right=right,
            stamp_ns=(left_ns + right_ns) // 2,
            skew=(right_ns - left_ns) * 1e-9,
            dropped=dropped,
        )

    def close(self) -> None:
        """Let go of both."""
        for device in self._devices:
            device.close()

    def _grab_pair(self) -> tuple[int, int, int]:
        """Grab until both pictures belong together; return both stamps [ns] and the drops."""
        stamps = [device.grab() for device in self._devices]
        for dropped in range(_MOST_ALONE):
            apart = (stamps[1] - stamps[0]) * 1e-9
            if abs(apart) <= self._largest_skew:
                return stamps[0], stamps[1], dropped
            older = 0 if apart > 0 else 1
            stamps[older] = self._devices[older].grab()
        raise DeviceError(
            f"{_MOST_ALONE} pictures in a row have no partner within "
            f"{self._largest_skew * 1e3:.0f} ms: set both cameras to one rate, or connect their "
            "triggers"
        )
