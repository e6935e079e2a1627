"""What every source of frames and every sink of pictures has in common."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from bearcub.messages import UInt8


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """What was taken at one moment.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        Of one size, colour as BGR.
    disparity_path : Path or None
        A disparity file instead of a right image; its format is the reader's business.
    name : str
        The left image's name without folder and extension, or the video's with the frame's number.
    index : int
        0 for the first frame.
    stamp_ns : int
        Since the first frame [ns], from the source's rate; 0 throughout when that is not known.
    """

    name: str
    index: int
    stamp_ns: int
    left: UInt8 | None = None
    right: UInt8 | None = None
    disparity_path: Path | None = None


class Closing(Protocol):
    """Closes when its ``with`` block ends, also by an exception or Ctrl-C."""

    def close(self) -> None:
        """Let go of the file or device, complete; a second call does nothing."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class FrameSource(Closing, Protocol):
    """Frames in their order, each read when it is asked for; they can be walked through once."""

    @property
    def count(self) -> int | None:
        """How many frames to expect; None when that is not known."""
        ...

    @property
    def rate_hz(self) -> float | None:
        """Frames per second [Hz]; None when that is not known."""
        ...

    def __iter__(self) -> Iterator[Frame]: ...


class FrameSink(Closing, Protocol):
    """Takes pictures one after another; what was taken is valid however the program ends."""

    def write(self, picture: UInt8, *, name: str) -> None:
        """Store one grey or BGR picture.

        Raises
        ------
        InputError
            If it does not fit to those before it.
        DeviceError
            If it cannot be written.
        """
        ...
