"""The devices of a robot, from the ``[devices.NAME]`` tables of its configuration file.

Every table names its `kind` and what that kind may be set to. The order of the tables is kept.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bearcub.clock import Clock
from bearcub.config import Config, require_known
from bearcub.devices import open_frames
from bearcub.devices.cameras import CameraSource, Capture
from bearcub.devices.cameras.files import FileCapture
from bearcub.devices.cameras.opencv import PairCapture, SingleCapture, VideoDevice, VideoSettings
from bearcub.devices.cameras.plugins import PluginSettings, build_capture, plugin_names
from bearcub.devices.carmen import open_carmen
from bearcub.devices.dry_run import DryRunDrive
from bearcub.devices.galil import GalilDrive, GalilSetup
from bearcub.devices.gps import Gpsd, NmeaGps
from bearcub.devices.mavlink import MavlinkDrive
from bearcub.devices.protocols import Drive, FrameSource, Reading, Source
from bearcub.devices.sick import Cola, Dialect, Lms2xx, Sweep
from bearcub.devices.stream import Streaming
from bearcub.devices.wheels import Wheels
from bearcub.errors import ConfigError, FormatError, InputError
from bearcub.messages import WheelState
from bearcub.runtime.device_lines import Build, Place, network, serial_line
from bearcub.runtime.device_settings import (
    CameraDevice,
    CarmenDevice,
    ColaDevice,
    DryRunDevice,
    GalilDevice,
    GpsdDevice,
    Lms2xxDevice,
    MavlinkDevice,
    PluginDevice,
    SerialDevice,
    required,
)
from bearcub.runtime.tilt_devices import TILT_KINDS


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """One configured device, not yet started.

    Attributes
    ----------
    name, kind : str
        Of its table.
    part : Source or Drive
    rig : Path or None
        Calibration of a stereo camera.
    """

    name: str
    kind: str
    part: Source[Any] | Drive
    rig: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """What one configuration file says: the numbers of the stages, and the devices."""

    config: Config
    devices: list[Device]


def load_robot(path: Path, *, clock: Clock) -> Robot:
    """Return what a configuration file says, with its devices built but not started.

    Parameters
    ----------
    path : Path
        TOML; the tables beside ``[devices.NAME]`` are those of `Config`.
    clock : Clock
        That the devices stamp by.

    Raises
    ------
    ConfigError
        If the file cannot be read, a kind or key is unknown, or a value cannot be.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: is not TOML: {error}") from error
    try:
        found = tables.pop("devices", {})
        config = Config.from_tables(tables)
        devices = build_devices(found, clock=clock, folder=path.parent)
    except ConfigError as error:
        raise ConfigError(f"{error} (in {path})") from error
    return Robot(config=config, devices=devices)


def build_devices(tables: object, *, clock: Clock, folder: Path) -> list[Device]:
    """Return the devices of nested dictionaries, as TOML gives them.

    Parameters
    ----------
    tables : dict
        From names to tables.
    clock : Clock
        That the devices stamp by.
    folder : Path
        From which relative paths start.

    Raises
    ------
    ConfigError
        As `load_robot`.
    """
    if not isinstance(tables, dict):
        raise ConfigError(f"devices = {tables!r}: expected tables such as [devices.tilt]")
    found: list[Device] = []

    def wheels() -> Reading[WheelState] | None:
        """Return what the first drive says; it may be configured after who asks."""
        drives = (device.part for device in found if hasattr(device.part, "feedback"))
        drive = next(drives, None)
        return None if drive is None else drive.feedback()

    for name, table in tables.items():
        place = Place(role=name, clock=clock, folder=folder, wheels=wheels)
        found.append(_build(table, place))
    return found


def _build(table: object, place: Place) -> Device:
    key = f"devices.{place.role}"
    if not isinstance(table, dict):
        raise ConfigError(f"{key} = {table!r}: expected a table [{key}]")
    values = dict(table)
    kind, known = values.pop("kind", None), kinds()
    if not isinstance(kind, str):
        raise ConfigError(f"{key}.kind: is missing; expected one of {', '.join(sorted(known))}")
    require_known(kind, known, what="kind of device")
    of, build = known[kind]
    for name in values:
        require_known(name, {field.name for field in fields(of)}, what=f"key {key}.")
    try:
        settings = of(**values)
        part = build(settings, place)
    except ConfigError as error:
        text = str(error).replace(f"{of.__name__}.", "")
        raise ConfigError(text if text.startswith(key) else f"{key}: {text}") from error
    rig = getattr(settings, "rig", "")
    return Device(name=place.role, kind=kind, part=part, rig=place.folder / rig if rig else None)


def _lms2xx(settings: Lms2xxDevice, place: Place) -> Source[Any]:
    driver = Lms2xx(
        fov_deg=settings.fov_deg,
        resolution_deg=settings.resolution_deg,
        baud=settings.baud,
        unit=settings.unit or None,
        measuring_mode=None if settings.measuring_mode < 0 else settings.measuring_mode,
    )
    link = serial_line(settings.port, 9600)
    return Streaming(link, driver, clock=place.clock, rate_hz=driver.rate_hz, role=place.role)


def _cola(settings: ColaDevice, place: Place) -> Source[Any]:
    sweep = None
    if settings.step_deg:
        sweep = Sweep(
            start_deg=settings.start_deg,
            stop_deg=settings.stop_deg,
            step_deg=settings.step_deg,
            scan_hz=settings.rate_hz if settings.set_rate else None,
        )
    driver = Cola(
        dialect=Dialect[settings.dialect],
        sweep=sweep,
        remission=settings.remission,
        nearest=settings.nearest,
    )
    return Streaming(
        network(settings.address, default=2112),
        driver,
        clock=place.clock,
        rate_hz=settings.rate_hz,
        role=place.role,
    )


def _carmen(settings: CarmenDevice, place: Place) -> Source[Any]:
    required(settings.source, "source", "give a .clf file")
    try:
        return open_carmen(
            place.folder / settings.source, clock=place.clock, no_return=settings.no_return
        )
    except (InputError, FormatError) as error:
        raise ConfigError(f"source: {error}") from error


def _gps(settings: SerialDevice, place: Place) -> Source[Any]:
    return Streaming(
        serial_line(settings.port, settings.baud or 9600),
        NmeaGps(),
        clock=place.clock,
        rate_hz=settings.rate_hz or 1.0,
        role=place.role,
    )


def _gpsd(settings: GpsdDevice, place: Place) -> Source[Any]:
    return Streaming(
        network(settings.address, default=2947),
        Gpsd(),
        clock=place.clock,
        rate_hz=settings.rate_hz,
        role=place.role,
    )


def _galil(settings: GalilDevice, place: Place) -> Drive:
    for name in ("wheel_radius", "track", "counts"):
        required(getattr(settings, name), name, "measure it on the robot")
    wheels = Wheels(
        radius=settings.wheel_radius,
        track=settings.track,
        counts=settings.counts,
        left_sign=-1 if settings.invert_left else 1,
        right_sign=-1 if settings.invert_right else 1,
    )
    setup = GalilSetup(
        wheels=wheels,
        left=settings.left,
        right=settings.right,
        speed=settings.speed,
        acceleration=settings.acceleration,
        deceleration=settings.deceleration,
        rate_hz=settings.rate_hz,
        silence=settings.silence,
        ramp_step=settings.ramp_step,
        fastest=settings.fastest,
        replace_program=settings.replace_program,
    )
    return GalilDrive(
        network(settings.address, default=23),
        setup,
        clock=place.clock,
        command_limit=settings.command_limit,
        role=place.role,
    )


def _mavlink(settings: MavlinkDevice, place: Place) -> Drive:
    return MavlinkDrive(
        serial_line(settings.port, settings.baud),
        clock=place.clock,
        speed=settings.speed,
        rate_hz=settings.rate_hz,
        command_limit=settings.command_limit,
        role=place.role,
    )


def _dry_run(settings: DryRunDevice, place: Place) -> Drive:
    return DryRunDrive(
        clock=place.clock,
        track=settings.track,
        acceleration=settings.acceleration,
        command_limit=settings.command_limit,
        role=place.role,
    )


def _camera(settings: CameraDevice, place: Place) -> Source[Any]:
    required(settings.source, "source", "give a camera that `bearcub devices` lists, or files")
    capture = _file_capture(settings, place) or _live_capture(settings, place)
    return CameraSource(capture, clock=place.clock, rate_hz=settings.rate_hz, role=place.role)


def _file_capture(settings: CameraDevice, place: Place) -> Capture | None:
    """Return files as a camera; None where `source` is no file or folder."""
    left = place.folder / settings.source
    if "://" in settings.source or left.is_char_device() or not left.exists():
        return None
    right = place.folder / settings.right if settings.right else None

    def open_source() -> FrameSource:
        single = right is None and not settings.side_by_side
        return open_frames(left, right, side_by_side=settings.side_by_side, single=single)

    return FileCapture(
        open_source, name=settings.source, clock=place.clock, rate_hz=settings.rate_hz
    )


def _live_capture(settings: CameraDevice, place: Place) -> Capture:
    chosen = VideoSettings(
        width=settings.width,
        height=settings.height,
        rate_hz=settings.rate_hz,
        pixel_format=settings.format,
        exposure_ms=settings.exposure_ms,
        gain=math.nan if settings.gain < 0 else settings.gain,
    )
    devices = [
        VideoDevice(source, clock=place.clock, settings=chosen)
        for source in (settings.source, settings.right)
        if source
    ]
    if len(devices) == 1:
        return SingleCapture(devices[0], side_by_side=settings.side_by_side)
    if settings.side_by_side:
        raise ConfigError(
            f"right = {settings.right!r}: side_by_side holds the right picture already"
        )
    return PairCapture(*devices, largest_skew=settings.largest_skew_ms / 1e3)


def _plugin(name: str) -> Build:
    def build(settings: PluginDevice, place: Place) -> Source[Any]:
        chosen = PluginSettings(
            device=settings.device,
            library=settings.library,
            width=settings.width,
            height=settings.height,
            rate_hz=settings.rate_hz,
            exposure_ms=settings.exposure_ms,
        )
        capture = build_capture(name, chosen, clock=place.clock)
        return CameraSource(capture, clock=place.clock, rate_hz=settings.rate_hz, role=place.role)

    return build


def kinds() -> dict[str, tuple[type[Any], Build]]:
    """Return what a table's `kind` may be: its settings and its builder."""
    return {**_KINDS, **{name: (PluginDevice, _plugin(name)) for name in plugin_names()}}


_KINDS: Mapping[str, tuple[type[Any], Build]] = {
    **TILT_KINDS,
    "lms2xx": (Lms2xxDevice, _lms2xx),
    "cola": (ColaDevice, _cola),
    "carmen": (CarmenDevice, _carmen),
    "gps": (SerialDevice, _gps),
    "gpsd": (GpsdDevice, _gpsd),
    "galil": (GalilDevice, _galil),
    "mavlink": (MavlinkDevice, _mavlink),
    "dry-run": (DryRunDevice, _dry_run),
    "camera": (CameraDevice, _camera),
}
