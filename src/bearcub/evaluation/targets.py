"""What is promised on simulated frames: every row of the table with its threshold beside it.

Every row counts frames with medium sensor noise; the others are listed by their noise apart.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from bearcub.evaluation.metrics import Figure, Metrics, allowed, relative
from bearcub.evaluation.remarks import (
    DISPARITY,
    absolute,
    columns,
    depth_percent,
    gravity,
    pieces,
    pixel,
    pixel_deg,
    typical,
)
from bearcub.evaluation.selection import (
    APART,
    between,
    crater,
    empty,
    large,
    named,
    on,
    ramp,
    reading,
    smooth,
    steep,
    usual,
)
from bearcub.evaluation.table import Row, Section

SIGMAS = {"68 %": (1.0, (64.0, 72.0)), "95 %": (1.959964, (93.0, 97.0))}
"""The intervals: how many sigmas to either side, and the share of truths [%] promised inside."""

STATED: dict[str, tuple[str, ...]] = {
    "things": ("distance", "bearing", "width", "height"),
    "holes": ("distance", "width", "length", "depth"),
    "ground": ("slope", "pitch", "roll", "height"),
}
"""The numbers that come with a sigma."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Promise:
    """One row of the table.

    Attributes
    ----------
    measure : str
    unit : str
    figure : callable
        Returns the figure of a contender.
    limit : float, tuple of two floats or None
        As in `bearcub.evaluation.table.Row`.
    sense : str
        As in `bearcub.evaluation.table.Row`.
    remark : callable, optional
        Returns what stands beside it: the physical limit, most of all.
    """

    measure: str
    unit: str
    figure: Callable[[Metrics], Figure]
    limit: float | tuple[float, float] | None = None
    sense: str = "at most"
    remark: Callable[[Metrics], str] | None = None


def _obstacles() -> list[Promise]:
    what = "obstacles >= 0.3 m wide and high, 1 to 8 m, visible >= 70 %"
    return [
        Promise(
            measure=f"{what}: recall",
            unit="%",
            figure=lambda m: m.recall(large, frames=usual),
            limit=98.0,
            sense="at least",
        ),
        Promise(
            measure=f"{what}: precision",
            unit="%",
            figure=lambda m: m.precision(large, frames=smooth),
            limit=98.0,
            sense="at least",
            remark=pieces,
        ),
        _distance(1.0, 4.0, limit=1.0),
        _distance(4.0, 8.0, limit=2.0),
        Promise(
            measure="bearing, median absolute error",
            unit="deg",
            figure=lambda m: m.error("bearing", large, frames=usual),
            limit=0.3,
            remark=lambda m: f"a pixel is {typical(m, large, pixel_deg):.2f} deg",
        ),
        *(_size(name) for name in ("width", "height")),
    ]


def _distance(start: float, end: float, *, limit: float) -> Promise:
    chosen = between(start, end)
    return Promise(
        measure=f"distance {start:g} to {end:g} m, median absolute error",
        unit="%",
        figure=lambda m: _percent(m.error("distance", chosen, scale=relative, frames=usual)),
        limit=limit,
        remark=lambda m: (
            f"{DISPARITY:g} px of disparity are {typical(m, chosen, depth_percent):.2f} %"
        ),
    )


def _size(name: str) -> Promise:
    return Promise(
        measure=f"{name}, median absolute error as a share of max(2 cm, 5 %)",
        unit="%",
        figure=lambda m: _percent(m.error(name, large, scale=allowed, frames=usual)),
        limit=100.0,
        remark=lambda m: (
            absolute(m, name) + f"; a pixel is {100.0 * typical(m, large, pixel):.1f} cm"
        ),
    )


def _small() -> list[Promise]:
    wanted = (
        ("10 cm box at 4 m", named("small box", 4.0), 95.0),
        ("3 cm post at 3 m", named("thin post", 3.0), 90.0),
        ("test piece of 7 cm x 40 cm at 3 m", named("standing test piece", 3.0), 95.0),
    )
    return [
        Promise(
            measure=f"{what}: recall",
            unit="%",
            figure=lambda m, chosen=chosen: m.recall(chosen, frames=usual),  # type: ignore[misc]
            limit=limit,
            sense="at least",
            remark=lambda m, chosen=chosen: columns(m, chosen),  # type: ignore[misc]
        )
        for what, chosen, limit in wanted
    ]


def _false() -> list[Promise]:
    return [
        Promise(
            measure="false obstacles in 1,000 frames of empty floor, all sweeps",
            unit="",
            figure=lambda m: m.false_per_thousand(empty),
            limit=1.0,
        ),
        *(
            Promise(
                measure=f"the same on {surface.replace('-', ' ')}",
                unit="",
                figure=lambda m, kind=surface: m.false_per_thousand(on(kind)),  # type: ignore[misc]
            )
            for surface in APART
        ),
    ]


def _holes() -> list[Promise]:
    return [
        Promise(
            measure="holes 0.4 to 1 m wide within the geometric limit: recall",
            unit="%",
            figure=lambda m: m.recall(crater, of="holes", frames=usual),
            limit=95.0,
            sense="at least",
            remark=lambda _: "the limit: 6 rows and 0.5 px of disparity",
        ),
        Promise(
            measure="holes: precision",
            unit="%",
            figure=lambda m: m.precision(of="holes", frames=usual),
            sense="at least",
        ),
        Promise(
            measure="false holes in 1,000 frames",
            unit="",
            figure=lambda m: m.false_per_thousand(usual, of="holes"),
            limit=1.0,
        ),
        *(
            Promise(
                measure=f"hole {name}, median absolute error",
                unit="%",
                figure=lambda m, name=name: _percent(  # type: ignore[misc]
                    m.error(name, crater, of="holes", scale=relative, frames=usual)
                ),
                limit=limit,
            )
            for name, limit in (("distance", 3.0), ("width", 10.0))
        ),
    ]


def _ground() -> list[Promise]:
    attitude = ("pitch", "roll")
    return [
        Promise(
            measure="slope from 1.5 to 5 m, RMS error, tilt reading good",
            unit="deg",
            figure=lambda m: m.ground_rms(["slope"], reading("good", "exact")),
            limit=0.5,
            remark=gravity,
        ),
        Promise(
            measure="slope against the robot, RMS error, no tilt reading",
            unit="deg",
            figure=lambda m: m.ground_rms(["slope"], reading("missing")),
            limit=0.5,
        ),
        Promise(
            measure="camera attitude (pitch and roll), RMS error",
            unit="deg",
            figure=lambda m: m.ground_rms(attitude, usual),
            limit=0.2,
        ),
        *(
            Promise(
                measure=f"the same, tilt reading {words}",
                unit="deg",
                figure=lambda m, kind=kind: m.ground_rms(attitude, reading(kind)),  # type: ignore[misc]
                limit=0.2,
            )
            for kind, words in (
                ("biased", "off by 5 deg"),
                ("late", "50 ms late"),
                ("missing", "missing"),
            )
        ),
    ]


def _ways() -> list[Promise]:
    return [
        Promise(
            measure="ramps and cross slopes to 15 deg: frames without an obstacle",
            unit="%",
            figure=lambda m: m.clean(ramp),
            limit=100.0,
            sense="at least",
        ),
        Promise(
            measure="walls and banks steeper than 30 deg, 0.3 m and higher: found",
            unit="%",
            figure=lambda m: m.recall(steep, frames=usual),
            limit=100.0,
            sense="at least",
        ),
        Promise(
            measure="table and branch above the robot: not in the way",
            unit="%",
            figure=lambda m: m.passed_under(usual),
            limit=100.0,
            sense="at least",
        ),
    ]


def _intervals() -> list[Promise]:
    return [
        Promise(
            measure=f"{words} intervals of all numbers contain the truth",
            unit="%",
            figure=lambda m, k=k: m.coverage(k, **STATED, frames=usual),  # type: ignore[misc]
            limit=limit,
        )
        for words, (k, limit) in SIGMAS.items()
    ]


def promises() -> list[Promise]:
    """Return the rows of the table in their order."""
    return [
        *_obstacles(),
        *_small(),
        *_false(),
        *_holes(),
        *_ground(),
        *_ways(),
        *_intervals(),
    ]


def by_number() -> list[Promise]:
    """Return the coverage of the intervals of every number apart, by the same promise."""
    return [
        Promise(
            measure=f"{_OF[of]} {name}: {words}",
            unit="%",
            figure=lambda m, of=of, name=name, k=k: m.coverage(  # type: ignore[misc]
                k, frames=usual, **{of: (name,)}
            ),
            limit=limit,
        )
        for of, names in STATED.items()
        for name in names
        for words, (k, limit) in SIGMAS.items()
    ]


_OF = {"things": "obstacle", "holes": "hole", "ground": "ground"}


def rows(
    chosen: Iterable[Promise], ours: Metrics, rivals: Mapping[str, Metrics]
) -> tuple[list[Row], dict[str, Figure]]:
    """Return rows of the table, and by their measure the frames that show them."""
    found: list[Row] = []
    shown: dict[str, Figure] = {}
    for promise in chosen:
        figure = promise.figure(ours)
        estimate = figure.estimate
        if not estimate.count:
            continue  # no frame that shows it was among those asked for
        shown[promise.measure] = figure
        found.append(
            Row(
                measure=promise.measure,
                value=estimate.value,
                unit=promise.unit,
                limit=promise.limit,
                sense="at least" if promise.sense == "at least" else "at most",
                note="" if promise.remark is None else promise.remark(ours),
                low=estimate.low,
                high=estimate.high,
                count=estimate.count,
                rivals={
                    name: promise.figure(metrics).estimate.value for name, metrics in rivals.items()
                },
            )
        )
    return found, shown


def comparison(table: Sequence[Row]) -> list[Row]:
    """Return in how many rows every baseline is worse, and in which not; none without any."""
    compared = [row for row in table if row.best is not None]
    if not compared:
        return []
    lost = [row.measure for row in compared if row.best is False]
    return [
        Row(
            measure="rows in which every baseline is worse",
            value=100.0 * (1.0 - len(lost) / len(compared)),
            unit="%",
            limit=100.0,
            sense="at least",
            count=len(compared),
            note=f"not in: {'; '.join(lost)}" if lost else "better in every row",
        )
    ]


def _percent(figure: Figure) -> Figure:
    return Figure(estimate=figure.estimate.times(100.0), worst=figure.worst, best=figure.best)


def section(table: Sequence[Row], *, frames: int, where: str) -> Section:
    """Return the table as a section."""
    return Section(
        name="sim",
        title=f"{where}: what is promised",
        about=_ABOUT.format(frames=frames),
        rows=tuple(table),
    )


_ABOUT = (
    "{frames} frames with truth; stereo and the tilt reading alone, medium sensor noise. "
    "Intervals are 95 % bootstrap intervals over frames (Wilson's for a rate that no frame "
    "contradicts, three in N for a count of none). An answer means a thing when their intervals of "
    "bearing, each 0.5 deg wider, overlap and the distances differ by at most the larger of 0.3 m "
    "and 10 %; the best-fitting pair first, one to one. Everything else that is answered is false, "
    "a second answer for one thing included. Things of which less than 70 % are visible or in both "
    "images, and things nearer than 1 m or farther than 12 m, are neither missed nor false."
)
