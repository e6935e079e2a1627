"""How a device is: watched by the rate at which its values are expected."""

import math
from collections import deque
from dataclasses import dataclass

_WINDOW = 2.0  # over which the rate is measured [s]; four periods of a slow device
_MOST_STAMPS = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class Health:
    """How a source or drive is at one moment.

    Attributes
    ----------
    name : str
        ``tilt (/dev/ttyUSB0)``.
    problem : str
        What is wrong, in one sentence that begins with the name; empty when all is well.
    connected : bool
        Whether there is a line to the device, not whether anything comes over it.
    rate_hz : float
        Values per second over the last two seconds [Hz].
    age : float
        Since the latest value arrived [s]; infinite before the first.
    values : int
        Delivered so far.
    errors : int
        What came and was refused: wrong checksum, impossible value, a reply that says no; and
        connections that failed.
    drops : int
        Values that the device numbered and that never came.
    resyncs : int
        How often bytes had to be skipped to find the next telegram.
    last_error : str
        The latest error, kept after recovery; empty when there was none.
    """

    name: str
    problem: str
    connected: bool = True
    rate_hz: float = math.nan
    age: float = math.inf
    values: int = 0
    errors: int = 0
    drops: int = 0
    resyncs: int = 0
    last_error: str = ""

    @property
    def good(self) -> bool:
        """Whether values come as they should."""
        return not self.problem


def silence_limit(rate_hz: float) -> float:
    """Return after how long a silence [s] a source of this rate counts as dead.

    Three periods, but not under 0.2 s, where a busy machine alone makes such gaps, and not over
    0.4 s, so that a dead device is named within half a second. A source slower than 4 Hz is
    given one and a half periods.

    Examples
    --------
    >>> [round(silence_limit(rate), 3) for rate in (100, 10, 5, 1)]
    [0.2, 0.3, 0.4, 1.5]
    """
    return max(1.5 / rate_hz, min(max(3.0 / rate_hz, 0.2), 0.4))


class Arrivals:
    """Counts values and measures their rate.

    Parameters
    ----------
    rate_hz : float
        At which they are expected [Hz].
    """

    def __init__(self, rate_hz: float) -> None:
        self.count = 0
        self._window_ns = round(max(_WINDOW, 4.0 / rate_hz) * 1e9)
        self._stamps: deque[int] = deque(maxlen=_MOST_STAMPS)

    def add(self, now_ns: int) -> None:
        """Count one value that arrives now."""
        self.count += 1
        self._stamps.append(now_ns)

    def age(self, now_ns: int) -> float:
        """Return the seconds since the last arrival; infinite before the first."""
        return (now_ns - self._stamps[-1]) * 1e-9 if self._stamps else math.inf

    def rate_hz(self, now_ns: int) -> float:
        """Return the arrivals per second over the last two seconds [Hz]; NaN before two."""
        if self.count < 2:
            return math.nan
        recent = [stamp for stamp in tuple(self._stamps) if now_ns - stamp <= self._window_ns]
        if len(recent) < 2:
            return 0.0
        span = recent[-1] - recent[0]
        if now_ns - recent[-1] > 2 * span / (len(recent) - 1):  # it has fallen silent
            span = now_ns - recent[0]
        return (len(recent) - 1) / (span * 1e-9) if span else math.nan
