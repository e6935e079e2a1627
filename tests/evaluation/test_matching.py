"""Which answers mean which things."""

import math
from typing import Any

import pytest

from bearcub.evaluation.matching import match
from bearcub.evaluation.report import Found
from bearcub.evaluation.target import Target


def target(distance: float = 4.0, bearing_deg: float = 0.0, **more: Any) -> Target:
    numbers = {"kind": "can", "width": 0.4, "height": 0.7, "base_height": 0.0, **more}
    return Target(distance=distance, bearing=math.radians(bearing_deg), **numbers)


def found(distance: float = 4.0, bearing_deg: float = 0.0, width: float = 0.4) -> Found:
    return Found(distance=distance, bearing=math.radians(bearing_deg), width=width)


def test_perfect_answer_matches_everything() -> None:
    things = [target(3.0, -10.0), target(5.0, 0.0), target(2.0, 20.0)]
    answers = [found(2.0, 20.0), found(3.0, -10.0), found(5.0, 0.0)]
    matches = match(answers, things)
    assert [s.found for s in matches.sightings] == [answers[1], answers[2], answers[0]]
    assert matches.false == ()


def test_missed_thing_and_false_answer_count_once_each() -> None:
    matches = match([found(4.0, 0.0), found(4.0, 30.0)], [target(4.0, 0.0), target(4.0, -30.0)])
    assert [s.found is None for s in matches.sightings] == [False, True]
    assert matches.false == (found(4.0, 30.0),)
    assert matches.pieces == 0


@pytest.mark.parametrize(
    ("distance", "off", "matches_it"),
    [(2.0, 0.29, True), (2.0, 0.31, False), (8.0, -0.79, True), (8.0, 0.81, False)],
)
def test_distance_may_be_off_by_30_cm_or_a_tenth(
    distance: float,
    off: float,
    matches_it: bool,  # noqa: FBT001
) -> None:
    matches = match([found(distance + off)], [target(distance)])
    assert (matches.sightings[0].found is not None) is matches_it


def test_bearings_must_overlap_within_half_a_degree_each() -> None:
    post = target(3.0, 0.0, width=0.03)  # 0.573 deg wide
    assert match([found(3.0, 1.5, width=0.03)], [post]).false == ()
    assert len(match([found(3.0, 1.6, width=0.03)], [post]).false) == 1


def test_second_answer_for_one_thing_is_false_and_a_piece() -> None:
    matches = match([found(4.2), found(4.05)], [target(4.0)])
    assert matches.sightings[0].found == found(4.05)  # the better one
    assert matches.false == (found(4.2),)
    assert matches.pieces == 1


def test_best_fitting_pair_goes_first_whatever_the_order() -> None:
    things = [target(4.0, 0.0), target(4.0, 4.0)]
    answers = [found(4.0, 3.8), found(4.0, 0.4)]
    for order in (answers, answers[::-1]):
        matches = match(order, things)
        assert [s.found for s in matches.sightings] == [answers[1], answers[0]]


def test_answers_for_what_does_not_count_are_not_false() -> None:
    hidden = target(4.0, 0.0, ignored="only 20 % of it are visible")
    assert match([found(4.0), found(4.1)], [hidden]).false == ()
    assert match([], [hidden]).sightings[0].found is None


def test_answers_for_what_is_overhead_are_not_false_obstacles() -> None:
    branch = target(3.0, 0.0, base_height=2.2, passable=True)
    matches = match([found(3.0)], [branch])
    assert matches.false == ()
    assert matches.sightings[0].found == found(3.0)


def test_answer_without_a_width_can_still_match() -> None:
    assert match([found(4.0, 1.0, width=math.nan)], [target(4.0)]).false == ()


def test_nothing_and_nothing_match() -> None:
    matches = match([], [])
    assert (matches.sightings, matches.false) == ((), ())
