"""What is said to be a hole stands out, ends where it ends, and is shown by the images."""

from dataclasses import replace

import numpy as np
import pytest

from bearcub.geometry import (
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    forward_in_camera,
)
from bearcub.messages import Float32, Ground, Hole, Snapshot, Tilt, UInt8
from bearcub.obstacles import holes
from bearcub.obstacles.cloud import View
from bearcub.obstacles.holes import find_holes
from bearcub.obstacles.segment import segment
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.verify import Witness
from bearcub.pipeline import Pipeline
from bearcub.sim import render, scenes

SHAPE = (160, 320)
NOISE = 0.1
CAMERA = Projection(fx=200.0, fy=200.0, cx=159.5, cy=40.0, baseline=0.12)
PIT = np.s_[82:98, 140:180]  # the floor there has 6.2 to 7.7 px


@pytest.fixture
def ground(sure_ground: Ground) -> Ground:
    """Return ground with little noise, as `floor` has it."""
    return replace(sure_ground, noise=NOISE)


@pytest.fixture
def floor() -> Float32:
    """Return a floor with noise: ten rows per level, horizon at row 20."""
    noise = np.random.default_rng(0).normal(0, NOISE, SHAPE)
    level = 0.1 * np.arange(SHAPE[0])[:, None] - 2.0
    return np.where(level > 0, np.maximum(level + noise, 0.01), 0).astype(np.float32)


def holes_of(
    disparity: Float32, ground: Ground, *, witness: Witness | None = None
) -> tuple[Hole, ...]:
    """Return the holes in a disparity map over known ground."""
    sorter = Sorter.of(disparity, ground, sigmas=3.0, unevenness=0.02, farthest_level=1.0)
    sorting = sorter.part(np.s_[:], np.s_[:])
    segments = segment(
        sorting,
        CAMERA,
        step=1,
        camera_height=ground.height,
        lean=0.0,
        least_height=0.1,
        low_height=0.3,
        clearance=2.0,
        least_pixels=30,
        nearest_level=60.0,
        farthest_level=1.0,
    )
    down = Attitude(roll=ground.roll, pitch=ground.pitch).down()
    view = View(
        projection=CAMERA,
        base_from_optical=base_from_optical(down, forward_in_camera(Attitude(roll=0.0, pitch=0.0))),
        origin=np.array([0.0, 0.0, ground.height]),
    )
    found, _ = find_holes(
        sorter,
        sorting,
        segments,
        np.zeros(segments.count + 1, dtype=bool),
        view,
        ground,
        farthest=50.0,
        witness=witness,
        offset=0.0,
        fringe=0.0,
    )
    return found


def pictures(disparity: Float32, *, seed: int = 3, brighter: float = 0.0) -> Witness:
    """Return a pair with random texture that has this disparity in every row of the left image.

    Each row of the left image samples that of the right at ``u - d``.
    """
    rng = np.random.default_rng(seed)
    right = rng.normal(120, 30, disparity.shape)
    columns = np.arange(disparity.shape[1])
    left = np.stack(
        [np.interp(columns - d, columns, row) for d, row in zip(disparity, right, strict=True)]
    )
    left += brighter + rng.normal(0, 2, left.shape)
    return Witness(left=grey(left), right=grey(right))


def grey(image: Float64) -> UInt8:
    shown: UInt8 = np.clip(image, 0, 255).astype(np.uint8)
    return shown


def with_pit(floor: Float32, fall: float = 1.5) -> Float32:
    d = floor.copy()
    d[PIT] -= np.float32(fall)
    return d


def test_noise_that_hangs_from_a_pit_does_not_bring_it_nearer(
    floor: Float32, ground: Ground
) -> None:
    d = with_pit(floor)
    (clean,) = holes_of(d, ground)
    d[98:130, 170:178] -= np.float32(0.9)  # a strand no wider than a matcher's window
    (hole,) = holes_of(d, ground)
    assert hole.distance == pytest.approx(clean.distance, rel=0.02)
    assert hole.box == clean.box


def test_two_seeds_of_one_pit_are_one_hole(floor: Float32, ground: Ground) -> None:
    d = with_pit(floor)
    # between them lower than the rim (a fifth of 1.5 px), not lower than the tolerance (0.42 px)
    d[82:98, 154:166] = 0.1 * np.arange(82, 98)[:, None] - 2.0 - 0.36
    assert len(holes_of(d, ground)) == 1


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_gap_between_blades_is_no_hole(floor: Float32, ground: Ground, seed: int) -> None:
    d = with_pit(floor, 0.5)
    assert len(holes_of(d, ground)) == 1
    # tufts around it, 1-sigma 0.32 px: one in twenty lies lower than what the gap is
    tufts = np.random.default_rng(seed).normal(0, 0.32, (16, 24)).repeat(4, axis=0)
    d[58:122, 112:208] += tufts.repeat(4, axis=1).astype(np.float32)
    d[PIT] = floor[PIT] - np.float32(0.5)
    assert holes_of(d, ground) == ()


def test_wrong_matches_are_no_hole_however_low_they_lie(floor: Float32, ground: Ground) -> None:
    d = with_pit(floor)
    assert len(holes_of(d, ground, witness=pictures(d))) == 1
    assert holes_of(d, ground, witness=pictures(floor)) == ()


def test_images_speak_for_the_shift_that_pixels_share(floor: Float32) -> None:
    v, u = (grid.ravel() for grid in np.mgrid[PIT])
    level = floor[v, u]
    lower, same = pictures(with_pit(floor)), pictures(floor)
    assert lower.shifted(u, v, level, -1.5) > 20
    assert same.shifted(u, v, level, -1.5) == 0
    # the median of noisy disparities may be half or twice the shift
    assert lower.shifted(u, v, level, -3.0) > 20
    assert lower.shifted(u, v, level, 1.5) < 3


def test_brighter_camera_is_no_evidence_of_a_hole(floor: Float32) -> None:
    v, u = (grid.ravel() for grid in np.mgrid[PIT])
    assert pictures(floor, brighter=25.0).shifted(u, v, floor[v, u], -1.5) == 0
    assert pictures(with_pit(floor), brighter=25.0).shifted(u, v, floor[v, u], -1.5) > 20


def test_nothing_to_ask_is_no_evidence(floor: Float32) -> None:
    none = np.zeros(0, dtype=np.int64)
    assert pictures(floor).shifted(none, none, np.zeros(0, dtype=np.float32), -1.5) == 0.0


def test_a_pit_reaches_down_through_what_is_not_matched_to_the_floor(
    floor: Float32, ground: Ground
) -> None:
    d = floor.copy()
    d[82:90, 120:200] -= np.float32(1.5)
    whole = d.copy()
    whole[90:98, 120:200] -= np.float32(1.5)
    d[90:98, 20:300] = np.nan  # more than the pit itself: not only its own shade
    (expected,) = holes_of(whole, ground)
    (hole,) = holes_of(d, ground)
    assert hole.distance == pytest.approx(expected.distance, rel=0.02)


def test_lower_ground_on_which_the_robot_stands_is_no_hole(floor: Float32, ground: Ground) -> None:
    d = floor.copy()
    d[110:, 60:260] -= np.float32(3.0)
    assert len(holes_of(d, ground)) == 1  # the image's lower border cuts it
    d[110:] = floor[110:] - np.float32(3.0)
    assert holes_of(d, ground) == ()


@pytest.mark.parametrize("baseline", [0.06, 0.12])
def test_a_shallow_pit_that_has_not_the_shape_looked_for_is_told_where_the_images_show_it(
    baseline: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = scenes.paper_rig()
    rig = replace(
        rig,
        camera=replace(rig.camera, baseline=baseline),
        mount=replace(rig.mount, height=0.6),
    )
    distance = 2.5 if baseline < 0.1 else 3.2  # it lies 1.3 px below the floor
    pit = scenes.pit(distance=distance, depth=0.12, width=1.0, length=1.0)
    pair = render(pit, rig, noise="medium", seed=3)
    monkeypatch.setattr(holes, "openings", lambda *_: [])
    seen = Snapshot(left=pair.left, right=pair.right, tilt=Tilt(pitch=0.0, roll=0.0))
    (hole,) = Pipeline(rig).process(seen).holes
    assert hole.kind == "pit"
    assert hole.distance == pytest.approx(distance, abs=0.15)
    assert hole.width == pytest.approx(1.0, abs=0.1)
