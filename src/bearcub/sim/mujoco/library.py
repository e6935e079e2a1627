"""MuJoCo and its OpenGL, imported when first needed and asked for in one sentence when missing."""

import ctypes.util
import os
from functools import cache
from importlib import import_module
from typing import Any

from bearcub.errors import DeviceError

_PACKAGES = "the simulator needs MuJoCo and PyOpenGL: pip install 'bearcub[sim]'"
_SYSTEM = (
    "the simulator found no software OpenGL: sudo apt-get install libegl1 libegl-mesa0 "
    "libgl1-mesa-dri"
)


@cache
def mujoco() -> Any:
    """Return the module ``mujoco``, set up to draw without a screen.

    MuJoCo reads ``MUJOCO_GL`` when it is imported; where the user has not set it, EGL is taken,
    or OSMesa where only that is installed.

    Raises
    ------
    DeviceError
        If a package is missing, with the command that installs it.
    """
    os.environ.setdefault("MUJOCO_GL", _backend())
    try:
        import_module("OpenGL")
        return import_module("mujoco")
    except ModuleNotFoundError as missing:
        raise DeviceError(f"{_PACKAGES} (missing: {missing.name})") from missing
    except (ImportError, OSError, RuntimeError, AttributeError) as broken:
        raise DeviceError(f"{_SYSTEM} ({broken})") from broken


def gl() -> Any:
    """Return the module ``OpenGL.GL``; call it after `mujoco`."""
    mujoco()
    return import_module("OpenGL.GL")


def drawing_context(width: int, height: int) -> Any:
    """Return an OpenGL context, current in this thread.

    Raises
    ------
    DeviceError
        If the machine has no OpenGL, with the command that installs a software one.
    """
    library = mujoco()
    try:
        context = library.GLContext(width, height)
        context.make_current()
    except Exception as broken:  # every binding raises its own kind
        raise DeviceError(f"{_SYSTEM} ({type(broken).__name__}: {broken})") from broken
    return context


def _backend() -> str:
    if ctypes.util.find_library("EGL") is None and ctypes.util.find_library("OSMesa"):
        return "osmesa"
    return "egl"
