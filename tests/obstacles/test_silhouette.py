"""Sides of things are where the image shows them, and as sure as it shows nothing else."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bearcub.geometry import Projection
from bearcub.messages import UInt8
from bearcub.obstacles.cloud import View
from bearcub.obstacles.joining import Thing
from bearcub.obstacles.measure import Extent
from bearcub.obstacles.silhouette import with_silhouettes

# f = 100 px, a level camera 1.2 m up: 4 m away a column is 4 cm wide, and the floor in row 50; what
# is 1 m high ends in row 25
LEVEL = View(
    projection=Projection(fx=100.0, fy=100.0, cx=80.0, cy=20.0, baseline=0.12),
    base_from_optical=np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    origin=np.array([0.0, 0.0, 1.2]),
)
FLOOR = 50
PIXEL = 0.01  # angle of a column, straight ahead [rad]


def matched(first: int, last: int) -> Thing:
    """Return what was matched 4 m ahead, 1 m high, from one column to another."""
    left, right = (math.atan((80 - u) * PIXEL) for u in (first - 0.5, last + 0.5))
    extent = Extent(
        x=4.0,
        y=0.0,
        distance=4.0,
        bearing=0.5 * (left + right),
        right=right,
        left=left,
        range_right=4.0 / math.cos(right),
        range_left=4.0 / math.cos(left),
        width=0.04 * (last + 1 - first),
        top=1.0,
        bottom=0.0,
        lowest=0.0,
        fill=1.0,
        front=1.0,
        climb=math.nan,
        ground=0.0,
        sigma_distance=0.01,
        sigma_bearing=0.0,
        sigma_width=0.0,
        sigma_top=0.02,
    )
    return Thing(extent=extent, box=(first, 25, last, 50), pixels=1000, numbers=(1,))


def picture(first: int, last: int) -> UInt8:
    """Return a bright board on dark ground, between two columns."""
    image = np.full((80, 160), 40, dtype=np.uint8)
    image[25 : FLOOR + 1, first : last + 1] = 140
    return image


def told(thing: Thing, image: UInt8) -> Extent:
    (seen,) = with_silhouettes([thing], image, LEVEL)
    return seen.extent


@pytest.mark.parametrize("off", [-2, 0, 2])
def test_sides_move_to_the_silhouette(off: int) -> None:
    found = told(matched(70 - off, 89 + off), picture(70, 89))
    assert found.width == pytest.approx(0.8, abs=0.004)  # 20 columns of 4 cm
    assert found.left == pytest.approx(math.atan(10.5 * PIXEL), abs=0.1 * PIXEL)
    assert found.right == pytest.approx(math.atan(-9.5 * PIXEL), abs=0.1 * PIXEL)
    assert found.bearing == pytest.approx(0.5 * (found.left + found.right))


def test_a_side_that_alone_is_seen_is_sure_to_a_tenth_of_a_column() -> None:
    found = told(matched(70, 89), picture(70, 89))
    assert found.sigma_bearing == pytest.approx(0.5 * math.sqrt(2) * 0.1 * PIXEL, rel=0.05)
    assert found.sigma_width == pytest.approx(math.sqrt(2) * 0.1 * 0.04, rel=0.1)


def test_a_side_is_as_doubtful_as_half_of_how_far_off_the_silhouette_is() -> None:
    found = told(matched(82, 89), picture(70, 89))  # 12 columns of the left end are not matched
    assert found.left == pytest.approx(math.atan(-1.5 * PIXEL))  # too far to be moved
    assert found.sigma_bearing == pytest.approx(0.5 * 6 * PIXEL, rel=0.05)
    assert found.sigma_width == pytest.approx(6 * 0.04, rel=0.05)


def test_nothing_is_known_of_sides_that_the_image_does_not_show() -> None:
    plain = np.full((80, 160), 40, dtype=np.uint8)
    found = told(matched(70, 89), plain)
    assert found.width == pytest.approx(0.8)
    assert found.sigma_width > 0.2


def test_a_wider_foot_makes_width_and_distance_doubtful_but_moves_no_side() -> None:
    image = picture(70, 89)
    image[49 : FLOOR + 1, 67:93] = 140  # 3 columns, 12 cm, at either side, 6 cm high
    found, without = told(matched(70, 89), image), told(matched(70, 89), picture(70, 89))
    assert found.width == pytest.approx(without.width, abs=0.004)
    assert found.sigma_width == pytest.approx(math.sqrt(2) * 1.3 * 0.12, rel=0.1)
    assert found.sigma_distance == pytest.approx(1.3 * 0.12, rel=0.1)


def test_a_shadow_at_one_side_does_not_make_the_distance_doubtful() -> None:
    image = picture(70, 89)
    image[49 : FLOOR + 1, 90:93] = 140
    found = told(matched(70, 89), image)
    assert found.sigma_width == pytest.approx(1.3 * 0.12, rel=0.15)
    assert found.sigma_distance == pytest.approx(0.01, rel=0.05)


def test_what_hangs_has_no_foot() -> None:
    image = picture(70, 89)
    image[49 : FLOOR + 1, 67:93] = 140
    thing = matched(70, 89)
    hangs = replace(thing, extent=replace(thing.extent, bottom=0.5))
    assert told(hangs, image).sigma_distance == 0.01


def test_a_side_that_the_image_cuts_stays_there() -> None:
    thing = matched(0, 20)
    assert told(thing, picture(2, 20)).left == thing.extent.left


def test_what_the_images_alone_show_is_left_alone() -> None:
    thing = replace(matched(72, 87), numbers=())
    assert with_silhouettes([thing], picture(70, 89), LEVEL) == [thing]
