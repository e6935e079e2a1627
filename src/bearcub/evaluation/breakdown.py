"""The same figures by range, kind, scenario, sweep and number: where to look when one is bad."""

import math
from collections.abc import Callable, Iterable

from bearcub.evaluation.bootstrap import Estimate
from bearcub.evaluation.metrics import Metrics, plain, relative
from bearcub.evaluation.table import Grid
from bearcub.evaluation.target import Target
from bearcub.evaluation.verdict import Verdict

BANDS = ((1.0, 2.0), (2.0, 4.0), (4.0, 6.0), (6.0, 8.0), (8.0, 12.0))
"""Bands of range [m]."""

SWEEPS = ("surface", "light", "noise", "tilt", "height", "hfov_deg", "baseline")
"""The tags that frames are told apart by."""

_ERRORS = (
    ("distance", "%", 100.0, relative),
    ("bearing", "deg", 1.0, plain),
    ("width", "cm", 100.0, plain),
    ("height", "cm", 100.0, plain),
)
_HOLE_ERRORS = (
    ("distance", "%", 100.0, relative),
    ("width", "%", 100.0, relative),
    ("length", "%", 100.0, relative),
    ("depth", "cm", 100.0, plain),
)

Things = Callable[[Target], bool]


def grids(metrics: Metrics) -> tuple[Grid, ...]:
    """Return the tables of one contender."""
    return (
        by_scenario(metrics),
        _errors("Obstacles by range", _bands(), metrics, of="things"),
        _errors("Obstacles by kind", _kinds(metrics, "things"), metrics, of="things"),
        _errors("Holes by range", _bands(), metrics, of="holes"),
        _errors("Holes by kind", _kinds(metrics, "holes"), metrics, of="holes"),
        by_sweep(metrics),
        runtime(metrics),
    )


def by_scenario(metrics: Metrics) -> Grid:
    """Return what was found, missed and false in every scenario."""
    names = sorted({verdict.scenario for verdict in metrics.verdicts})
    return Grid(
        title="By scenario",
        columns=("scenario", *_COUNTS),
        lines=tuple((name, *_counts(metrics, _of_scenario(name))) for name in names),
    )


def by_sweep(metrics: Metrics) -> Grid:
    """Return the same for every value of every sweep."""
    lines = []
    for key in SWEEPS:
        values = {v.tags[key] for v in metrics.verdicts if key in v.tags}
        for value in sorted(values, key=lambda value: (isinstance(value, str), value)):
            words = f"{value:g}" if isinstance(value, float) else str(value)
            lines.append((f"{key} {words}", *_counts(metrics, _tagged(key, value))))
    return Grid(title="By sweep", columns=("sweep", *_COUNTS), lines=tuple(lines))


def runtime(metrics: Metrics) -> Grid:
    """Return how long the stages take."""
    stages = list(dict.fromkeys(name for v in metrics.verdicts for name in v.timing))
    return Grid(
        title="Time for a frame, all processes at work [ms]",
        columns=("stage", "median", "95 %"),
        lines=tuple(
            (name, _short(metrics.stage(name)), _short(metrics.stage(name, share=0.95)))
            for name in stages
        ),
    )


_COUNTS = (
    "frames",
    "obstacles",
    "found %",
    "false / 1000",
    "holes",
    "found %",
    "false / 1000",
    "slope RMS deg",
    "attitude RMS deg",
)


def _counts(metrics: Metrics, frames: Callable[[Verdict], bool]) -> tuple[str, ...]:
    chosen = [verdict for verdict in metrics.verdicts if frames(verdict)]
    return (
        f"{len(chosen)}",
        f"{sum(len(v.things) for v in chosen)}",
        _short(metrics.recall(frames=frames).estimate),
        _short(metrics.false_per_thousand(frames).estimate),
        f"{sum(len(v.holes) for v in chosen)}",
        _short(metrics.recall(of="holes", frames=frames).estimate),
        _short(metrics.false_per_thousand(frames, of="holes").estimate),
        _short(metrics.ground_rms(["slope"], frames).estimate),
        _short(metrics.ground_rms(["pitch", "roll"], frames).estimate),
    )


def _errors(title: str, groups: Iterable[tuple[str, Things]], metrics: Metrics, *, of: str) -> Grid:
    """Return recall, and every error as median / 95 % / bias, by group."""
    numbers = _ERRORS if of == "things" else _HOLE_ERRORS
    lines = []
    for name, things in groups:
        total = sum(things(s.target) for v in metrics.verdicts for s in getattr(v, of))
        if not total:
            continue
        cells = [name, f"{total}", _short(metrics.recall(things, of=of).estimate)]
        for number, _, factor, scale in numbers:
            figures = [
                metrics.error(number, things, of=of, scale=scale).estimate,
                metrics.error(number, things, of=of, scale=scale, share=0.95).estimate,
                metrics.bias(number, things, of=of, scale=scale),
            ]
            cells.append(" / ".join(_short(figure.times(factor)) for figure in figures))
        lines.append(tuple(cells))
    heads = [f"{name} {unit}: median / 95 % / bias" for name, unit, _, _ in numbers]
    return Grid(title=title, columns=("", "of", "found %", *heads), lines=tuple(lines))


def _bands() -> list[tuple[str, Things]]:
    return [(f"{start:g} to {end:g} m", _within(start, end)) for start, end in BANDS]


def _within(start: float, end: float) -> Things:
    return lambda target: start <= target.distance < end


def _kinds(metrics: Metrics, of: str) -> list[tuple[str, Things]]:
    names = sorted({s.target.kind for v in metrics.verdicts for s in getattr(v, of)})
    return [(name, _of_kind(name)) for name in names]


def _of_kind(name: str) -> Things:
    return lambda target: target.kind == name


def _of_scenario(name: str) -> Callable[[Verdict], bool]:
    return lambda verdict: verdict.scenario == name


def _tagged(key: str, value: str | float) -> Callable[[Verdict], bool]:
    return lambda verdict: verdict.tags.get(key) == value


def _short(estimate: Estimate) -> str:
    value = estimate.value
    return "-" if math.isnan(value) else f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
