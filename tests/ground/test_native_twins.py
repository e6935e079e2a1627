"""The compiled fit and profile find what their twins in NumPy find."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.geometry import Attitude, Projection
from bearcub.ground.fit import Gates, fit_plane
from bearcub.ground.prior import Prior
from bearcub.ground.profile import follow_floor
from bearcub.messages import Float32, Float64
from bearcub.stereo.native import reason_missing

pytestmark = pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")

LENS = Projection(fx=193.0, fy=190.0, cx=159.0, cy=121.0, baseline=0.12)
GATES = Gates(height=2.0, pitch=math.radians(20.0), roll=math.radians(25.0))
HEIGHT = 1.2


def plane_of(pitch: float, roll: float, *, height: float = HEIGHT) -> Float64:
    return LENS.plane(height=height, down=Attitude(pitch=pitch, roll=roll).down())


def view(plane: Float64, *, seed: int, bend: float, unmatched: float) -> Float32:
    """Return a floor that bends, with a kerb, a wall to one side and noise; NaN unmatched."""
    random = np.random.default_rng(seed)
    u, v = np.arange(320)[None, :], np.arange(240)[:, None]
    level = np.maximum(plane[0] * u + plane[1] * v + plane[2], 0.0)
    depth = LENS.fx * LENS.baseline / np.maximum(level, 1e-3)
    lift = np.where(depth > 3.0, bend * (depth - 3.0), 0.0) + 0.15 * (depth > 5.0)
    floor = level * HEIGHT / np.maximum(HEIGHT - lift, 0.2)
    wall = np.where((u > 240) & (v > 40), LENS.fx * LENS.baseline / 4.0, 0.0)
    seen = np.maximum(floor, wall) + random.normal(0.0, 0.15, floor.shape)
    d: Float32 = np.where(level > 0, np.maximum(seen, 0.0), 0.0).astype(np.float32)
    d[random.random(d.shape) < unmatched] = np.nan
    return d


def expected(pitch: float, roll: float) -> Prior:
    sigma = np.array([0.12, math.radians(1.5), math.radians(1.5)])
    return Prior(height=HEIGHT, pitch=pitch, roll=roll, sigma=sigma, tilted=True)


floors = st.fixed_dictionaries(
    {
        "pitch": st.floats(-0.1, 0.25),
        "roll": st.floats(-0.25, 0.25),
        "bend": st.sampled_from([0.0, 0.1, -0.1, 0.3]),
        "unmatched": st.sampled_from([0.0, 0.3, 0.98, 1.0]),
        "seed": st.integers(0, 2**31),
    }
)


@settings(max_examples=60, deadline=None)
@given(floor=floors, off=st.floats(-0.05, 0.05), turned=st.booleans())
def test_the_fit_agrees_with_its_twin(floor: dict[str, float], *, off: float, turned: bool) -> None:
    plane = plane_of(floor["pitch"], floor["roll"])
    d = view(plane, seed=int(floor["seed"]), bend=floor["bend"], unmatched=floor["unmatched"])
    prior = expected(floor["pitch"] + off, floor["roll"] - off)
    if turned:  # a view whose rows and columns go backwards
        d = d[::-1, ::-1]
    first, second = (
        fit_plane(d, LENS, prior, GATES, unevenness=0.02, compiled=compiled)
        for compiled in (True, False)
    )
    assert (first is None) == (second is None)
    if first is None or second is None:
        return
    np.testing.assert_allclose(first.plane, second.plane, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(first.covariance, second.covariance, rtol=1e-6, atol=1e-12)
    assert first.count == second.count
    assert first.noise == pytest.approx(second.noise)
    assert first.support == pytest.approx(second.support)


@settings(max_examples=60, deadline=None)
@given(floor=floors, steepest=st.sampled_from([0.1, 0.4]))
def test_the_profile_agrees_with_its_twin(floor: dict[str, float], *, steepest: float) -> None:
    plane = plane_of(floor["pitch"], floor["roll"])
    d = view(plane, seed=int(floor["seed"]), bend=floor["bend"], unmatched=floor["unmatched"])
    first, second = (
        follow_floor(
            d,
            LENS,
            plane,
            noise=0.2,
            height=HEIGHT,
            pitch=floor["pitch"],
            steepest=steepest,
            compiled=compiled,
        )
        for compiled in (True, False)
    )
    assert len(first.knots) == len(second.knots)
    for name in ("knots", "bend", "noise", "error"):
        np.testing.assert_allclose(
            getattr(first, name), getattr(second, name), rtol=1e-4, atol=1e-5, err_msg=name
        )
    assert first.step == pytest.approx(second.step)
    assert first.end == pytest.approx(second.end)


def test_a_floor_is_found_at_all_by_both() -> None:
    plane = plane_of(0.1, 0.05)
    d = view(plane, seed=1, bend=0.1, unmatched=0.1)
    for compiled in (True, False):
        fit = fit_plane(d, LENS, expected(0.1, 0.05), GATES, unevenness=0.02, compiled=compiled)
        assert fit is not None
        profile = follow_floor(
            d, LENS, plane, noise=0.2, height=HEIGHT, pitch=0.1, steepest=0.4, compiled=compiled
        )
        assert len(profile.knots) > 20
