"""Standing pixels become things: what only a strip joins is parted, what gaps interrupt is not."""

import numpy as np
import pytest

from bearcub.geometry import Projection
from bearcub.ground.surface import Surface
from bearcub.messages import Float32
from bearcub.obstacles.segment import Segments, segment
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.stereo.native import COMPILED

CAMERA = Projection(fx=200.0, fy=200.0, cx=119.5, cy=59.5, baseline=0.1)


def grouped(disparity: Float32, *, overhead: int = 0) -> Segments:
    """Group everything that is nearer than a floor of 2 px; the camera is 1 m up.

    What rises into the uppermost `overhead` rows is higher than what blocks the way.
    """
    rows, columns = disparity.shape
    floor = np.full_like(disparity, 2.0)
    floor[:overhead] = -20.0
    sorting = Sorting(
        u=np.arange(columns),
        v=np.arange(rows),
        disparity=disparity,
        floor=floor,
        residual=disparity - floor,
        allowed=np.full_like(disparity, 0.5),
        standing=disparity > 2.5,
        on_floor=disparity <= 2.5,
        below=np.zeros(disparity.shape, dtype=bool),
    )
    return segments_of(sorting, step=1)


def segments_of(sorting: Sorting, *, step: int) -> Segments:
    return segment(
        sorting,
        CAMERA,
        step=step,
        camera_height=1.0,
        lean=0.0,
        least_height=0.1,
        low_height=0.3,
        clearance=2.0,
        least_pixels=30,
        nearest_level=60.0,
        farthest_level=1.0,
    )


def boards(*columns: tuple[int, int, int], strip: int = 0) -> Float32:
    """Return boards of 8 px that end at row 100 (left, right, height), joined by a strip."""
    d = np.full((120, 240), 2.0, dtype=np.float32)
    for left, right, height in columns:
        d[100 - height : 100, left:right] = 8.0
    if strip:
        d[70 : 70 + strip, columns[0][0] : columns[-1][1]] = 8.0
    return d


@pytest.mark.parametrize("second", [25, 60, 90])
def test_strip_along_the_horizon_does_not_join_two_things(second: int) -> None:
    found = grouped(boards((20, 60, 60), (140, 180, second), strip=6))
    names = {int(found.labels[90, u]) for u in (30, 160)}
    assert len(names) == 2
    assert found.labels[72, 100] not in names  # the strip is a thing of its own
    assert found.count == len(np.unique(found.labels)) - 1


def test_strip_beside_a_thing_is_not_part_of_it() -> None:
    d = boards((20, 60, 60))
    d[70:76, 60:200] = 8.0
    found = grouped(d)
    assert found.labels[90, 40] != found.labels[72, 150]


def test_low_side_of_a_thing_is_part_of_it() -> None:
    found = grouped(boards((20, 60, 60), (60, 85, 12)))
    assert found.labels[95, 40] == found.labels[95, 75] != 0


def test_gap_without_matches_does_not_part_a_thing() -> None:
    d = boards((20, 100, 60))
    d[:, 55:59] = np.nan
    found = grouped(d)
    assert found.labels[90, 30] == found.labels[90, 90] != 0


def test_step_in_height_does_not_part_a_thing() -> None:
    found = grouped(boards((20, 60, 60), (60, 120, 25)))
    assert found.labels[95, 30] == found.labels[95, 110] != 0


def before_a_wall(smear: int) -> Float32:
    """Return a wall of 8 px before which a board of 11 px stands, smeared into it over columns."""
    d = boards((20, 160, 80))
    d[40:100, 120:160] = 11.0
    d[40:100, 120 - smear : 120] = np.linspace(8.0, 11.0, smear)
    return d


@pytest.mark.parametrize("smear", [16, 30])
def test_a_thing_before_a_wall_is_parted_from_it_though_the_matcher_smears_it(smear: int) -> None:
    found = grouped(before_a_wall(smear))
    assert found.labels[90, 40] != found.labels[90, 140]
    assert 0 not in (found.labels[90, 40], found.labels[90, 140])
    assert found.count == 2


def test_a_wall_seen_aslant_is_one_thing() -> None:
    found = grouped(before_a_wall(100))
    assert found.labels[90, 25] == found.labels[90, 90] == found.labels[90, 155] != 0


def test_nothing_that_stands_is_no_thing() -> None:
    assert grouped(boards()).count == 0


@pytest.mark.parametrize(("last", "joined"), [(45, True), (30, False)])
def test_what_hangs_overhead_is_a_things_only_where_it_is_not_far_above(
    *, last: int, joined: bool
) -> None:
    d = boards((20, 60, 40))
    d[last - 15 : last, 30:50] = 8.0  # 15 or 30 rows above 40 rows of a thing
    found = grouped(d, overhead=50)
    assert (found.labels[last - 8, 40] == found.labels[80, 40]) == joined
    assert found.labels[last - 8, 40] != 0


@pytest.mark.parametrize(
    "compiled",
    [False, pytest.param(True, marks=pytest.mark.skipif(not COMPILED, reason="no core"))],
)
def test_pixels_between_samples_of_a_thing_are_not_those_of_a_nearer_one_beside_it(
    *, compiled: bool
) -> None:
    """Of every third column; a wall of 24 px ends in column 121, right of a sampled one."""
    d = np.full((240, 240), 2.0, dtype=np.float32)
    d[120:200, 60:122] = 24.0
    d[140:200, 122:180] = 16.0
    none = np.zeros(64, dtype=np.float32)
    plane = np.array([0.0, 0.0, 2.0], dtype=np.float32)
    flat = Surface(plane=plane, height=1.0, bend=none, noise=none)
    sorter = Sorter(disparity=d, surface=flat, tolerance=none + 0.5, farthest_level=1.0)
    found = segments_of(sorter.part(np.s_[::3], np.s_[::3]), step=3)
    things = [
        sorter.disparity[thing.v, thing.u]
        for thing in found.members(sorter, least=30, compiled=compiled)
    ]
    assert [np.unique(own).tolist() for own in things] in ([[24.0], [16.0]], [[16.0], [24.0]])
