"""A camera that runs beside the loop: one thread takes, the loop looks at the latest picture."""

import math
import threading
from collections import deque
from dataclasses import dataclass, replace

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Capture, Taken
from bearcub.devices.framing import Tally
from bearcub.devices.health import Health
from bearcub.devices.protocols import Frame, Reading, Source
from bearcub.devices.watch import Watch
from bearcub.errors import DeviceError, FormatError

_FIRST_RETRY, _LAST_RETRY = 0.05, 0.5  # the pause before opening again doubles in between [s]
_SKEWS = 100  # pairs over which the skew is measured
_JOIN = 2.5  # longer than a picture is waited for; a camera that hangs then is left behind [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class Skew:
    """How far apart the two pictures of a pair were taken, over the last hundred pairs [s].

    NaN where the camera does not tell.
    """

    median: float
    largest: float


class CameraSource(Source[Frame]):
    """A `Source` of single pictures or pairs.

    Parameters
    ----------
    capture : Capture
    clock : Clock
        The same that `capture` stamps its pictures by.
    rate_hz : float
        At which pictures are expected [Hz].
    role : str
        What it is for, as in ``stereo (/dev/video0)``.
    """

    def __init__(self, capture: Capture, *, clock: Clock, rate_hz: float, role: str) -> None:
        self._name = f"{role} ({capture.name})"
        self._capture = capture
        self._clock = clock
        self._tally = Tally()
        self._watch = Watch(self._name, rate_hz=rate_hz, tally=self._tally, clock=clock)
        self._skews: deque[float] = deque(maxlen=_SKEWS)
        self._latest: tuple[Frame, int] | None = None
        self._open = False
        self._failures = 0
        self._retry_ns = 0
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def name(self) -> str:
        """What it is called in messages: ``stereo (/dev/video0)``."""
        return self._name

    @property
    def skew(self) -> Skew:
        """How far apart the two pictures of a pair are taken."""
        skews = sorted(abs(skew) for skew in tuple(self._skews) if not math.isnan(skew))
        if not skews:
            return Skew(median=math.nan, largest=math.nan)
        return Skew(median=skews[len(skews) // 2], largest=skews[-1])

    def start(self) -> None:
        """Start the thread; it opens the camera when it can."""
        if self._thread is None and not self._stopping.is_set():
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Let go of the camera; it cannot be started again."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(_JOIN)
        if self._thread is None or not self._thread.is_alive():
            self._capture.close()
        self._watch.closed()

    def latest(self) -> Reading[Frame] | None:
        """Return the latest picture or pair with its age; None before the first."""
        latest = self._latest  # one load: the thread may replace it at any time
        if latest is None:
            return None
        frame, count = latest
        age = (self._clock.now_ns() - frame.stamp_ns) * 1e-9
        return Reading(
            value=frame,
            stamp_ns=frame.stamp_ns,
            age=age,
            fresh=age <= self._watch.limit,
            count=count,
        )

    def health(self) -> Health:
        """Return how it is now; `Health.drops` counts pictures without partner and lost ones."""
        health = self._watch.health()
        if self._thread is None or self._thread.is_alive() or self._stopping.is_set():
            return health
        problem = f"{self._name}: its reader failed by an error of this program; see stderr"
        return replace(health, problem=problem)

    def step(self) -> float:
        """Take one picture, or open the camera; return the seconds until there is more to do."""
        try:
            if not self._open:
                pause = (self._retry_ns - self._clock.now_ns()) * 1e-9
                if pause > 0:
                    return min(pause, 0.05)
                self._watch.connecting()
                self._capture.open()
                self._open = True
                self._watch.connected()
            self._publish(self._capture.take())
        except FormatError as error:
            self._watch.refused(error)
        except DeviceError as error:
            self._lose(error)
        return 0.0

    def _run(self) -> None:
        while not self._stopping.is_set():
            self._stopping.wait(self.step())

    def _publish(self, taken: Taken) -> None:
        for picture in (taken.left, taken.right):
            if picture is not None:
                picture.flags.writeable = False
        self._skews.append(taken.skew)
        self._tally.drops += taken.dropped
        self._watch.value(self._clock.now_ns())
        self._failures = 0
        count = self._watch.arrivals.count
        frame = Frame(
            name=f"{count - 1:06d}",
            index=count - 1,
            stamp_ns=taken.stamp_ns,
            left=taken.left,
            right=taken.right,
        )
        self._latest = (frame, count)

    def _lose(self, error: DeviceError) -> None:
        self._open = False
        self._capture.close()
        self._watch.lost(error)
        pause = min(_FIRST_RETRY * 2 ** min(self._failures, 8), _LAST_RETRY)
        self._failures += 1
        self._retry_ns = self._clock.now_ns() + round(pause * 1e9)
