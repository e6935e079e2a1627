"""How answers read on a terminal."""

import math

import numpy as np
import pytest

from bearcub.cli import wording
from bearcub.messages import FreeRange, Hole, Limit, Obstacle, Terrain

BRANCH = Obstacle(
    id=2,
    x=3.0,
    y=-0.6,
    distance=3.06,
    bearing=math.radians(-11.3),
    width=1.6,
    height=1.04,
    base_height=0.92,
    sigma_distance=0.02,
    sigma_bearing=math.radians(0.02),
    sigma_width=0.03,
    sigma_height=0.01,
    confidence=0.97,
    box=(0, 0, 9, 9),
    pixels=100,
    truncated=("right", "top"),
)
DROP = Hole(
    x=3.0,
    y=0.0,
    distance=3.0,
    bearing=0.0,
    width=4.0,
    length=math.nan,
    depth=0.5,
    depth_is_lower_bound=True,
    kind="drop",
    sigma_distance=0.05,
    sigma_width=0.1,
    sigma_length=math.nan,
    sigma_depth=0.05,
    confidence=0.9,
    box=(0, 0, 9, 9),
    pixels=100,
)


def test_what_the_image_cuts_is_a_lower_bound_and_what_hangs_says_so() -> None:
    assert wording.obstacle_cells(BRANCH) == (
        "2",
        "3.06 m ±0.02",
        "11.30° ±0.02 right",
        "≥ 1.60 m ±0.03",
        "≥ 1.04 m ±0.01",
        "97 %",
        "hangs 0.92 m up; cut by the image border: right, top",
    )


def test_a_drop_has_no_end_and_at_least_a_depth() -> None:
    assert wording.hole_cells(DROP) == (
        "drop",
        "3.00 m ±0.05",
        "0.0°",
        "4.00 m ±0.10",
        "no end seen",
        "≥ 0.50 m ±0.05",
        "90 %",
        "",
    )


@pytest.mark.parametrize(
    ("slope_deg", "cross_deg", "reference", "words"),
    [
        (
            8.5,
            -2.0,
            "gravity",
            "8.5° ±0.3 up ahead, 2.0° rising to the right across, rough by 4.0 mm; against gravity",
        ),
        (
            -8.5,
            math.nan,
            "robot",
            "8.5° ±0.3 down ahead, rough by 4.0 mm; against the ground under the robot",
        ),
        (
            math.nan,
            math.nan,
            "robot",
            "not known: too little ground seen from 1.5 to 5 m ahead",
        ),
    ],
)
def test_slopes_say_which_way_and_against_what(
    slope_deg: float, cross_deg: float, reference: str, words: str
) -> None:
    terrain = Terrain(
        slope=math.radians(slope_deg),
        cross_slope=math.radians(cross_deg),
        sigma=math.radians(0.3),
        roughness=0.004,
        reference=reference,
    )
    assert wording.slope(terrain) == words


def test_the_free_way_is_told_ahead_and_where_it_is_longest() -> None:
    free = FreeRange(
        bearing=np.radians([-20.0, 0.0, 20.0]),
        range=np.array([6.5, 3.0, 2.0]),
        limit=(Limit.UNSEEN, Limit.OBSTACLE, Limit.HOLE),
    )
    assert wording.free_way(free) == (
        "straight ahead 3.0 m, then obstacle; farthest 20.0° right 6.5 m, then unseen"
    )


def test_a_free_way_that_is_not_known_says_so() -> None:
    assert wording.free_way(FreeRange(bearing=np.zeros(0), range=np.zeros(0), limit=())) == (
        "not known"
    )
