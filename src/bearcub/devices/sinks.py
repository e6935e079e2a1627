"""Where annotated pictures go: a video, one picture, or a folder of pictures."""

import os
from pathlib import Path

import cv2
import numpy as np

from bearcub.devices.images import quiet_opencv
from bearcub.devices.protocols import Closing, FrameSink
from bearcub.errors import DeviceError, InputError
from bearcub.messages import UInt8

_CODECS = {".mp4": "mp4v", ".avi": "MJPG"}
_PICTURES = (".png", ".jpg", ".jpeg")
_RATE_HZ = 10.0


class VideoSink(Closing):
    """Writes an .mp4 (MPEG-4 part 2) or .avi (Motion JPEG) video.

    The file appears with the first picture, whose size all others must have; an odd last row or
    column is left out. Closing writes the index without which an .mp4 cannot be played, so use it
    in a ``with`` block.

    Parameters
    ----------
    path : Path
    rate_hz : float
        Pictures per second.

    Raises
    ------
    InputError
        If the path ends in neither .mp4 nor .avi, or the rate is not positive.
    DeviceError
        If its folder does not exist or must not be written to.
    """

    def __init__(self, path: Path, *, rate_hz: float) -> None:
        if path.suffix.lower() not in _CODECS:
            raise InputError(f"{path}: expected a video's name to end in {' or '.join(_CODECS)}")
        if not rate_hz > 0:
            raise InputError(f"rate_hz = {rate_hz}: expected more than 0")
        _require_writable(path)
        self.path = path
        self._rate_hz = rate_hz
        self._writer: cv2.VideoWriter | None = None
        self._shape: tuple[int, ...] = ()

    def write(self, picture: UInt8, *, name: str) -> None:
        """Append one grey or BGR picture.

        Raises
        ------
        InputError
            If its size differs from that of the first one.
        DeviceError
            If the video cannot be written.
        """
        height, width = picture.shape[:2]
        if self._writer is None:
            self._shape = (height, width)
            self._writer = self._open(width, height)
        if self._shape != (height, width):
            raise InputError(
                f"{self.path}: picture {name} is {width} x {height} pixels, "
                f"expected {self._shape[1]} x {self._shape[0]} as the first one"
            )
        colour = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture
        self._writer.write(colour)

    def _open(self, width: int, height: int) -> cv2.VideoWriter:
        codec = cv2.VideoWriter.fourcc(*_CODECS[self.path.suffix.lower()])
        with quiet_opencv():
            writer = cv2.VideoWriter(str(self.path), codec, self._rate_hz, (width, height))
        if not writer.isOpened():
            raise DeviceError(f"{self.path}: cannot be written as a {width} x {height} video")
        return writer

    def close(self) -> None:
        """Complete the file."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None


class ImageSink(Closing):
    """Writes one picture to a file, or each to a folder under its name.

    Parameters
    ----------
    path : Path
        Ends in .png, .jpg or .jpeg, or is a folder, which is created if need be and gets .png
        files.

    Raises
    ------
    InputError
        If the path ends in something else.
    DeviceError
        If it cannot be written to.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._folder = path.is_dir() or not path.suffix
        if self._folder:
            try:
                path.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise DeviceError(f"{path}: cannot be made a folder: {error.strerror}") from error
        elif path.suffix.lower() not in _PICTURES:
            raise InputError(
                f"{path}: expected a picture ({' '.join(_PICTURES)}), a video "
                f"({' '.join(_CODECS)}) or a folder"
            )
        _require_writable(path / "picture" if self._folder else path)
        self._written = ""

    def write(self, picture: UInt8, *, name: str) -> None:
        """Write one grey or BGR picture; a file of that name is replaced once it is complete.

        Raises
        ------
        InputError
            If a second picture comes for a single file.
        DeviceError
            If it cannot be written.
        """
        if self._written and not self._folder:
            raise InputError(
                f"{self.path}: holds picture {self._written} already; expected a folder or a "
                f"video for {name} and more"
            )
        target = self.path / f"{name}.png" if self._folder else self.path
        encoded = cv2.imencode(target.suffix, picture)[1]
        unfinished = target.with_name(f".{target.name}.part")
        try:
            np.asarray(encoded).tofile(unfinished)
            unfinished.replace(target)
        except OSError as error:
            raise DeviceError(f"{target}: cannot be written: {error.strerror or error}") from error
        finally:
            unfinished.unlink(missing_ok=True)
        self._written = name

    def close(self) -> None:
        """Do nothing: every picture is complete once it is written."""


def open_sink(path: Path, *, rate_hz: float | None = None, single: bool = False) -> FrameSink:
    """Open what the ending of `path` asks for: a video, one picture, or a folder of pictures.

    Parameters
    ----------
    path : Path
    rate_hz : float, optional
        Pictures per second of a video; 10 by default.
    single : bool, optional
        Whether one picture is all that comes; a sequence does not fit into a .png.

    Raises
    ------
    InputError
        If the ending is unknown, or that of one picture for a sequence.
    DeviceError
        If it cannot be written to.
    """
    if path.suffix.lower() in _CODECS and not path.is_dir():
        return VideoSink(path, rate_hz=rate_hz or _RATE_HZ)
    if path.suffix.lower() in _PICTURES and not path.is_dir() and not single:
        raise InputError(
            f"{path}: holds one picture; expected a folder or a video ({' '.join(_CODECS)}) "
            "for a sequence"
        )
    return ImageSink(path)


def _require_writable(path: Path) -> None:
    """Raise `DeviceError` unless a file can be created at `path`."""
    folder = path.parent
    if path.is_dir():
        raise DeviceError(f"{path}: is a folder, expected the name of a file")
    if not folder.is_dir():
        raise DeviceError(f"{path}: there is no folder {folder}; create it first")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise DeviceError(f"{path}: no permission to write there")
