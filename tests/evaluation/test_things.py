"""Obstacles and holes against the truth of a rendered scene."""

import math
from collections.abc import Callable

import pytest

from bearcub.evaluation.sample import score
from bearcub.evaluation.table import Row
from bearcub.evaluation.things import compare_holes, compare_obstacles
from bearcub.messages import Answer, Hole, Obstacle

TRUTH = {
    "obstacles": [{"distance": 4.0, "bearing_deg": 2.0, "width": 0.5, "height": 0.8}],
    "holes": [
        {
            "distance": 2.5,
            "bearing_deg": 0.0,
            "width": 0.8,
            "length": None,
            "depth": 0.5,
            "depth_seen": 0.3,
        }
    ],
}


def test_errors_are_found_minus_true(
    make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
) -> None:
    thing = make_obstacle(
        distance=4.08, bearing=math.radians(1.9), width=0.45, height=0.84, sigma_bearing=0.01
    )
    found = compare_obstacles(make_answer(obstacles=(thing,)), TRUTH)
    (errors,) = found.errors
    assert (found.missed, found.false) == (0, 0)
    assert errors["distance"].percent == pytest.approx(2.0)
    assert errors["width"].percent == pytest.approx(-10.0)
    assert errors["height"].percent == pytest.approx(5.0)
    assert errors["bearing"].absolute == pytest.approx(-0.1)
    assert errors["bearing"].sigma == pytest.approx(0.573, abs=1e-3)


def test_thing_elsewhere_is_false_and_the_true_one_missed(
    make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
) -> None:
    # at 4 m, 10 deg are 0.7 m
    away = make_obstacle(distance=4.0, bearing=math.radians(12.0))
    found = compare_obstacles(make_answer(obstacles=(away,)), TRUTH)
    assert (found.missed, found.false, found.errors) == (1, 1, ())


def test_holes_are_as_deep_as_is_seen(
    make_answer: Callable[..., Answer], make_hole: Callable[..., Hole]
) -> None:
    pit = make_hole(distance=2.4, width=0.8, length=math.nan, depth=0.33)
    (errors,) = compare_holes(make_answer(holes=(pit,)), TRUTH).errors
    assert errors["depth"].percent == pytest.approx(10.0)
    assert math.isnan(errors["length"].absolute)


def test_sample_reports_the_worst_view_and_where(
    make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
) -> None:
    def seen(distance: float, *others: Obstacle) -> Answer:
        thing = make_obstacle(
            distance=distance, bearing=math.radians(2.0), width=0.5, height=0.8, sigma_distance=0.02
        )
        return make_answer(obstacles=(thing, *others))

    ghost = make_obstacle(id=2, distance=9.0)
    rows: dict[str, Row] = {
        row.measure: row
        for row in score(
            {
                "level": compare_obstacles(seen(4.03), TRUTH),
                "rolled": compare_obstacles(seen(3.92, ghost), TRUTH),
            }
        )
    }
    assert (rows["false obstacles"].value, rows["false obstacles"].note) == (1, "rolled: 1")
    assert rows["distance error"].value == pytest.approx(2.0)
    assert rows["distance error"].note == "-2.00 % at rolled"
    assert rows["distance error"].passed is False
    assert rows["width error"].passed is True
    assert rows["distance within 2 sigma of the truth"].value == 50.0


def test_sample_without_an_answer_keeps_no_promise(make_answer: Callable[..., Answer]) -> None:
    rows = score({"level": compare_obstacles(make_answer(), TRUTH)})
    kept = {row.measure for row in rows if row.passed}
    assert kept == {"false obstacles"}
