"""What tests of several folders share."""

import numpy as np
import pytest

from bearcub.errors import DeviceError
from bearcub.messages import Ground
from bearcub.sim.mujoco.library import drawing_context


@pytest.fixture(scope="session")
def opengl() -> None:
    """Skip what draws with MuJoCo where that is not possible."""
    try:
        context = drawing_context(16, 16)
    except DeviceError as missing:
        pytest.skip(str(missing))
    context.free()


@pytest.fixture(scope="session")
def sure_ground() -> Ground:
    """Return ground that is known well: ten rows per level, horizon at row 20, 1.2 m below."""
    return Ground(
        plane=np.array([0.0, 0.1, -2.0]),
        covariance=np.diag([1e-12, 1e-12, 1e-6]),
        height=1.2,
        pitch=0.1,
        roll=0.0,
        sigma_height=0.01,
        sigma_pitch=0.001,
        sigma_roll=0.001,
        noise=0.2,
        source="image",
        seen=True,
        residual=0.2,
        tilt_disagreement=float("nan"),
    )
