"""Slope and cross slope, against gravity and against the robot, with their signs."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from bearcub.messages import Answer, Float32
from bearcub.sim import Rendered, scenes
from bearcub.sim.world import Ground, Scene

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]

NOISE = 0.2


def told(answer: Answer) -> dict[str, Any]:
    terrain: dict[str, Any] = answer.to_dict()["terrain"]
    return terrain


def test_level_floor_is_level_with_and_without_a_tilt_reading(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    disparity = noisy(shot(scenes.floor()).disparity, NOISE)
    for roll, reference in ((None, "robot"), (0.0, "gravity")):
        terrain = told(look(disparity, roll=roll))
        assert terrain["reference"] == reference
        assert abs(terrain["slope_deg"]) < 0.5
        assert abs(terrain["cross_slope_deg"]) < 0.3
        assert 0 < terrain["sigma_deg"] < 1.0
        if reference == "gravity":  # a slope is known no better than gravity
            assert terrain["sigma_deg"] > 0.2
        # what noise of 0.2 px hides is not known
        assert terrain["roughness"] is None or 0 <= terrain["roughness"] < 0.01


@pytest.mark.parametrize(("roll", "pitch"), [(8.0, 0.0), (0.0, 5.0), (-10.0, -4.0), (12.0, 3.0)])
def test_inclined_robot_on_level_ground_sees_level_ground(
    shot: Shot, noisy: Noisy, look: Look, roll: float, pitch: float
) -> None:
    frame = shot(scenes.floor(), roll=roll, pitch=pitch)
    terrain = told(look(noisy(frame.disparity, NOISE), roll=roll, pitch=pitch))
    assert terrain["reference"] == "gravity"
    assert abs(terrain["slope_deg"]) < 0.5
    assert abs(terrain["cross_slope_deg"]) < 0.3


@pytest.mark.parametrize("cross", [-8.0, -3.0, 6.0, 12.0])
def test_cross_slope_is_positive_where_the_ground_rises_to_the_left(
    shot: Shot, noisy: Noisy, look: Look, cross: float
) -> None:
    frame = shot(scenes.cross_slope(slope=math.radians(cross)))
    disparity = noisy(frame.disparity, NOISE)
    terrain = told(look(disparity, roll=0))
    assert terrain["cross_slope_deg"] == pytest.approx(cross, abs=0.4)
    assert abs(terrain["slope_deg"]) < 0.5
    against_robot = told(look(disparity))
    assert against_robot["reference"] == "robot"
    assert abs(against_robot["cross_slope_deg"]) < 0.4  # the ground under it is the same plane


@pytest.mark.parametrize("slope", [-6.0, 5.0, 10.0])
def test_slope_on_which_the_robot_stands_is_told_against_gravity(
    shot: Shot, noisy: Noisy, look: Look, slope: float
) -> None:
    """The robot follows the ground it stands on; slope is up positive."""
    ground = Ground(
        texture=scenes.ASPHALT,
        pieces=((-1e-6, 0.0, math.tan(math.radians(slope))),),
    )
    standing = scenes.standing(Scene(ground=ground))
    assert math.degrees(standing.pitch) == pytest.approx(-slope)  # nose up on an ascent
    frame = shot(Scene(ground=ground), pitch=-slope)
    assert frame.truth["terrain"]["slope_deg"] == pytest.approx(slope)
    disparity = noisy(frame.disparity, NOISE)
    terrain = told(look(disparity, pitch=-slope))
    assert terrain["slope_deg"] == pytest.approx(slope, abs=0.5)
    assert abs(terrain["cross_slope_deg"]) < 0.3
    assert abs(told(look(disparity))["slope_deg"]) < 0.5  # against the ground under it


def test_robot_standing_across_a_slope_reads_its_roll_as_the_cross_slope(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    scene = scenes.cross_slope(slope=math.radians(6))
    standing = scenes.standing(scene)
    roll, pitch = math.degrees(standing.roll), math.degrees(standing.pitch)
    assert roll == pytest.approx(6.0)  # left side up: right side down
    frame = shot(scene, roll=roll, pitch=pitch)
    terrain = told(look(noisy(frame.disparity, NOISE), roll=roll, pitch=pitch))
    assert terrain["cross_slope_deg"] == pytest.approx(6.0, abs=0.4)


def test_profile_has_ascending_bands_inside_1_5_to_5_m(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    profile = told(look(noisy(shot(scenes.floor()).disparity, NOISE), roll=0))["profile"]
    assert len(profile) >= 4
    assert all(1.5 <= band["from"] < band["to"] <= 5.0 for band in profile)
    assert all(a["to"] <= b["from"] for a, b in pairwise(profile))
    for band in profile:
        assert abs(band["slope_deg"]) < max(1.0, 4 * band["sigma_deg"])


def test_rough_ground_is_told_from_smooth_ground(shot: Shot, noisy: Noisy, look: Look) -> None:
    """Waves of 2.5 cm that rise and fall evenly: 7.2 mm RMS, 25 mm over the root of 12."""
    slope = 2 * 0.025 / 0.25
    pieces = tuple((1.4 + 0.25 * k, 0.0, slope if k % 2 == 0 else -slope) for k in range(18))
    waves = Scene(ground=Ground(texture=scenes.ASPHALT, pieces=(*pieces, (6.0, 0.0, 0.0))))
    rough = told(look(noisy(shot(waves).disparity, 0.1), roll=0))["roughness"]
    smooth = told(look(noisy(shot(scenes.floor()).disparity, 0.1), roll=0))["roughness"]
    assert rough == pytest.approx(0.0072, rel=0.25)
    assert smooth is None or rough > 2 * smooth  # None: less than the noise hides


def test_nothing_is_told_of_ground_that_is_not_in_view(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    answer = look(noisy(shot(scenes.wall(distance=1.2)).disparity, NOISE), roll=0)
    terrain = told(answer)
    for key in ("slope_deg", "cross_slope_deg", "sigma_deg", "roughness"):
        assert terrain[key] is None
    assert terrain["profile"] == []
    assert np.isnan(answer.terrain.slope)
