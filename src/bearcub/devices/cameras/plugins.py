"""Cameras that need their maker's software: found by name, imported when they are used.

A package of its own adds one through the entry point group ``bearcub.cameras``: a function that
takes `PluginSettings` and a `Clock` and returns a `Capture`.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points

from bearcub.clock import Clock
from bearcub.config import require_known
from bearcub.devices.cameras.capture import Capture
from bearcub.errors import ConfigError, DeviceError

GROUP = "bearcub.cameras"
_OWN = {
    "aravis": "bearcub.devices.cameras.aravis",
    "depthai": "bearcub.devices.cameras.depthai",
    "realsense": "bearcub.devices.cameras.realsense",
    "genicam": "bearcub.devices.cameras.genicam",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginSettings:
    """What a plug-in's camera is set to; a camera refuses what it cannot do.

    Attributes
    ----------
    device : str
        Which one, where there are several: a serial number or identifier; empty for the first.
    library : str
        File of a GenTL producer (``.cti``), for GenICam cameras.
    width, height : int
        Of one picture [px]; 0 for the camera's own.
    rate_hz : float
        [Hz].
    exposure_ms : float
        [ms]; 0 is automatic.
    """

    device: str = ""
    library: str = ""
    width: int = 0
    height: int = 0
    rate_hz: float = 15.0
    exposure_ms: float = 0.0


Build = Callable[[PluginSettings, Clock], Capture]


def plugin_names() -> list[str]:
    """Return the names of all plug-ins, whether or not their software is installed."""
    return sorted({*_OWN, *_installed()})


def build_capture(name: str, settings: PluginSettings, *, clock: Clock) -> Capture:
    """Return a plug-in's camera, not yet open.

    Parameters
    ----------
    name : str
        One of `plugin_names`.
    settings : PluginSettings
    clock : Clock

    Raises
    ------
    ConfigError
        If there is no plug-in of that name, or the settings do not do for it.
    """
    require_known(name, plugin_names(), what="camera driver")
    build = _load(name)
    return build(settings, clock)


def import_sdk(module: str, *, package: str, install: str = "") -> object:
    """Return a maker's module, or say how to install it.

    Parameters
    ----------
    module, package : str
        Their names, which may differ.
    install : str, optional
        The command that installs it; by default that of pip.

    Raises
    ------
    DeviceError
        If it is not installed, or does not fit this machine.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DeviceError(
            f"this camera needs the package {package}, which cannot be imported ({error}); "
            f"run: {install or f'pip install {package}'}"
        ) from error


def _installed() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _load(name: str) -> Build:
    if name in _OWN:
        build: Build = importlib.import_module(_OWN[name]).build
        return build
    point = _installed()[name]
    try:
        found: Build = point.load()
    except (ImportError, AttributeError) as error:
        raise ConfigError(
            f"camera driver {name}: its package does not load {point.value}: {error}"
        ) from error
    return found
