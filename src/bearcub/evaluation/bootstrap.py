"""How far a figure could be off by chance: confidence intervals from resampled frames.

The percentile bootstrap [1]_ draws whole frames, not single things, because the errors of one frame
have a common cause. A rate that no frame contradicts (0 of N, N of N) has no spread to resample;
its interval is Wilson's [2]_, and a count of none in N frames is bounded by the rule of three [3]_.

References
----------
.. [1] Efron and Tibshirani, "An introduction to the bootstrap", 1993, sec. 13.3.
.. [2] Wilson, "Probable inference, the law of succession, and statistical inference", JASA 1927.
.. [3] Hanley and Lippman-Hand, "If nothing goes wrong, is everything all right?", JAMA 1983.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from bearcub.messages import Float32, Float64

LEVEL = 0.95
"""Share of the intervals that contain the true value."""

RESAMPLES = 1000
"""How often frames are drawn anew for an interval."""

_Z = 1.959964  # of a normal distribution, two-sided 95 %


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A figure with its 95 % confidence interval.

    Attributes
    ----------
    value : float
        NaN where nothing was measured.
    low, high : float
        NaN, too, where the interval is not known.
    count : int
        Numbers of things or frames that it rests on.
    """

    value: float
    low: float
    high: float
    count: int

    def times(self, factor: float) -> "Estimate":
        """Return the same in another unit."""
        return replace(
            self, value=self.value * factor, low=self.low * factor, high=self.high * factor
        )


UNKNOWN = Estimate(value=math.nan, low=math.nan, high=math.nan, count=0)


class Bootstrap:
    """Resamples of a number of frames, the same for every figure.

    Parameters
    ----------
    frames : int
    seed : int
        The same seed gives the same intervals.
    resamples : int
        Below 2 there are no intervals.

    Examples
    --------
    Nine of ten found, a thing a frame:

    >>> Bootstrap(10).rate([1] * 9 + [0], [1] * 10)
    Estimate(value=0.9, low=0.7, high=1.0, count=10)
    """

    def __init__(self, frames: int, *, seed: int = 0, resamples: int = RESAMPLES) -> None:
        self.frames = frames
        rng = np.random.default_rng(seed)
        shares = np.full(max(frames, 1), 1.0 / max(frames, 1))
        self._weights: Float32 = rng.multinomial(frames, shares, size=resamples).astype(np.float32)

    def rate(self, hits: ArrayLike, trials: ArrayLike) -> Estimate:
        """Return the share of hits among trials.

        Parameters
        ----------
        hits, trials : array_like, shape (frames,)
            Counts of every frame, ``hits <= trials``.
        """
        found = self.ratio(hits, trials)
        total = float(np.sum(trials))
        if found.count and found.low == found.high:
            low, high = wilson(round(float(np.sum(hits))), round(total))
            return replace(found, low=low, high=high)
        return found

    def per_frame(self, counts: ArrayLike, frames: ArrayLike) -> Estimate:
        """Return how often something happens in a frame; 0 of N is bounded by three in N.

        Parameters
        ----------
        counts : array_like, shape (frames,)
        frames : array_like, shape (frames,)
            1 for the frames that count, 0 for others.
        """
        found = self.ratio(counts, frames)
        if found.count and not np.any(counts):
            return replace(found, high=3.0 / found.count)
        return found

    def ratio(self, top: ArrayLike, bottom: ArrayLike) -> Estimate:
        """Return a sum over frames divided by another.

        Parameters
        ----------
        top, bottom : array_like, shape (frames,)
        """
        above, below = (np.asarray(values, dtype=np.float32) for values in (top, bottom))
        total = float(below.sum())
        if total == 0.0:
            return UNKNOWN
        sums = self._weights @ np.stack([above, below], axis=1)
        kept = sums[:, 1] > 0.0
        low, high = _tails(sums[kept, 0].astype(np.float64) / sums[kept, 1])
        return Estimate(
            value=float(np.sum(top)) / float(np.sum(bottom)),
            low=round(low, 9),
            high=round(high, 9),
            count=round(total),
        )

    def rms(self, errors: ArrayLike, frame: ArrayLike) -> Estimate:
        """Return the root mean square of errors; unknown ones do not count.

        Parameters
        ----------
        errors : array_like, shape (N,)
        frame : array_like of int, shape (N,)
            The frame of each.
        """
        values, numbers = _known(errors, frame)
        squares = np.bincount(numbers, weights=values**2, minlength=self.frames)
        found = self.ratio(squares, np.bincount(numbers, minlength=self.frames))
        return replace(
            found, value=_root(found.value), low=_root(found.low), high=_root(found.high)
        )

    def mean(self, errors: ArrayLike, frame: ArrayLike) -> Estimate:
        """Return the mean of errors (their bias); unknown ones do not count."""
        values, numbers = _known(errors, frame)
        return self.ratio(
            np.bincount(numbers, weights=values, minlength=self.frames),
            np.bincount(numbers, minlength=self.frames),
        )

    def quantile(self, errors: ArrayLike, frame: ArrayLike, *, share: float = 0.5) -> Estimate:
        """Return the value that `share` of the errors do not exceed; unknown ones do not count.

        Parameters
        ----------
        errors : array_like, shape (N,)
        frame : array_like of int, shape (N,)
            The frame of each.
        share : float
            0.5 for the median.
        """
        values, numbers = _known(errors, frame)
        if not len(values):
            return UNKNOWN
        order = np.argsort(values, kind="stable")
        values, numbers = values[order], numbers[order]
        mass = np.cumsum(self._weights[:, numbers], axis=1)
        mass = mass[mass[:, -1] > 0.0]
        ranks = (mass < share * mass[:, -1:]).sum(axis=1)
        low, high = _tails(values[np.minimum(ranks, len(values) - 1)])
        return Estimate(
            value=float(np.quantile(values, share)),
            low=low,
            high=high,
            count=len(values),
        )


def _tails(samples: Float64) -> tuple[float, float]:
    """Return the ends of the interval; unknown where hardly a resample says anything."""
    if len(samples) < 2:
        return math.nan, math.nan
    low, high = np.quantile(samples, ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0))
    return float(low), float(high)


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a rate.

    Examples
    --------
    >>> [round(bound, 3) for bound in wilson(0, 100)]
    [0.0, 0.037]
    """
    share, z2 = hits / trials, _Z**2
    centre = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    spread = _Z * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    spread /= 1 + z2 / trials
    return max(0.0, centre - spread), min(1.0, centre + spread)


def _known(
    errors: ArrayLike, frame: ArrayLike
) -> tuple[Float64, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    values = np.asarray(errors, dtype=np.float64).reshape(-1)
    numbers = np.asarray(frame, dtype=np.int64).reshape(-1)
    known = np.isfinite(values)
    return values[known], numbers[known]


def _root(value: float) -> float:
    return math.sqrt(max(value, 0.0)) if not math.isnan(value) else math.nan
