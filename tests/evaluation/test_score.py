"""Numbers worked by hand: corridors, pairs, shares."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.evaluation.score import (
    best_label,
    box_region,
    covered,
    cut,
    inside_corridor,
    match,
    overlap,
    rms,
    worst,
)

STRAIGHT = np.array([[0.0, 0.0], [30.0, 0.0]])


@pytest.mark.parametrize(
    ("points", "inside"),
    [
        ([(5.0, 0.99), (5.0, -0.99), (11.99, 0.0), (0.01, 0.0)], [True] * 4),
        ([(5.0, 1.01), (5.0, -1.01), (12.01, 0.0), (-0.01, 0.0)], [False] * 4),
    ],
)
def test_straight_corridor_is_two_metres_wide_and_twelve_long(
    points: list[tuple[float, float]], inside: list[bool]
) -> None:
    assert inside_corridor(points, STRAIGHT, half_width=1.0, reach=12.0).tolist() == inside


def test_corridor_follows_a_left_turn() -> None:
    # 5 m ahead, then square to the left: (5, 4) is on the way, (9, 0) is where it would go straight
    turn = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 10.0]])
    points = [(5.0, 4.0), (4.2, 4.0), (9.0, 0.0), (3.9, 4.0), (5.0, 7.1), (5.7, 0.7)]
    inside = inside_corridor(points, turn, half_width=1.0, reach=12.0)
    assert inside.tolist() == [True, True, False, False, False, True]


def test_corridor_ends_where_the_recording_ends() -> None:
    short = np.array([[0.0, 0.0], [3.0, 0.0]])
    inside = inside_corridor([(2.9, 0.0), (3.1, 0.0)], short, half_width=1.0, reach=12.0)
    assert inside.tolist() == [True, False]


def test_vehicle_that_stood_still_swept_nothing() -> None:
    standing = np.zeros((3, 2))
    assert not inside_corridor([(0.0, 0.0)], standing, half_width=1.0, reach=12.0).any()


def test_point_of_unknown_place_is_in_no_corridor() -> None:
    assert not inside_corridor([(math.nan, 0.0)], STRAIGHT, half_width=1.0, reach=12.0).any()


def test_cut_ends_a_path_in_the_middle_of_a_piece() -> None:
    path = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert cut(path, 14.0).tolist() == [[0.0, 0.0], [10.0, 0.0], [10.0, 4.0]]
    assert cut(path, 10.0).tolist() == [[0.0, 0.0], [10.0, 0.0]]
    assert cut(path, 99.0).tolist() == path.tolist()


@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=1, max_size=20))
def test_mirrored_points_are_in_the_mirrored_corridor(points: list[tuple[float, float]]) -> None:
    path = np.array([[0.0, 0.0], [4.0, 0.5], [9.0, 2.0]])
    mirror = np.array([1.0, -1.0])
    inside = inside_corridor(points, path, half_width=1.0, reach=12.0)
    mirrored = inside_corridor(np.array(points) * mirror, path * mirror, half_width=1.0, reach=12.0)
    assert inside.tolist() == mirrored.tolist()


def test_pairs_take_the_closest_first_and_each_thing_once() -> None:
    found = [(1.0, 0.0), (1.3, 0.0), (9.0, 0.0)]
    truth = [(1.2, 0.0), (0.7, 0.0)]
    # 1.3 is 0.1 from 1.2; what remains is 1.0 and 0.7, 0.3 apart; 9.0 is alone
    assert match(found, truth, gate=0.5) == [(1, 0), (0, 1)]


def test_nothing_pairs_beyond_the_gate_or_with_nothing() -> None:
    assert match([(1.0, 0.0)], [(2.0, 0.0)], gate=0.5) == []
    assert match([], [(2.0, 0.0)], gate=0.5) == []
    assert match([(math.nan, 0.0)], [(2.0, 0.0)], gate=0.5) == []


def test_unknown_errors_are_not_good_errors() -> None:
    assert math.isnan(worst([0.1, math.nan]))
    assert math.isnan(rms([0.1, math.nan]))
    assert covered([0.1, math.nan], [1.0, 1.0]) == 0.5


def test_two_sigma_is_twice_the_sigma() -> None:
    assert covered([0.19, -0.19, 0.21, -0.21], [0.1] * 4) == 0.5


def test_best_label_is_the_obstacle_with_most_of_the_region() -> None:
    labels = np.array([[1, 1, 2, 0], [2, 2, 2, -1]], dtype=np.int32)
    everywhere = np.ones(labels.shape, dtype=bool)
    assert best_label(labels, everywhere) == (2, 0.5)
    assert best_label(labels, labels == -1) == (0, 0.0)
    assert best_label(labels, ~everywhere) == (0, 0.0)


def test_boxes_are_inclusive() -> None:
    assert box_region((1, 0, 2, 1), (3, 4)).sum() == 4
    assert overlap((0, 0, 1, 1), (0, 0, 1, 1)) == 1.0
    assert overlap((0, 0, 1, 1), (2, 0, 3, 1)) == 0.0
    assert overlap((0, 0, 3, 3), (2, 2, 3, 3)) == 4 / 16
