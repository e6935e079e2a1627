import math

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.sim import scenes
from bearcub.sim.ladar import sweep

LEVEL = Attitude(roll=0.0, pitch=0.0)


def nose_down(degrees: float) -> Attitude:
    return Attitude(roll=0.0, pitch=math.radians(degrees))


def test_wall_is_as_far_as_it_is_in_every_direction() -> None:
    scan = sweep(scenes.wall(distance=3.0), LEVEL)
    assert scan.ranges[180] == pytest.approx(3.0)
    assert scan.ranges[[90, 270]] == pytest.approx(3.0 * math.sqrt(2))
    assert math.degrees(scan.angles[90]) == pytest.approx(-45)
    # 3 m / cos(68 deg) is 8.01 m, out of reach
    assert np.isinf(scan.ranges[[0, 44, 316, 360]]).all()


def test_what_stands_to_the_left_has_a_positive_angle() -> None:
    scan = sweep(scenes.garbage_can(distance=3.05, bearing=math.radians(20)), LEVEL)
    seen = np.degrees(scan.angles[np.isfinite(scan.ranges)])
    assert seen.mean() == pytest.approx(20, abs=0.3)
    # the can's body is 6 mm thinner than its rim
    assert scan.ranges[np.isfinite(scan.ranges)].min() == pytest.approx(3.056, abs=1e-3)


def test_level_beams_pass_over_the_floor_and_tilted_ones_meet_it() -> None:
    assert np.isinf(sweep(scenes.floor(), LEVEL).ranges).all()
    scan = sweep(scenes.floor(), nose_down(3))
    assert scan.ranges[180] == pytest.approx(0.3 / math.sin(math.radians(3)))
    rolled = sweep(scenes.floor(), Attitude(roll=math.radians(12), pitch=0.0))
    # right side down: the beam to the right (-90 deg) meets the floor, that to the left the sky
    assert rolled.ranges[0] == pytest.approx(0.3 / math.sin(math.radians(12)))
    assert np.isinf(rolled.ranges[360])


def test_measured_ranges_are_in_steps_of_a_centimetre_and_repeat() -> None:
    exact, one, same, other = (sweep(scenes.wall(), LEVEL, seed=s) for s in (None, 1, 1, 2))
    np.testing.assert_array_equal(one.ranges, same.ranges)
    assert not np.array_equal(one.ranges, other.ranges, equal_nan=True)
    both = np.isfinite(exact.ranges) & np.isfinite(one.ranges)
    off = one.ranges[both] - exact.ranges[both]
    assert off.std() == pytest.approx(0.01, rel=0.25)
    steps = one.ranges[np.isfinite(one.ranges)] / 0.01
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-3)
