"""What is made of one frame's answer."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from bearcub.evaluation.report import Found, Report
from bearcub.evaluation.verdict import Record, Verdict, errors, judge, true_slopes
from bearcub.messages import Answer, Ground, Hole, Obstacle, Terrain, Tilt
from bearcub.rig import Camera, Mount, Rig

RIG = Rig(
    camera=Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12),
    mount=Mount(height=1.2, pitch=math.radians(5.0)),
)
CAN = {
    "name": "can",
    "distance": 4.0,
    "bearing_deg": 2.0,
    "width": 0.5,
    "height": 0.8,
    "base_height": 0.0,
    "visible_share": 1.0,
    "truncated": [],
    "passable": False,
}
PIT = {
    "kind": "pit",
    "distance": 2.5,
    "bearing_deg": -5.0,
    "width": 0.8,
    "length": 0.6,
    "depth": 0.5,
    "depth_seen": 0.3,
}
TRUTH: dict[str, Any] = {
    "tilt": {"pitch_deg": 0.0, "roll_deg": 0.0},
    "obstacles": [CAN],
    "holes": [PIT],
    "terrain": {"slope_deg": 3.0, "cross_slope_deg": 0.0},
    "ground": {"height": 1.2, "pitch_deg": 5.0, "roll_deg": 0.0},
}
PERFECT = Report(
    obstacles=(
        Found(distance=4.0, bearing=math.radians(2.0), width=0.5, height=0.8, base_height=0.0),
    ),
    holes=(Found(distance=2.5, bearing=math.radians(-5.0), width=0.8, length=0.6, depth=0.3),),
    slope=math.radians(3.0),
    cross_slope=0.0,
    reference="gravity",
    height=1.2,
    pitch=math.radians(5.0),
    roll=0.0,
)


def judged(report: Report, truth: dict[str, Any] = TRUTH, **more: Any) -> Verdict:
    record = Record(
        name="a/0", scenario="a", rig=RIG, tilt=None, truth=truth, reports={"x": report}, **more
    )
    return judge(record, "x")


def test_perfect_answer_is_perfect() -> None:
    verdict = judged(PERFECT)
    (can,), (pit,) = verdict.things, verdict.holes
    for error in [*errors(can).values(), *errors(pit).values(), *verdict.ground.values()]:
        assert error.absolute == pytest.approx(0.0, abs=1e-12)
    assert set(errors(can)) == {"distance", "bearing", "width", "height"}
    assert set(errors(pit)) == {"distance", "bearing", "width", "length", "depth"}
    assert (verdict.false, verdict.false_holes, verdict.pieces) == ((), (), 0)


def test_shifted_answer_shows_exactly_the_shift() -> None:
    (can,) = PERFECT.obstacles
    off = replace(
        can,
        distance=4.1,
        bearing=math.radians(1.5),
        width=0.46,
        height=0.83,
        sigma={"distance": 0.05, "bearing": math.radians(0.2)},
    )
    (sighting,) = judged(replace(PERFECT, obstacles=(off,), pitch=math.radians(5.3))).things
    found = errors(sighting)
    assert found["distance"].absolute == pytest.approx(0.1)
    assert found["distance"].sigma == 0.05
    assert found["bearing"].absolute == pytest.approx(-0.5)
    assert found["bearing"].sigma == pytest.approx(0.2)
    assert found["width"].absolute == pytest.approx(-0.04)
    assert found["height"].absolute == pytest.approx(0.03)


def test_attitude_errors_are_in_degrees() -> None:
    ground = judged(replace(PERFECT, pitch=math.radians(5.3), roll=math.radians(-0.2))).ground
    assert ground["pitch"].absolute == pytest.approx(0.3)
    assert ground["roll"].absolute == pytest.approx(-0.2)


def test_empty_answer_misses_everything() -> None:
    verdict = judged(Report())
    assert [s.found for s in (*verdict.things, *verdict.holes)] == [None, None]
    assert all(math.isnan(error.absolute) for error in verdict.ground.values())


def test_what_the_image_cuts_has_no_width_and_no_bearing() -> None:
    wall = {**CAN, "truncated": ["left", "top"]}
    (sighting,) = judged(PERFECT, {**TRUTH, "obstacles": [wall]}).things
    assert set(errors(sighting)) == {"distance"}


@pytest.mark.parametrize(("base_height", "in_the_way"), [(0.0, True), (1.9, True), (2.1, False)])
def test_thing_overhead_is_in_the_way_only_if_the_answer_says_so(
    base_height: float,
    in_the_way: bool,  # noqa: FBT001
) -> None:
    branch = {**CAN, "base_height": 2.2, "passable": True}
    (can,) = PERFECT.obstacles
    answer = replace(PERFECT, obstacles=(replace(can, base_height=base_height),))
    verdict = judged(answer, {**TRUTH, "obstacles": [branch]}, tags={"clearance": 2.0})
    assert verdict.things == ()
    assert verdict.false == ()
    assert (verdict.overhead[0].found is not None) is in_the_way


def test_slope_against_the_robot_leaves_out_the_ground_it_stands_on() -> None:
    # A robot on a slope of 4 deg up that goes on as one of 3: 1 deg down for the robot.
    truth = {
        **TRUTH,
        "tilt": {"pitch_deg": -4.0, "roll_deg": 0.0},
        "ground": {"height": 1.2, "pitch_deg": 5.0, "roll_deg": 0.0},
    }
    assert true_slopes(truth, RIG, reference="gravity") == (3.0, 0.0)
    assert true_slopes(truth, RIG, reference="robot")[0] == pytest.approx(-1.0)
    leaning = {**truth, "tilt": {"pitch_deg": 0.0, "roll_deg": 6.0}}
    assert true_slopes(leaning, RIG, reference="robot")[1] == pytest.approx(-6.0, abs=0.05)


def test_slope_against_a_reading_that_is_known_to_be_wrong_does_not_count() -> None:
    assert "slope" not in judged(PERFECT, tags={"tilt": "biased"}).ground
    assert "pitch" in judged(PERFECT, tags={"tilt": "biased"}).ground
    assert "slope" in judged(replace(PERFECT, reference="robot"), tags={"tilt": "biased"}).ground


@pytest.mark.parametrize(("distance", "counts"), [(4.9, False), (5.1, True)])
def test_slope_counts_where_no_bank_ends_the_ground(distance: float, *, counts: bool) -> None:
    truth = {**TRUTH, "obstacles": [{**CAN, "name": "bank", "distance": distance}]}
    assert ("slope" in judged(PERFECT, truth).ground) is counts


def test_error_of_the_reading_itself_is_kept() -> None:
    tilt = Tilt(pitch=math.radians(0.4), roll=0.0)
    record = Record(name="a", scenario="a", rig=RIG, tilt=tilt, truth=TRUTH, reports={"x": PERFECT})
    assert judge(record, "x").tilt_error == pytest.approx(0.4)
    assert math.isnan(judged(PERFECT).tilt_error)


def test_report_says_what_the_answer_says(
    make_answer: Callable[..., Answer],
    make_obstacle: Callable[..., Obstacle],
    make_hole: Callable[..., Hole],
    make_ground: Callable[..., Ground],
) -> None:
    terrain = Terrain(
        slope=0.1, cross_slope=-0.2, sigma=0.01, roughness=math.nan, reference="gravity"
    )
    answer = make_answer(
        obstacles=(make_obstacle(),), holes=(make_hole(),), terrain=terrain, ground=make_ground()
    )
    report = Report.of(answer)
    (thing,), (hole,) = report.obstacles, report.holes
    assert (thing.distance, thing.width, thing.height, thing.base_height) == (4.0, 0.8, 1.2, 0.0)
    assert thing.sigma == {"distance": 0.05, "bearing": 0.002, "width": 0.02, "height": 0.02}
    assert (hole.length, hole.depth, hole.sigma["depth"]) == (0.08, 0.04, 0.002)
    assert (report.slope, report.cross_slope, report.sigma_slope) == (0.1, -0.2, 0.01)
    assert (report.height, report.sigma["pitch"]) == (1.28, 0.001)
    assert report.timing["total"] == 3.0


def test_floor_that_was_not_seen_is_not_reported(
    make_answer: Callable[..., Answer], make_ground: Callable[..., Ground]
) -> None:
    report = Report.of(make_answer(ground=make_ground(seen=False)))
    assert math.isnan(report.height)
    assert report.sigma == {}


def test_depth_that_is_only_a_bound_has_no_interval(
    make_answer: Callable[..., Answer], make_hole: Callable[..., Hole]
) -> None:
    (hole,) = Report.of(make_answer(holes=(make_hole(depth_is_lower_bound=True),))).holes
    assert math.isnan(hole.sigma["depth"])
