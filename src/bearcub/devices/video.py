"""Video files, read frame by frame."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import cv2
import numpy as np

from bearcub.devices.images import Picture, quiet_opencv, require_file
from bearcub.errors import FormatError

VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".m4v", ".webm", ".mpg", ".mpeg", ".ogv", ".wmv")


class VideoFile:
    """The frames of one video.

    Attributes
    ----------
    path : Path
    count : int or None
        Frames that its header announces.
    rate_hz : float or None
        Frames per second that its header announces.

    Raises
    ------
    InputError
        If there is no such file.
    FormatError
        If it is empty, cut off before its index, or no video.
    """

    def __init__(self, path: Path) -> None:
        require_file(path)
        _require_index(path)
        self._capture = _capture(path)
        if not self._capture.isOpened():
            raise FormatError(f"{path}: cannot be decoded; expected a video")
        count = self._capture.get(cv2.CAP_PROP_FRAME_COUNT)
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self.path = path
        self.count = int(count) if count > 0 else None
        self.rate_hz = rate_hz if 0 < rate_hz < math.inf else None
        self._index = 0

    def read(self) -> Picture | None:
        """Return the next frame, shape (H, W, 3), BGR; None when there is no more."""
        decoded, image = self._capture.read()
        if not decoded:
            return None
        index, self._index = self._index, self._index + 1
        return Picture(
            name=f"{self.path.stem}_{index:06d}",
            path=self.path,
            image=np.asarray(image, dtype=np.uint8),
        )

    def close(self) -> None:
        """Let go of the file."""
        self._capture.release()


def _capture(path: Path) -> cv2.VideoCapture:
    # OpenCV tries back-ends in turn, and those after FFmpeg complain on stderr.
    has_ffmpeg = cv2.CAP_FFMPEG in cv2.videoio_registry.getStreamBackends()
    with quiet_opencv():
        return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG if has_ffmpeg else cv2.CAP_ANY)


def _require_index(path: Path) -> None:
    """Raise `FormatError` for an MP4 or QuickTime file that lacks its index.

    Recorders write the index last, so that a recording that was cut off has none and nothing of
    it can be decoded.
    """
    with path.open("rb") as file:
        boxes = list(_complete_boxes(file, size=path.stat().st_size))
    if boxes[:1] == [b"ftyp"] and b"moov" not in boxes:
        raise FormatError(f"{path}: has no complete index (box 'moov'): the recording was cut off")


def _complete_boxes(file: BinaryIO, *, size: int) -> Iterator[bytes]:
    """Walk through the kinds of the outermost boxes (ISO/IEC 14496-12, section 4.2)."""
    start = 0
    while len(head := file.read(8)) == 8:
        length, header = int.from_bytes(head[:4], "big"), 8
        if length == 1:
            length, header = int.from_bytes(file.read(8), "big"), 16
        if length == 0:  # to the end of the file
            length = size - start
        start += length
        if length < header or start > size:
            return
        yield head[4:]
        file.seek(start)
