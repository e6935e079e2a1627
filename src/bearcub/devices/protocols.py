"""What all sources, drives and sinks have in common.

Two kinds of source: a `FrameSource` is walked through, frame by frame, by who wants every frame of
a recording; a `Source` runs beside the loop and is asked for its latest value.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Generic, Protocol, Self, TypeVar

from bearcub.devices.health import Health
from bearcub.messages import UInt8, WheelState

T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading(Generic[T_co]):
    """A source's latest value, as old as it was when it was asked for.

    Attributes
    ----------
    value
    stamp_ns : int
        When it was measured [ns], by the clock that the source was given: arrival of its last
        byte less the latency that is known of the device.
    age : float
        From then until it was asked for [s].
    fresh : bool
        False once no newer one has come for longer than a source of this rate may be silent; a
        reading that is not fresh must not be acted on.
    count : int
        1 for the source's first value; the same number is the same value.
    """

    value: T_co
    stamp_ns: int
    age: float
    fresh: bool
    count: int


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


class Source(Closing, Protocol[T_co]):
    """A sensor that runs beside the loop; it recovers by itself and says how it is.

    ``with source:`` starts and closes it.
    """

    @property
    def name(self) -> str:
        """What it is called in messages: ``tilt (/dev/ttyUSB0)``."""
        ...

    def start(self) -> None:
        """Begin to connect and to read, without waiting for either; a second call does nothing."""
        ...

    def latest(self) -> Reading[T_co] | None:
        """Return the latest value, never waiting for one; None before the first."""
        ...

    def health(self) -> Health:
        """Return how it is; a dead device is named within half a second."""
        ...

    def __enter__(self) -> Self:
        self.start()
        return self


class Drive(Closing, Protocol):
    """What turns the wheels. A drive that hears nothing for a while stops by itself.

    ``with drive:`` starts it, and stops the robot at the end, also by an exception or Ctrl-C.
    """

    @property
    def name(self) -> str:
        """What it is called in messages: ``drive (192.168.2.2:23)``."""
        ...

    def start(self) -> None:
        """Begin to connect, without waiting for it; a second call does nothing."""
        ...

    def command(self, speed: float, turn_rate: float) -> None:
        """Drive at `speed` [m/s], ahead positive, and `turn_rate` [rad/s], left positive.

        Returns at once. A command counts until the next one, at most for the drive's own limit.
        """
        ...

    def stop(self) -> None:
        """Stop as fast as the drive's deceleration allows; returns at once."""
        ...

    def feedback(self) -> Reading[WheelState] | None:
        """Return what the wheels do, never waiting for it; None before the first."""
        ...

    def health(self) -> Health:
        """Return how it is; a dead drive is named within half a second."""
        ...

    def __enter__(self) -> Self:
        self.start()
        return self
