"""What is plugged in, and what software is there to use it."""

import ctypes.util
import importlib.util
from dataclasses import dataclass
from pathlib import Path

from bearcub.stereo.native import levels

_CAMERAS = Path("/sys/class/video4linux")
_CAMERA_NAMES = Path("/dev/v4l/by-id")
_PORT_NAMES = Path("/dev/serial/by-id")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plugged:
    """One device file.

    Attributes
    ----------
    path : str
        ``/dev/video0``, ``/dev/ttyUSB0``.
    name : str
        What its maker calls it; may be empty.
    lasting : str
        The path that stays the same whatever else is plugged in; empty without one.
    """

    path: str
    name: str
    lasting: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Software:
    """One optional part of the installation.

    Attributes
    ----------
    name : str
        What it is for.
    found : bool
    advice : str
        How to get it.
    """

    name: str
    found: bool
    advice: str


def cameras(*, root: Path = _CAMERAS, names: Path = _CAMERA_NAMES) -> list[Plugged]:
    """Return the V4L2 cameras; of several nodes of one camera, those that take pictures.

    Parameters
    ----------
    root : Path
        Where the kernel lists them.
    names : Path
        Where links with lasting names are.
    """
    lasting = _lasting(names)
    found = []
    for node in sorted(root.glob("video*"), key=lambda path: (len(path.name), path.name)):
        # Index 0 is the node of the pictures; others carry metadata.
        if _text(node / "index") in ("", "0"):
            path = f"/dev/{node.name}"
            name = _text(node / "name")
            found.append(Plugged(path=path, name=name, lasting=lasting.get(node.name, "")))
    return found


def serial_ports(*, names: Path = _PORT_NAMES) -> list[Plugged] | None:
    """Return the serial ports; None without pyserial.

    Parameters
    ----------
    names : Path
        Where links with lasting names are.
    """
    if importlib.util.find_spec("serial") is None:
        return None
    from serial.tools import list_ports  # noqa: PLC0415 (optional, and slow to import)

    lasting = _lasting(names)
    return [
        Plugged(
            path=port.device,
            name="" if port.description in (None, "n/a") else port.description,
            lasting=lasting.get(Path(port.device).name, ""),
        )
        for port in sorted(list_ports.comports(), key=lambda port: port.device)
    ]


def software() -> list[Software]:
    """Return the optional parts of the installation, whether or not they are there."""
    return [
        _native_core(),
        _module("learned matchers", "onnxruntime", "pip install 'bearcub[onnx]'"),
        _module("serial lines", "serial", "pip install 'bearcub[devices]'"),
        _module("GPS", "pynmeagps", "pip install 'bearcub[devices]'"),
        _module("MAVLink", "pymavlink", "pip install pymavlink"),
        _module("OAK cameras", "depthai", "pip install depthai"),
        _module("RealSense cameras", "pyrealsense2", "pip install pyrealsense2"),
        _module("GenICam cameras", "harvesters", "pip install harvesters"),
        _module("GenICam by Aravis", "gi", "sudo apt install python3-gi gir1.2-aravis-0.8"),
        _module("simulator: physics", "mujoco", "pip install 'bearcub[sim]'"),
        _module("simulator: drawing", "OpenGL", "pip install 'bearcub[sim]'"),
        _library(
            "simulator: drawing without a screen",
            ("EGL", "OSMesa"),
            "libegl1 libegl-mesa0 libgl1-mesa-dri",
        ),
    ]


def _native_core() -> Software:
    best = levels()[:1]
    return Software(
        name=f"native core: {best[0]}" if best else "native core",
        found=bool(best),
        advice="matching is several times slower; run: sudo apt install g++, and install again",
    )


def _module(name: str, module: str, command: str) -> Software:
    return Software(
        name=name,
        found=importlib.util.find_spec(module) is not None,
        advice=f"run: {command}",
    )


def _library(name: str, libraries: tuple[str, ...], packages: str) -> Software:
    return Software(
        name=name,
        found=any(ctypes.util.find_library(library) for library in libraries),
        advice=f"run: sudo apt install {packages}",
    )


def _lasting(names: Path) -> dict[str, str]:
    """Return from a device's own name to its lasting one."""
    if not names.is_dir():
        return {}
    return {link.resolve().name: str(link) for link in sorted(names.iterdir(), reverse=True)}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""
