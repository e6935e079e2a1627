"""One thing's pixels become numbers with error bars; the pixels are laid out by hand."""

import math

import numpy as np
import pytest

from bearcub.geometry import Attitude, Float64, Projection, base_from_optical, forward_in_camera
from bearcub.ground.surface import Surface
from bearcub.messages import Float32
from bearcub.obstacles.cloud import View
from bearcub.obstacles.measure import Extent, measure

LEVEL = Attitude(roll=0.0, pitch=0.0)
# f B = 40 px m, level, 1 m up: a row or column at 4 m is 1 cm
VIEW = View(
    projection=Projection(fx=400.0, fy=400.0, cx=199.5, cy=149.5, baseline=0.1),
    base_from_optical=base_from_optical(LEVEL.down(), forward_in_camera(LEVEL)),
    origin=np.array([0.0, 0.0, 1.0]),
)

# level and without a bend: heights are above the plane
LEVEL_FLOOR = Surface(
    plane=np.array([0.0, 0.1, -12.0], dtype=np.float32),
    height=1.0,
    bend=np.zeros(400, dtype=np.float32),
    noise=np.full(400, 0.1, dtype=np.float32),
)


def board(*, noise: float = 0.0, bias: float = 0.0, seed: int = 0, keep: float = 1.0) -> Extent:
    """Measure an upright board 4 m ahead: columns 140 to 179, rows 170 to 229."""
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(140, 180), range(170, 230)))
    rng = np.random.default_rng(seed)
    kept = rng.random(len(u)) < keep
    d = (10.0 + rng.normal(0, noise, len(u))).astype(np.float32)
    return measured(u[kept], v[kept], d[kept], noise=max(noise, 0.1), bias=bias)


def test_optical_pixels_become_points_in_base_link() -> None:
    point = VIEW.points(np.array([159.5]), np.array([249.5]), np.array([10.0]))
    # Z = 4 m; 40 columns to the left are 0.4 m left, 100 rows down are 1 m below the camera
    np.testing.assert_allclose(point, [[4.0], [0.4], [0.0]], atol=1e-12)


def test_board_is_as_far_as_its_disparity_says() -> None:
    found = board()
    # 4 m ahead, its near edge 0.2 m to the left: never nearer than 4.0 nor farther than its ends
    assert 4.0 <= found.distance <= math.hypot(4.0, 0.6) + 1e-6
    assert found.distance == pytest.approx(math.hypot(4.0, 0.22), abs=0.02)
    assert math.hypot(found.x, found.y) == pytest.approx(found.distance)


def test_bearing_is_that_of_the_middle_and_positive_to_the_left() -> None:
    # edges at columns 139.5 and 179.5: atan(60 / 400) and atan(20 / 400)
    middle = 0.5 * (math.atan(0.15) + math.atan(0.05))
    assert board().bearing == pytest.approx(middle, abs=0.5 / 400)  # half a pixel


def test_width_and_height_are_those_of_the_pixels() -> None:
    found = board()
    # 40 columns of 1 cm, seen 5.7 deg aslant; rows 169.5 to 229.5 are 0.2 to 0.8 m below the camera
    assert found.width == pytest.approx(0.40, abs=0.015)
    assert found.top == pytest.approx(0.80, abs=0.015)
    assert found.bottom == pytest.approx(0.20, abs=0.015)
    assert found.fill == pytest.approx(1.0, abs=0.1)


def test_missing_matches_do_not_shrink_a_thing_but_its_fill() -> None:
    found = board(keep=0.5)
    assert found.width == pytest.approx(0.40, abs=0.015)
    assert found.top == pytest.approx(0.80, abs=0.015)
    assert found.fill == pytest.approx(0.5, abs=0.1)


def test_noise_widens_the_error_bars_and_stays_within_them() -> None:
    quiet = board()
    for seed in range(5):
        found = board(noise=0.3, seed=seed)
        assert found.sigma_distance > quiet.sigma_distance
        assert abs(found.distance - quiet.distance) < 4 * found.sigma_distance
        assert abs(found.bearing - quiet.bearing) < 4 * found.sigma_bearing
        assert abs(found.width - quiet.width) < 4 * found.sigma_width


def test_a_face_that_is_noisier_than_the_floor_is_not_measured_nearer() -> None:
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(140, 180), range(170, 230)))
    d = 10.0 + np.random.default_rng(0).normal(0, 0.38, len(u)).astype(np.float32)
    found = measured(u, v, d.astype(np.float32), noise=0.2)
    assert found.distance == pytest.approx(board().distance, rel=0.01)


def test_ends_of_a_straight_face_are_those_of_its_line_whatever_its_outermost_pixels_do() -> None:
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(100, 180), range(170, 230)))
    d = 10.0 + 0.02 * (u - 100.0)  # a plane: 4 m ahead at its left end, 3.45 m at its right end
    true = [math.hypot(40.0 / d, 40.0 / d * x / 400) for d, x in ((11.6, 20.0), (10.0, 100.0))]
    d[u < 112] -= 1.0  # two of the thirteen directions are matched to what is behind
    found = measured(u, v, d.astype(np.float32))
    assert [found.range_right, found.range_left] == pytest.approx(true, abs=0.03)


def test_ends_of_what_is_turned_towards_us_with_an_edge_are_its_own() -> None:
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(100, 180), range(170, 230)))
    d = 12.0 - 0.05 * np.abs(u - 139.5)  # 3.33 m at the edge, 4 m at both ends
    found = measured(u, v, d.astype(np.float32))
    ends = [math.hypot(4.0, 4.0 * (199.5 - column) / 400) for column in (179.5, 99.5)]
    assert [found.range_right, found.range_left] == pytest.approx(ends, abs=0.06)


def test_error_that_all_pixels_share_does_not_average_out() -> None:
    # dZ = Z dd / d: 0.2 px of 10 px at 4 m are 8 cm, whatever the number of pixels
    # and a range has 0.85 of them: a height has the floor's error, too
    shared = board(bias=0.2).sigma_distance
    assert shared == pytest.approx(0.85 * 0.08, rel=0.1)


def test_a_thing_turned_round_the_robot_keeps_its_size() -> None:
    turned = View(
        projection=VIEW.projection,
        base_from_optical=VIEW.base_from_optical,
        origin=np.array([0.5, -0.3, 1.0]),
    )
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(140, 180), range(170, 230)))
    d = np.full(len(u), 10.0, dtype=np.float32)
    found = measured(u, v, d, view=turned)
    assert found.x == pytest.approx(4.5, abs=0.02)  # the camera is 0.5 m before the origin
    assert found.top == pytest.approx(0.80, abs=0.015)
    assert found.width == pytest.approx(0.40, abs=0.02)


def test_round_thing_is_as_wide_as_its_silhouettes() -> None:
    """Its outermost direction's middle is nearer than they are."""
    radius, centre = 0.225, 3.2
    half = math.asin(radius / centre)
    columns = np.arange(math.ceil(199.5 - 400 * math.tan(half)), 200 + int(400 * math.tan(half)))
    ray = np.hypot(1.0, (columns - 199.5) / 400)  # along it the axis is centre / ray away
    reach = centre / ray - np.sqrt(radius**2 - centre**2 * (1 - 1 / ray**2))
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(columns, range(170, 230)))
    d = np.tile(40.0 * ray / reach, 60).astype(np.float32)
    found = measured(u, v, d)
    assert found.width == pytest.approx(2 * radius * math.cos(half), rel=0.025)


def test_slope_of_a_ramp_is_free_of_the_noise_in_its_range() -> None:
    # height 0.25 (x - 3) seen from 1 m up: row 149.5 + 400 k shows x = 1.75 / (k + 0.25)
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(100, 300), range(140, 280)))
    x = 1.75 / ((v - 149.5) / 400 + 0.25)
    d = 40.0 / x + np.random.default_rng(0).normal(0, 0.5, len(x))
    found = measured(u, v, d.astype(np.float32))
    assert found.climbs
    assert found.climb == pytest.approx(0.25, rel=0.06)


@pytest.mark.parametrize(("noise", "nearest"), [(0.3, 4.0), (0.02, 40 / 11.5)])
def test_dent_is_wrong_matches_only_where_noise_is_large(noise: float, nearest: float) -> None:
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(140, 180), range(170, 230)))
    d = np.where((u >= 159) & (u < 163), 11.5, 10.0).astype(np.float32)
    assert measured(u, v, d, noise=noise).distance == pytest.approx(nearest, rel=0.03)


def measured(
    u: Float64,
    v: Float64,
    d: Float32,
    *,
    view: View = VIEW,
    noise: float = 0.1,
    bias: float = 0.0,
) -> Extent:
    """Measure what fills these pixels."""
    return measure(
        view,
        LEVEL_FLOOR,
        u,
        v,
        d,
        noise=noise,
        bias=bias,
        fattening=0.0,
        fringe=0.0,
        witnessed=False,
        stride=1,
        pixels=len(u),
    )


@pytest.mark.parametrize("noise", [0.3, 3.0])
def test_a_round_thing_is_seen_to_its_silhouettes_unless_noise_hides_that(noise: float) -> None:
    # a can of 0.5 m, its axis 1.75 m away: it ends 8.2 degrees to either side, 1.732 m away
    radius, axis = 0.25, 1.75
    u, v = (grid.ravel().astype(float) for grid in np.meshgrid(range(140, 260), range(170, 230)))
    angle = np.arctan((199.5 - u) / 400)
    seen = np.abs(np.sin(angle)) < radius / axis
    u, v, angle = u[seen], v[seen], angle[seen]
    reach = axis * np.cos(angle) - np.sqrt(radius**2 - (axis * np.sin(angle)) ** 2)
    found = measured(u, v, (40 / (reach * np.cos(angle))).astype(np.float32), noise=noise)
    chord = 2 * 1.732 * radius / axis
    assert found.width / chord == pytest.approx(0.981 if noise < 1 else 0.966, abs=0.005)
