"""The figures of one contender over many frames, each with its confidence interval."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bearcub.evaluation.bootstrap import RESAMPLES, Bootstrap, Estimate
from bearcub.evaluation.matching import Sighting
from bearcub.evaluation.target import Target
from bearcub.evaluation.things import Error
from bearcub.evaluation.verdict import Verdict, errors

Frames = Callable[[Verdict], bool]
"""Tells which frames count."""

Things = Callable[[Target], bool]
"""Tells which obstacles or holes count."""

Scale = Callable[[Error], float]
"""What an error is divided by; 1 leaves it as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One figure and the frames that show it at its worst and at its best.

    Attributes
    ----------
    estimate : Estimate
    worst, best : tuple of str
        Names of frames, the worst first; empty where every frame is alike.
    """

    estimate: Estimate
    worst: tuple[str, ...] = ()
    best: tuple[str, ...] = ()


def every(_: object) -> bool:
    """Leave nothing out."""
    return True


def plain(_: Error) -> float:
    """Leave an error in its unit."""
    return 1.0


def relative(error: Error) -> float:
    """Divide an error by the truth: a share of it."""
    return abs(error.truth)


def allowed(error: Error) -> float:
    """Divide an error by 2 cm or 5 % of the truth, whichever is larger."""
    return max(0.02, 0.05 * abs(error.truth))


class Metrics:
    """The verdicts on one contender, and what they come to.

    Parameters
    ----------
    verdicts : sequence of Verdict
    intervals : bool
        Whether the intervals are wanted; without them figures come much faster.
    """

    def __init__(self, verdicts: Sequence[Verdict], *, intervals: bool = True) -> None:
        self.verdicts = tuple(verdicts)
        self._bootstrap = Bootstrap(len(self.verdicts), resamples=RESAMPLES if intervals else 1)
        self._errors = [
            {"things": _measured(v.things), "holes": _measured(v.holes)} for v in self.verdicts
        ]

    def recall(
        self, things: Things = every, *, of: str = "things", frames: Frames = every
    ) -> Figure:
        """Return the share of things (or "holes") that were found."""
        chosen = [
            [s for s in getattr(v, of) if things(s.target)] if frames(v) else []
            for v in self.verdicts
        ]
        hits = [sum(s.found is not None for s in seen) for seen in chosen]
        total = [len(seen) for seen in chosen]
        return self._rate(hits, total)

    def precision(
        self, things: Things = every, *, of: str = "things", frames: Frames = every
    ) -> Figure:
        """Return the share of right answers among those that mean such a thing or nothing."""
        hits, total = [], []
        for verdict in self.verdicts:
            counted = frames(verdict)
            false = verdict.false if of == "things" else verdict.false_holes
            right = sum(s.found is not None for s in getattr(verdict, of) if things(s.target))
            hits.append(right if counted else 0)
            total.append(right + len(false) if counted else 0)
        return self._rate(hits, total)

    def false_per_thousand(self, frames: Frames = every, *, of: str = "things") -> Figure:
        """Return the false obstacles (or "holes") in 1,000 frames."""
        counted = np.array([frames(v) for v in self.verdicts], dtype=np.int64)
        false = np.array(
            [len(v.false if of == "things" else v.false_holes) for v in self.verdicts],
            dtype=np.int64,
        )
        false = false * counted
        estimate = self._bootstrap.per_frame(false, counted).times(1000.0)
        return self._shown(estimate, false, good=counted)

    def clean(self, frames: Frames) -> Figure:
        """Return the share of frames without a false obstacle."""
        counted = [int(frames(v)) for v in self.verdicts]
        hits = [int(not v.false) * one for v, one in zip(self.verdicts, counted, strict=True)]
        return self._rate(hits, counted)

    def passed_under(self, frames: Frames = every) -> Figure:
        """Return the share of things overhead that no answer calls an obstacle in the way."""
        chosen = [v.overhead if frames(v) else () for v in self.verdicts]
        hits = [sum(s.found is None for s in seen) for seen in chosen]
        return self._rate(hits, [len(seen) for seen in chosen])

    def error(
        self,
        name: str,
        things: Things = every,
        *,
        of: str = "things",
        scale: Scale = plain,
        share: float = 0.5,
        frames: Frames = every,
    ) -> Figure:
        """Return the magnitude that `share` of the errors of one number do not exceed."""
        values, frame = self._gathered(name, things, of, scale, frames)
        estimate = self._bootstrap.quantile(np.abs(values), frame, share=share)
        return self._largest(estimate, values, frame)

    def bias(
        self,
        name: str,
        things: Things = every,
        *,
        of: str = "things",
        scale: Scale = plain,
        frames: Frames = every,
    ) -> Estimate:
        """Return the mean of the signed errors of one number."""
        values, frame = self._gathered(name, things, of, scale, frames)
        return self._bootstrap.mean(values, frame)

    def ground_rms(self, names: Iterable[str], frames: Frames = every) -> Figure:
        """Return the root mean square of errors of slope or attitude, all names together."""
        values, frame = [], []
        for index, verdict in enumerate(self.verdicts):
            for name in names:
                if frames(verdict) and name in verdict.ground:
                    values.append(verdict.ground[name].absolute)
                    frame.append(index)
        return self._largest(self._bootstrap.rms(values, frame), values, frame)

    def coverage(
        self,
        k: float,
        *,
        things: Iterable[str] = (),
        holes: Iterable[str] = (),
        ground: Iterable[str] = (),
        frames: Frames = every,
    ) -> Figure:
        """Return the share of truths within `k` of the sigma that the answer states.

        Numbers without a sigma do not count.

        Parameters
        ----------
        k : float
            1 for the 68 % interval, 1.96 for that of 95 %.
        things, holes, ground : iterable of str
            Which numbers of obstacles, of holes and of the ground.
        frames : callable
            Which frames.
        """
        inside, total = [], []
        for index, verdict in enumerate(self.verdicts):
            stated = self._stated(index, list(things), list(holes), list(ground))
            kept = stated if frames(verdict) else []
            inside.append(sum(abs(e.absolute) <= k * e.sigma for e in kept))
            total.append(len(kept))
        return self._rate(inside, total)

    def stage(self, name: str, *, share: float = 0.5) -> Estimate:
        """Return how long a stage takes [ms]; NaN for one that no frame has."""
        times = [v.timing.get(name, math.nan) for v in self.verdicts]
        return self._bootstrap.quantile(times, range(len(times)), share=share)

    def _stated(
        self, index: int, things: list[str], holes: list[str], ground: list[str]
    ) -> list[Error]:
        """Return the errors of one frame that come with a sigma."""
        found = [
            e[name] for e in self._errors[index]["things"].values() for name in things if name in e
        ]
        found += [
            e[name] for e in self._errors[index]["holes"].values() for name in holes if name in e
        ]
        found += [e for name, e in self.verdicts[index].ground.items() if name in ground]
        return [e for e in found if math.isfinite(e.sigma) and math.isfinite(e.absolute)]

    def _gathered(
        self, name: str, things: Things, of: str, scale: Scale, frames: Frames
    ) -> tuple[list[float], list[int]]:
        """Return the scaled errors of one number, and the frame of each."""
        values, frame = [], []
        for index, verdict in enumerate(self.verdicts):
            for number, measured in self._errors[index][of].items() if frames(verdict) else ():
                if name in measured and things(getattr(verdict, of)[number].target):
                    values.append(measured[name].absolute / scale(measured[name]))
                    frame.append(index)
        return values, frame

    def _rate(self, hits: Sequence[int], total: Sequence[int]) -> Figure:
        """Return a rate in percent; its worst frames are those that fail most."""
        estimate = self._bootstrap.rate(hits, total).times(100.0)
        failed = np.asarray(total) - np.asarray(hits)
        return self._shown(estimate, failed, good=np.asarray(total) > 0)

    def _largest(self, estimate: Estimate, values: list[float], frame: list[int]) -> Figure:
        """Return an error; its worst frames are those with the largest one."""
        worst = np.full(len(self.verdicts), -1.0)  # what was not told is no example
        size = np.nan_to_num(np.abs(values), nan=-1.0)
        np.maximum.at(worst, np.array(frame, dtype=np.int64), size)
        return self._shown(estimate, worst, good=worst >= 0.0)

    def _shown(self, estimate: Estimate, badness: ArrayLike, *, good: ArrayLike) -> Figure:
        """Return a figure with the frames that are worst and best among the `good` (counted)."""
        bad = np.asarray(badness, dtype=np.float64)
        counted = np.flatnonzero(np.asarray(good, dtype=bool))
        order = counted[np.argsort(-bad[counted], kind="stable")]
        return Figure(
            estimate=estimate,
            worst=tuple(self.verdicts[k].name for k in order[:_EXAMPLES] if bad[k] > 0.0),
            best=tuple(self.verdicts[k].name for k in order[-1:]),
        )


_EXAMPLES = 3


def _measured(sightings: Sequence[Sighting]) -> dict[int, dict[str, Error]]:
    """Return the errors of what was found, by its place in `sightings`."""
    return {k: errors(s) for k, s in enumerate(sightings) if s.found is not None}
