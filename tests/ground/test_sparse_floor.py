"""Where a matcher finds things and little of the floor around them, the floor goes on as it was."""

import numpy as np
import pytest

from bearcub.geometry import Attitude, Float64, Projection
from bearcub.ground.profile import Profile, follow_floor
from bearcub.messages import Float32
from bearcub.stereo.native import reason_missing

LENS = Projection(fx=386.0, fy=386.0, cx=319.5, cy=239.5, baseline=0.12)
HEIGHT, PITCH = 1.2, 0.1
FAR = 8.0  # level beyond which little of the floor is matched [px]: 5.8 m
COMPILED = pytest.param(True, marks=pytest.mark.skipif(bool(reason_missing()), reason="no core"))


@pytest.fixture
def plane() -> Float64:
    """Return the floor's plane."""
    return LENS.plane(height=HEIGHT, down=Attitude(pitch=PITCH, roll=0.0).down())


def dark_view(plane: Float64, *, slope: float = 0.0, noise: float = 0.15) -> Float32:
    """Return a floor that is matched by patches beyond `FAR`, with two boards there at 6 px.

    One that climbs by `slope` from 3 m on has no boards.
    """
    random = np.random.default_rng(1)
    u, v = np.arange(640)[None, :], np.arange(480)[:, None]
    level = plane[0] * u + plane[1] * v + plane[2]
    floor = np.maximum(level, climbing(level, slope))
    d = floor + random.normal(0.0, noise, floor.shape)
    patches = np.kron(random.random((20, 32)) < 0.7, np.ones((24, 20), dtype=bool))
    d[(level < FAR) & patches | (level < 1.0)] = np.nan
    if slope == 0.0:
        for left in (240, 350):
            board = np.s_[210:260, left : left + 60]
            d[board] = np.maximum(6.0 + random.normal(0.0, noise, (50, 60)), floor[board])
    view: Float32 = d.astype(np.float32)
    return view


def climbing(level: Float64, slope: float) -> Float64:
    """Return the disparity where the plane has `level`: at range D / d it is s (D / d - 3) high."""
    depth = LENS.fx * LENS.baseline
    climb: Float64 = (HEIGHT * level + slope * depth) / (HEIGHT + 3.0 * slope)
    return climb


def followed(d: Float32, plane: Float64, *, compiled: bool) -> Profile:
    steepest = float(np.radians(26.0))
    return follow_floor(
        d,
        LENS,
        plane,
        noise=0.3,
        height=HEIGHT,
        pitch=PITCH,
        steepest=steepest,
        compiled=compiled,
    )


@pytest.mark.parametrize("compiled", [COMPILED, False])
def test_boards_do_not_lift_the_floor_around_them(plane: Float64, *, compiled: bool) -> None:
    profile = followed(dark_view(plane), plane, compiled=compiled)
    far = profile.knots < 6.0  # the boards stand up to 1.5 px above it
    assert far.any()
    assert np.abs(profile.bend[far]).max() < 0.25


@pytest.mark.parametrize("compiled", [COMPILED, False])
def test_ground_that_climbs_is_still_followed(plane: Float64, *, compiled: bool) -> None:
    slope = 0.15
    profile = followed(dark_view(plane, slope=slope), plane, compiled=compiled)
    far = profile.knots < FAR
    true = climbing(profile.knots, slope) - profile.knots
    assert profile.bend[far] == pytest.approx(true[far], abs=0.5)


@pytest.mark.parametrize("compiled", [COMPILED, False])
def test_floor_is_never_so_noisy_that_a_thing_drowns(plane: Float64, *, compiled: bool) -> None:
    profile = followed(dark_view(plane, noise=2.0), plane, compiled=compiled)
    assert profile.noise.max() == pytest.approx(0.75)
