"""The floor as a picture, straight and bent, and what is told to lie on it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bearcub.ground import floor_disparity
from bearcub.ground.profile import follow_floor
from bearcub.ground.surface import Surface
from bearcub.messages import Answer, Float32, Float64, Ground, Pixel
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]


@pytest.fixture
def tilted(sure_ground: Ground) -> Ground:
    """Return ground of ten rows per level, horizon at row 2, tilted by a level in 40 columns."""
    return replace(sure_ground, plane=np.array([0.025, 0.1, -0.2]))


def test_straight_floor_is_its_plane_at_every_pixel(tilted: Ground) -> None:
    floor = floor_disparity(tilted, (60, 40))
    assert floor.shape == (60, 40)
    assert floor.dtype == np.float32
    assert floor[0, 0] == pytest.approx(-0.2)  # above the horizon
    assert floor[2, 0] == pytest.approx(0.0, abs=1e-6)
    assert floor[52, 0] == pytest.approx(5.0, abs=1e-5)
    assert floor[52, 20] == pytest.approx(5.5, abs=1e-5)


def test_bend_is_added_by_the_planes_own_disparity_and_linear_between_knots(
    tilted: Ground,
) -> None:
    bent = replace(
        tilted,
        knots=np.array([1.0, 3.0, 5.0]),
        bend=np.array([1.0, 0.0, 0.0]),
        knot_noise=np.array([0.3, 0.2, 0.2]),
    )
    flat = replace(tilted, plane=np.array([0.0025, 0.01, -0.02]))  # a hundred rows per level
    bent = replace(bent, plane=flat.plane)
    added = floor_disparity(bent, (600, 40)) - floor_disparity(flat, (600, 40))
    # rows 102, 202, 302, 502 of column 0 are levels 1, 2, 3, 5; knots may be rounded off
    np.testing.assert_allclose(added[[102, 202, 302, 502], 0], [1.0, 0.5, 0.0, 0.0], atol=0.06)
    # level 2 lies 10 rows higher 40 columns to the right
    assert added[192, 39] == pytest.approx(0.5, abs=0.06)
    assert 0 <= added[12, 0] <= 1.0  # farther than the last knot: no more than there


def test_lift_is_the_height_of_the_floor_where_it_has_a_disparity(tilted: Ground) -> None:
    # a floor of 6 px where the plane has 5 px lies 1.2 (1 - 5 / 6) = 0.2 m higher: a step up
    bent = replace(
        tilted,
        knots=np.array([1.0, 5.0, 6.0, 8.0]),
        bend=np.array([0.2, 1.0, 0.0, 0.0]),
        knot_noise=np.full(4, 0.2),
    )
    surface = Surface.of(bent, (600, 400))
    assert surface.lift(5.9) == pytest.approx(0.2, abs=0.01)
    assert surface.lift(6.0) == pytest.approx(0.0, abs=0.01)  # at its face, the floor before it
    assert surface.lift(8.0) == pytest.approx(0.0, abs=0.01)
    assert surface.lift(0.0) == 0.0
    assert Surface.of(tilted, (600, 400)).lift(5.0) == pytest.approx(0.0, abs=1e-6)


def bends(frame: Rendered, rig: Rig, plane: Float64) -> tuple[Float64, Float64]:
    """Return the followed profile's knots and bends over the level floor's exact plane."""
    profile = follow_floor(
        frame.disparity,
        rig.camera.projection,
        plane,
        noise=0.1,
        height=rig.mount.height,
        pitch=rig.mount.pitch,
        steepest=np.radians(20),
    )
    return profile.knots, profile.bend


@pytest.fixture
def level(rig: Rig) -> Float64:
    """Return the level floor's plane."""
    return rig.camera.projection.plane(height=rig.mount.height, down=rig.mount.attitude.down())


def test_profile_of_a_flat_floor_has_no_bend(shot: Shot, rig: Rig, level: Float64) -> None:
    knots, bend = bends(shot(scenes.floor()), rig, level)
    assert len(knots) > 10
    assert (np.diff(knots) > 0).all()
    np.testing.assert_allclose(bend, 0, atol=1e-3)


@pytest.mark.parametrize("slope", [-8.0, -5.0, 5.0, 10.0, 15.0])
def test_profile_follows_a_ramp(shot: Shot, rig: Rig, level: Float64, slope: float) -> None:
    frame = shot(scenes.ramp(start=3.0, slope=np.radians(slope)))
    knots, bend = bends(frame, rig, level)
    rows = np.arange(160, 240)  # from 1.55 m ahead to well on the ramp
    plane = level[1] * rows + level[0] * 160 + level[2]
    followed = plane + np.interp(plane, knots, bend)
    true = frame.disparity[rows, 160]
    # a bin is a twelfth of its level wide, over which the ramp's own bend changes
    np.testing.assert_allclose(followed, true, atol=0.25)
    assert np.abs(true - plane).max() > 0.25  # there is something to follow


def test_profile_does_not_climb_a_wall(shot: Shot, rig: Rig, level: Float64) -> None:
    knots, bend = bends(shot(scenes.wall(distance=3.0)), rig, level)
    # the wall stands at 193 * 0.12 / (3 cos 5.9 deg ...) = 7.5 px; the floor beyond is not bent up
    assert bend.max() < 0.5
    assert np.abs(bend[knots > 8.0]).max() < 0.1


@pytest.mark.parametrize("sigma", [0.05, 0.1, 0.2, 0.3, 0.4])
def test_tolerance_grows_with_the_noise_so_that_floor_stays_floor(
    shot: Shot, noisy: Noisy, look: Look, sigma: float
) -> None:
    frame = shot(scenes.floor())
    kind = look(noisy(frame.disparity, sigma)).layers.kind
    near = (frame.labels == 0) & (frame.disparity > 2)
    # three sigmas leave 0.3 % of a Gaussian outside
    assert (kind[near] == Pixel.FLOOR).mean() > 0.99


def test_tolerance_shrinks_with_the_noise_so_that_low_things_show(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    """10 cm at 2.5 m are 0.75 px: more than seven sigmas of 0.1 px, less than three of 0.3 px."""
    frame = shot(scenes.small_box(distance=2.5))
    box = frame.labels == 1
    taken_for_floor = [
        (look(noisy(frame.disparity, sigma)).layers.kind[box] == Pixel.FLOOR).mean()
        for sigma in (0.1, 0.3)
    ]
    assert taken_for_floor[0] < 0.7
    assert taken_for_floor[1] > 0.9
