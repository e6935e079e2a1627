"""Files as a live camera: images, folders and videos at the rate at which they were taken."""

import threading
from collections.abc import Callable, Iterator

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken
from bearcub.devices.protocols import Frame, FrameSource
from bearcub.errors import BearcubError, DeviceDisconnected, DeviceError


class FileCapture:
    """Frames of files, each when its time has come; what the loop is too slow for is dropped.

    Parameters
    ----------
    open_source : callable
        Opens the files: ``lambda: open_frames(left, right)``.
    name : str
        Of the files, for messages.
    clock : Clock
    rate_hz : float
        Frames per second, where the files do not say.
    wait : callable, optional
        What passes the time, given in seconds.
    """

    def __init__(
        self,
        open_source: Callable[[], FrameSource],
        *,
        name: str,
        clock: Clock,
        rate_hz: float,
        wait: Callable[[float], object] | None = None,
    ) -> None:
        self.name = name
        self._open_source = open_source
        self._clock = clock
        self._rate_hz = rate_hz
        self._wait = wait or threading.Event().wait
        self._source: FrameSource | None = None
        self._frames: Iterator[Frame] = iter(())
        self._start_ns = 0
        self._taken = 0
        self._ended = False

    def open(self) -> None:
        """Open the files, once; they do not begin anew after their end."""
        if self._ended:
            raise DeviceDisconnected("the recording is at its end")
        if self._source is None:
            try:
                self._source = self._open_source()
            except DeviceError:
                raise
            except BearcubError as error:
                raise DeviceError(str(error)) from error
            self._frames = iter(self._source)
            self._rate_hz = self._source.rate_hz or self._rate_hz
            self._start_ns = self._clock.now_ns()

    def take(self) -> Taken:
        """Wait until a frame's time has come."""
        period_ns = 1e9 / self._rate_hz
        passed_ns = self._clock.now_ns() - self._start_ns
        dropped = max(0, int(passed_ns / period_ns) - self._taken)
        frame = self._frame(skip=dropped)
        due_ns = self._start_ns + round((self._taken - 1) * period_ns)
        pause = (due_ns - self._clock.now_ns()) * 1e-9
        if pause > 0:
            self._wait(pause)
        if frame.left is None:
            raise DeviceError(f"{frame.name}: is a disparity map, expected pictures")
        return Taken(
            left=frame.left,
            right=frame.right,
            stamp_ns=due_ns,
            skew=0.0,
            dropped=dropped,
        )

    def close(self) -> None:
        """Let go of the files."""
        source, self._source = self._source, None
        if source is not None:
            self._ended = True
            source.close()

    def _frame(self, *, skip: int) -> Frame:
        for _ in range(skip):
            self._next()
        return self._next()

    def _next(self) -> Frame:
        try:
            frame = next(self._frames, None)
        except DeviceError:
            raise
        except BearcubError as error:
            raise DeviceError(str(error)) from error
        if frame is None:
            self._ended = True
            raise DeviceDisconnected("the recording is at its end")
        self._taken += 1
        return frame
