"""MuJoCo is an optional extra, and it needs OpenGL from the system."""

import pytest

from bearcub.errors import DeviceError
from bearcub.sim.mujoco.library import drawing_context


@pytest.fixture(scope="session", autouse=True)
def _drawing() -> None:
    try:
        context = drawing_context(16, 16)
    except DeviceError as missing:
        pytest.skip(str(missing))
    context.free()
