"""Image files: reading one without surprises, and finding those of a folder."""

import contextlib
import os
import re
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import FormatError, InputError
from bearcub.messages import UInt8

RawImage = NDArray[np.unsignedinteger[Any]]  # uint8 or uint16

_NETPBM = (".pgm", ".ppm", ".pnm")
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", *_NETPBM, ".tif", ".tiff", ".webp")
DISPARITY_SUFFIXES = (".pgm", ".png", ".tif", ".tiff", ".pfm", ".npy", ".npz")


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One picture of a stream; `image` is None where a file is only passed on."""

    name: str
    path: Path
    image: RawImage | None


class ImageFiles:
    """Files one after another, as a stream of pictures.

    Attributes
    ----------
    path : Path
        The first file.
    count : int
    rate_hz : None
        Files do not say.
    """

    rate_hz: float | None = None

    def __init__(self, paths: Sequence[Path], *, decode: bool = True) -> None:
        self.path = paths[0]
        self.count: int | None = len(paths)
        self._paths = iter(paths)
        self._decode = decode

    def read(self) -> Picture | None:
        """Return the next picture; None when there is no more."""
        path = next(self._paths, None)
        if path is None:
            return None
        image = read_raw(path) if self._decode else None
        return Picture(name=path.stem, path=path, image=image)

    def close(self) -> None:
        """Do nothing: every file was closed when it had been read."""


def read_image(path: Path) -> UInt8:
    """Read one grey or colour (BGR) image; 16-bit ones as `to_8_bit` scales them.

    Raises
    ------
    InputError
        If there is no such file or it may not be read.
    FormatError
        If it is empty, cut off, no image, or has pixels of more than 16 bits.
    """
    raw = read_raw(path)
    return to_8_bit(raw, bits=used_bits(raw))


def read_raw(path: Path) -> RawImage:
    """Read one image with the depth it has; errors as in `read_image`."""
    require_file(path)
    try:
        data = np.fromfile(path, dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    image = None if _cut_off(data) else _decode(data)
    if image is None:
        raise FormatError(
            f"{path}: {data.size} bytes that are no complete image; "
            f"expected one of {' '.join(IMAGE_SUFFIXES)}"
        )
    if image.dtype not in (np.uint8, np.uint16):
        raise FormatError(f"{path}: pixels are {image.dtype}, expected 8 or 16 bit")
    return image


def require_file(path: Path) -> None:
    """Raise `InputError` without a file at `path` and `FormatError` if it is empty."""
    if not path.is_file():
        raise InputError(
            f"{path}: {'is a folder, not a file' if path.is_dir() else 'no such file'}"
        )
    if path.stat().st_size == 0:
        raise FormatError(f"{path}: is empty (0 bytes)")


def _cut_off(data: UInt8) -> bool:
    """Tell a PNG or JPEG without its end, of which some versions of OpenCV show the rest grey."""
    found = data.tobytes()
    if found.startswith(b"\x89PNG"):
        return b"IEND" not in found
    start_of_scan, end_of_image = b"\xff\xda", b"\xff\xd9"
    return found.startswith(b"\xff\xd8") and found.rfind(end_of_image) < found.rfind(start_of_scan)


def _decode(data: UInt8) -> NDArray[Any] | None:
    with quiet_opencv(), contextlib.suppress(cv2.error):  # raised beyond OpenCV's size limits
        return cv2.imdecode(data, cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR)
    return None


@contextlib.contextmanager
def quiet_opencv() -> Iterator[None]:
    """Keep OpenCV, and FFmpeg inside it, from writing to stderr what is going to be raised.

    For as long as any thread asks for it.
    """
    # FFmpeg's level can be set in no other way, and only before OpenCV has loaded it.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    _OPENCV.hush()
    try:
        yield
    finally:
        _OPENCV.let_speak()


class _Voice:
    """The level from which on OpenCV writes messages: one for all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._hushed = 0
        self._level = 0

    def hush(self) -> None:
        with self._lock:
            self._hushed += 1
            if self._hushed == 1:
                self._level = _logging().getLogLevel()
                _logging().setLogLevel(0)

    def let_speak(self) -> None:
        with self._lock:
            self._hushed -= 1
            if self._hushed == 0:
                _logging().setLogLevel(self._level)


_OPENCV = _Voice()


def _logging() -> Any:
    return getattr(cv2.utils, "logging", cv2)  # OpenCV 5 moved the two functions there


def used_bits(image: RawImage) -> int:
    """Return how many bits an image's pixels use: 8, 10, 12, 14 or 16.

    A 16-bit file does not say how many of its bits the camera filled; the brightest pixel does.
    """
    if image.dtype == np.uint8:
        return 8
    brightest = int(image.max())
    return next(bits for bits in (8, 10, 12, 14, 16) if brightest >> bits == 0)


def to_8_bit(image: RawImage, *, bits: int) -> UInt8:
    """Return the upper 8 of the `bits` that a 16-bit image uses; 8-bit images are unchanged.

    Examples
    --------
    >>> twelve = np.array([[0, 16, 4095]], dtype=np.uint16)
    >>> to_8_bit(twelve, bits=used_bits(twelve))
    array([[  0,   1, 255]], dtype=uint8)
    """
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    return (image >> (bits - 8)).astype(np.uint8)


def list_folder(folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    """Return the files of a folder that end in one of `suffixes`, numbers in their order.

    Hidden files are left out. ``img_9.png`` comes before ``img_10.png``.

    Raises
    ------
    InputError
        If there is none, if two differ in their ending only, or the folder may not be read.
    """
    try:
        found = sorted(
            (
                path
                for path in folder.iterdir()
                if path.suffix.lower() in suffixes and not path.name.startswith(".")
            ),
            key=_natural_key,
        )
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror}") from error
    if not found:
        raise InputError(f"{folder}: holds no file that ends in {' '.join(suffixes)}")
    names: dict[str, Path] = {}
    for path in found:
        other = names.setdefault(path.stem, path)
        if other is not path:
            raise InputError(
                f"{folder}: holds both {other.name} and {path.name}, expected one file per frame"
            )
    return found


def _natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    parts = re.findall(r"\d+|\D+", path.stem)
    return [(int(p), "") if p.isdecimal() else (-1, p) for p in parts], path.name
