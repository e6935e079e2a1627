"""Cameras that OpenCV opens: V4L2/UVC devices, and streams such as RTSP by their address."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import cv2
import numpy as np

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken, split_side_by_side
from bearcub.devices.images import quiet_opencv
from bearcub.errors import ConfigError, DeviceDisconnected, DeviceError, FormatError
from bearcub.messages import UInt8

_MANUAL, _AUTOMATIC = 1, 3  # V4L2_CID_EXPOSURE_AUTO: manual, aperture priority
_OPEN_MS = _READ_MS = 2000  # a camera or stream that takes longer is given up
# With one alone uvcvideo has nowhere to put the next picture while the program holds the last one,
# and loses every second. Two cameras get into step only if neither loses any while it waits.
_BUFFERS = 4
_WAITED = 1.5  # periods after which a picture that waited in its buffer is left out
_YOUNG_NS = 1_000_000_000  # the stamp of a picture that was waited for is no older
_MOST_ALONE = 10
_FORMATS = ("", "MJPG", "YUYV", "GREY", "UYVY")
_T = TypeVar("_T")
_JPEG = (cv2.VideoWriter.fourcc(*"MJPG"), cv2.VideoWriter.fourcc(*"JPEG"))


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
        self._stamped: bool | None = None  # whether its driver's stamps are of this clock
        self._delay_ns = 0  # from the stamp until the picture is here, when nothing is in its way
        self._jpeg = False

    def open(self) -> None:
        """Open and set it.

        Raises
        ------
        DeviceError
            If it cannot be opened, or does not take what it is set to.
        """
        with quiet_opencv():
            if self._stream:
                limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS]
                limits += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
                capture = cv2.VideoCapture(self.name, cv2.CAP_FFMPEG, limits)
            else:
                # OpenCV reads its patience [s] from here alone, when it first waits for a picture.
                os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", str(_READ_MS // 1000))
                capture = cv2.VideoCapture(self.name, cv2.CAP_V4L2)
            if not capture.isOpened():
                capture.release()
                raise DeviceError(f"cannot be opened as a camera{self._reason()}")
            self._capture, self._stamped, self._delay_ns = capture, None, _YOUNG_NS
            if not self._stream:
                self._set(capture)

    def grab(self) -> int:
        """Wait for the next picture without decoding it; return when it was taken [ns].

        Of several that have waited, the newest one is the next.
        """
        stamp_ns, age_ns = self._grab_next()
        self._delay_ns = min(self._delay_ns, age_ns)
        for _ in range(_BUFFERS):  # newer ones may wait behind it
            if age_ns - self._delay_ns < _WAITED * 1e9 / self._settings.rate_hz:
                break
            stamp_ns, age_ns = self._grab_next()
        return stamp_ns

    def retrieve(self) -> UInt8:
        """Decode the picture grabbed last, shape (H, W, 3), BGR.

        Raises
        ------
        FormatError
            If this one is damaged; the next one may be well.
        """
        decoded, picture = self._require_open().retrieve()
        if not decoded:
            raise DeviceDisconnected("sent a picture that cannot be decoded")
        if not self._jpeg:
            return np.asarray(picture, dtype=np.uint8)
        unpacked = cv2.imdecode(picture, cv2.IMREAD_COLOR) if picture.size else None
        if unpacked is None:
            raise FormatError("sent a picture that is no JPEG; check its cable and its hub")
        return np.asarray(unpacked, dtype=np.uint8)

    def close(self) -> None:
        """Let go of it."""
        capture, self._capture = self._capture, None
        if capture is not None:
            with quiet_opencv():
                capture.release()

    def _reason(self) -> str:
        """Return why it cannot be opened, and what to do."""
        if self._stream:
            return "; check its address and network"
        try:
            os.close(os.open(self.name, os.O_RDWR | os.O_NONBLOCK))
        except PermissionError:
            return ": permission denied; run: sudo usermod -aG video $USER, then log in again"
        except OSError as error:
            return f": {(error.strerror or 'no answer').lower()}; see: bearcub devices"
        return f": it is none, or busy; check which program uses it: fuser {self.name}"

    def _grab_next(self) -> tuple[int, int]:
        """Wait for a picture; return when it was taken and how old it is [ns]."""
        capture = self._require_open()
        with quiet_opencv():
            if not capture.grab():
                raise DeviceDisconnected("sends no pictures any more; check its cable")
        now_ns = self._clock.now_ns()
        stamp_ns = round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        if self._stamped is None:
            # The first picture was waited for: an old stamp is one of another clock, or none. Of a
            # later one it says that the picture itself is old.
            self._stamped = not self._stream and 0 <= now_ns - stamp_ns < _YOUNG_NS
        return (stamp_ns, now_ns - stamp_ns) if self._stamped else (now_ns, 0)

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
        capture.set(cv2.CAP_PROP_BUFFERSIZE, _BUFFERS)
        # After what begins the stream anew: OpenCV then asks for the denominator of 2/15 s again.
        capture.set(cv2.CAP_PROP_FPS, settings.rate_hz)
        self._jpeg = round(capture.get(cv2.CAP_PROP_FOURCC)) in _JPEG
        if self._jpeg:  # OpenCV would give the last picture again in place of one that is damaged
            capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        if settings.exposure_ms:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
            exposure = settings.exposure_ms * 10  # units of 100 µs
            _set_control(capture, cv2.CAP_PROP_EXPOSURE, exposure, name="exposure_ms", unit=0.1)
        else:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _AUTOMATIC)
        if not math.isnan(settings.gain):
            _set_control(capture, cv2.CAP_PROP_GAIN, settings.gain, name="gain", unit=1.0)
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


def _set_control(
    capture: cv2.VideoCapture, key: int, value: float, *, name: str, unit: float
) -> None:
    """Set a control; raise `DeviceError` where the camera does not take it.

    A camera takes the nearest value that it has, and says which: up to a tenth beside is right.
    """
    taken = capture.set(key, value)
    found = capture.get(key)
    if not taken:
        raise DeviceError(
            f"does not take {name} = {value * unit:g}; leave it out, or see its controls: "
            "v4l2-ctl --list-ctrls"
        )
    if abs(found - value) > max(0.1 * value, 0.5):
        raise DeviceError(
            f"takes {name} = {found * unit:g}, not {value * unit:g}; "
            "see its range: v4l2-ctl --list-ctrls"
        )


def _of(device: Grabbing, act: Callable[[], _T]) -> _T:
    """Have an error say which of two cameras it is of."""
    try:
        return act()
    except (DeviceError, FormatError) as error:
        raise type(error)(f"{device.name}: {error}") from error


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
        self._in_step = False

    def open(self) -> None:
        """Open both cameras; the error names the one that fails."""
        self._in_step = False
        for device in self._devices:
            _of(device, device.open)

    def take(self) -> Taken:
        """Wait for the next pair."""
        if not self._in_step:
            self._bring_into_step()
        left_ns, right_ns, dropped = self._grab_pair()
        left, right = (_of(device, device.retrieve) for device in self._devices)
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

    def _bring_into_step(self) -> None:
        """Leave out what one camera took while the other one began: it is no loss."""
        for _ in range(_MOST_ALONE):
            if not self._grab_pair()[2]:
                break
        self._in_step = True

    def _grab_pair(self) -> tuple[int, int, int]:
        """Grab until both pictures belong together; return both stamps [ns] and the drops."""
        stamps = [_of(device, device.grab) for device in self._devices]
        for dropped in range(_MOST_ALONE):
            apart = (stamps[1] - stamps[0]) * 1e-9
            if abs(apart) <= self._largest_skew:
                return stamps[0], stamps[1], dropped
            older = 0 if apart > 0 else 1
            stamps[older] = _of(self._devices[older], self._devices[older].grab)
        raise DeviceError(
            f"{_MOST_ALONE} pictures in a row have no partner within "
            f"{self._largest_skew * 1e3:.0f} ms: set both cameras to one rate, or connect their "
            "triggers"
        )
