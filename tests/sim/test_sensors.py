"""Sensors are wrong in the ways they say, and the same way for the same seed."""

import math

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.sim.sensors import (
    GpsModel,
    GpsSensor,
    LadarModel,
    TiltModel,
    TiltSensor,
    WheelModel,
    WheelSensor,
)


def _tilts(model: TiltModel, seed: int, count: int = 400) -> np.ndarray:
    sensor = TiltSensor(model, seed=seed)
    readings = []
    for step in range(count):
        sensor.feel(0.02 * step, Attitude(roll=0.1, pitch=-0.05))
        reading = sensor.read(0.02 * step)
        readings.append((reading.pitch, reading.roll))
    return np.array(readings)


def test_tilt_sensor_has_its_noise_about_a_constant_bias() -> None:
    model = TiltModel(noise=math.radians(0.4), bias=math.radians(2.0))
    off = _tilts(model, seed=5) - [-0.05, 0.1]
    # the deviation of 400 readings is known to 3.5 %, their mean to a twentieth of it
    np.testing.assert_allclose(off.std(axis=0), math.radians(0.4), rtol=0.15)
    bias = np.degrees(off.mean(axis=0))
    assert (np.abs(bias) <= 2.1).all()
    other = np.degrees((_tilts(model, seed=6) - [-0.05, 0.1]).mean(axis=0))
    assert np.abs(other - bias).max() > 0.2


def test_tilt_sensor_says_what_was_true_a_lag_ago() -> None:
    sensor = TiltSensor(TiltModel(lag=0.05, noise=0.0, bias=0.0), seed=0)
    for step in range(101):
        sensor.feel(0.01 * step, Attitude(roll=0.02 * step, pitch=0.0))
    assert sensor.read(1.0).roll == pytest.approx(0.02 * 95)


def test_ladar_rounds_and_marks_what_it_cannot_measure() -> None:
    model = LadarModel(sigma=0.0, lost=0.0)
    angles = np.linspace(-1, 1, 5)
    ranges = np.array([0.02, 1.234, 7.999, 8.2, np.inf])
    scan = model.measured(ranges, angles, np.random.default_rng(0))
    np.testing.assert_allclose(scan.ranges, [-np.inf, 1.23, 8.0, np.inf, np.inf], rtol=1e-6)
    assert (scan.nearest, scan.farthest) == (0.05, 8.0)


def test_ladar_loses_its_share_of_beams_and_has_its_noise() -> None:
    model = LadarModel(sigma=0.01, quantum=1e-6, lost=0.1)
    ranges = np.full(5000, 3.0)
    scan = model.measured(ranges, np.linspace(-1, 1, 5000), np.random.default_rng(1))
    assert np.isnan(scan.ranges).mean() == pytest.approx(0.1, abs=0.02)
    assert np.nanstd(scan.ranges) == pytest.approx(0.01, rel=0.05)


def test_wheels_count_in_steps_and_are_wrong_by_their_radius() -> None:
    model = WheelModel(counts_per_metre=100.0, scale=0.0)
    sensor = WheelSensor(model, track=0.5, seed=0)
    sensor.read(0.0, 0.0, 0.0)
    state = sensor.read(0.5, 0.204, 0.297)
    # 20 and 30 counts in half a second: 0.4 and 0.6 m/s, 0.2 m/s apart on 0.5 m
    assert (state.left, state.right) == pytest.approx((0.2, 0.3))
    assert state.speed == pytest.approx(0.5)
    assert state.turn_rate == pytest.approx(0.4)
    worn = WheelSensor(WheelModel(scale=0.01), track=0.5, seed=3).read(0.0, 100.0, 100.0)
    assert 0 < abs(worn.left - 100) <= 1.001
    assert worn.left != worn.right


def test_gps_wanders_about_the_true_place() -> None:
    model = GpsModel(noise=0.02, wander=0.5, correlation=10.0)
    sensor = GpsSensor(model, seed=4)
    fixes = [sensor.read(0.2 * step, 3.0, -4.0) for step in range(3000)]
    off = np.array([model.origin.position(fix)[:2] for fix in fixes]) - [3.0, -4.0]
    # 600 s hold 30 independent values: the mean is known to 0.1 m, the deviation to 15 %
    assert np.abs(off.mean(axis=0)).max() < 0.35
    np.testing.assert_allclose(off.std(axis=0), 0.5, rtol=0.4)
    steps = np.diff(off, axis=0).std(axis=0)
    # white noise of two fixes, and what 0.2 s of 10 s change: 0.5 sqrt(2 (1 - exp(-0.02)))
    np.testing.assert_allclose(steps, math.hypot(0.02 * math.sqrt(2), 0.0995), rtol=0.1)


def test_gps_without_error_is_where_it_is() -> None:
    model = GpsModel(noise=0.0, wander=0.0)
    fix = GpsSensor(model, seed=0).read(0.0, 250.0, -1200.0)
    np.testing.assert_allclose(model.origin.position(fix)[:2], [250.0, -1200.0], atol=1e-4)


def test_the_same_seed_makes_the_same_errors() -> None:
    np.testing.assert_array_equal(_tilts(TiltModel(), 9, 20), _tilts(TiltModel(), 9, 20))
    first, second = (GpsSensor(GpsModel(), seed=2).read(0.0, 1.0, 2.0) for _ in range(2))
    assert first == second
