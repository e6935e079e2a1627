import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.viewer.placing import Area, Placing
from bearcub.viewer.text import draw_label, draw_text, label_size, text_mask, text_width, wrap
from bearcub.viewer.wording import hole_lines, metres, obstacle_lines, status

areas = st.builds(
    Area,
    st.integers(-40, 220),
    st.integers(-40, 160),
    st.integers(1, 120),
    st.integers(1, 90),
)


@given(st.lists(st.tuples(areas, st.integers(10, 80), st.integers(8, 30)), max_size=12))
def test_labels_never_overlap_and_never_leave_the_picture(
    things: list[tuple[Area, int, int]],
) -> None:
    bounds = Area(0, 0, 200, 150)
    placing = Placing(bounds, things=[area for area, _, _ in things])
    placed = [placing.place((w, h), beside=area) for area, w, h in things]
    found = [place for place in placed if place]
    for i, place in enumerate(found):
        assert place.overlap(bounds) == place.width * place.height
        assert not any(place.overlap(other) for other in found[:i])


def test_label_stands_above_its_thing_where_there_is_room() -> None:
    placing = Placing(Area(0, 0, 200, 150))
    assert placing.place((50, 20), beside=Area(60, 80, 30, 40)) == Area(60, 58, 50, 20)


def test_label_avoids_covering_another_thing() -> None:
    placing = Placing(Area(0, 0, 200, 150), things=[Area(60, 50, 60, 25)])
    place = placing.place((50, 20), beside=Area(60, 80, 30, 40))
    assert place is not None
    assert not place.overlap(placing.things[0])


def test_label_with_no_room_is_left_out() -> None:
    placing = Placing(Area(0, 0, 40, 40), taken=[Area(0, 0, 40, 40)])
    assert placing.place((20, 10), beside=Area(5, 5, 5, 5)) is None


def test_obstacle_label_says_distance_with_sigma_size_and_bearing(box: Any) -> None:
    thing = box(distance=3.052, sigma_distance=0.021, width=0.41, height=0.70, bearing=0.0332)
    assert obstacle_lines(thing) == ("1  3.05 m ±0.02", "0.41×0.70 m  1.9° L")


def test_what_the_border_cuts_is_a_lower_bound(box: Any) -> None:
    assert obstacle_lines(box(truncated=("left",)))[1].startswith("≥0.80×1.20")
    assert obstacle_lines(box(truncated=("top",)))[1].startswith("0.80×≥1.20")


def test_what_hangs_says_from_where(box: Any) -> None:
    assert "from 0.90" in obstacle_lines(box(base_height=0.9))[1]


def test_hole_label_says_size_and_depth_or_its_lower_bound(pit: Any) -> None:
    assert hole_lines(pit()) == ("pit  2.50 m ±0.04", "0.70×0.50 m, ≥0.30 deep")
    drop = pit(kind="drop", length=math.nan, depth=math.nan, depth_is_lower_bound=False)
    assert hole_lines(drop) == ("drop  2.50 m ±0.04", "0.70 m, ? deep")


def test_far_distances_are_rounded_to_their_sigma() -> None:
    assert metres(14.33, 0.56) == "14.3 m ±0.6"


def test_status_says_how_the_camera_stands_and_what_the_floor_comes_from(world: Any) -> None:
    line = " ".join(status(world(roll=math.radians(12)).answer()))
    assert "camera 1.00 m" in line
    assert "roll 12.0°" in line
    assert "floor: image" in line
    assert "slope 1.1 ±0.3°" in line
    assert "5.2 ms" in line
    assert "no floor seen" in " ".join(status(world(seen=False).answer()))


@pytest.mark.parametrize("text", ["±", "°", "×", "≥", "A", "7"])
def test_every_character_of_the_labels_leaves_ink(text: str) -> None:
    assert text_mask(text, 14.0).max() > 120


def test_text_is_cut_at_the_border_not_refused() -> None:
    canvas = np.zeros((20, 30, 3), dtype=np.uint8)
    draw_text(canvas, "3.05 m", (-10, -4), size=14)
    draw_text(canvas, "3.05 m", (25, 12), size=14)
    draw_text(canvas, "3.05 m", (500, 500), size=14)
    assert canvas[:, :8].any()


def test_label_fills_exactly_its_box() -> None:
    lines = ("3.05 m", "0.41 m")
    width, height = label_size(lines, 14.0)
    canvas = np.full((height + 20, width + 20, 3), 255, dtype=np.uint8)
    draw_label(canvas, lines, x=10, y=10, size=14.0, colour=(0, 0, 255))
    assert (canvas[:10] == 255).all()
    assert (canvas[10 + height :] == 255).all()
    assert (canvas[:, :10] == 255).all()
    assert (canvas[:, 10 + width :] == 255).all()
    assert canvas[10 : 10 + height, 10 : 10 + width].min() < 80


def test_wrapped_lines_fit_and_lose_no_word() -> None:
    text = "the tilt sensor and the image disagree by 2.1 deg"
    lines = wrap(text, size=12.0, width=120)
    assert " ".join(lines) == text
    assert len(lines) > 1
    assert max(text_width(line, 12.0) for line in lines) <= 120
