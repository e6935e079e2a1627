"""Pieces of a thing become one; things that only stand near each other stay apart."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bearcub.obstacles.joining import Thing, joined
from bearcub.obstacles.measure import Extent


def upright(
    *, right: float, left: float, ahead: float = 4.0, top: float = 1.0, bottom: float = 0.0
) -> Thing:
    """Return a board across the way, from y = `right` to y = `left` [m], `ahead` metres off."""
    return board((ahead, right), (ahead, left), top=top, bottom=bottom)


def board(
    right: tuple[float, float], left: tuple[float, float], *, top: float = 1.0, bottom: float = 0.0
) -> Thing:
    """Return a board from one point (x, y) [m] to another."""
    ends = np.array([right, left])
    along = ends[1] - ends[0]
    share = np.clip(-(ends[0] @ along) / (along @ along), 0.0, 1.0)
    nearest = ends[0] + share * along
    bearings = np.arctan2(ends[:, 1], ends[:, 0])
    extent = Extent(
        x=float(nearest[0]),
        y=float(nearest[1]),
        distance=math.hypot(*nearest),
        bearing=float(bearings.mean()),
        right=float(bearings[0]),
        left=float(bearings[1]),
        range_right=math.hypot(*right),
        range_left=math.hypot(*left),
        width=math.hypot(*along),
        top=top,
        bottom=bottom,
        lowest=bottom,
        fill=1.0,
        front=top,
        climb=math.nan,
        ground=0.0,
        sigma_distance=0.01,
        sigma_bearing=0.001,
        sigma_width=0.02,
        sigma_top=0.02,
    )
    first = round(1000 * (2 + right[1]))
    return Thing(extent=extent, box=(first, 10, first + 100, 90), pixels=1000, numbers=(first,))


def test_pieces_of_a_wall_become_the_wall() -> None:
    pieces = [upright(right=y, left=y + 0.58) for y in (-1.2, -0.6, 0.0, 0.6)]
    (wall,) = joined(pieces, low=0.35)
    assert wall.extent.width == pytest.approx(2.38, abs=0.05)
    assert wall.extent.distance == pytest.approx(4.0, abs=0.01)
    assert wall.extent.bearing == pytest.approx(0.0, abs=0.01)
    assert wall.pixels == 4000
    assert sorted(wall.numbers) == [800, 1400, 2000, 2600]
    assert wall.box == (800, 10, 2700, 90)


def test_piece_before_a_wall_at_its_range_is_the_wall() -> None:
    wall = upright(right=-1.0, left=1.0)
    patch = upright(right=0.2, left=0.6, ahead=4.05, top=0.9)
    (found,) = joined([wall, patch], low=0.35)
    assert found.extent.width == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(
    "other",
    [
        upright(right=0.25, left=0.75),  # 25 cm of way between them
        upright(right=0.0, left=0.5, ahead=4.4),  # 40 cm behind
        upright(right=-0.3, left=0.3, ahead=3.5),  # half a metre before
        upright(right=-0.2, left=0.4, top=1.2, bottom=0.8),  # hangs, and the way goes on under it
    ],
)
def test_things_with_room_between_them_stay_apart(other: Thing) -> None:
    board = upright(right=-0.6, left=0.0)
    assert len(joined([board, other], low=0.35)) == 2


def test_pieces_of_a_flank_seen_aslant_are_one_though_their_ends_are_not_at_one_range() -> None:
    tail = board((3.4, -2.6), (4.6, -2.6))
    front = board((4.75, -2.68), (6.6, -2.68))  # 8 cm aside; 17 cm farther at the near ends
    (car,) = joined([tail, front], low=0.35)
    assert (car.extent.right, car.extent.left) == (tail.extent.right, front.extent.left)


def test_cars_that_are_parked_in_a_row_stay_apart() -> None:
    near = board((10.0, -2.6), (14.0, -2.6))
    far = board((15.0, -2.6), (19.0, -2.6))  # 0.7 deg and a metre of way from the one before
    assert len(joined([near, far], low=0.35)) == 2


def test_two_ends_on_one_line_are_one_thing_where_its_middle_is_out_of_sight() -> None:
    front = board((3.4, -2.7), (3.8, -2.7))  # seven degrees of flank from the tail
    tail = board((4.8, -2.7), (7.4, -2.7))
    assert len(joined([front, tail], low=0.35)) == 2
    (car,) = joined([front, tail], low=0.35, unseen=lambda one, other: True)
    assert (car.extent.right, car.extent.left) == (front.extent.right, tail.extent.left)
    assert len(joined([front, tail], low=0.35, unseen=lambda one, other: False)) == 2


@pytest.mark.parametrize(
    "other",
    [
        board((3.0, -2.3), (3.4, -2.3)),  # 40 cm off the line
        board((2.2, -2.7), (2.4, -2.7)),  # farther away than the tail is long
        board((3.4, -2.7), (3.8, -2.7), top=0.2),  # a kerb
        board((3.4, -2.7), (3.8, -2.7), top=2.0, bottom=1.5),  # hangs
    ],
)
def test_what_is_no_other_end_stays_apart_though_nothing_is_seen_between(other: Thing) -> None:
    tail = board((4.8, -2.7), (7.4, -2.7))
    assert len(joined([other, tail], low=0.35, unseen=lambda one, other: True)) == 2


def test_a_sliver_that_a_matcher_leaves_close_behind_a_surface_is_its() -> None:
    wall = upright(right=-0.6, left=0.6, ahead=1.2)
    sliver = upright(right=-0.3, left=-0.28, ahead=1.35)
    (whole,) = joined([wall, sliver], low=0.35)
    assert whole.extent.distance == pytest.approx(1.2)
    thing = upright(right=-0.3, left=-0.1, ahead=1.35)
    assert len(joined([wall, thing], low=0.35)) == 2


def test_a_low_piece_is_the_foot_of_what_begins_where_it_ends() -> None:
    foot = upright(right=-2.6, left=2.5, ahead=3.6, top=0.21)
    upper = upright(right=-2.5, left=2.5, ahead=3.9)
    higher = replace(upper, extent=replace(upper.extent, lowest=0.18))
    for pieces in ([foot, higher], [higher, foot]):
        (bank,) = joined(pieces, low=0.35)
        assert (bank.extent.distance, bank.extent.top) == (foot.extent.distance, 1.0)
    # a kerb with floor between it and the wall behind
    assert len(joined([foot, upper], low=0.35)) == 2


def test_a_foot_moves_a_bank_nearer_and_not_wider() -> None:
    bank = upright(right=-2.0, left=2.0, top=0.6)
    foot = upright(right=-0.5, left=0.5, ahead=3.7, top=0.12)
    (found,) = joined([foot, bank], low=0.35)
    assert found.extent.distance == pytest.approx(3.7)
    assert found.extent.width == pytest.approx(4.0)
    assert found.numbers == (*bank.numbers, *foot.numbers)


def test_nearest_comes_first() -> None:
    far, near = upright(right=-1.0, left=0.0, ahead=6.0), upright(right=1.0, left=1.5, ahead=2.0)
    assert joined([far, near], low=0.35) == [near, far]
    assert joined([], low=0.35) == []


def test_joining_waits_for_no_order() -> None:
    pieces = [upright(right=y, left=y + 0.58) for y in (-1.2, -0.6, 0.0, 0.6)]
    pieces[0] = replace(pieces[0], extent=replace(pieces[0].extent, width=0.57))
    one, other = joined(pieces, low=0.35), joined(pieces[::-1], low=0.35)
    assert len(one) == len(other) == 1
    assert one[0].extent.width == pytest.approx(other[0].extent.width)


def test_parts_of_a_kerb_are_one_where_it_goes_on_between_them() -> None:
    parts = [upright(right=y, left=y + 0.4, top=0.12) for y in (-1.5, 0.0, 1.2)]
    (kerb,) = joined(parts, low=0.35, standing=lambda one, other: True)
    assert (kerb.extent.right, kerb.extent.left) == (parts[0].extent.right, parts[2].extent.left)
    assert len(joined(parts, low=0.35, standing=lambda one, other: False)) == 3


@pytest.mark.parametrize(
    "other",
    [
        upright(right=0.0, left=0.4, top=0.3),  # higher
        upright(right=0.0, left=0.4, top=0.12, bottom=0.05),  # hangs
    ],
)
def test_what_ends_higher_or_hangs_is_no_part_of_a_kerb(other: Thing) -> None:
    kerb = upright(right=-1.5, left=-1.1, top=0.12)
    assert len(joined([kerb, other], low=0.35, standing=lambda one, other: True)) == 2


def test_tall_things_side_by_side_are_parts_of_nothing() -> None:
    trunks = [upright(right=y, left=y + 0.4) for y in (-1.5, 0.0)]
    assert len(joined(trunks, low=0.35, standing=lambda one, other: True)) == 2


def test_ground_that_goes_on_behind_a_bank_level_with_its_top_is_no_other_thing() -> None:
    bank = upright(right=-3.0, left=3.0)
    plateau = upright(right=-1.0, left=2.0, ahead=6.0, top=1.02)
    behind = replace(plateau, extent=replace(plateau.extent, lowest=0.95))
    for pieces in ([bank, behind], [behind, bank]):
        (found,) = joined(pieces, low=0.35)
        assert found.extent == bank.extent
        assert found.numbers == (*bank.numbers, *behind.numbers)


@pytest.mark.parametrize(
    "change",
    [
        {"top": 1.2},  # rises above the bank
        {"lowest": 0.6},  # is seen below its top: the bank does not reach that far
        {"distance": 3.0},  # stands before it
        {"bottom": 0.95},  # hangs over the way, and the bank does not
    ],
)
def test_what_stands_behind_a_bank_is_another_thing(change: dict[str, float]) -> None:
    bank = upright(right=-3.0, left=3.0)
    thing = upright(right=-1.0, left=2.0, ahead=6.0, top=1.02)
    behind = replace(thing, extent=replace(thing.extent, **{"lowest": 0.95} | change))
    assert len(joined([bank, behind], low=0.35)) == 2


def test_a_low_thing_behind_another_is_another_though_little_of_it_stands_out() -> None:
    near = upright(right=-0.5, left=0.5, ahead=7.6, top=0.2)
    far = upright(right=-0.1, left=0.1, ahead=9.0, top=0.2)
    behind = replace(far, extent=replace(far.extent, lowest=0.12))
    assert len(joined([near, behind], low=0.35)) == 2


def test_the_underside_of_a_table_is_the_table() -> None:
    top = upright(right=-0.6, left=0.6, ahead=2.0, top=0.75, bottom=0.69)
    under = upright(right=-0.3, left=0.4, ahead=2.6, top=0.71, bottom=0.67)
    (table,) = joined([under, top], low=0.35)
    assert table.extent == top.extent


def test_the_far_edge_of_a_table_top_hangs_though_the_top_hides_what_is_below() -> None:
    top = upright(right=-0.6, left=0.6, ahead=4.0, top=0.78, bottom=0.64)
    edge = upright(right=-0.1, left=0.2, ahead=3.95, top=0.76)
    hidden = replace(edge, extent=replace(edge.extent, lowest=0.72))
    (table,) = joined([hidden, top], low=0.35)
    assert table.extent == top.extent
    # a can in front of it stands
    assert len(joined([edge, top], low=0.35)) == 2


@pytest.mark.parametrize(("width", "begins"), [(0.05, 0.82), (0.3, 0.79)])
def test_a_sliver_does_not_tell_how_low_a_branch_hangs(width: float, begins: float) -> None:
    branch = upright(right=-0.6, left=1.0, top=0.97, bottom=0.82)
    piece = upright(right=0.0, left=width, top=0.95, bottom=0.79)
    (whole,) = joined([branch, piece], low=0.35)
    assert whole.extent.bottom == begins
