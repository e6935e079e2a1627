"""Tilt from raw accelerations and rates: right at rest, in motion, and while the robot drives."""

import math
from collections.abc import Callable

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.protocols import Reading
from bearcub.devices.stream import Streaming
from bearcub.devices.tilt.complementary import (
    AT_REST,
    GRAVITY,
    Acceleration,
    Complementary,
    Fused,
    OwnAcceleration,
)
from bearcub.devices.tilt.mip import MipInertial
from bearcub.devices.tilt.vectornav import VectorNavInertial
from bearcub.devices.tilt.xsens import XsensInertial
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.tilt.attitude import inertial, rocking
from bearcub.emulators.tilt.mip import MipEmulator
from bearcub.emulators.tilt.vectornav import VectorNavEmulator
from bearcub.emulators.tilt.xsens import XsensEmulator
from bearcub.messages import Inertial, Tilt, WheelState

STEP = 0.02


def at_rest(pitch: float = 0.0, roll: float = 0.0) -> Inertial:
    return inertial(lambda _: Tilt(pitch=pitch, roll=roll), 0)


def wheels(seconds: float, *, speed: float, turn_rate: float = 0.0) -> Reading[WheelState]:
    state = WheelState(left=0.0, right=0.0, speed=speed, turn_rate=turn_rate, enabled=True)
    return Reading(value=state, stamp_ns=round(seconds * 1e9), age=0.0, fresh=True, count=1)


@pytest.mark.parametrize(("pitch", "roll"), [(0.1, 0.0), (0.0, -0.2), (0.3, 0.4), (-1.2, 3.0)])
def test_the_first_reading_gives_the_tilt_at_rest(pitch: float, roll: float) -> None:
    tilt = Complementary().update(at_rest(pitch, roll), dt=0.0)
    assert (tilt.pitch, tilt.roll) == pytest.approx((pitch, roll), abs=1e-9)


def test_the_filter_follows_a_rocking_robot_better_than_half_a_tenth_of_a_degree() -> None:
    follower = Complementary()
    worst = 0.0
    for step in range(500):
        now_ns = round(step * STEP * 1e9)
        tilt, truth = follower.update(inertial(rocking, now_ns), dt=STEP), rocking(now_ns)
        worst = max(worst, abs(tilt.pitch - truth.pitch), abs(tilt.roll - truth.roll))
    assert math.degrees(worst) < 0.05


def test_a_biased_gyro_costs_its_bias_times_the_time_constant() -> None:
    follower = Complementary(tau=1.0)
    biased = Inertial(acceleration=(0.0, 0.0, GRAVITY), rate=(0.0, 0.01, 0.0))
    for _ in range(1000):
        tilt = follower.update(biased, dt=STEP)
    assert tilt.pitch == pytest.approx(0.01 * 1.0, rel=0.03)


def test_own_acceleration_tilts_a_naive_filter_by_three_degrees_and_this_one_not() -> None:
    braking = Inertial(acceleration=(-0.5, 0.0, GRAVITY), rate=(0.0, 0.0, 0.0))
    naive, aware = Complementary(), Complementary()
    for _ in range(500):
        wrong = naive.update(braking, dt=STEP)
        right = aware.update(braking, dt=STEP, own=Acceleration(ahead=-0.5))
    assert math.degrees(wrong.pitch) == pytest.approx(2.92, abs=0.01)  # atan(0.5 / 9.81)
    assert right.pitch == 0.0


def test_a_bend_is_told_from_a_roll() -> None:
    bend = Inertial(acceleration=(0.0, 1.0, GRAVITY), rate=(0.0, 0.0, 0.5))  # to the left
    tilt = Complementary().update(bend, dt=0.0, own=Acceleration(left=1.0))
    assert tilt.roll == 0.0
    assert math.degrees(Complementary().update(bend, dt=0.0).roll) == pytest.approx(5.8, abs=0.05)


def test_a_jolt_is_left_to_the_gyro() -> None:
    follower = Complementary(gate=1.0)
    follower.update(at_rest(), dt=0.0)
    jolt = Inertial(acceleration=(5.0, 0.0, 15.0), rate=(0.1, 0.2, 0.0))
    tilt = follower.update(jolt, dt=0.1)
    assert (tilt.pitch, tilt.roll) == pytest.approx((0.02, 0.01))


def test_after_a_gap_it_starts_anew() -> None:
    follower = Complementary(tau=1.0)
    follower.update(at_rest(pitch=0.5), dt=0.0)
    assert follower.update(at_rest(pitch=-0.5), dt=1.5).pitch == pytest.approx(-0.5)


def test_roll_goes_on_past_upside_down() -> None:
    follower = Complementary()
    follower.update(at_rest(roll=3.1), dt=0.0)
    turning = Inertial(acceleration=(9.0, 9.0, 9.0), rate=(1.0, 0.0, 0.0))
    assert follower.update(turning, dt=0.1).roll == pytest.approx(3.2 - math.tau)


def test_the_wheels_tell_acceleration_and_bend_and_nothing_when_they_are_stale() -> None:
    readings: list[Reading[WheelState] | None] = [
        None,
        wheels(0.0, speed=0.0),
        *(wheels(0.1 * n, speed=0.1 * n, turn_rate=0.5) for n in range(1, 20)),
    ]
    given = iter([*readings, None])
    own = OwnAcceleration(lambda: next(given), smoothing=0.1)
    found = [own() for _ in readings]
    assert found[0] == AT_REST
    assert found[2].ahead == pytest.approx(0.5)  # half of the first change at once
    assert found[-1].ahead == pytest.approx(1.0, abs=1e-4)
    assert found[-1].left == pytest.approx(1.9 * 0.5)
    assert own() == AT_REST


def test_one_reading_asked_for_twice_changes_nothing() -> None:
    given = iter([wheels(0.0, speed=0.0), wheels(0.1, speed=0.1), wheels(0.1, speed=0.1)])
    own = OwnAcceleration(lambda: next(given))
    own()
    assert own() == own()


@pytest.mark.parametrize(
    ("emulator", "driver", "rate_hz"),
    [
        (VectorNavEmulator, VectorNavInertial, 40.0),
        (MipEmulator, MipInertial, 50.0),
        (XsensEmulator, XsensInertial, 50.0),
    ],
)
def test_raw_values_of_each_imu_become_the_tilt(
    emulator: Callable[[], Emulator],
    driver: Callable[[], VectorNavInertial | MipInertial | XsensInertial],
    rate_hz: float,
) -> None:
    clock = ManualClock()
    link = DirectLink(emulator(), clock=clock, wait=clock.advance)
    fused = Fused(driver(), clock=clock)
    source: Streaming[Tilt] = Streaming(link, fused, clock=clock, rate_hz=rate_hz, role="imu")
    while clock.now_ns() < 3e9:
        clock.advance(source.step() or 1e-6)
    reading = source.latest()
    assert reading is not None
    truth = rocking(reading.stamp_ns)
    assert source.health().good
    assert math.degrees(abs(reading.value.pitch - truth.pitch)) < 0.1
    assert math.degrees(abs(reading.value.roll - truth.roll)) < 0.1
    source.close()
