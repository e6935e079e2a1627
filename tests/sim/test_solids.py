"""The truncated cone, by hand and against the cylinder; other solids are seen in test_render."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.messages import Float64
from bearcub.sim.scenes import PLAIN
from bearcub.sim.solids import Cone, Cylinder

# radius 0.5 m at the ground, 0.1 m at 0.8 m: half a metre in for every metre up
CONE = Cone(x=3.0, y=0.0, bottom=0.0, height=0.8, radii=(0.5, 0.1), texture=PLAIN)
EYE = np.zeros(2)


def column(*values: float) -> Float64:
    return np.array(values, dtype=np.float64)[:, None]


def hit(cone: Cone, origin: Float64, ray: Float64) -> float:
    return float(cone.hit(origin, ray)[0])


@pytest.mark.parametrize(
    ("origin", "ray", "t"),
    [
        ((0, 0, 0.4), (1, 0, 0), 2.7),  # radius 0.3 at half its height
        ((0, 0, 0.0), (1, 0, 0), 2.5),  # the rim of its foot
        ((0, 0, 0.9), (1, 0, 0), math.inf),  # over its top
        ((0, 0, -0.1), (1, 0, 0), math.inf),  # below it
        ((3, 0, 2.0), (0, 0, -1), 1.2),  # from above: its upper end
        ((3.3, 0, 2.0), (0, 0, -1), 1.6),  # from above beside that: radius 0.3 at z = 0.4
        ((3, 0, -1.0), (0, 0, 1), 1.0),  # from below: its foot
        ((0, 0.31, 0.4), (1, 0, 0), math.inf),  # past it: 0.3 there
        ((9, 0, 0.4), (1, 0, 0), math.inf),  # behind the eye
        ((9, 0, 0.4), (-1, 0, 0), 5.7),  # from its other side
    ],
)
def test_rays_meet_the_cone_where_it_is(
    origin: tuple[float, ...], ray: tuple[float, ...], t: float
) -> None:
    assert hit(CONE, column(*origin), column(*ray)) == pytest.approx(t, abs=1e-12)


def test_normal_of_the_cone_leans_up_by_its_taper() -> None:
    normal, _, up = CONE.surface(column(2.7, 0.0, 0.4))
    np.testing.assert_allclose(normal[:, 0], np.array([-1, 0, 0.5]) / math.sqrt(1.25), atol=1e-12)
    assert up[0] == pytest.approx(0.4)
    np.testing.assert_allclose(CONE.surface(column(3.02, 0.03, 0.8))[0][:, 0], [0, 0, 1])


def test_cone_spans_its_foot_and_its_height() -> None:
    assert (CONE.bottom, CONE.top) == (0.0, 0.8)
    np.testing.assert_allclose(CONE.nearest(EYE), [2.5, 0.0])
    bearings = np.arctan2(*CONE.outline(EYE).T[::-1])
    np.testing.assert_allclose(np.sort(bearings), math.asin(0.5 / 3.0) * np.array([-1, 1]))


def test_cone_may_stand_on_its_tip() -> None:
    funnel = Cone(x=3.0, y=0.0, bottom=1.0, height=0.8, radii=(0.1, 0.5), texture=PLAIN)
    assert hit(funnel, column(0, 0, 1.4), column(1, 0, 0)) == pytest.approx(2.7)
    np.testing.assert_allclose(funnel.nearest(EYE), [2.5, 0.0])


def test_cone_without_taper_is_a_cylinder() -> None:
    cone = Cone(x=3.0, y=0.2, bottom=0.1, height=0.8, radii=(0.3, 0.3), texture=PLAIN)
    cylinder = Cylinder(start=(3.0, 0.2, 0.1), end=(3.0, 0.2, 0.9), radius=0.3, texture=PLAIN)
    rng = np.random.default_rng(5)
    for origin in rng.uniform([-1, -1, 0], [1, 1, 3], (20, 3))[:, :, None]:
        rays = rng.uniform([2, -0.4, -1], [4, 0.8, 2], (500, 3)).T - origin
        with np.errstate(all="ignore"):
            one, two = cone.hit(origin, rays), cylinder.hit(origin, rays)
        assert 50 < np.isfinite(one).sum() < 500
        np.testing.assert_allclose(one, two, atol=1e-9)


@given(st.floats(-0.6, 0.6), st.floats(0.01, 1.2))
def test_points_that_are_hit_lie_on_the_cone(y: float, z: float) -> None:
    origin, ray = column(0.0, 0.0, 1.2), column(3.0, y, z - 1.2)
    t = hit(CONE, origin, ray)
    if math.isfinite(t):
        x, y, z = (origin + t * ray)[:, 0]
        off, wide = math.hypot(x - 3.0, y), 0.5 - 0.5 * z
        on_top = z == pytest.approx(0.8, abs=1e-9) and off <= 0.1 + 1e-9
        assert on_top or off == pytest.approx(wide, abs=1e-9)
