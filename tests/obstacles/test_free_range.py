"""How far the way is free in each direction, and what ends it."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from bearcub.messages import Answer, Float32, FreeRange, Limit
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes
from bearcub.sim.world import Ground, Scene, Thing

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]
Crate = Callable[..., Thing]

FLOOR = Ground(texture=scenes.ASPHALT)


def towards(way: FreeRange, bearing: float) -> tuple[float, Limit]:
    """Return range [m] and limit in the direction nearest to `bearing` [deg]."""
    index = int(np.argmin(np.abs(np.degrees(way.bearing) - bearing)))
    return float(way.range[index]), way.limit[index]


def test_bearings_ascend_evenly_across_the_view(shot: Shot, noisy: Noisy, look: Look) -> None:
    way = look(noisy(shot(scenes.floor()).disparity)).free_range
    degrees = np.degrees(way.bearing)
    np.testing.assert_allclose(np.diff(degrees), 2.0, atol=1e-9)
    # the half field of view is atan(159.5 / 193) = 39.6 deg
    assert degrees[0] == pytest.approx(-38)
    assert degrees[-1] == pytest.approx(38)
    assert len(way) == len(way.range) == len(way.limit) == 39


def test_empty_floor_is_free_as_far_as_it_is_seen(shot: Shot, noisy: Noisy, look: Look) -> None:
    way = look(noisy(shot(scenes.floor()).disparity, 0.1)).free_range
    assert set(way.limit) == {Limit.UNSEEN}
    assert way.range.min() > 10.0
    assert way.range.max() <= 20.0  # the farthest that is looked at


@pytest.mark.parametrize(("x", "y"), [(2.5, 0.0), (3.0, 1.0), (4.0, -1.2)])
def test_obstacle_ends_the_way_in_its_directions_and_in_no_other(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate, x: float, y: float
) -> None:
    frame = shot(Scene(ground=FLOOR, things=(crate(x, y, width=0.8, height=0.8),)))
    way = look(noisy(frame.disparity)).free_range
    bearing = math.degrees(math.atan2(y, x))
    reach, limit = towards(way, bearing)
    assert limit == Limit.OBSTACLE
    # floor is followed in steps of 7 %: never farther than the thing, at most a step nearer
    assert 0.91 * math.hypot(x, y) < reach < 1.03 * math.hypot(x, y)
    for side in (bearing + 16, bearing - 16):
        reach, limit = towards(way, side)
        assert limit != Limit.OBSTACLE
        assert reach > 8.0


def test_wall_ends_the_way_everywhere(shot: Shot, noisy: Noisy, look: Look, rig: Rig) -> None:
    frame = shot(scenes.wall(distance=4.0), by=rig)
    way = look(noisy(frame.disparity), by=rig).free_range
    assert set(way.limit) == {Limit.OBSTACLE}
    np.testing.assert_allclose(way.range * np.cos(way.bearing), 4.0, rtol=0.05)


def test_ground_that_is_not_seen_is_not_free(shot: Shot, noisy: Noisy, look: Look) -> None:
    frame = shot(scenes.floor())
    disparity = noisy(frame.disparity, 0.1)
    disparity[frame.disparity < 6.0] = np.nan  # 23.16 / 6 = 3.9 m of depth
    way = look(disparity).free_range
    assert set(way.limit) == {Limit.UNSEEN}
    reach, _ = towards(way, 0)
    assert reach == pytest.approx(3.75, abs=0.4)


def test_gap_in_the_floor_ends_the_way_before_it(shot: Shot, noisy: Noisy, look: Look) -> None:
    frame = shot(scenes.floor())
    disparity = noisy(frame.disparity, 0.1)
    disparity[(frame.disparity < 8.0) & (frame.disparity > 4.0)] = np.nan  # 2.8 to 5.7 m
    reach, limit = towards(look(disparity).free_range, 0)
    assert limit == Limit.UNSEEN
    assert 2.3 < reach < 3.2


def test_what_hangs_higher_than_the_robot_does_not_end_the_way(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, crate: Crate
) -> None:
    high = crate(3.5, 0.0, width=1.5, height=0.4, bottom=2.2)  # over the default 2 m
    low = crate(3.5, 0.0, width=1.5, height=0.4, bottom=1.2)
    answers = [
        look(noisy(shot(Scene(ground=FLOOR, things=(thing,)), by=rig).disparity, 0.1), by=rig)
        for thing in (high, low)
    ]
    assert [len(answer.obstacles) for answer in answers] == [1, 1]
    reach, limit = towards(answers[0].free_range, 0)
    assert limit == Limit.UNSEEN
    assert reach > 8.0
    reach, limit = towards(answers[1].free_range, 0)
    assert limit == Limit.OBSTACLE
    assert reach == pytest.approx(3.5, abs=0.2)


@pytest.mark.parametrize("start", [2.5, 3.0])
def test_bank_too_steep_for_a_way_ends_it_at_its_foot(
    shot: Shot, noisy: Noisy, look: Look, start: float
) -> None:
    """25 deg are steeper than the default 20 deg; slopes are told in bands of half a metre."""
    frame = shot(scenes.ramp(start=start, slope=math.radians(25)))
    reach, limit = towards(look(noisy(frame.disparity, 0.1), roll=0).free_range, 0)
    assert limit == Limit.SLOPE
    assert reach == pytest.approx(start, abs=0.5)


def test_bank_that_is_still_a_way_does_not_end_it(shot: Shot, noisy: Noisy, look: Look) -> None:
    frame = shot(scenes.ramp(start=2.5, slope=math.radians(12)))
    reach, limit = towards(look(noisy(frame.disparity, 0.1), roll=0).free_range, 0)
    assert limit != Limit.SLOPE
    assert reach > 5.0
