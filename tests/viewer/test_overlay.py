import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import Pixel, UInt8
from bearcub.rig import Rig
from bearcub.viewer.overlay import horizon, overlay
from bearcub.viewer.palette import HOLE, NIGHT, distance_colour

GREY = np.full((240, 320, 3), 100, dtype=np.uint8)
DATA = Path(__file__).parents[2] / ".." / "shared" / "data"


def test_floor_turns_green_and_what_is_neither_floor_nor_thing_stays(world: Any, rig: Rig) -> None:
    answer = world().answer()
    picture = overlay(answer, GREY, rig.camera.projection)[:240]
    kind = answer.layers.kind
    clear = np.zeros(kind.shape, dtype=bool)
    clear[:90], clear[130:] = True, True  # away from the horizon line and its name
    floor = picture[clear & (kind == Pixel.FLOOR)]
    assert (floor[:, 1] > floor[:, 2] + 20).all()
    assert (picture[clear & (kind == Pixel.OTHER)] == 100).all()


def test_unseen_ground_is_greyed_but_the_sky_is_not(world: Any, rig: Rig) -> None:
    colourful = GREY.copy()
    colourful[:] = (0, 0, 250)
    answer = world().answer()
    picture = overlay(answer, colourful, rig.camera.projection)
    assert (picture[20:90] == (0, 0, 250)).all()
    assert np.ptp(picture[225, 100].astype(int)) < 130


def test_box_is_drawn_where_the_obstacle_is_in_the_colour_of_its_distance(
    world: Any, rig: Rig, box: Any
) -> None:
    picture = overlay(world(obstacles=(box(),)).answer(), GREY, rig.camera.projection)
    colour = distance_colour(4.0)
    for u, v in ((140, 150), (179, 150), (160, 199), (160, 100)):
        assert tuple(picture[v, u]) == colour
    inside = picture[150, 160].astype(float)
    towards = np.array(colour) - 100.0
    assert inside @ towards > 100 * towards.sum()
    assert tuple(picture[150, 130]) != colour


def test_near_is_warmer_than_far(world: Any, rig: Rig, box: Any) -> None:
    near = overlay(world(obstacles=(box(),)).answer(), GREY, rig.camera.projection)
    far = overlay(world(obstacles=(box(distance=18.0),)).answer(), GREY, rig.camera.projection)
    assert near[150, 160, 2] > far[150, 160, 2]
    assert near[150, 160, 0] < far[150, 160, 0]


@pytest.mark.parametrize("roll_deg", [-12.0, 0.0, 12.0])
def test_horizon_has_the_slope_of_the_floor_plane(world: Any, rig: Rig, roll_deg: float) -> None:
    shape = world(roll=math.radians(roll_deg))
    a, b, _ = shape.plane
    dark = np.zeros((240, 320, 3), dtype=np.uint8)
    white = overlay(shape.answer(), dark, rig.camera.projection)[:240].min(axis=2) >= 100
    v, u = np.nonzero(white[:, :240])  # its name stands to the right
    slope = np.polyfit(u, v, 1)[0]
    assert slope == pytest.approx(-a / b, abs=0.005)
    assert slope == pytest.approx(-math.tan(math.radians(roll_deg)), abs=0.005)


def test_horizon_ends_are_on_the_floor_plane_s_zero() -> None:
    plane = np.array([0.02, 0.1, -15.0])
    ends = horizon(plane, width=320, height=240)
    assert ends is not None
    for u, v in ends:
        assert plane @ [u, v, 1.0] == pytest.approx(0.0, abs=1e-9)
    assert (ends[0][0], ends[1][0]) == (0.0, 319.0)


@pytest.mark.parametrize("plane", [[0.0, 0.0, 3.0], [math.nan, 0.1, 1.0]])
def test_a_plane_without_horizon_draws_none(plane: list[float]) -> None:
    assert horizon(np.array(plane), width=320, height=240) is None


def test_hole_is_hatched_with_stripes_inside_its_mask_only(world: Any, rig: Rig, pit: Any) -> None:
    without = overlay(world().answer(), GREY, rig.camera.projection).astype(int)
    picture = overlay(world(holes=(pit(),)).answer(), GREY, rig.camera.projection).astype(int)
    inside = picture[185:205, 45:95]
    purple = (inside[..., 2] > inside[..., 1] + 60).mean()
    assert 0.3 < purple < 0.7
    assert tuple(picture[195, 40]) == HOLE
    assert (picture[130:175, 230:] == without[130:175, 230:]).all()


def test_labels_stand_on_dark_ground_whatever_the_background(
    world: Any, rig: Rig, box: Any
) -> None:
    white = np.full_like(GREY, 255)
    picture = overlay(world(obstacles=(box(),)).answer(), white, rig.camera.projection)
    label = picture[70:98, 140:240]
    assert label.min() < 80
    assert label.max() > 230
    assert np.median(label) < 110


def test_notes_are_shown_in_a_banner_and_without_notes_there_is_none(world: Any, rig: Rig) -> None:
    plain = overlay(world().answer(), GREY, rig.camera.projection)
    noted = overlay(world(notes=("no floor seen",)).answer(), GREY, rig.camera.projection)
    assert (plain[:8] == 100).all()
    assert (noted[:8, 4:] < 100).any()
    yellow = (noted[:20, 4:, 2] > 180) & (noted[:20, 4:, 0] < 120)
    assert yellow.sum() > 50


def test_size_depends_on_the_image_alone(world: Any, rig: Rig, box: Any, pit: Any) -> None:
    plain = overlay(world().answer(), GREY, rig.camera.projection)
    long = "the tilt sensor disagrees with the image " * 12
    full = overlay(
        world(obstacles=(box(),), holes=(pit(),), notes=(long,), seen=False).answer(),
        GREY,
        rig.camera.projection,
    )
    assert plain.shape == full.shape
    assert plain.shape[1:] == (320, 3)
    assert (plain[240:, :2] == NIGHT).all()


def test_grey_image_is_accepted_and_not_changed(world: Any, rig: Rig) -> None:
    image = np.random.default_rng(0).integers(0, 255, (240, 320)).astype(np.uint8)
    before = image.copy()
    picture = overlay(world().answer(), image, rig.camera.projection)
    assert (image == before).all()
    assert (picture[:8] == image[:8, :, None]).all()


def test_without_an_image_the_disparity_is_drawn_near_warm_and_far_cool(
    world: Any, rig: Rig
) -> None:
    answer = world().answer()
    answer.layers.kind[:] = Pixel.OTHER
    picture = overlay(answer, None, rig.camera.projection)
    blue, _, red = picture[215, 60].astype(int)  # 2.1 m
    assert red > blue + 50
    blue, _, red = picture[130, 60].astype(int)  # 19 m
    assert blue > red + 50


def test_image_of_another_size_is_refused_with_both_sizes(world: Any, rig: Rig) -> None:
    with pytest.raises(InputError, match=r"expected 320 x 240 .* found 160 x 120"):
        overlay(world().answer(), GREY[::2, ::2].copy(), rig.camera.projection)


def test_unknown_numbers_and_things_at_the_border_are_drawn(
    world: Any, rig: Rig, box: Any, pit: Any
) -> None:
    nan = math.nan
    answer = world(
        obstacles=(box(sigma_distance=nan, height=nan, box=(0, 0, 319, 239)),),
        holes=(pit(kind="drop", length=nan, sigma_distance=nan, box=(0, 230, 319, 239)),),
    ).answer()
    assert overlay(answer, GREY, rig.camera.projection).shape[0] > 240


def test_real_road_image_keeps_its_pixels_where_nothing_is_drawn(world: Any, rig: Rig) -> None:
    path = DATA / "inria_road" / "left_46.png"
    if not path.exists():
        pytest.skip("the recording inria_road is not beside the repository")
    image: UInt8 = np.asarray(cv2.imread(str(path)), dtype=np.uint8)[40:280, 100:420].copy()
    picture = overlay(world().answer(), image, rig.camera.projection)
    assert (picture[:90] == image[:90]).all()
    assert (picture[140:239] != image[140:239]).any(axis=2).all()
