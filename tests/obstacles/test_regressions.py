"""What once went wrong: ramps, drops, far things, limits of the free range."""

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


def towards(way: FreeRange, bearing: float) -> tuple[float, Limit]:
    """Return range [m] and limit in the direction nearest to `bearing` [deg]."""
    index = int(np.argmin(np.abs(np.degrees(way.bearing) - bearing)))
    return float(way.range[index]), way.limit[index]


def test_pit_ends_the_way_at_its_near_lip(shot: Shot, noisy: Noisy, look: Look, rig: Rig) -> None:
    frame = shot(scenes.pit(distance=2.2, width=1.0), by=rig)
    way = look(noisy(frame.disparity, 0.1), by=rig).free_range
    for bearing in (-6.0, 0.0, 6.0):
        reach, limit = towards(way, bearing)
        assert limit == Limit.HOLE
        assert reach == pytest.approx(2.2 / math.cos(math.radians(bearing)), abs=0.15)
    assert towards(way, 30)[1] == Limit.UNSEEN


def test_no_floor_in_view_leaves_the_range_unknown(shot: Shot, noisy: Noisy, look: Look) -> None:
    disparity = np.full((240, 320), np.nan, dtype=np.float32)
    disparity[:60] = 0.5
    answer = look(disparity)
    told = answer.to_dict()["free_range"]
    assert {entry["limit"] for entry in told} == {"unseen"}
    assert {entry["range"] for entry in told} == {None}


@pytest.mark.parametrize(("distance", "depth"), [(4.0, 1.0)])
def test_edge_of_a_loading_dock_is_a_drop(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, distance: float, depth: float
) -> None:
    frame = shot(scenes.drop(distance=distance, depth=depth), by=rig)
    answer = look(noisy(frame.disparity, 0.1), by=rig)
    assert answer.obstacles == ()
    (hole,) = answer.holes
    assert hole.kind == "drop"
    assert hole.distance == pytest.approx(distance, abs=0.1)
    assert hole.width > 0.85 * frame.truth["holes"][0]["width"]
    told = answer.to_dict()["holes"][0]
    assert told["length"] is None
    assert told["sigma"]["length"] is None
    assert told["depth_is_lower_bound"]


@pytest.mark.parametrize("slope", [-10.0, -5.0])
@pytest.mark.parametrize("tilt", [None, 0.0])
def test_descent_that_begins_close_ahead_is_floor(
    shot: Shot, noisy: Noisy, look: Look, slope: float, tilt: float | None
) -> None:
    pieces = ((2.0, 0.0, math.tan(math.radians(slope))), (5.0, 0.0, 0.0))
    frame = shot(Scene(ground=Ground(texture=scenes.ASPHALT, pieces=pieces)))
    answer = look(noisy(frame.disparity, 0.2), roll=tilt)
    assert answer.obstacles == ()
    assert answer.holes == ()


@pytest.mark.parametrize("slope", [-8.5, 5.0, 8.5, 12.0])
def test_slope_is_the_mean_from_1_5_to_5_m(
    shot: Shot, noisy: Noisy, look: Look, slope: float
) -> None:
    frame = shot(scenes.ramp(start=3.0, slope=math.radians(slope)))
    terrain = look(noisy(frame.disparity, 0.2), roll=0).terrain
    true = frame.truth["terrain"]["slope_deg"]
    assert math.degrees(terrain.slope) == pytest.approx(true, abs=1.0)


@pytest.mark.parametrize("slope", [8.5, 12.0, 15.0])
@pytest.mark.parametrize("tilt", [None, 0.0])
def test_ramp_without_end_is_no_obstacle(
    shot: Shot, noisy: Noisy, look: Look, slope: float, tilt: float | None
) -> None:
    frame = shot(scenes.ramp(start=3.0, slope=math.radians(slope)))
    assert look(noisy(frame.disparity, 0.2), roll=tilt).obstacles == ()


@pytest.mark.parametrize("start", [3.0])
@pytest.mark.parametrize("slope", [-5.0, 5.0, 8.5])
def test_ground_is_the_floor_just_ahead_of_the_robot_not_a_mean_with_the_ramp(
    shot: Shot, noisy: Noisy, look: Look, start: float, slope: float
) -> None:
    frame = shot(scenes.ramp(start=start, slope=math.radians(slope)))
    ground = look(noisy(frame.disparity, 0.2), roll=0).ground
    true = frame.truth["ground"]
    assert math.degrees(ground.pitch) == pytest.approx(true["pitch_deg"], abs=1.0)
    assert ground.height == pytest.approx(true["height"], rel=0.03)


def test_wall_behind_the_floor_does_not_tilt_it(shot: Shot, noisy: Noisy, look: Look) -> None:
    frame = shot(scenes.wall(distance=3.0))
    ground = look(noisy(frame.disparity, 0.2)).ground
    assert math.degrees(ground.pitch) == pytest.approx(
        5.9, abs=4 * math.degrees(ground.sigma_pitch)
    )
    assert ground.height == pytest.approx(1.2, abs=4 * ground.sigma_height)


@pytest.mark.parametrize(("distance", "sigma"), [(5.0, 0.2), (8.0, 0.2)])
def test_standing_can_far_away_is_found_and_stands(
    shot: Shot, noisy: Noisy, look: Look, distance: float, sigma: float
) -> None:
    frame = shot(scenes.garbage_can(distance=distance, bearing=0.1))
    (thing,) = look(noisy(frame.disparity, sigma)).obstacles
    assert thing.base_height == 0.0


def test_can_half_hidden_behind_another_stands(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    _, tall = look(noisy(shot(scenes.two_cans(), by=rig).disparity), by=rig).obstacles
    assert tall.base_height == 0.0 or math.isnan(tall.base_height)


@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3])
def test_height_of_a_crate_lies_within_its_error_bar_at_any_noise(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, crate: Crate, sigma: float
) -> None:
    frame = shot(Scene(ground=Ground(texture=scenes.ASPHALT), things=(crate(2.0, 0.0),)), by=rig)
    (thing,) = look(noisy(frame.disparity, sigma), by=rig).obstacles
    assert abs(thing.height - 0.6) < 2 * thing.sigma_height


@pytest.mark.parametrize("sigma", [0.1, 0.2])
def test_lower_bound_of_a_drop_is_not_above_its_depth(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, sigma: float
) -> None:
    frame = shot(scenes.drop(distance=4.0, depth=1.0), by=rig)
    (hole,) = look(noisy(frame.disparity, sigma), by=rig).holes
    assert hole.depth < 1.0 + 3 * hole.sigma_depth


def test_limits_are_limits(shot: Shot, noisy: Noisy, look: Look) -> None:
    way = look(noisy(shot(scenes.floor()).disparity, 0.1)).free_range
    assert all(isinstance(limit, Limit) for limit in way.limit)


@pytest.mark.parametrize("sigma", [0.5, 0.7])
def test_infinitely_far_pixels_beside_the_floor_raise_no_warning(
    shot: Shot, look: Look, sigma: float
) -> None:
    disparity = shot(scenes.floor()).disparity
    noise = np.random.default_rng(0).normal(0, sigma, disparity.shape)
    look(np.maximum(disparity + noise * (disparity > 0), 0).astype(np.float32))


def test_sky_alone_raises_no_warning(look: Look) -> None:
    look(np.zeros((240, 320), dtype=np.float32))
