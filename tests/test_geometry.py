"""The floor's plane in disparity space, attitudes and frames, against numbers worked by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.geometry import (
    OPTICAL_FROM_BODY,
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    camera_attitude,
    forward_in_camera,
    inverse,
    rotation,
)

PAPER = Projection(fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
LEVEL = Attitude(roll=0.0, pitch=0.0)

angles = st.floats(-80, 80)
heights = st.floats(0.05, 5.0)
projections = st.builds(
    Projection,
    fx=st.floats(100, 2000),
    fy=st.floats(100, 2000),
    cx=st.floats(0, 1500),
    cy=st.floats(0, 1000),
    baseline=st.floats(0.03, 1.0),
)


def degrees(*, roll: float, pitch: float) -> Attitude:
    return Attitude(roll=math.radians(roll), pitch=math.radians(pitch))


def floor_of(*, roll: float, pitch: float, height: float = 1.2) -> Float64:
    return PAPER.plane(height=height, down=degrees(roll=roll, pitch=pitch).down())


@given(projections, heights, angles, angles)
def test_plane_and_floor_are_each_others_inverse(
    projection: Projection, height: float, roll: float, pitch: float
) -> None:
    down = degrees(roll=roll, pitch=pitch).down()
    found_height, found_down = projection.floor(projection.plane(height=height, down=down))
    # c sums terms of up to 1e4 px whose rounding is 1e-12 px, divided by f >= 100
    assert found_height == pytest.approx(height, rel=1e-9)
    np.testing.assert_allclose(found_down, down, atol=1e-9)


@given(projections, heights, angles, angles, st.floats(0, 1500), st.floats(0, 1000))
def test_points_of_the_plane_lie_one_camera_height_down(
    projection: Projection, height: float, roll: float, pitch: float, u: float, v: float
) -> None:
    down = degrees(roll=roll, pitch=pitch).down()
    disparity = float(projection.plane(height=height, down=down) @ [u, v, 1.0])
    if abs(disparity) < 1e-3:
        return  # the horizon: a point at infinity
    point = projection.points(np.array([u]), np.array([v]), np.array([disparity]))[0]
    assert float(point @ down) == pytest.approx(height, rel=1e-6)


def test_papers_rig_has_ten_rows_per_level_and_its_horizon_at_row_200() -> None:
    a, b, c = floor_of(roll=0.0, pitch=5.9)
    assert a == 0.0
    assert 1 / b == pytest.approx(1.2 / (0.12 * math.cos(math.radians(5.9))), rel=1e-12)
    assert 1 / b == pytest.approx(10.053, abs=5e-4)
    # 239.5 - 386 tan(5.9 deg) = 239.5 - 39.889
    assert -c / b == pytest.approx(199.611, abs=5e-4)


def test_level_camera_has_its_horizon_at_the_principal_row() -> None:
    np.testing.assert_allclose(floor_of(roll=0.0, pitch=0.0), [0.0, 0.1, -23.95], atol=1e-12)


def test_right_side_down_brings_the_floor_nearer_on_the_right() -> None:
    a, b, _ = floor_of(roll=10.0, pitch=0.0)
    assert a > 0
    assert a / b == pytest.approx(math.tan(math.radians(10)), rel=1e-12)


def test_nose_down_lifts_the_horizon_in_the_image() -> None:
    _, b, c = floor_of(roll=0.0, pitch=10.0)
    assert -c / b == pytest.approx(239.5 - 386 * math.tan(math.radians(10)), rel=1e-12)


def test_pixels_of_unequal_height_and_width_stretch_the_rows_only() -> None:
    tall = Projection(fx=400, fy=200, cx=0, cy=0, baseline=0.1)
    # 1 m up, level: the floor 2 m ahead is 200 * 1 / 2 = 100 rows down, its disparity 400 * 0.1 / 2
    a, b, c = tall.plane(height=1.0, down=LEVEL.down())
    assert (a, b * 100, c) == pytest.approx((0.0, 20.0, 0.0))


def test_no_plane_is_no_floor() -> None:
    height, _ = PAPER.floor(np.zeros(3))
    assert math.isnan(height)


def test_a_pixel_and_its_disparity_give_the_point() -> None:
    # Z = 386 * 0.12 / 4.632 = 10 m; a tenth of f to the right is 1 m, half of it down is 5 m
    point = PAPER.points(np.array([319.5 + 38.6]), np.array([239.5 + 193]), np.array([4.632]))
    np.testing.assert_allclose(point, [[1.0, 5.0, 10.0]], rtol=1e-12)


def test_disparity_zero_is_infinitely_far_and_nan_stays_unknown() -> None:
    points = PAPER.points(np.array([0.0, 0.0]), np.array([0.0, 0.0]), np.array([0.0, np.nan]))
    assert points[0, 2] == np.inf
    assert np.isnan(points[1]).all()


def test_attitude_is_read_back_from_the_direction_of_the_ground() -> None:
    for roll, pitch in ((0, 0), (12, 5.77), (-80, 30), (15, -40)):
        attitude = degrees(roll=roll, pitch=pitch)
        down = attitude.down()
        assert np.linalg.norm(down) == pytest.approx(1.0)
        found = Attitude.from_down(3.7 * down)  # of any length
        assert (found.roll, found.pitch) == pytest.approx((attitude.roll, attitude.pitch))


def test_level_camera_has_the_ground_along_its_y_axis() -> None:
    np.testing.assert_array_equal(LEVEL.down(), [0.0, 1.0, 0.0])


def test_positive_roll_takes_the_right_side_down_and_positive_pitch_the_nose() -> None:
    ahead, right = np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    half = math.sqrt(0.5)
    rolled = rotation(roll=math.radians(45), pitch=0.0)
    pitched = rotation(roll=0.0, pitch=math.radians(45))
    np.testing.assert_allclose(rolled @ right, [0.0, -half, -half], atol=1e-12)
    np.testing.assert_allclose(rolled @ ahead, ahead, atol=1e-12)
    np.testing.assert_allclose(pitched @ ahead, [half, 0.0, -half], atol=1e-12)
    np.testing.assert_allclose(pitched @ right, right, atol=1e-12)


def test_attitude_and_rotation_agree_on_where_the_ground_is() -> None:
    attitude = degrees(roll=20, pitch=-10)
    body_from_level = rotation(roll=attitude.roll, pitch=attitude.pitch).T
    down = OPTICAL_FROM_BODY @ body_from_level @ [0.0, 0.0, -1.0]
    np.testing.assert_allclose(attitude.down(), down, atol=1e-12)


@pytest.mark.parametrize(
    ("body", "mount", "expected"),
    [
        # sin(pitch) = cos 12 sin 5.9, tan(roll) = tan 12 / cos 5.9
        ((12.0, 0.0), (0.0, 5.9), (12.0620, 5.7706)),
        ((0.0, 5.0), (0.0, 5.9), (0.0, 10.9)),  # pitches add
        ((3.0, 0.0), (4.0, 0.0), (7.0, 0.0)),  # rolls add
        ((-12.0, 0.0), (0.0, 5.9), (-12.0620, 5.7706)),
        ((0.0, 20.0), (20.0, 0.0), (20.0, 20.0)),  # the camera rolls within the pitched body
        # sin(pitch) = cos 20 sin 20, tan(roll) = tan 20 / cos 20: not the line above
        ((20.0, 0.0), (0.0, 20.0), (21.1728, 18.7472)),
    ],
)
def test_body_and_mount_combine_as_rotations_that_do_not_commute(
    body: tuple[float, float], mount: tuple[float, float], expected: tuple[float, float]
) -> None:
    camera = camera_attitude(
        body=degrees(roll=body[0], pitch=body[1]), mount=degrees(roll=mount[0], pitch=mount[1])
    )
    found = math.degrees(camera.roll), math.degrees(camera.pitch)
    assert found == pytest.approx(expected, abs=5e-5)  # the literals' last digit


def test_level_base_frame_of_a_level_camera_only_renames_the_axes() -> None:
    turn = base_from_optical(LEVEL.down(), forward_in_camera(LEVEL))
    np.testing.assert_allclose(turn, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-12)


@given(st.floats(-45, 45), st.floats(-45, 45), st.floats(-30, 30), st.floats(-30, 30))
def test_base_frame_is_orthonormal_with_the_ground_below_and_the_heading_ahead(
    roll: float, pitch: float, mount_roll: float, mount_pitch: float
) -> None:
    mount = degrees(roll=mount_roll, pitch=mount_pitch)
    down = camera_attitude(body=degrees(roll=roll, pitch=pitch), mount=mount).down()
    forward = forward_in_camera(mount)
    turn = base_from_optical(down, forward)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)  # right-handed
    np.testing.assert_allclose(turn @ down, [0, 0, -1], atol=1e-12)
    x, y, z = turn @ forward
    assert x > 0
    assert y == pytest.approx(0.0, abs=1e-12)
    assert z == pytest.approx(-math.sin(math.radians(pitch)), abs=1e-12)


def test_camera_looking_down_sees_straight_ahead_above_its_axis() -> None:
    ahead = forward_in_camera(degrees(roll=0, pitch=30))
    np.testing.assert_allclose(ahead, [0.0, -0.5, math.sqrt(0.75)], atol=1e-12)


def test_axis_of_a_pitched_camera_meets_the_floor_at_height_over_tangent() -> None:
    mount = degrees(roll=0, pitch=30)
    turn = base_from_optical(mount.down(), forward_in_camera(mount))
    disparity = PAPER.plane(height=1.2, down=mount.down()) @ [PAPER.cx, PAPER.cy, 1.0]
    point = PAPER.points(np.array([PAPER.cx]), np.array([PAPER.cy]), np.array([disparity]))[0]
    # 1.2 / tan 30 deg = 2.0785 m ahead, 1.2 m below
    np.testing.assert_allclose(turn @ point, [2.078461, 0.0, -1.2], atol=1e-6)


@given(angles, angles, angles, angles)
def test_attitudes_multiply_as_their_matrices_do(
    roll: float, pitch: float, mount_roll: float, mount_pitch: float
) -> None:
    body, mount = degrees(roll=roll, pitch=pitch), degrees(roll=mount_roll, pitch=mount_pitch)
    turns = [rotation(roll=one.roll, pitch=one.pitch) for one in (body, mount)]
    down = OPTICAL_FROM_BODY @ (turns[0] @ turns[1]).T @ np.array([0.0, 0.0, -1.0])
    found = camera_attitude(body=body, mount=mount).down()
    np.testing.assert_allclose(found, down, rtol=0, atol=1e-12)
    ahead = OPTICAL_FROM_BODY @ turns[1].T @ np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(forward_in_camera(mount), ahead, rtol=0, atol=1e-12)


@given(st.integers(0, 2**31))
def test_a_matrix_times_its_inverse_is_one(seed: int) -> None:
    matrix = np.random.default_rng(seed).normal(size=(3, 3)) + 3 * np.eye(3)
    if abs(np.linalg.det(matrix)) > 0.1:
        np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(3), rtol=0, atol=1e-8)
