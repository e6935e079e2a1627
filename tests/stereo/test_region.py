"""What is lower than the robot, and near enough, is never above the first row."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.geometry import Attitude, base_from_optical, forward_in_camera
from bearcub.rig import Camera
from bearcub.stereo.region import first_row

CAMERA = Camera(width=640, height=480, fx=400, fy=400, cx=319.5, cy=239.5, baseline=0.12)
LEVEL = Attitude(roll=0.0, pitch=0.0)
SURE = np.zeros(3)


def row(
    *,
    height: float = 1.2,
    attitude: Attitude = LEVEL,
    sigma: np.ndarray = SURE,
    clearance: float = 0.8,
    nearest: float = 1.0,
    farthest: float = 20.0,
) -> int:
    return first_row(
        CAMERA,
        height=height,
        attitude=attitude,
        sigma=sigma,
        clearance=clearance,
        nearest=nearest,
        farthest=farthest,
    )


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        # 0.4 m below the camera at 20 m: row 239.5 + 400 * 0.02 = 247.5, less 16, in steps of 32
        ({}, 224),
        # nose down by 5.9 deg: 41.3 rows less
        ({"attitude": Attitude(roll=0.0, pitch=math.radians(5.9))}, 160),
        # three sigmas of 2 deg, 42 rows less
        ({"sigma": np.array([0.0, math.radians(2), 0.0])}, 160),
        # rolled by 12 deg the horizon rises by 319.5 tan 12 deg = 68 rows at one side
        ({"attitude": Attitude(roll=math.radians(-12), pitch=0.0)}, 160),
        ({"attitude": Attitude(roll=math.radians(12), pitch=0.0)}, 160),
        # higher than the camera by 0.8 m at 4 m: row 239.5 - 80 - 16
        ({"clearance": 2.0, "nearest": 4.0}, 128),
        # the same at 1 m is above the image
        ({"clearance": 2.0}, 0),
        # nose up by 20 deg, all of interest is low: but half the image is always looked at
        ({"attitude": Attitude(roll=0.0, pitch=math.radians(-20))}, 224),
    ],
)
def test_rows_by_hand(options: dict[str, float], expected: int) -> None:
    assert row(**options) == expected  # type: ignore[arg-type]


@given(
    pitch=st.floats(-0.3, 0.4),
    roll=st.floats(-0.4, 0.4),
    off=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
    one=st.sampled_from([1, 2]),
    up=st.floats(0.0, 0.8),
    depth=st.floats(1.0, 20.0),
    column=st.floats(0, 639),
)
def test_no_low_point_in_reach_is_above_the_first_row(
    *,
    pitch: float,
    roll: float,
    off: tuple[float, float, float],
    one: int,
    up: float,
    depth: float,
    column: float,
) -> None:
    """Height, and pitch or roll, are off by up to three sigmas."""
    sigma = np.array([0.1, 0.03, 0.03])
    found = row(attitude=Attitude(roll=roll, pitch=pitch), sigma=sigma)
    errors = 3 * sigma * off
    errors[one] = 0.0
    true = Attitude(roll=roll + errors[2], pitch=pitch + errors[1])
    base = base_from_optical(true.down(), forward_in_camera(LEVEL))
    # The ray of this column whose point at this depth is `up` above the floor, row by bisection.
    low, high = -5000.0, 5000.0
    for _ in range(60):
        middle = (low + high) / 2
        ray = np.array([(column - CAMERA.cx) / CAMERA.fx, (middle - CAMERA.cy) / CAMERA.fy, 1])
        above = 1.2 + errors[0] + (base @ (ray * depth))[2]
        low, high = (middle, high) if above > up else (low, middle)
    assert low >= found or found == 0
