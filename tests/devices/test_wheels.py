"""Two wheels: motion to counts and back, odometry, encoder counters that wrap."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.devices.wheels import Odometry, Pose, Rolled, Wheels
from bearcub.errors import ConfigError

METRE = Wheels(radius=0.5 / math.pi, track=0.5, counts=1000)  # 1000 counts per metre


def test_a_left_bend_turns_the_right_wheel_faster() -> None:
    assert METRE.rates(1.0, 0.4) == pytest.approx((900.0, 1100.0))


def test_a_mirrored_motor_counts_backwards_when_it_drives_ahead() -> None:
    mirrored = Wheels(radius=0.5 / math.pi, track=0.5, counts=1000, right_sign=-1)
    assert mirrored.rates(1.0, 0.0) == pytest.approx((1000.0, -1000.0))
    assert mirrored.motion(1000.0, -1000.0) == pytest.approx((1.0, 0.0))


@given(v=st.floats(-3, 3), omega=st.floats(-3, 3))
def test_rates_and_motion_are_inverse(v: float, omega: float) -> None:
    assert METRE.motion(*METRE.rates(v, omega)) == pytest.approx((v, omega), abs=1e-9)


@given(v=st.floats(-5, 5), omega=st.floats(-5, 5))
def test_limiting_keeps_every_wheel_under_the_limit_and_the_bend(v: float, omega: float) -> None:
    slow_v, slow_omega = METRE.limited(v, omega, speed=0.8)
    assert max(abs(r) for r in METRE.rates(slow_v, slow_omega)) <= 800 + 1e-6
    assert slow_v * omega == pytest.approx(v * slow_omega, abs=1e-9)


def test_a_full_circle_ends_where_it_began() -> None:
    odometry, radius = Odometry(track=0.5), 2.0
    for step in range(101):
        turned = 2 * math.pi * step / 100
        odometry.update((radius - 0.25) * turned, (radius + 0.25) * turned)
    assert (odometry.pose.x, odometry.pose.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert odometry.pose.yaw == pytest.approx(0.0, abs=1e-9)


def test_half_a_circle_to_the_left_ends_two_radii_to_the_left() -> None:
    end = Pose().moved(math.pi * 2.0, math.pi)
    assert (end.x, end.y) == pytest.approx((0.0, 4.0), abs=1e-12)


def test_a_counter_that_wraps_goes_on() -> None:
    rolled = Rolled(METRE)
    rolled.update(2**31 - 500, 0)
    rolled.update(-(2**31) + 500, 0)
    assert (rolled.left, rolled.right) == pytest.approx((1.0, 0.0))


def test_a_counter_that_was_reset_moves_nothing() -> None:
    rolled = Rolled(METRE)
    rolled.update(0, 0)
    rolled.update(2000, 2000)
    rolled.restart()
    rolled.update(0, 0)
    assert (rolled.left, rolled.right) == pytest.approx((2.0, 2.0))


@pytest.mark.parametrize("wrong", [{"radius": 0.0}, {"track": -1.0}, {"left_sign": 0}])
def test_impossible_wheels_are_refused_by_name(wrong: dict[str, float]) -> None:
    (name,) = wrong
    with pytest.raises(ConfigError, match=rf"wheels\.{name}"):
        Wheels(**{"radius": 0.1, "track": 0.5, "counts": 1000, **wrong})  # type: ignore[arg-type]
