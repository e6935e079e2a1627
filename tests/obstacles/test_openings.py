"""A pit that no matcher shows is found in the images; paint, slopes and steps are none."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from bearcub.geometry import (
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    forward_in_camera,
)
from bearcub.ground.surface import Surface
from bearcub.messages import Float32, Ground, Hole, UInt8
from bearcub.obstacles import openings as module
from bearcub.obstacles.cloud import View
from bearcub.obstacles.dark import dark_patches
from bearcub.obstacles.descent import descent
from bearcub.obstacles.floor_lines import floor_lines
from bearcub.obstacles.mouths import Mouth, mouths
from bearcub.obstacles.openings import openings
from bearcub.obstacles.regions import Region
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.sunken import likeliest, opening
from bearcub.obstacles.upright import Scene
from bearcub.obstacles.verify import Witness
from bearcub.stereo.native import COMPILED

SHAPE = (200, 320)
# level, 1.2 m above a floor of ten rows per level; 12 px are 4 m
CAMERA = Projection(fx=400.0, fy=400.0, cx=159.5, cy=20.0, baseline=0.12)
LEVELS = np.maximum(0.1 * np.arange(SHAPE[0]) - 2.0, 0.0)
PIT = np.s_[126:141, 130:190]  # 12 px at its near lip, 4 m, and 60 columns: 0.6 m; 0.55 m long
WALL = 10.55  # disparity of the floor at its far lip [px]
MOUTH = Mouth(u=160, level=12.0, sure=8.0)


def pictures(
    rows: Float64 = LEVELS, *, pit: bool = False, paint: bool = False, gain: float = 1.0
) -> Witness:
    """Return a textured pair whose rows have these disparities, with a dark pit or paint in it."""
    rng = np.random.default_rng(3)
    columns = np.arange(SHAPE[1])
    left = 110.0 + _texture(rng)
    dark = 70.0 + _texture(rng)
    if paint:
        left[PIT] = dark[PIT]
    right = _moved(left, rows)
    if pit:
        wall = _moved(dark, np.full(SHAPE[0], WALL))
        first, last = PIT[1].start - rows, PIT[1].stop - 1 - rows
        open_there = (columns >= first[:, None]) & (columns <= last[:, None])
        open_there[: PIT[0].start] = open_there[PIT[0].stop :] = False
        right[open_there] = wall[open_there]
        left[PIT] = dark[PIT]
    return Witness(left=_taken(gain * left, rng), right=_taken(right, rng))


def _moved(image: Float64, rows: Float64) -> Float64:
    columns = np.arange(SHAPE[1])
    moved = [np.interp(columns + d, columns, row) for d, row in zip(rows, image, strict=True)]
    return np.array(moved, dtype=np.float64)


def _texture(rng: np.random.Generator) -> Float64:
    blurred = cv2.GaussianBlur(rng.normal(0, 50, SHAPE), (0, 0), 1.5)
    return np.asarray(blurred, dtype=np.float64)


def _taken(image: Float64, rng: np.random.Generator) -> UInt8:
    """Return an image as a camera takes it: a little blurred, with noise."""
    blurred = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0, 2, SHAPE)
    shown: UInt8 = np.clip(blurred, 0, 255).astype(np.uint8)
    return shown


def images(witness: Witness, ground: Ground) -> Scene:
    surface = Surface.of(ground, SHAPE)
    return Scene(witness=witness, surface=surface, projection=CAMERA, offset=0.0)


def found(
    witness: Witness,
    ground: Ground,
    *,
    known: tuple[Region, ...] = (),
    doubtful: tuple[tuple[Hole, Region], ...] = (),
    seen: Float64 = LEVELS,
    lower: float = 0.25,
    refused: bool = False,
) -> list[tuple[Hole, Region]]:
    """Return the holes that the images show over a map that shows floor, a little `lower` there."""
    disparity: Float32 = np.repeat(seen[:, None], SHAPE[1], axis=1).astype(np.float32)
    disparity[PIT] -= np.float32(lower)
    sorter = Sorter.of(disparity, ground, sigmas=2.0, unevenness=0.01, farthest_level=1.0)
    level = Attitude(roll=0.0, pitch=0.0)
    view = View(
        projection=CAMERA,
        base_from_optical=base_from_optical(level.down(), forward_in_camera(level)),
        origin=np.array([0.0, 0.0, ground.height]),
    )
    scene = images(witness, ground)
    return openings(list(known), list(doubtful), scene, sorter, view, ground, lambda _: refused)


@pytest.mark.parametrize("gain", [1.0, 1.2])
def test_a_pit_shows_at_its_near_lip_to_unequal_cameras_too(
    sure_ground: Ground, gain: float
) -> None:
    scene = images(pictures(pit=True, gain=gain), sure_ground)
    first = mouths(scene.witness, scene.surface, CAMERA, offset=0.0)[0]
    assert 130 <= first.u <= 190
    assert first.level == pytest.approx(12.0, abs=0.5)


def test_paint_shows_nothing(sure_ground: Ground) -> None:
    scene = images(pictures(paint=True), sure_ground)
    assert mouths(scene.witness, scene.surface, CAMERA, offset=0.0) == []
    assert opening(scene, MOUTH) is None


def test_a_mouth_is_as_large_as_the_images_show(sure_ground: Ground) -> None:
    sunken = opening(images(pictures(pit=True), sure_ground), MOUTH)
    assert sunken is not None
    assert (sunken.left, sunken.right) == pytest.approx((130, 189), abs=4)
    assert sunken.near == pytest.approx(12.05, abs=0.25)
    assert sunken.far == pytest.approx(10.55, abs=0.4)  # close to it the wall is no lower


@pytest.mark.skipif(not COMPILED, reason="there is no compiled core")
@pytest.mark.parametrize(("most", "every"), [((36, 90), 1), ((24, 48), 2)])
@pytest.mark.parametrize("first", [60, -15])
def test_core_and_numpy_find_the_same_wall(
    sure_ground: Ground, *, first: int, most: tuple[int, int], every: int
) -> None:
    scene = images(pictures(pit=True), sure_ground)
    part = floor_lines(scene, (first, 260), (9.6, 13.5), most=most)
    assert part is not None
    assert part.known.all() == (first > 0)
    core, numpy = (likeliest(part, every, compiled=compiled) for compiled in (True, False))
    assert core.gain == pytest.approx(numpy.gain, rel=1e-4)  # rounding
    assert replace(core, gain=numpy.gain) == numpy
    assert numpy.gain > 20


def test_where_disparities_have_an_offset_it_is_as_large(sure_ground: Ground) -> None:
    farther = replace(sure_ground, plane=sure_ground.plane + np.array([0.0, 0.0, 3.0]))
    scene = Scene(
        witness=pictures(pit=True),
        surface=Surface.of(farther, SHAPE),
        projection=CAMERA,
        offset=3.0,
    )
    sunken = opening(scene, replace(MOUTH, level=15.0))
    assert sunken is not None
    assert sunken.near == pytest.approx(15.05, abs=0.25)


def test_lower_ground_without_an_end_is_no_pit(sure_ground: Ground) -> None:
    lower = np.where(np.arange(SHAPE[0]) < 141, 0.85 * LEVELS, LEVELS)
    assert opening(images(pictures(lower), sure_ground), MOUTH) is None


def test_floor_that_was_followed_over_a_step_tells_no_pit(sure_ground: Ground) -> None:
    knots, bend = np.array([9.0, 11.0, 11.3, 14.0]), np.array([1.0, 1.0, 0.0, 0.0])
    stepped = replace(sure_ground, knots=knots, bend=bend, knot_noise=np.full(4, 0.1))
    assert opening(images(pictures(pit=True), stepped), MOUTH) is None


def test_a_pit_that_no_match_shows_is_told_with_its_place_and_size(sure_ground: Ground) -> None:
    ((hole, region),) = found(pictures(pit=True), sure_ground)
    assert hole.kind == "pit"
    assert hole.distance == pytest.approx(4.0, rel=0.02)
    assert hole.width == pytest.approx(0.6, rel=0.15)
    assert hole.length == pytest.approx(0.55, rel=0.3)
    # the line of sight over the near lip falls 1.2 m in 4 m
    assert hole.depth == pytest.approx(1.2 * hole.length / hole.distance)
    assert hole.depth_is_lower_bound
    assert region.holds(160, 135)
    assert not region.holds(160, 160)


def test_what_is_known_is_not_told_again(sure_ground: Ground) -> None:
    witness = pictures(pit=True)
    ((_, region),) = found(witness, sure_ground)
    assert found(witness, sure_ground, known=(region,)) == []


def test_what_other_reasons_refuse_is_not_told(sure_ground: Ground) -> None:
    assert found(pictures(pit=True), sure_ground, refused=True) == []


def test_nothing_is_told_where_no_floor_was_matched_around(sure_ground: Ground) -> None:
    assert found(pictures(pit=True), sure_ground, seen=LEVELS + 3.0) == []


def test_nothing_is_told_where_floor_itself_was_matched(sure_ground: Ground) -> None:
    assert found(pictures(pit=True), sure_ground, lower=0.0) == []


def _descended(lines: int) -> Float64:
    """Return rows of floor that falls by a fifth of its disparity over so many lines."""
    lip = 140
    row = np.arange(SHAPE[0])
    foot = 0.8 * LEVELS[lip - lines]
    slope = foot + (LEVELS[lip] - foot) * (row - (lip - lines)) / max(lines, 1)
    below = np.where(row <= lip - lines, 0.8 * LEVELS, slope)
    return np.asarray(np.where(row >= lip, LEVELS, below), dtype=np.float64)


def test_ground_that_falls_at_once_is_told_from_a_slope(sure_ground: Ground) -> None:
    columns = (20.0, 300.0)
    drop, _ = descent(images(pictures(_descended(0)), sure_ground), columns, 12.0)
    slope, steepness = descent(images(pictures(_descended(10)), sure_ground), columns, 12.0)
    assert drop < -2.0
    assert slope > 0.0
    # 0.3 m lower: the foot is in line 130, of 11 px: 8.8 px or 5.45 m, and the lip 4 m
    assert steepness == pytest.approx(0.3 / 1.45, rel=0.15)


def test_where_nothing_is_seen_of_a_descent_nothing_is_told(sure_ground: Ground) -> None:
    scene = images(pictures(), sure_ground)
    assert descent(scene, (100.0, 104.0), 12.0) == (-math.inf, math.inf)


def shadow(*, slope: float, row: int, lower: float) -> Witness:
    """Return a pair with a post's shadow across it, the right image some rows lower."""
    rng = np.random.default_rng(3)
    left = 110.0 + _texture(rng)
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    left[np.abs(v - row + slope * (u - 160)) < 2] -= 80
    right = _moved(left, LEVELS)
    move = np.array([[1, 0, 0], [0, 1, lower]], dtype=np.float32)
    right = np.asarray(cv2.warpAffine(right, move, SHAPE[::-1]), dtype=np.float64)
    return Witness(left=_taken(left, rng), right=_taken(right, rng))


@pytest.mark.parametrize(
    ("slope", "row", "lower"),
    [(0.12, 130, 0.35), (-0.07, 138, -0.35), (0.2, 138, 0.35)],
)
def test_a_shadow_is_no_hole_where_rows_are_a_little_off(
    sure_ground: Ground, slope: float, row: int, lower: float
) -> None:
    assert found(shadow(slope=slope, row=row, lower=lower), sure_ground) == []


def test_a_dark_patch_is_where_a_pit_may_be(sure_ground: Ground) -> None:
    scene = images(pictures(pit=True), sure_ground)
    (patch,) = dark_patches(scene.witness.left, scene.surface, CAMERA)
    assert 135 <= patch.u <= 185
    assert patch.level == pytest.approx(12.0, abs=0.4)
    assert patch.sure == pytest.approx(110 / 70, rel=0.15)


def test_a_dark_band_across_is_no_dark_patch(sure_ground: Ground) -> None:
    scene = images(pictures(), sure_ground)
    band = scene.witness.left.copy()
    band[126:141] //= 2
    assert dark_patches(band, scene.surface, CAMERA) == []
    assert dark_patches(scene.witness.left, scene.surface, CAMERA) == []


def test_a_hole_beside_what_is_dark_is_none(
    sure_ground: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    witness = pictures(pit=True)
    monkeypatch.setattr(module, "mouths", lambda *_, **__: [])
    assert len(found(witness, sure_ground)) == 1  # it is dark
    beside = replace(MOUTH, u=230)
    monkeypatch.setattr(module, "dark_patches", lambda *_: [beside])
    assert opening(images(witness, sure_ground), beside) is not None
    assert found(witness, sure_ground) == []


@pytest.mark.parametrize(("width", "told"), [(0.5, True), (0.35, False)])
def test_what_is_no_rectangle_is_as_wide_as_the_map_says(
    sure_ground: Ground, monkeypatch: pytest.MonkeyPatch, *, width: float, told: bool
) -> None:
    witness = pictures(pit=True)
    ((hole, region),) = found(witness, sure_ground)
    monkeypatch.setattr(module, "_LEAST", 0.8)  # the rectangle is narrower
    seen = replace(hole, width=width)
    assert found(witness, sure_ground) == []
    answers = found(witness, sure_ground, doubtful=((seen, region),))
    assert [answer for answer, _ in answers] == ([seen] if told else [])
