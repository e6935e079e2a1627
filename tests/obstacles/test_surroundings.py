"""What is around a thing: its foot or the floor below it, what goes on beside it and between."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bearcub.geometry import Projection
from bearcub.messages import Float32, Ground
from bearcub.obstacles.cloud import View
from bearcub.obstacles.measure import Extent
from bearcub.obstacles.segment import Member
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.surroundings import (
    flaring,
    goes_on_below,
    stands_between,
    unseen_beside,
    unseen_between,
)

LEVEL = 8.0  # of the thing [px]; the floor has it in row 100
FOUND = slice(40, 70)  # rows in which it was found
COLUMNS = slice(40, 60)


@pytest.fixture
def stands(sure_ground: Ground) -> Callable[[Float32], bool]:
    """Return a function that asks a map about the thing found in it."""

    ground = replace(sure_ground, noise=0.8)

    def ask(disparity: Float32) -> bool:
        sorter = Sorter.of(disparity, ground, sigmas=2.0, unevenness=0.0, farthest_level=0.5)
        v, u = (grid.ravel() for grid in np.mgrid[FOUND, COLUMNS])
        return goes_on_below(sorter, Member(number=1, u=u, v=v, stride=1, pixels=len(u)))

    return ask


@pytest.fixture
def floor() -> Float32:
    """Return the floor with the upper part of a thing, and noise, in 120 rows."""
    noise = np.random.default_rng(0).normal(0, 0.8, (120, 100))
    d = np.maximum(0.1 * np.arange(120)[:, None] - 2.0, 0) + noise
    d[FOUND, COLUMNS] = LEVEL
    return np.asarray(d, dtype=np.float32)


def test_thing_that_goes_on_to_the_floor_stands(
    floor: Float32, stands: Callable[[Float32], bool]
) -> None:
    floor[70:100, COLUMNS] = LEVEL + np.random.default_rng(1).normal(0, 0.8, (30, 20))
    assert stands(floor)


def test_thing_with_floor_below_hangs(floor: Float32, stands: Callable[[Float32], bool]) -> None:
    assert not stands(floor)


def test_what_nothing_is_known_of_below_is_not_said_to_stand(
    floor: Float32, stands: Callable[[Float32], bool]
) -> None:
    floor[70:, COLUMNS] = np.nan
    assert not stands(floor)


def test_legs_do_not_make_a_table_stand(floor: Float32, stands: Callable[[Float32], bool]) -> None:
    floor[70:100, 40:43] = floor[70:100, 57:60] = LEVEL
    assert not stands(floor)


def test_a_thing_may_go_on_where_nothing_beside_it_is_matched() -> None:
    d = np.full((40, 100), 4.0, dtype=np.float32)
    d[10:30, 40:60] = 10.0
    d[:, 60:67] = np.nan  # seven dark columns on its right
    d[:, 31:40] = np.nan  # nine on its left, where the right image does not show six of them
    assert unseen_beside(d, (40, 10, 59, 29), 10.0) == (3.0, 7.0)


def test_what_the_right_image_does_not_show_beside_a_thing_makes_it_no_wider() -> None:
    d = np.full((40, 100), 4.0, dtype=np.float32)
    d[10:30, 40:60] = 10.0
    d[10:30, 34:40] = np.nan
    assert unseen_beside(d, (40, 10, 59, 29), 10.0) == (0.0, 0.0)


def test_a_thing_at_the_image_border_has_nothing_beside_it() -> None:
    d = np.full((40, 100), 10.0, dtype=np.float32)
    assert unseen_beside(d, (0, 10, 99, 29), 10.0) == (0.0, 0.0)


ONE, OTHER = (10, 20, 29, 59), (60, 30, 79, 69)  # with columns 30 to 59 and rows 30 to 59 between


@pytest.mark.parametrize(
    ("own", "behind", "out_of_sight"),
    [
        (8, 0, True),
        (8, 1, False),  # an eighth of what is matched lies behind
        (15, 0, False),  # the half is matched
        (0, 0, False),  # nothing tells whether it goes on
    ],
)
def test_middle_of_a_thing_is_out_of_sight_where_little_is_matched_and_nothing_behind(
    *, own: int, behind: int, out_of_sight: bool
) -> None:
    d = np.full((100, 100), np.nan, dtype=np.float32)
    d[30:60, 30 : 30 + own] = 8.0
    d[30:60, 59 : 59 - behind : -1] = 2.0
    assert unseen_between(d, ONE, OTHER, farthest=7.0) == out_of_sight
    assert unseen_between(d, OTHER, ONE, farthest=7.0) == out_of_sight


# f = 100 px, B = 0.12 m, a camera that looks level from 1.2 m up: the horizon is row 20, the floor
# 1 m away has 12 px in row 140, what stands there is 0.2 m high in row 120
KERB = Projection(fx=100.0, fy=100.0, cx=50.0, cy=20.0, baseline=0.12)
AHEAD = View(
    projection=KERB,
    base_from_optical=np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    origin=np.array([0.0, 0.0, 1.2]),
)


def part(first: int, last: int) -> Extent:
    """Return a part of a kerb 1 m ahead, 0.2 m high, in some columns."""
    right, left = np.arctan((50 - np.array([last, first])) / 100)
    return Extent(
        x=1.0,
        y=0.0,
        distance=1.0,
        bearing=0.5 * (right + left),
        right=right,
        left=left,
        range_right=1 / np.cos(right),
        range_left=1 / np.cos(left),
        width=0.01 * (last - first),
        top=0.2,
        bottom=0.0,
        lowest=0.0,
        fill=1.0,
        front=0.2,
        climb=np.nan,
        ground=0.0,
        sigma_distance=0.01,
        sigma_bearing=0.001,
        sigma_width=0.02,
        sigma_top=0.02,
    )


@pytest.mark.parametrize(
    ("columns", "of_the_kerb", "goes_on"),
    [
        (slice(0, 100), 1.0, True),  # from one to the other
        (slice(0, 100), 0.6, True),  # a matcher's smoothness leaves more than half of it
        (slice(0, 100), 0.4, False),
        (slice(0, 40), 1.0, False),  # the floor is seen behind it in half of the columns between
    ],
)
def test_a_kerb_goes_on_where_its_face_is_seen(
    sure_ground: Ground, columns: slice, of_the_kerb: float, *, goes_on: bool
) -> None:
    d = np.repeat(0.1 * np.arange(160)[:, None] - 2.0, 100, axis=1).astype(np.float32)
    face = slice(120, 140)
    d[face, columns] += of_the_kerb * (12.0 - d[face, columns])
    sorter = Sorter.of(d, sure_ground, sigmas=3.0, unevenness=0.0, farthest_level=0.5)
    left, right = part(5, 20), part(60, 95)
    assert stands_between(sorter, AHEAD, left, right) == goes_on
    assert stands_between(sorter, AHEAD, right, left) == goes_on


@pytest.mark.parametrize("stride", [1, 3])
def test_a_thing_flares_by_how_much_wider_its_lower_third_is(stride: int) -> None:
    shape = np.repeat([3, 5, 9], 3)[:, None] > np.arange(9)  # 3, 5 and 9 wide, 3 rows each
    v, u = stride * np.argwhere(shape).T
    member = Member(number=1, u=u, v=v, stride=stride, pixels=stride**2 * len(u))
    assert flaring(member) == pytest.approx(6 * stride)


def test_what_narrows_downwards_does_not_flare() -> None:
    v, u = np.argwhere(np.repeat([9, 5, 3], 3)[:, None] > np.arange(9)).T
    assert flaring(Member(number=1, u=u, v=v, stride=1, pixels=len(u))) == 0.0
