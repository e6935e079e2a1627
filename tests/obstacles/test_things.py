"""Things on the floor: how far, at what angle, how large, how high, each within its error bar."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.messages import Answer, Float32, Obstacle, Pixel
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes
from bearcub.sim.solids import Box
from bearcub.sim.world import Ground, Scene, Thing

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]
Crate = Callable[..., Thing]

FLOOR = Ground(texture=scenes.ASPHALT)


def scene(*things: Thing) -> Scene:
    return Scene(ground=FLOOR, things=things)


def only(things: Sequence[Obstacle]) -> Obstacle:
    assert len(things) == 1, [(thing.distance, thing.pixels) for thing in things]
    return things[0]


# distance [m], bearing [deg], roll of the body [deg]
PLACES = [
    (2.0, 0.0, 0.0),
    (3.0, 5.0, 0.0),
    (3.0, -15.0, 10.0),
    (5.0, 10.0, -10.0),
    (4.0, 0.0, 15.0),
]


@pytest.mark.parametrize(("distance", "bearing", "roll"), PLACES)
def test_garbage_can_is_one_thing_where_it_stands(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, distance: float, bearing: float, roll: float
) -> None:
    can = scenes.garbage_can(distance=distance, bearing=math.radians(bearing))
    frame = shot(can, roll=roll, by=rig)
    found = only(look(noisy(frame.disparity), by=rig).obstacles)
    truth = frame.truth["obstacles"][0]
    assert abs(found.distance - truth["distance"]) < 3 * found.sigma_distance
    assert found.sigma_distance < 0.02 * distance
    assert abs(math.degrees(found.bearing) - truth["bearing_deg"]) < 0.3  # two pixels
    assert math.hypot(found.x, found.y) == pytest.approx(found.distance, rel=1e-6)
    # the lid is narrower than the rim by 5 % and the edges recede: no closer than a tenth
    assert found.width == pytest.approx(truth["width"], rel=0.1)
    assert found.height == pytest.approx(truth["height"], abs=0.03)
    assert found.base_height == 0.0
    assert found.truncated == ()


CRATES = [
    (2.0, 0.0, 0.5, 0.6, 0.0),
    (3.0, 1.0, 0.5, 0.6, 8.0),
    (3.0, -1.2, 0.3, 0.3, -8.0),
    (4.5, 0.5, 1.0, 1.0, 0.0),
    (6.0, -1.0, 0.6, 1.5, 5.0),
]


@pytest.mark.parametrize(("x", "y", "width", "height", "roll"), CRATES)
def test_place_and_width_of_a_crate_lie_within_their_error_bars(
    shot: Shot,
    noisy: Noisy,
    look: Look,
    crate: Crate,
    rig: Rig,
    x: float,
    y: float,
    width: float,
    height: float,
    roll: float,
) -> None:
    frame = shot(scene(crate(x, y, width=width, height=height)), roll=roll, by=rig)
    found = only(look(noisy(frame.disparity), by=rig).obstacles)
    truth = frame.truth["obstacles"][0]
    z = {
        "distance": (found.distance - truth["distance"]) / found.sigma_distance,
        "bearing": (math.degrees(found.bearing) - truth["bearing_deg"])
        / math.degrees(found.sigma_bearing),
        "width": (found.width - truth["width"]) / found.sigma_width,
    }
    assert max(abs(value) for value in z.values()) < 3, z
    assert found.height == pytest.approx(height, abs=0.025)
    # error bars are of use: 4 % of the distance, two pixels of angle, a tenth of the size
    assert found.sigma_distance < 0.04 * found.distance
    assert found.sigma_bearing < 2 / rig.camera.fx
    assert found.sigma_width < 0.1 * found.width


def test_things_are_numbered_from_the_nearest(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    things = scene(crate(4.0, 1.6), crate(2.2, -0.6), crate(3.0, 0.4), crate(3.4, -1.6))
    answer = look(noisy(shot(things).disparity))
    assert [thing.id for thing in answer.obstacles] == [1, 2, 3, 4]
    distances = [thing.distance for thing in answer.obstacles]
    assert distances == sorted(distances)
    np.testing.assert_allclose(distances, [2.23, 3.0, 3.66, 4.22], atol=0.1)
    for thing in answer.obstacles:
        u_min, v_min, u_max, v_max = thing.box
        inside = answer.layers.labels == thing.id
        v, u = np.nonzero(inside)
        assert (u.min(), v.min(), u.max(), v.max()) == (u_min, v_min, u_max, v_max)
        assert np.count_nonzero(inside) == thing.pixels


def test_two_things_at_one_bearing_are_two(shot: Shot, noisy: Noisy, look: Look, rig: Rig) -> None:
    frame = shot(scenes.two_cans(near=2.5, far=4.5), by=rig)
    low, tall = look(noisy(frame.disparity), by=rig).obstacles
    assert low.distance == pytest.approx(2.5, abs=0.05)
    assert tall.distance == pytest.approx(4.5, abs=0.15)
    assert low.height == pytest.approx(0.7, abs=0.03)
    assert tall.height == pytest.approx(1.1, abs=0.05)
    assert abs(math.degrees(low.bearing - tall.bearing)) < 0.5


def test_two_things_beside_each_other_with_floor_between_are_two(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    pair = scene(crate(3.0, 0.5), crate(3.0, -0.5))
    left, right = sorted(look(noisy(shot(pair).disparity)).obstacles, key=lambda o: -o.bearing)
    assert math.degrees(left.bearing) == pytest.approx(9.5, abs=0.5)
    assert math.degrees(right.bearing) == pytest.approx(-9.5, abs=0.5)


@pytest.mark.parametrize(("bearing", "side"), [(37.5, "left"), (-37.5, "right")])
def test_thing_cut_by_the_border_has_a_width_without_error_bar(
    shot: Shot, noisy: Noisy, look: Look, bearing: float, side: str
) -> None:
    frame = shot(scenes.garbage_can(distance=3.0, bearing=math.radians(bearing)))
    assert frame.truth["obstacles"][0]["truncated"] == [side]
    answer = look(noisy(frame.disparity))
    found = only(answer.obstacles)
    assert found.truncated == (side,)
    assert math.isnan(found.sigma_width)
    told = answer.to_dict()["obstacles"][0]
    assert told["sigma"]["width"] is None
    assert told["sigma"]["height"] is not None
    assert 0.1 < told["width"] < 0.449  # what is seen of it: a lower bound
    assert any(f"cut by the image's {side} border" in vote["reason"] for vote in told["votes"])


def test_thing_that_leaves_the_image_above_has_a_height_without_error_bar(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    frame = shot(scene(crate(2.5, 0.0, height=4.0)))
    answer = look(noisy(frame.disparity))
    found = only(answer.obstacles)
    assert found.truncated == ("top",)
    told = answer.to_dict()["obstacles"][0]
    assert told["sigma"]["height"] is None
    assert told["sigma"]["width"] is not None
    assert 1.5 < told["height"] < 4.0


@pytest.mark.parametrize("base", [0.9, 1.3])
def test_branch_hangs_and_says_how_high(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, base: float
) -> None:
    frame = shot(scenes.branch(distance=3.0, base=base), by=rig)
    found = only(look(noisy(frame.disparity), by=rig).obstacles)
    assert found.base_height == pytest.approx(base, abs=0.03)
    assert found.height == pytest.approx(base + 0.12, abs=0.03)
    assert found.distance == pytest.approx(3.0, abs=3 * found.sigma_distance)


@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("roll", [0.0, 8.0, -15.0])
def test_nothing_stands_on_an_empty_floor_however_noisy(
    shot: Shot, noisy: Noisy, look: Look, sigma: float, roll: float
) -> None:
    frame = shot(scenes.floor(), roll=roll)
    for seed in range(3):
        answer = look(noisy(frame.disparity, sigma, seed=seed))
        assert answer.obstacles == ()
        assert answer.holes == ()


def test_nothing_stands_on_a_noisy_floor_of_the_full_size(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    answer = look(noisy(shot(scenes.floor(), roll=5, by=rig).disparity, 0.3), by=rig)
    assert (answer.obstacles, answer.holes) == ((), ())


def test_mirrored_scene_is_answered_mirrored(
    shot: Shot, look: Look, crate: Crate, rig: Rig
) -> None:
    """Without noise: what lies left at +b lies right at -b, all else the same."""
    places = [(2.5, 0.9), (3.6, -0.7)]
    here = look(shot(scene(*(crate(x, y) for x, y in places)), roll=6, by=rig).disparity, by=rig)
    there = look(shot(scene(*(crate(x, -y) for x, y in places)), roll=-6, by=rig).disparity, by=rig)
    assert len(here.obstacles) == len(there.obstacles) == 2
    pixel = 1 / rig.camera.fx
    for one, other in zip(here.obstacles, there.obstacles, strict=True):
        assert one.bearing == pytest.approx(-other.bearing, abs=pixel)
        assert one.y == pytest.approx(-other.y, abs=2 * pixel * one.distance)
        # samples are taken on a grid that is not mirrored: as close as the error bars
        assert one.distance == pytest.approx(other.distance, abs=one.sigma_distance)
        assert one.width == pytest.approx(other.width, abs=2 * pixel * one.distance)
        assert one.height == pytest.approx(other.height, abs=2 * pixel * one.distance)
    assert here.ground.roll == pytest.approx(-there.ground.roll, abs=1e-3)


def test_camera_off_the_robots_origin_moves_every_place_with_it(
    shot: Shot, noisy: Noisy, look: Look, small_rig: Rig
) -> None:
    frame = shot(scenes.garbage_can(distance=3.0, bearing=0.0))
    disparity = noisy(frame.disparity)
    at_origin = only(look(disparity).obstacles)
    ahead = replace(small_rig, mount=replace(small_rig.mount, x=0.4, y=-0.25))
    moved = only(look(disparity, by=ahead).obstacles)
    assert moved.x == pytest.approx(at_origin.x + 0.4, abs=0.02)
    assert moved.y == pytest.approx(at_origin.y - 0.25, abs=0.08)  # another point may be nearest
    assert moved.bearing == pytest.approx(math.atan2(-0.25, 3.6), abs=math.radians(1))
    assert moved.height == pytest.approx(at_origin.height, abs=0.005)


def test_thing_farther_than_the_farthest_is_not_reported(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    frame = shot(scene(crate(26.0, 0.0, width=4.0, height=3.0)))
    assert look(noisy(frame.disparity, 0.1)).obstacles == ()  # the default is 20 m


def test_pixels_of_a_thing_are_told_from_those_of_the_floor(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    frame = shot(scene(crate(2.5, 0.3, width=0.8, height=1.0)))
    kind = look(noisy(frame.disparity)).layers.kind
    thing, floor = frame.labels == 1, (frame.labels == 0) & (frame.disparity > 2)
    # its foot is within the tolerance of the floor: 3 sigmas of 0.2 px at 8.9 px are 8 cm of 1 m
    assert (kind[thing] == Pixel.OBSTACLE).mean() > 0.85
    assert (kind[floor] == Pixel.FLOOR).mean() > 0.98
    assert (kind[frame.labels < -1] == Pixel.OTHER).all()  # the sky


def test_body_attitude_does_not_change_where_a_thing_is(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    can = scenes.garbage_can(distance=3.0, bearing=math.radians(5))
    found = []
    for roll, pitch in ((0, 0), (10, 0), (-10, 3), (0, -4)):
        frame = shot(can, roll=roll, pitch=pitch)
        found.append(only(look(noisy(frame.disparity), roll=roll, pitch=pitch).obstacles))
    for thing in found[1:]:
        assert thing.distance == pytest.approx(found[0].distance, abs=0.1)
        assert thing.bearing == pytest.approx(found[0].bearing, abs=math.radians(0.5))
        assert thing.height == pytest.approx(found[0].height, abs=0.05)


def test_can_on_a_slope_is_as_high_as_on_the_level(shot: Shot, noisy: Noisy, look: Look) -> None:
    slope = Ground(texture=scenes.ASPHALT, cross=math.tan(math.radians(6)))
    standing = scenes.standing(Scene(ground=slope))
    assert isinstance(standing, Attitude)
    frame = shot(
        Scene(ground=slope, things=(scenes.can(3.2, 0.0, ground=slope),)),
        roll=math.degrees(standing.roll),
        pitch=math.degrees(standing.pitch),
    )
    found = only(look(noisy(frame.disparity)).obstacles)
    assert found.height == pytest.approx(0.70, abs=0.05)
    assert found.base_height == 0.0


@pytest.mark.parametrize("slope", [5.0, 8.5])
def test_height_is_above_the_ground_that_a_thing_stands_on(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate, rig: Rig, slope: float
) -> None:
    ground = scenes.ramp(start=2.5, slope=math.radians(slope)).ground
    lift = (5.0 - 2.5) * math.tan(math.radians(slope))
    frame = shot(Scene(ground=ground, things=(crate(5.0, 0.0, bottom=lift),)), by=rig)
    found = look(noisy(frame.disparity), by=rig).obstacles[0]
    assert found.distance == pytest.approx(5.0, abs=0.1)
    assert found.height == pytest.approx(0.6, abs=0.06)  # not 0.6 m and the ramp's 0.22 or 0.37
    assert found.base_height == 0.0


@pytest.mark.parametrize("yaw", [30.0, 45.0])
def test_distance_of_a_crate_turned_towards_us_is_that_of_its_edge(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, yaw: float
) -> None:
    box = Box(
        x=3.0, y=0.0, bottom=0.0, size=(0.6, 0.6, 0.6), yaw=math.radians(yaw), texture=scenes.WOOD
    )
    frame = shot(scene(Thing(name="crate", foot=(3.0, 0.0), parts=(box,))), by=rig)
    found = only(look(noisy(frame.disparity, 0.1), by=rig).obstacles)
    # 3 m less half a diagonal of 0.85 m at 45 deg; the mean of its direction is 4 cm beyond
    assert found.distance == pytest.approx(frame.truth["obstacles"][0]["distance"], abs=0.015)


def test_what_the_lower_border_cuts_is_not_told_to_hang(
    shot: Shot, noisy: Noisy, look: Look, crate: Crate
) -> None:
    """Its foot is below the picture: the robot cannot know that there is a way under it."""
    frame = shot(scene(crate(x=1.0, y=0.35, width=0.3, height=1.0)))
    found = only(look(noisy(frame.disparity, 0.1), roll=0).obstacles)
    assert "bottom" in found.truncated
    assert found.base_height == 0.0
