"""What rises no higher than the ground before it climbs is ground; what does is a thing."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bearcub.ground.surface import Surface
from bearcub.messages import Ground
from bearcub.obstacles.measure import Extent
from bearcub.obstacles.ramps import carries_on, over_a_crest

FOCAL = 46.3  # f = 386 px, B = 0.12 m
HEIGHT = 0.8  # of the camera: it looks along the ground behind the crest [m]
START, CREST = 3.5, 6.0  # of the ramp [m]
CLIMB = math.tan(math.radians(15.0))


@pytest.fixture
def ramp(sure_ground: Ground) -> Ground:
    """Return a ramp of 15 deg that is followed to its crest, 0.67 m up."""
    ahead = np.linspace(CREST, 1.5, 60)
    floor = FOCAL / ahead
    lift = np.maximum(0.0, CLIMB * (ahead - START))
    bend = floor * lift / HEIGHT
    return replace(
        sure_ground,
        plane=np.array([0.0, 0.12 / HEIGHT, -20.0]),
        height=HEIGHT,
        knots=floor - bend,
        bend=bend,
        knot_noise=np.full(60, 0.2),
    )


def thing(*, ahead: float, rises: float, ground: float, wide: float = 1.0) -> Extent:
    """Return something that rises to a height above the ground before it [m]."""
    half = 0.5 * wide / ahead
    return Extent(
        x=ahead,
        y=0.0,
        distance=ahead,
        bearing=0.0,
        right=-half,
        left=half,
        range_right=ahead,
        range_left=ahead,
        width=wide,
        top=rises,
        bottom=0.0,
        lowest=0.0,
        fill=1.0,
        front=rises,
        climb=math.nan,
        ground=ground,
        sigma_distance=0.1,
        sigma_bearing=0.001,
        sigma_width=0.02,
        sigma_top=0.02,
    )


@pytest.mark.parametrize(
    ("ahead", "rises", "ground", "is_ground"),
    [
        (6.0, 0.15, 0.58, True),  # 0.15 + 3 * 0.1 + 0.34 m on, 15 deg have risen by 0.21 m
        (6.0, 0.25, 0.58, False),
        (5.0, 0.15, 0.33, False),  # the ramp is seen to go on behind it
        (3.0, 0.15, 0.0, False),  # level ground
    ],
)
def test_what_rises_as_the_ramp_does_where_it_is_seen_no_more_is_its_crest(
    ramp: Ground, *, ahead: float, rises: float, ground: float, is_ground: bool
) -> None:
    extent = thing(ahead=ahead, rises=rises, ground=ground)
    surface = Surface.of(ramp, (480, 640))
    assert over_a_crest(extent, ramp, surface, focal=FOCAL, carried=0.0) == is_ground


def test_what_a_matcher_carries_up_is_taken_off(ramp: Ground) -> None:
    extent, surface = thing(ahead=6.0, rises=0.25, ground=0.58), Surface.of(ramp, (480, 640))
    assert over_a_crest(extent, ramp, surface, focal=FOCAL, carried=0.06)


def test_ground_that_was_not_followed_has_no_crest(ramp: Ground) -> None:
    level = replace(ramp, knots=np.zeros(0), bend=np.zeros(0), knot_noise=np.zeros(0))
    extent = thing(ahead=6.0, rises=0.1, ground=0.0)
    assert not over_a_crest(extent, level, Surface.of(level, (480, 640)), focal=FOCAL, carried=0)


CLIMBING = replace(thing(ahead=4.0, rises=0.3, ground=0.0, wide=6.0), climb=0.25)


@pytest.mark.parametrize(
    ("change", "more"),
    [
        ({}, True),  # 0.3 + 0.25 * 4 m + 0.1 m is higher
        ({"front": 1.5}, False),
        ({"front": 1.5, "lowest": 2.0}, True),  # in the air
        ({"distance": 3.0}, False),  # before it
        ({"bearing": 0.6}, False),  # 4.8 m aside
    ],
)
def test_what_lies_behind_the_foot_of_a_ramp_and_no_higher_is_more_of_it(
    change: dict[str, float], *, more: bool
) -> None:
    extent = replace(thing(ahead=8.0, rises=1.2, ground=0.0), **change)
    found = carries_on(CLIMBING, extent, across=False, blur=0.0, least=0.1, overhead=1.9)
    assert found == more


def test_a_ramp_as_wide_as_the_view_goes_on_beside_what_is_seen_of_it() -> None:
    extent = replace(thing(ahead=8.0, rises=1.2, ground=0.0), bearing=0.6)
    assert carries_on(CLIMBING, extent, across=True, blur=0.0, least=0.1, overhead=1.9)
