"""Light adds up, and every preset is a light one can see by."""

import math

import numpy as np
import pytest

from bearcub.sim.light import HAZE, PRESETS, SIGHT, SKYLIGHT, SUNLIGHT, Light

SUN = (-0.55, 0.52, 0.65)


def test_a_clear_day_leaves_the_sun_where_the_scene_has_it() -> None:
    np.testing.assert_allclose(Light().towards_sun((3.0, 0.0, 4.0)), [0.6, 0.0, 0.8])


def test_azimuth_turns_left_from_ahead_and_elevation_up() -> None:
    light = Light(azimuth=math.radians(90), elevation=math.radians(30))
    np.testing.assert_allclose(light.towards_sun(SUN), [0, math.sqrt(0.75), 0.5], atol=1e-12)


def test_falling_light_is_sun_and_sky_times_exposure() -> None:
    light = Light(strength=0.5, ambient=2.0, exposure=3.0)
    fallen = light.falling(np.array([0.0, 1.0]), np.array([1.0, 0.5]))
    expected = np.hstack([6.0 * SKYLIGHT, 1.5 * SUNLIGHT + 3.0 * SKYLIGHT])
    np.testing.assert_allclose(fallen, expected, rtol=1e-6)


def test_haze_swallows_63_percent_of_a_colour_at_the_limit_of_sight() -> None:
    black = np.zeros((3, 2), dtype=np.float32)
    away = np.array([[0.0, SIGHT], [0.0, 0.0], [0.0, 0.0]], dtype=np.float32)
    seen = Light().through_haze(black, away)
    np.testing.assert_allclose(seen[:, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(seen[:, 1], HAZE[:, 0] * (1 - math.exp(-1)), rtol=1e-5)


@pytest.mark.parametrize("name", PRESETS)
def test_grey_ground_is_neither_black_nor_white_in_any_preset(name: str) -> None:
    light = PRESETS[name]
    up = light.towards_sun(SUN)[2]
    fallen = 0.3 * light.falling(np.array([up]), np.array([1.0]))
    assert 0.02 < fallen.min() <= fallen.max() < 0.9


def test_clouds_make_the_sky_grey_from_horizon_to_zenith() -> None:
    upward = np.array([0.0, 1.0])
    clear, covered = Light().sky(upward), Light(cloud=1.0).sky(upward)
    assert clear[0, 1] > 4 * clear[2, 1]  # blue overhead
    np.testing.assert_allclose(covered, HAZE.mean(), rtol=1e-6)


def test_dusk_is_darker_than_low_sun_and_overcast_has_no_shadows() -> None:
    level = np.array([1.0])
    light = {
        name: float(preset.falling(level * preset.towards_sun(SUN)[2], level).mean())
        for name, preset in PRESETS.items()
    }
    assert light["dusk"] < 0.4 * light["low_sun"]
    assert not PRESETS["overcast"].shadows
    assert PRESETS["overcast"].strength == 0.0
