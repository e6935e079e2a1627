"""Ramps and other floors that are not one plane are still floors."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from bearcub.messages import Answer, Float32, Pixel
from bearcub.sim import Rendered, scenes
from bearcub.sim.world import Ground, Scene

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]

SLOPES = [-10.0, -5.0, 5.0, 8.5, 12.0, 15.0]


def ramp(slope: float, *, start: float) -> Scene:
    """Return level ground, a ramp of 3 m and level ground again."""
    pieces = ((start, 0.0, math.tan(math.radians(slope))), (start + 3.0, 0.0, 0.0))
    return Scene(ground=Ground(texture=scenes.ASPHALT, pieces=pieces))


RAMPS = [(start, slope) for start in (2.0, 3.0) for slope in SLOPES if slope > 0 or start > 2]


@pytest.mark.parametrize(("start", "slope"), RAMPS)
@pytest.mark.parametrize("tilt", [None, 0.0])
def test_ramp_is_floor_neither_obstacle_nor_hole(
    shot: Shot, noisy: Noisy, look: Look, start: float, slope: float, tilt: float | None
) -> None:
    frame = shot(ramp(slope, start=start))
    answer = look(noisy(frame.disparity, 0.2), roll=tilt)
    assert answer.obstacles == ()
    assert answer.holes == ()
    near = (frame.labels == 0) & (frame.disparity > 5)  # to 4.6 m
    assert (answer.layers.kind[near] == Pixel.FLOOR).mean() > 0.95


@pytest.mark.parametrize("slope", SLOPES)
def test_slope_of_a_ramp_is_told_in_the_bands_that_lie_on_it(
    shot: Shot, noisy: Noisy, look: Look, slope: float
) -> None:
    frame = shot(scenes.ramp(start=2.5, slope=math.radians(slope)))
    terrain = look(noisy(frame.disparity, 0.2), roll=0).terrain
    assert terrain.reference == "gravity"
    on_ramp = [band for band in terrain.profile if band.start >= 2.5 and band.end <= 4.0]
    assert len(on_ramp) >= 2
    for band in on_ramp:
        error = math.degrees(band.slope) - slope
        assert abs(error) < max(1.0, 4 * math.degrees(band.sigma)), (band.start, error)


@pytest.mark.parametrize("slope", [28.0, 30.0])
def test_floor_is_not_followed_up_a_bank(
    shot: Shot, noisy: Noisy, look: Look, slope: float
) -> None:
    """In a bin a bank rises by about 3 cm, of which noise and a step excuse one; in two by 6."""
    frame = shot(scenes.ramp(start=3.0, slope=math.radians(slope)))
    answer = look(noisy(frame.disparity, 0.15), roll=0)
    foot = 192.9 * 0.12 / 3.0  # f B / Z [px]
    assert 0.75 * foot < answer.ground.followed_to < 1.05 * foot
    assert min(thing.distance for thing in answer.obstacles) < 4.0


@pytest.mark.parametrize("slope", [-6.0, 4.0, 8.0])
def test_slope_under_the_robot_is_seen_as_its_own_attitude(
    shot: Shot, noisy: Noisy, look: Look, slope: float
) -> None:
    """A body on a slope sees a plane; only the tilt reading tells that it is inclined."""
    frame = shot(scenes.floor(), pitch=-slope)  # nose up on an ascent
    disparity = noisy(frame.disparity, 0.2)
    alone = look(disparity).terrain
    assert alone.reference == "robot"
    assert abs(math.degrees(alone.slope)) < 0.6


def test_a_floor_curved_like_a_bowl_stays_floor(shot: Shot, noisy: Noisy, look: Look) -> None:
    """Three gentle pieces, 3 deg steeper each metre."""
    bowl = tuple((1.8 + k, 0.0, math.tan(math.radians(3.0 * k + 3.0))) for k in range(3))
    pieces = (*bowl, (5.0, 0.0, 0.0))
    frame = shot(Scene(ground=Ground(texture=scenes.ASPHALT, pieces=pieces)))
    answer = look(noisy(frame.disparity, 0.2), roll=0)
    assert answer.obstacles == ()
    assert np.count_nonzero(answer.layers.kind == Pixel.HOLE) == 0
