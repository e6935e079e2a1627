"""Frames from files: pairs, folders, videos, side-by-side pictures and disparity maps."""

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from bearcub.devices.images import (
    DISPARITY_SUFFIXES,
    IMAGE_SUFFIXES,
    ImageFiles,
    Picture,
    RawImage,
    list_folder,
    require_file,
    to_8_bit,
    used_bits,
)
from bearcub.devices.protocols import Closing, Frame
from bearcub.devices.video import VIDEO_SUFFIXES, VideoFile
from bearcub.errors import DeviceError, InputError
from bearcub.messages import UInt8


class _Stream(Protocol):
    """Pictures of one camera; `ImageFiles` and `VideoFile` are such."""

    path: Path
    count: int | None
    rate_hz: float | None

    def read(self) -> Picture | None: ...

    def close(self) -> None: ...


class FileFrames(Closing):
    """Frames whose pictures come from one to two streams; see `open_frames`.

    Parameters
    ----------
    streams : sequence of streams
        Left and right; or left, or a side-by-side picture, alone; or left and disparity files; or
        disparity files alone.
    side_by_side : bool
        Whether every picture is two: its left half and its right half.
    rate_hz : float or None
        Frames per second; None takes it from the streams.
    """

    def __init__(
        self, streams: Sequence[_Stream], *, side_by_side: bool, rate_hz: float | None
    ) -> None:
        self._streams = tuple(streams)
        self._side_by_side = side_by_side
        self._rate_hz = rate_hz or self._streams[0].rate_hz
        self._first: tuple[Path, str] | None = None
        self._bits = 8

    @property
    def count(self) -> int | None:
        """How many frames to expect; None when a header does not say."""
        counts = [stream.count for stream in self._streams]
        return min((c for c in counts if c is not None), default=None)

    @property
    def rate_hz(self) -> float | None:
        """Frames per second; None when neither the files nor the caller say."""
        return self._rate_hz

    def __iter__(self) -> Iterator[Frame]:
        """Walk through the frames, once.

        Raises
        ------
        InputError, FormatError
            If a file cannot be read, or a picture's size differs from that of the others.
        DeviceError
            If a video ends before the other one or before its header says, after the frames that
            it has were given out.
        """
        for index in itertools.count():
            pictures = [stream.read() for stream in self._streams]
            complete = [picture for picture in pictures if picture is not None]
            if len(complete) < len(pictures):
                self._require_end(pictures, index)
                return
            yield self._frame(complete, index)

    def _require_end(self, pictures: Sequence[Picture | None], index: int) -> None:
        """Raise `DeviceError` unless all streams end here as announced."""
        announced = max(stream.count or 0 for stream in self._streams)
        together = not any(pictures)
        # Some containers do not count frames; OpenCV then rounds duration times rate.
        if together and index >= max(1, announced - 1):
            return
        ended = next(s for s, r in zip(self._streams, pictures, strict=True) if r is None)
        of = f" of {announced}" if announced > index else ""
        more = "" if together else ", the other camera's goes on"
        raise DeviceError(f"{ended.path}: the video ended after frame {index}{of}{more}")

    def _frame(self, pictures: Sequence[Picture], index: int) -> Frame:
        images = self._images(pictures)
        disparity_path = next((r.path for r in pictures if r.image is None), None)
        return Frame(
            name=pictures[0].name,
            index=index,
            stamp_ns=round(index * 1e9 / self._rate_hz) if self._rate_hz else 0,
            left=images[0] if images else None,
            right=images[1] if len(images) > 1 else None,
            disparity_path=disparity_path,
        )

    def _images(self, pictures: Sequence[Picture]) -> list[UInt8]:
        """Return the pictures in 8 bit, all scaled alike and never again with fewer bits."""
        images = [(r.path, r.image) for r in pictures if r.image is not None]
        for path, image in images:
            self._first = self._first or (path, _size(image))
            if _size(image) != self._first[1]:
                raise InputError(
                    f"{path}: {_size(image)} pixels, expected {self._first[1]} "
                    f"as in {self._first[0]}"
                )
            self._bits = max(self._bits, used_bits(image))
        if self._side_by_side:
            images = [(path, half) for path, image in images for half in _halves(image, path)]
        return [to_8_bit(image, bits=self._bits) for _, image in images]

    def close(self) -> None:
        """Let go of the files."""
        for stream in self._streams:
            stream.close()


def _size(image: RawImage) -> str:
    return f"{image.shape[1]} x {image.shape[0]}"


def _halves(image: RawImage, path: Path) -> list[RawImage]:
    width = image.shape[1]
    if width % 2:
        raise InputError(
            f"{path}: {width} columns, expected an even number for a left and a right half"
        )
    return [np.ascontiguousarray(half) for half in np.split(image, 2, axis=1)]


def open_frames(
    left: Path | None = None,
    right: Path | None = None,
    *,
    disparity: Path | None = None,
    side_by_side: bool = False,
    single: bool = False,
    rate_hz: float | None = None,
) -> FileFrames:
    """Open files as a source of frames; pictures are read as they are asked for.

    Folders are paired by file name without ending where the two share any, else in their order
    with numbers counted as numbers. 16-bit pictures are scaled to 8 bit by one shift for all:
    from as many bits, of 8, 10, 12, 14 and 16, as the brightest pixel so far takes.

    Parameters
    ----------
    left, right : Path, optional
        Two images, two folders of images or two videos.
    disparity : Path, optional
        A disparity file or a folder of them instead of `right`; `left` may come with it.
    side_by_side : bool, optional
        `left` holds both: an image, a folder or a video whose left half is the left image.
    single : bool, optional
        `left` alone is all there is: what one colour camera saw.
    rate_hz : float, optional
        Frames per second, for the stamps; by default what a video says.

    Raises
    ------
    InputError
        If a file is missing, or what is given does not make pairs.
    FormatError
        If a video cannot be decoded.
    """
    if rate_hz is not None and not rate_hz > 0:
        raise InputError(f"rate_hz = {rate_hz}: expected more than 0")
    given = [path for path in (left, right, disparity) if path is not None]
    if not (single and left is not None and given == [left] and not side_by_side):
        _require_combination(left, right, disparity, side_by_side=side_by_side)
    streams = _streams(given, _common_kind(given), disparity=disparity)
    return FileFrames(streams, side_by_side=side_by_side, rate_hz=rate_hz)


def _require_combination(
    left: Path | None, right: Path | None, disparity: Path | None, *, side_by_side: bool
) -> None:
    if disparity is not None:
        if right is not None or side_by_side:
            raise InputError(f"{disparity}: a disparity replaces the right image; give one of both")
    elif left is None:
        raise InputError(f"{right or 'no input'}: expected a left image, folder or video too")
    elif right is None and not side_by_side:
        raise InputError(f"{left}: expected a right image, folder or video too, or a disparity")
    elif right is not None and side_by_side:
        raise InputError(f"{right}: a side-by-side picture holds the right image already")


def _common_kind(paths: Sequence[Path]) -> str:
    """Return "folder", "video" or "file", which all paths have to be."""
    kinds = [_kind(path) for path in paths]
    if len(set(kinds)) > 1:
        found = " but ".join(f"{path} is a {kind}" for path, kind in zip(paths, kinds, strict=True))
        raise InputError(f"{found}; expected two files, two folders or two videos")
    if len(paths) > 1 and paths[0].samefile(paths[1]):
        raise InputError(f"{paths[1]}: given twice, expected the other camera's")
    return kinds[0]


def _kind(path: Path) -> str:
    if path.is_dir():
        return "folder"
    require_file(path)
    return "video" if path.suffix.lower() in VIDEO_SUFFIXES else "file"


def _streams(paths: Sequence[Path], kind: str, *, disparity: Path | None) -> list[_Stream]:
    if kind == "video":
        if disparity is not None:
            raise InputError(f"{disparity}: a video cannot hold disparities; give files")
        videos = [VideoFile(path) for path in paths]
        _require_one_rate(videos)
        return list(videos)
    lists = [[path] for path in paths]
    if kind == "folder":
        lists = [
            list_folder(path, DISPARITY_SUFFIXES if path == disparity else IMAGE_SUFFIXES)
            for path in paths
        ]
        if len(lists) == 2:
            lists[1] = _partners(lists[0], lists[1])
    return [
        ImageFiles(files, decode=path != disparity)
        for path, files in zip(paths, lists, strict=True)
    ]


def _require_one_rate(videos: Sequence[VideoFile]) -> None:
    rates = [video.rate_hz for video in videos if video.rate_hz]
    if len(rates) > 1 and abs(rates[0] - rates[1]) > 0.01 * rates[0]:
        raise InputError(
            f"{videos[1].path}: {rates[1]:g} frames per second, expected {rates[0]:g} "
            f"as in {videos[0].path}"
        )


def _partners(left: list[Path], right: list[Path]) -> list[Path]:
    """Return the files of `right` in the order of their partners in `left`."""
    by_name = {path.stem: path for path in right}
    names = {path.stem for path in left}
    if names & by_name.keys():
        unpaired = [path for path in left if path.stem not in by_name]
        unpaired += [path for path in right if path.stem not in names]
    else:
        unpaired = left[len(right) :] + right[len(left) :]
    if unpaired:
        raise InputError(
            f"{left[0].parent} holds {len(left)} frames and {right[0].parent} {len(right)}: "
            f"{unpaired[0]} has no partner"
        )
    return [by_name.get(path.stem, other) for path, other in zip(left, right, strict=True)]
