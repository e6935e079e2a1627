"""Other rendered scenes, for information: holes, slopes and obstacles of many shapes."""

import math
from collections.abc import Callable, Mapping

from bearcub.evaluation.runner import Runner
from bearcub.evaluation.table import Row, Section
from bearcub.evaluation.things import Comparison, compare_holes, compare_obstacles
from bearcub.messages import Answer, Snapshot, Tilt
from bearcub.sim import render, scenes
from bearcub.sim.world import Scene

SCENES: dict[str, Callable[[], Scene]] = {
    "empty floor": scenes.floor,
    "pit 0.8 x 0.6 x 0.3 m": scenes.pit,
    "drop of 0.5 m": scenes.drop,
    "kerb of 0.12 m": scenes.kerb,
    "ramp up 8.5 deg": scenes.ramp,
    "ramp down 8.5 deg": lambda: scenes.ramp(slope=math.radians(-8.5)),
    "cross slope 6 deg": scenes.cross_slope,
    "wall": scenes.wall,
    "two cans at one bearing": scenes.two_cans,
    "branch in the air": scenes.branch,
    "table": scenes.table,
    "five posts": scenes.posts,
    "box of 10 cm": scenes.small_box,
}

_ABOUT = (
    "Rendered with the paper's rig and medium noise, answered with the tilt reading of a body that "
    "stands on the ground. Counts of what was missed and what is false among obstacles and holes; "
    "found (true) sizes beside."
)


def evaluate_scenes(runner: Runner | None = None) -> Section:
    """Answer every scene once."""
    runner = runner or Runner()
    rows: list[Row] = []
    for name, build in runner.track(SCENES.items(), total=len(SCENES), name="scenes"):
        rows += _scene(name, build(), runner)
    return Section(name="scenes", title="Other scenes", about=_ABOUT, rows=tuple(rows))


def _scene(name: str, scene: Scene, runner: Runner) -> list[Row]:
    rig, body = scenes.paper_rig(), scenes.standing(scene)
    rendered = render(scene, rig, body=body, noise="medium", seed=7)
    snapshot = Snapshot(
        left=rendered.left, right=rendered.right, tilt=Tilt(pitch=body.pitch, roll=body.roll)
    )
    label = name.replace(" ", "_")
    ((_, answer),) = runner.answers(rig, {label: lambda: snapshot}, name="scenes")
    obstacles = compare_obstacles(answer, rendered.truth)
    holes = compare_holes(answer, rendered.truth)
    return [
        Row(
            measure=f"{name}: missed",
            value=obstacles.missed + holes.missed,
            note="; ".join(_sizes(obstacles) + _sizes(holes)),
        ),
        Row(
            measure=f"{name}: false",
            value=obstacles.false + holes.false,
            note=f"obstacles: {obstacles.false}, holes: {holes.false}"
            if obstacles.false + holes.false
            else "",
        ),
        _slope(name, answer, rendered.truth["terrain"]),
    ]


def _sizes(comparison: Comparison) -> list[str]:
    return [
        ", ".join(f"{what} {e.value:.2f} ({e.truth:.2f})" for what, e in errors.items())
        for errors in comparison.errors
    ]


def _slope(name: str, answer: Answer, truth: Mapping[str, float]) -> Row:
    along = math.degrees(answer.terrain.slope)
    across = math.degrees(answer.terrain.cross_slope)
    return Row(
        measure=f"{name}: slope error",
        value=abs(along - truth["slope_deg"]),
        unit="deg",
        note=f"{along:.1f} ({truth['slope_deg']:.1f}), across {across:.1f} "
        f"({truth['cross_slope_deg']:.1f}) deg",
    )
