"""Where no floor is in view the answer says so, and rests on what was known before."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import Answer, Float32
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]


def require_unseen(answer: Answer, rig: Rig, *, source: str) -> None:
    ground = answer.ground
    assert not ground.seen
    assert ground.source == source
    assert ground.height == rig.mount.height
    assert ground.pitch == pytest.approx(rig.mount.pitch)
    assert ground.sigma_height > 0.05 * ground.height  # as little as is known of the mount
    assert math.isnan(ground.residual)
    assert math.isnan(ground.tilt_disagreement)
    assert any(note.startswith("no floor seen") for note in answer.notes)
    found = answer.to_dict()["ground"]
    assert (found["residual_px"], found["tilt_disagreement_deg"]) == (None, None)


@pytest.mark.parametrize("distance", [0.8, 1.2])
def test_wall_that_fills_the_view_is_no_floor(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig, distance: float
) -> None:
    frame = shot(scenes.wall(distance=distance))
    assert (frame.labels == 1).all()
    answer = look(noisy(frame.disparity, 0.2))
    require_unseen(answer, rig, source="mount")
    require_unseen(look(noisy(frame.disparity, 0.2), roll=0), rig, source="tilt")


def test_wall_that_fills_the_view_is_an_obstacle_all_the_same(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    answer = look(noisy(shot(scenes.wall(distance=1.2)).disparity, 0.2))
    assert [round(thing.distance, 1) for thing in answer.obstacles] == [1.2]


def test_sky_alone_is_no_floor(look: Look, rig: Rig) -> None:
    answer = look(np.zeros((240, 320), dtype=np.float32))
    require_unseen(answer, rig, source="mount")
    assert answer.obstacles == ()


def test_floor_without_a_single_match_is_not_seen(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    frame = shot(scenes.garbage_can())
    disparity = noisy(frame.disparity, 0.2)
    disparity[frame.labels == 0] = np.nan
    require_unseen(look(disparity), rig, source="mount")


def test_nothing_is_claimed_of_ground_that_is_not_seen(look: Look) -> None:
    disparity = np.full((240, 320), np.nan, dtype=np.float32)
    disparity[:60] = 0.5  # far things above the horizon
    answer = look(disparity)
    assert not answer.ground.seen
    found = answer.to_dict()["terrain"]
    for key in ("slope_deg", "cross_slope_deg", "sigma_deg", "roughness"):
        assert found[key] is None
    assert found["profile"] == []
    assert answer.holes == ()


def test_map_without_a_single_match_is_refused(look: Look) -> None:
    with pytest.raises(InputError, match="none of the 76800 pixels"):
        look(np.full((240, 320), np.nan, dtype=np.float32))


def test_table_top_below_the_camera_is_not_the_floor(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    """Both are level planes; the lower one that carries the other is the floor."""
    frame = shot(scenes.table(distance=2.0))
    ground = look(noisy(frame.disparity, 0.2)).ground
    assert ground.seen
    assert ground.height == pytest.approx(rig.mount.height, rel=0.02)
    high = replace(rig, mount=replace(rig.mount, height=0.9))  # believed nearer the table top
    ground = look(noisy(frame.disparity, 0.2), by=high).ground
    assert ground.height == pytest.approx(rig.mount.height, rel=0.02)
