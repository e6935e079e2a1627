import math

import numpy as np
import pytest

from bearcub.errors import ConfigError
from bearcub.sim.materials import ASPHALT, GRASS, PAINTED
from bearcub.sim.objects import (
    KINDS,
    box,
    lying_test_piece,
    place,
    plate,
    standing_test_piece,
    table,
)
from bearcub.sim.texture import Painted, Stroke
from bearcub.sim.world import Ground, Thing

FLAT = Ground(texture=ASPHALT)
RAMP = Ground(texture=ASPHALT, pieces=((2.0, 0.0, 0.1),))
EYE = np.zeros(2)


def nearest(things: tuple[Thing, ...]) -> float:
    points = [part.nearest(EYE) for thing in things for part in thing.parts]
    return float(np.linalg.norm(points, axis=1).min())


def span(thing: Thing) -> tuple[float, float]:
    return min(part.bottom for part in thing.parts), max(part.top for part in thing.parts)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_begins_where_it_was_asked_to(kind: str) -> None:
    for seed in range(3):
        things = place(kind, 3.0, math.radians(-20), ground=FLAT, seed=(seed,))
        assert nearest(things) == pytest.approx(3.0, abs=1e-3)
        x, y = things[0].foot
        assert math.atan2(y, x) == pytest.approx(math.radians(-20))


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_stands_on_the_ground_or_hangs_over_it(kind: str) -> None:
    for thing in place(kind, 4.0, 0.0, ground=RAMP, seed=(1,)):
        bottom, _ = span(thing)
        over = bottom - RAMP.at(*thing.foot)
        hangs = "branch" in thing.name or thing.name == "table top"
        assert over > 0.5 if hangs else over == pytest.approx(0.0, abs=1e-9)


def test_a_seed_builds_one_variant() -> None:
    one, same, other = (place("can", 3.0, 0.0, ground=FLAT, seed=(s,)) for s in (1, 1, 2))
    assert one == same != other


def test_kinds_that_do_not_exist_name_the_nearest() -> None:
    with pytest.raises(ConfigError, match="unknown kind barel: did you mean barrel"):
        place("barel", 3.0, 0.0, ground=FLAT, seed=(1,))


def test_test_pieces_have_the_sizes_of_the_standards() -> None:
    lying = lying_test_piece(3.0, 0.0, ground=FLAT)
    assert span(lying) == pytest.approx((0.0, 0.2))
    np.testing.assert_allclose(np.ptp(lying.parts[0].outline(EYE), axis=0), [0.2, 0.6])
    leg = standing_test_piece(3.0, 0.0, ground=FLAT)
    assert span(leg) == (0.0, 0.4)
    assert nearest((leg,)) == pytest.approx(3.0 - 0.035)
    square = plate(3.0, 0.0, ground=FLAT, yaw=math.radians(45))
    assert span(square) == (0.0, 0.5)
    # 0.5 m turned by 45 deg, and the thickness of 0.02 m
    np.testing.assert_allclose(
        np.ptp(square.parts[0].outline(EYE), axis=0), 0.52 * math.sqrt(0.5) * np.ones(2)
    )


def test_turned_lying_piece_points_along_its_yaw() -> None:
    along = lying_test_piece(3.0, 0.0, ground=FLAT, yaw=math.radians(90))
    np.testing.assert_allclose(np.ptp(along.parts[0].outline(EYE), axis=0), [0.6, 0.2], atol=1e-9)


def test_table_leaves_the_way_free_between_its_legs() -> None:
    top, *legs = table(3.0, 0.0, ground=FLAT, size=(0.8, 1.2, 0.74))
    assert span(top) == pytest.approx((0.70, 0.74))
    assert len(legs) == 4
    for leg in legs:
        assert span(leg) == pytest.approx((0.0, 0.70))
    # inner faces of the legs: 0.6 m from the middle, less a leg's 0.06 m and half of one
    assert min(abs(leg.parts[0].outline(EYE)[:, 1]).min() for leg in legs) == pytest.approx(0.51)


def test_box_stands_on_a_step() -> None:
    ground = Ground(texture=ASPHALT, pieces=((2.0, 0.2, 0.0),))
    assert span(box(3.0, 0.0, ground=ground, size=(0.4, 0.3, 0.5))) == pytest.approx((0.2, 0.7))


def test_paint_covers_its_stroke_and_nothing_else() -> None:
    line = Stroke(start=(1.0, 0.0), end=(3.0, 0.0), width=0.1)
    floor = Painted(ground=GRASS, strokes=(line,), paint=(1.0, 1.0, 1.0))
    x = np.array([2.0, 2.0, 2.0, 0.97, 0.9], dtype=np.float32)
    y = np.array([0.0, 0.04, 0.06, 0.0, 0.0], dtype=np.float32)
    fine = np.full(5, 1e-3, dtype=np.float32)
    bare, seen = GRASS.albedo(x, y, fine), floor.albedo(x, y, fine)
    assert (seen[:, [0, 1, 3]] > 0.5).all()
    np.testing.assert_array_equal(seen[:, [2, 4]], bare[:, [2, 4]])


def test_painted_floor_has_its_pothole_ahead() -> None:
    place_ = [np.array([value], dtype=np.float32) for value in (4.2, 0.4, 0.01)]
    assert PAINTED.albedo(place_[0], place_[1], place_[2]).min() > 0.3
