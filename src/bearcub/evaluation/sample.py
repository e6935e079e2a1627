"""The sample's scene, rendered at every attitude that the robot may take."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from bearcub.evaluation.runner import Runner
from bearcub.evaluation.score import covered, worst
from bearcub.evaluation.table import Row, Section
from bearcub.evaluation.things import Comparison, Error, compare_obstacles
from bearcub.geometry import Attitude
from bearcub.messages import Answer, Snapshot, Tilt
from bearcub.rig import Rig
from bearcub.sim import render, scenes

ATTITUDES = tuple(product((-5, 0, 5), range(-15, 16, 5)))
"""Pitch and roll of the body [deg]."""

_ABOUT = (
    "The embedded sample's scene (garbage can 3.05 m ahead, the paper's rig, medium sensor noise) "
    "rendered at every roll of the body from -15 to 15 deg in steps of 5 and every pitch of -5, 0 "
    "and 5 deg. Every number is the worst of the 21."
)
_WITHOUT = "The same pairs, answered from the images and the mount alone."


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """The scene from one attitude.

    Attributes
    ----------
    pitch_deg, roll_deg : float
        Of the body.
    snapshot : Snapshot
        The rendered pair, without a tilt reading.
    truth : dict
        See `bearcub.sim.truth.describe`.
    """

    pitch_deg: float
    roll_deg: float
    snapshot: Snapshot
    truth: Mapping[str, Any]

    @property
    def tilt(self) -> Tilt:
        """What a perfect tilt sensor reads."""
        return Tilt(pitch=math.radians(self.pitch_deg), roll=math.radians(self.roll_deg))

    @property
    def name(self) -> str:
        """The attitude in words that can be a file name."""
        return f"pitch{self.pitch_deg:+g}_roll{self.roll_deg:+g}"


def view(pitch_deg: float, roll_deg: float) -> View:
    """Render the sample's scene with the body inclined."""
    body = Attitude(roll=math.radians(roll_deg), pitch=math.radians(pitch_deg))
    # A seed of its own for every attitude: 21 draws of the noise, not one.
    seed = 1000 + 31 * round(pitch_deg) + round(roll_deg)
    rendered = render(
        scenes.garbage_can(), scenes.paper_rig(), body=body, noise="medium", seed=seed
    )
    return View(
        pitch_deg=pitch_deg,
        roll_deg=roll_deg,
        snapshot=Snapshot(left=rendered.left, right=rendered.right),
        truth=rendered.truth,
    )


def evaluate_sample(
    runner: Runner | None = None, *, attitudes: Sequence[tuple[float, float]] = ATTITUDES
) -> list[Section]:
    """Render the scene at (pitch, roll) [deg] and compare both answers with the truth.

    Returns
    -------
    list of Section
        One with the tilt reading, one without.
    """
    runner = runner or Runner()
    views = [
        view(pitch, roll)
        for pitch, roll in runner.track(attitudes, total=len(attitudes), name="rendering")
    ]
    return [evaluate(views, runner, tilted=tilted) for tilted in (True, False)]


def evaluate(views: Sequence[View], runner: Runner, *, tilted: bool) -> Section:
    """Answer rendered views, with their tilt readings or without."""
    word = "with" if tilted else "without"
    name = f"sample_{word}_tilt"
    comparisons = {
        v.name: compare_obstacles(_answer(v, runner, name, tilted), v.truth) for v in views
    }
    return Section(
        name=name,
        title=f"The sample at every attitude, {word} the tilt reading",
        about=_ABOUT if tilted else _WITHOUT,
        rows=tuple(score(comparisons)),
    )


def _answer(shown: View, runner: Runner, name: str, tilted: bool) -> Answer:  # noqa: FBT001
    snapshot = Snapshot(
        left=shown.snapshot.left,
        right=shown.snapshot.right,
        tilt=shown.tilt if tilted else None,
    )
    rig: Rig = scenes.paper_rig()
    ((_, answer),) = runner.answers(rig, {shown.name: lambda: snapshot}, name=name)
    return answer


def score(comparisons: Mapping[str, Comparison]) -> list[Row]:
    """Return the worst of all views.

    Parameters
    ----------
    comparisons : mapping of str to Comparison
        By the name of the view.
    """
    return [
        _count("obstacles missed", {name: c.missed for name, c in comparisons.items()}),
        _count("false obstacles", {name: c.false for name, c in comparisons.items()}),
        _largest("distance", comparisons, unit="%", limit=1.5),
        _largest("width", comparisons, unit="%", limit=5.0),
        _largest("height", comparisons, unit="%", limit=5.0),
        _largest("bearing", comparisons, unit="deg", limit=0.3),
        *(_honesty(what, comparisons) for what in ("distance", "width", "height", "bearing")),
    ]


def _count(measure: str, counts: Mapping[str, int]) -> Row:
    where = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    return Row(measure=measure, value=sum(counts.values()), limit=0, note=where)


def _each(what: str, comparisons: Mapping[str, Comparison]) -> dict[str, Error]:
    """Return one error a view; the sample has one thing."""
    return {name: e[what] for name, c in comparisons.items() for e in c.errors}


def _largest(what: str, comparisons: Mapping[str, Comparison], *, unit: str, limit: float) -> Row:
    errors = _each(what, comparisons)
    numbers = {name: e.percent if unit == "%" else e.absolute for name, e in errors.items()}
    where = max(numbers, key=lambda name: _magnitude(numbers[name]), default="")
    note = f"{numbers[where]:+.2f} {unit} at {where}" if where else "nothing found"
    return Row(
        measure=f"{what} error",
        value=worst(list(numbers.values())),
        unit=unit,
        limit=limit,
        note=note,
    )


def _magnitude(number: float) -> float:
    return math.inf if math.isnan(number) else abs(number)


def _honesty(what: str, comparisons: Mapping[str, Comparison]) -> Row:
    errors = _each(what, comparisons).values()
    share = covered([e.absolute for e in errors], [e.sigma for e in errors])
    return Row(measure=f"{what} within 2 sigma of the truth", value=100.0 * share, unit="%")
