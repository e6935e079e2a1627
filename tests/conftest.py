"""What tests of several folders share."""

import pytest

from bearcub.errors import DeviceError
from bearcub.sim.mujoco.library import drawing_context


@pytest.fixture(scope="session")
def opengl() -> None:
    """Skip what draws with MuJoCo where that is not possible."""
    try:
        context = drawing_context(16, 16)
    except DeviceError as missing:
        pytest.skip(str(missing))
    context.free()
