"""What is missing is named in one sentence, with the command that installs it."""

import ctypes.util
import os
from collections.abc import Iterator
from typing import Any

import pytest

from bearcub.errors import DeviceError
from bearcub.sim.mujoco import library


@pytest.fixture(autouse=True)
def _fresh() -> Iterator[None]:
    library.mujoco.cache_clear()
    yield
    library.mujoco.cache_clear()


def _refusing(error: Exception, only: str) -> Any:
    def refuse(name: str) -> Any:
        if name == only:
            raise error
        return __import__(name)

    return refuse


@pytest.mark.parametrize("package", ["mujoco", "OpenGL"])
def test_a_missing_package_is_asked_for(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = ModuleNotFoundError(f"No module named '{package}'", name=package)
    monkeypatch.setattr(library, "import_module", _refusing(missing, package))
    with pytest.raises(DeviceError, match=rf"pip install 'bearcub\[sim\]' .*{package}"):
        library.mujoco()


def test_a_missing_system_library_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = AttributeError("'NoneType' object has no attribute 'eglQueryString'")
    monkeypatch.setattr(library, "import_module", _refusing(broken, "mujoco"))
    with pytest.raises(DeviceError, match="apt-get install libegl1 libegl-mesa0"):
        library.mujoco()


def test_a_machine_that_cannot_draw_is_told_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        @staticmethod
        def GLContext(_width: int, _height: int) -> None:  # noqa: N802 (MuJoCo's name)
            raise ImportError("Cannot initialize a EGL device display")

    monkeypatch.setattr(library, "mujoco", Broken)
    with pytest.raises(DeviceError, match=r"libegl1.*EGL device display"):
        library.drawing_context(8, 8)


def test_the_users_choice_of_backend_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setattr(library, "import_module", lambda _name: None)
    library.mujoco()
    assert os.environ["MUJOCO_GL"] == "osmesa"


@pytest.mark.parametrize(("has_egl", "backend"), [(True, "egl"), (False, "osmesa")])
def test_osmesa_is_taken_where_there_is_no_egl(
    has_egl: bool,  # noqa: FBT001 (a parameter)
    backend: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    found = {"EGL": "libEGL.so.1" if has_egl else None, "OSMesa": "libOSMesa.so.8"}
    monkeypatch.setattr(ctypes.util, "find_library", found.get)
    monkeypatch.setattr(library, "import_module", lambda _name: None)
    library.mujoco()
    assert os.environ["MUJOCO_GL"] == backend
