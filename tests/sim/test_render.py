"""Hand-worked geometry: a level camera 1.2 m high with f = 386 px and B = 0.12 m."""

import math
from dataclasses import replace
from itertools import groupby

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.errors import ConfigError
from bearcub.geometry import Attitude, camera_attitude
from bearcub.rig import Mount, Rig
from bearcub.sim import SKY, render, scenes
from bearcub.sim.solids import Cylinder
from bearcub.sim.texture import Material, resolved
from bearcub.sim.world import Ground, Pit, Scene, Thing

PAPER = scenes.paper_rig()
LEVEL = replace(PAPER, mount=Mount(height=1.2))
SMALL = scenes.paper_rig(width=160, height=120)
FB = 386 * 0.12


def degrees(roll: float, pitch: float) -> Attitude:
    return Attitude(roll=math.radians(roll), pitch=math.radians(pitch))


def small(rig: Rig) -> Rig:
    return replace(rig, camera=rig.camera.scaled(width=80, height=60))


@given(
    st.floats(-15, 15),
    st.floats(-10, 10),
    st.floats(-5, 15),
    st.floats(-5, 5),
    st.floats(0.3, 2.0),
)
@settings(max_examples=25, deadline=None)
def test_floor_has_the_disparity_of_the_closed_form_at_any_attitude(
    roll: float, pitch: float, mount_pitch: float, mount_roll: float, height: float
) -> None:
    mount = Mount(
        height=height, pitch=math.radians(mount_pitch), roll=math.radians(mount_roll), x=0.2
    )
    rig = small(Rig(camera=PAPER.camera, mount=mount))
    body = degrees(roll, pitch)
    frame = render(scenes.floor(), rig, body=body, supersample=1)
    down = camera_attitude(body=body, mount=mount.attitude).down()
    a, b, c = rig.camera.projection.plane(height=height, down=down)
    u, v = np.meshgrid(np.arange(80), np.arange(60))
    closed_form = a * u + b * v + c
    clear = np.abs(closed_form) > 1e-9  # the horizon itself may fall on either side
    np.testing.assert_array_equal((frame.labels == 0)[clear], (closed_form > 0)[clear])
    # float32 keeps 1e-5 px at 100 px
    np.testing.assert_allclose(frame.disparity, np.maximum(closed_form, 0), atol=1e-4)


def test_sky_has_disparity_zero_and_a_label_of_its_own() -> None:
    frame = render(scenes.floor(), small(LEVEL), supersample=1)
    assert (frame.labels[:30] == SKY).all()
    assert (frame.labels[30:] == 0).all()
    assert (frame.disparity[:30] == 0).all()


def test_roll_right_side_down_brings_the_floor_nearer_on_the_right() -> None:
    frame = render(scenes.floor(), SMALL, body=degrees(12, 0), supersample=1)
    assert frame.disparity[-1, -1] > frame.disparity[-1, 0] > 0
    horizon = np.argmax(frame.labels == 0, axis=0)
    # turned counter-clockwise: the right end is up, by tan(12.06 deg) of 159 columns
    assert horizon[0] - horizon[-1] == pytest.approx(159 * math.tan(math.radians(12.06)), abs=1)


def test_pitch_nose_down_raises_the_horizon() -> None:
    rows = [
        int(np.argmax(frame.labels[:, 320] == 0))
        for frame in (
            render(scenes.floor(), PAPER, body=degrees(0, pitch), supersample=1) for pitch in (0, 5)
        )
    ]
    # cy - f tan(pitch), first whole row below it: 239.5 - 39.9 = 199.6 and 239.5 - 74.2 = 165.3
    assert rows == [200, 166]


def test_front_of_the_can_is_at_its_distance() -> None:
    frame = render(scenes.garbage_can(bearing=0.0), LEVEL, supersample=1)
    face = frame.disparity[frame.labels == 1]
    # the middle columns miss the nearest line of the rim by 4 mm, 0.04 mm in depth
    assert face.max() == pytest.approx(FB / 3.05, abs=1e-3)
    # the far edge of the lid, 0.5 m below the camera at 3.4775 m, is on row 295.0
    assert (frame.labels[297, 320], frame.labels[293, 320]) == (1, 0)


def test_pit_shows_its_bottom_and_its_far_wall() -> None:
    hole = Pit(x0=2.0, x1=4.0, y0=-1.0, y1=1.0, depth=0.3, texture=scenes.SOIL)
    scene = Scene(ground=Ground(texture=scenes.ASPHALT, pits=(hole,)))
    frame = render(scene, LEVEL, supersample=1)
    # row 400: 160.5 px below the horizon; bottom 1.5 m under the camera, at 3.61 m
    assert frame.disparity[400, 320] == pytest.approx(0.12 / 1.5 * 160.5, abs=1e-5)
    # row 380: the floor would be at 3.30 m, inside the mouth; the bottom at 4.12 m, past the wall
    assert frame.disparity[380, 320] == pytest.approx(FB / 4.0, abs=1e-5)
    assert frame.labels[400, 320] == frame.labels[380, 320] == -1
    # 10 rows further down than the near lip (239.5 + 386 * 1.2 / 2 = 471.1) floor again
    assert frame.labels[470, 320] == -1
    assert frame.labels[472, 320] == 0


def test_side_wall_of_a_pit_is_where_it_was_dug() -> None:
    hole = Pit(x0=2.0, x1=4.0, y0=-0.5, y1=0.5, depth=0.4, texture=scenes.SOIL)
    frame = render(Scene(ground=Ground(texture=scenes.SOIL, pits=(hole,))), LEVEL, supersample=1)
    # row 440, column 383: the floor would be at (2.31 m, -0.38 m), inside the mouth;
    # 63.5 px to the right, the right wall is met at Z = 0.5 * 386 / 63.5 = 3.04 m, z = -0.38 m
    assert frame.labels[440, 383] == -1
    assert frame.disparity[440, 383] == pytest.approx(0.12 * 63.5 / 0.5, abs=1e-5)


def test_ramp_rises_from_its_foot() -> None:
    frame = render(scenes.ramp(start=3.0, slope=math.atan(0.15)), LEVEL, supersample=1)
    # z = 0.15 (x - 3) meets 1.2 - x m, m = 60.5 / 386, at x = 1.65 / (0.15 + m)
    assert frame.disparity[300, 320] == pytest.approx(FB * (0.15 + 60.5 / 386) / 1.65, abs=1e-5)
    # before its foot (row 394) the flat floor
    assert frame.disparity[400, 320] == pytest.approx(0.1 * 160.5, abs=1e-5)


def test_ramp_down_lies_below_the_floor() -> None:
    frame = render(scenes.ramp(start=3.0, slope=math.atan(-0.1)), LEVEL, supersample=1)
    # z = -0.1 (x - 3) meets 1.2 - x m, m = 100.5 / 386, at x = 0.9 / (m - 0.1)
    assert frame.disparity[340, 320] == pytest.approx(FB * (100.5 / 386 - 0.1) / 0.9, abs=1e-5)


def test_ground_that_rises_to_the_left_is_nearer_there() -> None:
    frame = render(scenes.cross_slope(slope=math.atan(0.1)), LEVEL, supersample=1)
    # z = 0.1 y, y = -x n, n = -219.5 / 386: x = 1.2 / (160.5 / 386 + 0.1 * 219.5 / 386)
    expected = 0.12 * (160.5 + 0.1 * 219.5) / 1.2
    assert frame.disparity[400, 100] == pytest.approx(expected, abs=1e-5)
    assert frame.disparity[400, 539] < frame.disparity[400, 100]


def test_body_standing_on_a_cross_slope_sees_it_level() -> None:
    scene = scenes.cross_slope(slope=math.radians(8))
    frame = render(scene, small(LEVEL), body=scenes.standing(scene), supersample=1)
    assert math.degrees(scenes.standing(scene).roll) == pytest.approx(8.0)
    np.testing.assert_allclose(frame.disparity[45], frame.disparity[45, 0], atol=1e-4)


def test_kerb_faces_the_robot() -> None:
    frame = render(scenes.kerb(distance=3.0, height=0.12), LEVEL, supersample=1)
    # z = 0.06 at 3 m is row 239.5 + 386 * 1.14 / 3 = 386.2
    assert frame.disparity[386, 320] == pytest.approx(FB / 3, abs=1e-5)
    assert frame.disparity[360, 320] == pytest.approx(0.12 / 1.08 * 120.5, abs=1e-5)
    assert frame.labels[386, 320] == 1  # the first number after the things': there are none
    assert frame.labels[360, 320] == 0


def test_drop_shows_the_ground_beyond_its_lip() -> None:
    frame = render(scenes.drop(distance=3.0, depth=0.5), LEVEL, supersample=1)
    assert frame.disparity[330, 320] == pytest.approx(0.12 / 1.7 * 90.5, abs=1e-5)
    assert frame.labels[330, 320] == -1
    assert frame.labels[395, 320] == 0  # lip at row 393.9


def test_lying_cylinder_is_nearest_at_its_axis_height() -> None:
    frame = render(scenes.branch(distance=3.0, base=0.9), LEVEL, supersample=1)
    # z = 0.96 at 3 m is row 270.4: row 270 passes 3 mm above, 0.1 mm further
    assert frame.disparity[270, 320] == pytest.approx(FB / 3, abs=1e-3)
    assert frame.labels[330, 320] == 0  # grass is seen below it


def test_ground_is_seen_under_a_table_and_not_through_its_top() -> None:
    labels = render(scenes.table(distance=3.0), LEVEL, supersample=1).labels
    # the top's front face: rows 239.5 + 386 * 0.46 / 3 = 298.7 to 239.5 + 386 * 0.5 / 3 = 303.8
    assert labels[301, 320] == 1
    assert labels[306, 320] == 0
    assert labels[345, 320] == 0
    # right front leg: y = -0.55 at 3.02 m is column 389.8
    assert labels[345, 390] == 1


def test_nearer_thing_hides_the_farther_one() -> None:
    labels = render(scenes.two_cans(near=2.5, far=4.5), LEVEL, supersample=1).labels
    assert [key for key, _ in groupby(labels[:, 320].tolist())] == [SKY, 0, 2, 1, 0]


def test_mirrored_scene_gives_the_mirrored_picture() -> None:
    plain = Material(dark=(0.3, 0.3, 0.3), light=(0.3, 0.3, 0.3))

    def scene(side: float) -> Scene:
        hole = Pit(
            x0=2.2, x1=3.0, y0=-0.3 - side * 0.5, y1=0.3 - side * 0.5, depth=0.3, texture=plain
        )
        ground = Ground(texture=plain, pits=(hole,), cross=side * 0.05)
        post = Cylinder(
            start=(3.0, side * 0.6, 0.0), end=(3.0, side * 0.6, 0.8), radius=0.1, texture=plain
        )
        thing = Thing(name="post", foot=(3.0, side * 0.6), parts=(post,))
        return Scene(ground=ground, things=(thing,), sun=(-0.5, 0.0, 0.6))

    one = render(scene(1.0), SMALL, body=degrees(9, 3))
    two = render(scene(-1.0), SMALL, body=degrees(-9, 3))
    np.testing.assert_array_equal(one.labels, two.labels[:, ::-1])
    np.testing.assert_allclose(one.disparity, two.disparity[:, ::-1], atol=1e-4)
    # single rays on an edge may fall to either side in single precision
    assert (np.abs(one.left.astype(int) - two.left[:, ::-1]) > 1).mean() < 1e-3


@pytest.mark.parametrize("doffs", [0.0, 7.0])
def test_both_cameras_see_the_same_point_alike(doffs: float) -> None:
    rig = replace(PAPER, camera=replace(PAPER.camera, doffs=doffs))
    frame = render(scenes.garbage_can(), rig, body=degrees(12, 0))
    u, v = np.meshgrid(np.arange(640, dtype=np.float32), np.arange(480, dtype=np.float32))
    seen = cv2.remap(frame.right, u - (frame.disparity - doffs), v, cv2.INTER_CUBIC)
    error = np.abs(seen.astype(float) - frame.left).mean(axis=2)
    inside = np.zeros((480, 640), dtype=bool)
    inside[5:-5, 60:-5] = True
    can = cv2.erode((frame.labels == 1).astype(np.uint8), np.ones((5, 5))) > 0
    for region in (can, inside & (frame.labels == 0), inside & (frame.labels == SKY)):
        # of 256 grey levels; interpolating the finest texture leaves more at a few pixels
        assert np.median(error[region]) < 2
        assert np.percentile(error[region], 95) < 8
    # the test can fail: half a pixel off is seen
    off = cv2.remap(frame.right, u - (frame.disparity - doffs) + 0.5, v, cv2.INTER_CUBIC)
    wrong = np.abs(off.astype(float) - frame.left).mean(axis=2)
    near = inside & (frame.labels == 0) & (frame.disparity > 15)
    assert np.median(wrong[near]) > 2 * np.median(error[near])


def test_waves_that_rays_cannot_carry_fade_out() -> None:
    footprint = np.array([0.01, 0.025, 1 / 30, 0.05, 1.0], dtype=np.float32)
    np.testing.assert_allclose(resolved(0.1, footprint), [1, 1, 0.5, 0, 0], atol=1e-6)


def test_ground_pieces_must_ascend() -> None:
    with pytest.raises(ConfigError, match=r"\[3.0, 2.0\]: must ascend"):
        Ground(texture=scenes.PLAIN, pieces=((3.0, 0.0, 0.1), (2.0, 0.0, 0.0)))


def test_rendered_arrays_are_read_only() -> None:
    frame = render(scenes.floor(), small(LEVEL), supersample=1)
    arrays = (frame.left, frame.right, frame.disparity, frame.labels)
    assert not any(array.flags.writeable for array in arrays)
