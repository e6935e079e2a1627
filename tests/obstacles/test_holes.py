"""Pits and drops are found; noise, reflections and single columns are none."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from bearcub.messages import Answer, Float32, Pixel
from bearcub.obstacles.holes import sight_limit
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes
from bearcub.sim.world import Ground, Scene, Thing

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]
Crate = Callable[..., Thing]


@pytest.mark.parametrize(("distance", "y"), [(2.0, 0.0), (2.5, 0.0), (2.5, -0.7), (3.0, 0.4)])
def test_pit_is_found_with_its_place_and_size(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, distance: float, y: float
) -> None:
    frame = shot(scenes.pit(distance=distance, width=0.8, length=0.6, depth=0.3, y=y), by=rig)
    answer = look(noisy(frame.disparity, 0.1), by=rig)
    assert answer.obstacles == ()
    (hole,) = answer.holes
    truth = frame.truth["holes"][0]
    assert hole.kind == "pit"
    assert hole.distance == pytest.approx(truth["distance"], abs=0.1)
    assert math.degrees(hole.bearing) == pytest.approx(truth["bearing_deg"], abs=1.0)
    # seen are the far wall and bottom, whose rim noise hides: a little less than the mouth
    assert hole.width == pytest.approx(0.8, abs=0.1)
    assert hole.length == pytest.approx(0.6, abs=0.15)
    # no line of sight over the near lip meets the far wall deeper than `depth_seen`
    assert 0.5 * truth["depth_seen"] < hole.depth < 1.1 * truth["depth_seen"]
    if hole.depth < 0.3 - 4 * hole.sigma_depth:
        assert hole.depth_is_lower_bound
    assert 0 < hole.confidence <= 1


def test_depth_of_a_shallow_pit_is_its_bottom(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    frame = shot(scenes.pit(distance=1.9, width=1.0, length=1.4, depth=0.25), by=rig)
    (hole,) = look(noisy(frame.disparity, 0.1), by=rig).holes
    assert hole.depth == pytest.approx(0.25, abs=0.03)
    assert hole.length == pytest.approx(1.4, abs=0.15)
    assert not hole.depth_is_lower_bound


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


def test_ground_that_ends_unseen_is_not_invented_to_be_a_hole(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    frame = shot(scenes.floor())
    disparity = noisy(frame.disparity)
    disparity[:190] = np.nan  # no match beyond 2.3 m
    answer = look(disparity)
    assert answer.ground.seen
    assert answer.holes == ()


def test_hole_in_one_column_alone_is_none(shot: Shot, noisy: Noisy, look: Look) -> None:
    """The far wall of a pit left in one image column only, flat floor in all others."""
    pit, flat = shot(scenes.pit(distance=2.0)), shot(scenes.floor())
    assert len(look(noisy(pit.disparity, 0.1)).holes) == 1
    columns = np.unique(np.nonzero(pit.labels == -1)[1])
    middle = int(columns[len(columns) // 2])
    disparity = flat.disparity.copy()
    disparity[:, middle] = pit.disparity[:, middle]
    answer = look(noisy(disparity, 0.1))
    assert answer.holes == ()
    assert not (answer.layers.kind == Pixel.HOLE).any()


@pytest.mark.parametrize("height", [0.4, 0.6, 1.5, 2.0])
def test_reflection_in_a_shiny_floor_is_no_hole(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate, height: float
) -> None:
    """What mirrors a crate upside down below its foot has the disparity of a pit there."""
    thing = Scene(
        ground=Ground(texture=scenes.TILES), things=(crate(3.0, 0.0, width=0.8, height=height),)
    )
    mirrored = crate(3.0, 0.0, width=0.8, height=height, bottom=-height)
    frame = shot(thing)
    below = shot(
        Scene(ground=Ground(texture=scenes.TILES, pieces=((-9.0, -9.0, 0.0),)), things=(mirrored,))
    )  # the crate hanging under a floor that is gone
    image = (frame.labels == 0) & (below.labels == 1)
    assert np.count_nonzero(image) > 300
    disparity = np.where(image, below.disparity, frame.disparity)
    answer = look(noisy(disparity, 0.1))
    assert answer.holes == ()
    assert len(answer.obstacles) == 1


@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3])
def test_flat_noisy_floor_has_no_hole(shot: Shot, noisy: Noisy, look: Look, sigma: float) -> None:
    frame = shot(scenes.floor(), roll=4)
    for seed in range(10, 14):
        assert look(noisy(frame.disparity, sigma, seed=seed)).holes == ()


def test_pit_deeper_than_the_sight_says_that_its_depth_is_a_lower_bound(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    frame = shot(scenes.pit(distance=2.2, width=0.8, length=0.5, depth=2.0), by=rig)
    (hole,) = look(noisy(frame.disparity, 0.1), by=rig).holes
    assert hole.depth_is_lower_bound
    assert hole.depth < 1.1 * frame.truth["holes"][0]["depth_seen"]


def test_sight_of_a_hole_ends_where_it_covers_too_few_rows() -> None:
    # f h w / (R (R + w)) = 386 * 1.2 * 0.6 / (6.5 * 7.1) = 6.02 rows
    assert sight_limit(386.0, 1.2, length=0.6, rows=6) == pytest.approx(6.5, abs=0.02)
    assert sight_limit(772.0, 1.2, length=0.6, rows=6) > 9.0


def test_pit_that_the_images_lower_border_cuts_is_told_and_ends_the_way(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    # the lowest row sees the floor at 1.55 m, beyond the pit's near lip
    frame = shot(scenes.pit(distance=1.2, length=0.9, width=0.8, depth=0.4), by=rig)
    answer = look(noisy(frame.disparity, 0.2), by=rig)
    (hole,) = answer.holes
    assert hole.truncated == ("bottom",)
    assert hole.distance == pytest.approx(1.55, abs=0.05)
    assert hole.width == pytest.approx(0.8, abs=0.1)
    told = answer.to_dict()
    assert told["holes"][0]["sigma"]["length"] is None
    ahead = [way for way in told["free_range"] if abs(way["bearing_deg"]) < 8]
    assert {way["limit"] for way in ahead} == {"hole"}
    assert all(way["range"] < 1.7 for way in ahead)


def test_descent_just_in_sight_is_no_drop(shot: Shot, noisy: Noisy, look: Look, rig: Rig) -> None:
    # the line of sight falls by 22 deg at 3 m, the way by 12
    frame = shot(scenes.ramp(start=3.0, slope=math.radians(-12.0)), by=rig)
    assert look(noisy(frame.disparity, 0.2), by=rig, roll=0).holes == ()
