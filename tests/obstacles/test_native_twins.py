"""The compiled kernels of the obstacle stage find what their twins in NumPy find."""

import math
from functools import partial
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.geometry import Attitude, Projection, base_from_optical
from bearcub.ground.surface import Surface
from bearcub.messages import Float32, Obstacle, Terrain, UInt8
from bearcub.obstacles import parallax
from bearcub.obstacles.cloud import View, cloud_of
from bearcub.obstacles.free_range import free_range
from bearcub.obstacles.layers import Painter
from bearcub.obstacles.parallax import evidence, feet
from bearcub.obstacles.segment import Segments, segment
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.obstacles.surroundings import hidden_below, mixed
from bearcub.obstacles.trim import Trimmer
from bearcub.obstacles.warp import window_between
from bearcub.stereo.native import core, levels, reason_missing

pytestmark = pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")

LENS = Projection(fx=193.0, fy=190.0, cx=159.0, cy=121.0, baseline=0.12)
HEIGHT = 1.2
DOWN = Attitude(pitch=0.1, roll=0.05).down()
VIEW = View(
    projection=LENS,
    base_from_optical=base_from_optical(DOWN, np.array([0.0, 0.0, 1.0])),
    origin=np.array([0.1, -0.05, HEIGHT]),
)
PLANE = LENS.plane(height=HEIGHT, down=DOWN)


def sorter_of(seed: int, *, unmatched: float, boxes: int) -> Sorter:
    """Return a floor with boxes that stand and pits, noise and NaN where unmatched."""
    random = np.random.default_rng(seed)
    u, v = np.arange(320)[None, :], np.arange(240)[:, None]
    d = np.maximum(PLANE[0] * u + PLANE[1] * v + PLANE[2], 0.0)
    for _ in range(boxes):
        left, top = random.integers(0, 300), random.integers(40, 220)
        box = np.s_[top : top + random.integers(5, 60), left : left + random.integers(3, 80)]
        d[box] = np.maximum(0.0, d[box].max(initial=0.0) + random.uniform(-2.0, 2.0))
    d = np.maximum(d + random.normal(0.0, 0.2, d.shape), 0.0).astype(np.float32)
    d[random.random(d.shape) < unmatched] = np.nan
    levels = np.arange(16 * 20, dtype=np.float32) / 16
    surface = Surface(
        plane=PLANE.astype(np.float32),
        height=HEIGHT,
        bend=(0.05 * np.sin(levels)).astype(np.float32),
        noise=np.full_like(levels, 0.2),
    )
    tolerance = (0.4 + 0.02 * levels).astype(np.float32)
    return Sorter(disparity=d, surface=surface, tolerance=tolerance, farthest_level=2.0)


sorters = st.builds(
    sorter_of,
    st.integers(0, 2**31),
    unmatched=st.sampled_from([0.0, 0.3, 1.0]),
    boxes=st.integers(0, 6),
)


def assert_same_bits(first: object, second: object) -> None:
    for name in type(first).__slots__:  # type: ignore[attr-defined]
        np.testing.assert_array_equal(
            getattr(first, name), getattr(second, name), err_msg=name, strict=True
        )


@settings(max_examples=40, deadline=None)
@given(
    sorter=sorters,
    rows=st.slices(240).filter(lambda s: (s.step or 1) > 0),
    columns=st.slices(320).filter(lambda s: (s.step or 1) > 0),
)
def test_pixels_are_sorted_to_the_same_bits(sorter: Sorter, *, rows: slice, columns: slice) -> None:
    first, second = (sorter.part(rows, columns, compiled=compiled) for compiled in (True, False))
    assert_same_bits(first, second)


def segments_of(sorting: Sorting, *, step: int, lean: float, compiled: bool) -> Segments:
    return segment(
        sorting,
        LENS,
        step=step,
        camera_height=HEIGHT,
        lean=lean,
        least_height=0.08,
        low_height=0.3,
        clearance=0.8,
        least_pixels=20,
        nearest_level=60.0,
        farthest_level=2.0,
        compiled=compiled,
    )


@settings(max_examples=60, deadline=None)
@given(sorter=sorters, step=st.sampled_from([1, 2, 3]), lean=st.floats(-0.3, 0.3))
def test_things_are_segmented_to_the_same_bits(sorter: Sorter, *, step: int, lean: float) -> None:
    sorting = sorter.part(np.s_[::step], np.s_[::step])
    first, second = (
        segments_of(sorting, step=step, lean=lean, compiled=compiled) for compiled in (True, False)
    )
    assert_same_bits(first, second)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    count=st.integers(1, 400),
    width=st.floats(0.0, 60.0),
    share=st.sampled_from([0.15, 0.35, 0.9]),
    blur=st.floats(0.0, 0.1),
)
def test_points_are_measured_alike(
    *, seed: int, count: int, width: float, share: float, blur: float
) -> None:
    random = np.random.default_rng(seed)
    u, v = random.uniform(0, width, count) + 30, random.uniform(0, 100, count) + 50
    d = random.normal(8.0, 0.5, count).clip(1.0).astype(np.float32)
    first, second = (cloud_of(VIEW, u, v, d, compiled=compiled) for compiled in (True, False))

    def same(name: str, *given: Any, atol: float = 1e-9) -> None:
        found, expected = getattr(first, name)(*given), getattr(second, name)(*given)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=atol, err_msg=name)

    same("sides", 1.0 / LENS.fx, share)
    same("heights", 0.03, share)
    same("face", *first.sides(1.0 / LENS.fx, share), 1.0 / LENS.fx, blur, 25.0)
    same("range", share)
    same("height_before", 2.9, share)
    same("squares")
    same("spread")


def test_points_behind_and_beside_have_the_bearings_of_the_arc_tangent() -> None:
    d = np.full(3, 4.0, dtype=np.float32)
    v = np.full(3, 100.0)
    for turn in np.linspace(0.0, 2 * math.pi, 17):
        c, s = math.cos(turn), math.sin(turn)
        view = View(
            projection=LENS,
            base_from_optical=np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ VIEW.base_from_optical,
            origin=np.zeros(3),
        )
        u = np.array([0.0, 150.0, 319.0])
        for k in range(3):
            one = np.s_[k : k + 1]
            first, second = (
                cloud_of(view, u[one], v[one], d[one], compiled=compiled)
                for compiled in (True, False)
            )
            np.testing.assert_allclose(
                first.sides(0.01, 0.5), second.sides(0.01, 0.5), rtol=0, atol=1e-11
            )


@settings(max_examples=30, deadline=None)
@given(sorter=sorters, step=st.sampled_from([1, 2, 3]))
def test_what_is_nearer_beside_a_thing_is_told_alike(sorter: Sorter, *, step: int) -> None:
    sorting = sorter.part(np.s_[::step], np.s_[::step])
    segments = segments_of(sorting, step=step, lean=0.05, compiled=True)
    for member in segments.members(sorter, least=5):
        for tell in (mixed, hidden_below):
            first, second = (
                tell(sorter.disparity, segments, member, compiled=compiled)
                for compiled in (True, False)
            )
            assert first == second


@settings(max_examples=30, deadline=None)
@given(
    sorter=sorters,
    seed=st.integers(0, 2**31),
    step=st.sampled_from([1, 2, 3]),
    plain=st.booleans(),
    pair=st.booleans(),
)
def test_all_pixels_of_a_thing_are_found(
    *, sorter: Sorter, seed: int, step: int, plain: bool, pair: bool
) -> None:
    random = np.random.default_rng(seed)
    contrast = 0.0 if plain else 40.0
    left, right = (
        (128 + contrast * random.normal(size=(240, 320))).clip(0, 255).astype(np.uint8)
        for _ in range(2)
    )
    right[:, :300] = left[:, 20:]  # the same texture wherever the disparity is 20
    trim = Trimmer(left=left, right=right, offset=1.5) if pair else None
    segments = segments_of(
        sorter.part(np.s_[::step], np.s_[::step]), step=step, lean=0.0, compiled=True
    )
    first, second = (
        list(segments.members(sorter, least=5, trim=trim, compiled=compiled))
        for compiled in (True, False)
    )
    if not pair:
        for one, other in zip(first, second, strict=True):
            assert_same_bits(one, other)
        return
    counts = [{member.number: member.pixels for member in members} for members in (first, second)]
    for number in counts[0].keys() | counts[1].keys():
        few, many = sorted(found.get(number, 0) for found in counts)
        assert many - few <= 1 + 0.02 * many  # rounding decides of some


def boxes_on_a_floor(
    seed: int, *, surface: Surface, offset: float, gain: float, columns: int
) -> tuple[UInt8, UInt8]:
    """Return a textured pair in which upright patches stand on the floor."""
    random = np.random.default_rng(seed)
    shape = 240, columns
    u, v = np.arange(columns)[None, :], np.arange(240)[:, None]
    d = surface.at(u, v) - np.float32(offset)
    for _ in range(columns // 50):
        left, foot = random.integers(0, columns - 14), random.integers(150, 240)
        box = np.s_[foot - 14 : foot, left : left + 14]
        d[box] = d[foot - 1, left]
    right = 120 + cv2.GaussianBlur(random.normal(0, 90, shape), (0, 0), 2.0)
    at = (u - d).astype(np.float32)
    row = np.broadcast_to(v.astype(np.float32), shape).copy()
    left_image = gain * cv2.remap(right.astype(np.float32), at, row, cv2.INTER_LINEAR)
    one, other = (
        (image + random.normal(0, 1.5, shape)).clip(0, 255).astype(np.uint8)
        for image in (left_image, right)
    )
    return one, other


def surface_of(*, roll: float, bent: float, offset: float) -> Surface:
    plane = LENS.plane(height=HEIGHT, down=Attitude(pitch=0.1, roll=roll).down())
    levels = np.arange(16 * 40, dtype=np.float32) / 16
    return Surface(
        plane=(plane + np.array([0.0, 0.0, offset])).astype(np.float32),
        height=HEIGHT,
        bend=(bent * np.sin(levels)).astype(np.float32),
        noise=np.full_like(levels, 0.2),
    )


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    roll=st.floats(-0.2, 0.2),
    bent=st.floats(0.0, 0.2),
    offset=st.sampled_from([0.0, 12.0]),  # the second shows what is looked at by half the columns
    gain=st.floats(0.8, 1.2),
    columns=st.sampled_from([320, 211, 40]),
)
def test_the_same_feet_show(
    *, seed: int, roll: float, bent: float, offset: float, gain: float, columns: int
) -> None:
    surface = surface_of(roll=roll, bent=bent, offset=offset)
    pair = boxes_on_a_floor(seed, surface=surface, offset=offset, gain=gain, columns=columns)
    first, second = (
        {
            (foot.u, foot.v): foot
            for foot in feet(*pair, surface, baseline=0.12, offset=offset, compiled=compiled)
        }
        for compiled in (True, False)
    )
    for place in first.keys() ^ second.keys():
        assert (first.get(place) or second[place]).sure < 7.2  # rounding decides
    for place in first.keys() & second.keys():
        # a few grey levels are rounded to the other side
        assert first[place].sure == pytest.approx(second[place].sure, rel=0.03)
        assert first[place].level == pytest.approx(second[place].level, rel=1e-5)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    roll=st.floats(-0.2, 0.2),
    bent=st.floats(0.0, 0.2),
    step=st.sampled_from([1, 2]),
    columns=st.sampled_from([320, 211, 40]),
)
def test_the_same_parallax_shows(
    *, seed: int, roll: float, bent: float, step: int, columns: int
) -> None:
    surface = surface_of(roll=roll, bent=bent, offset=0.0)
    pair = boxes_on_a_floor(seed, surface=surface, offset=0.0, gain=1.1, columns=columns)
    window = window_between(pair[0].shape, surface, 6.0, 14.0, step=step)
    assert window is not None
    first, second = (
        evidence(*pair, surface, window, offset=0.0, compiled=compiled)
        for compiled in (True, False)
    )
    for one, other in zip(first, second, strict=True):
        assert one.shape == other.shape == (window.rows, window.columns)
        # a few grey levels are rounded to the other side
        assert np.mean(~np.isclose(one, other, rtol=1e-3, atol=0.05)) < 0.01
    np.testing.assert_allclose(first[2], second[2], rtol=0.01)


@pytest.mark.parametrize("offset", [0.0, 12.0])
def test_feet_are_the_same_to_the_bit_on_every_instruction_set(
    monkeypatch: pytest.MonkeyPatch, *, offset: float
) -> None:
    surface = surface_of(roll=0.05, bent=0.1, offset=offset)
    pair = boxes_on_a_floor(2, surface=surface, offset=offset, gain=1.1, columns=320)
    found = []
    for level in levels():
        of_level = SimpleNamespace(
            find_feet=partial(core.find_feet, level=level), FeetTuning=core.FeetTuning
        )
        monkeypatch.setattr(parallax, "core", of_level)
        found.append(feet(*pair, surface, baseline=0.12, offset=offset))
    assert len(found[0]) > 0
    assert all(other == found[0] for other in found)


def an_obstacle(identity: int, base: float) -> Obstacle:
    return Obstacle(
        id=identity,
        x=2.0,
        y=0.1 * identity,
        distance=2.0,
        bearing=0.05 * identity,
        width=0.05,
        height=1.0,
        base_height=base,
        sigma_distance=0.1,
        sigma_bearing=0.01,
        sigma_width=0.1,
        sigma_height=0.1,
        confidence=0.9,
        box=(0, 0, 1, 1),
        pixels=100,
        truncated=(),
        votes=(),
    )


@settings(max_examples=40, deadline=None)
@given(sorter=sorters, farthest=st.sampled_from([4.0, 12.0]), step=st.sampled_from([1, 2]))
def test_the_way_is_as_free(sorter: Sorter, *, farthest: float, step: int) -> None:
    sorting = sorter.part(np.s_[::step], np.s_[::step])
    segments = segments_of(sorting, step=step, lean=0.05, compiled=False)
    obstacles = (an_obstacle(1, 0.0), an_obstacle(2, 1.5))  # the second hangs above the robot
    identities = np.zeros(segments.count + 1, dtype=np.int32)
    identities[1:3] = np.arange(1, 3)[: segments.count]
    painter = Painter(sorter=sorter, segments=segments, identities=identities, holes=())
    nan = math.nan
    terrain = Terrain(slope=nan, cross_slope=nan, sigma=nan, roughness=nan, reference="robot")
    first, second = (
        free_range(
            sorting,
            painter,
            obstacles,
            terrain,
            VIEW,
            bearing_step=math.radians(2.0),
            farthest=farthest,
            clearance=0.8,
            steepest=0.3,
            compiled=compiled,
        )
        for compiled in (True, False)
    )
    alike = np.isclose(first.range, second.range, rtol=1e-5, equal_nan=True)
    assert np.count_nonzero(~alike) <= 1  # a pixel on a border between cells
    assert sum(a != b for a, b in zip(first.limit, second.limit, strict=True)) <= 1


def test_a_map_of_any_stride_is_sorted() -> None:
    sorter = sorter_of(3, unmatched=0.1, boxes=2)
    wide: Float32 = np.repeat(sorter.disparity, 2, axis=1)
    every_other = Sorter(
        disparity=wide[:, ::2],
        surface=sorter.surface,
        tolerance=sorter.tolerance,
        farthest_level=2.0,
    )
    assert_same_bits(every_other.part(np.s_[:], np.s_[:]), sorter.part(np.s_[:], np.s_[:]))
