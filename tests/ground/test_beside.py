"""The floor is the way ahead, not the higher ground beside it, of which there may be more."""

import math

import numpy as np
import pytest

from bearcub.geometry import Float64, Projection
from bearcub.ground.fit import Gates, fit_plane
from bearcub.ground.prior import Prior
from bearcub.messages import Float32
from bearcub.stereo.native import reason_missing

COMPILED = pytest.param(True, marks=pytest.mark.skipif(bool(reason_missing()), reason="no core"))
HEIGHT = 1.65  # of the camera above the street [m]
LENS = Projection(fx=300.0, fy=300.0, cx=259.5, cy=72.0, baseline=0.54)
PRIOR = Prior(
    height=HEIGHT, pitch=0.0, roll=0.0, sigma=np.array([0.165, 0.087, 0.087]), tilted=False
)
GATES = Gates(height=1.5, pitch=0.26, roll=0.26)


def street(kerb: float, half_width: float) -> Float32:
    """Return the disparity of a street between pavements that lie higher, with noise of 0.2 px."""
    v, u = np.mgrid[0:158, 0:520].astype(float)
    below, aside = v - LENS.cy, LENS.baseline * np.abs(u - LENS.cx)
    way, pavement = (LENS.baseline * below / height for height in (HEIGHT, HEIGHT - kerb))
    face = aside / half_width
    d: Float64 = np.where(
        aside < half_width * way, way, np.where(aside > half_width * pavement, pavement, face)
    )
    d = d + np.random.default_rng(0).normal(0, 0.2, d.shape)
    return np.where(below > 0, np.maximum(d, 0.01), 0).astype(np.float32)


@pytest.mark.parametrize("kerb", [0.2, 0.3])
@pytest.mark.parametrize("compiled", [COMPILED, False])
def test_a_street_between_pavements_is_the_floor(kerb: float, *, compiled: bool) -> None:
    fit = fit_plane(street(kerb, 2.0), LENS, PRIOR, GATES, unevenness=0.03, compiled=compiled)
    assert fit is not None
    height, down = LENS.floor(fit.plane)
    assert height == pytest.approx(HEIGHT, abs=0.03)
    assert math.degrees(math.atan2(down[0], down[1])) == pytest.approx(0.0, abs=0.2)
