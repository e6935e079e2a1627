"""MuJoCo is an optional extra, and it needs OpenGL from the system."""

import pytest


@pytest.fixture(scope="module", autouse=True)
def _drawing(request: pytest.FixtureRequest) -> None:
    if request.path.name != "test_library.py":  # that is about what happens without
        request.getfixturevalue("opengl")
