"""What a ``[devices.NAME]`` table may say: one frozen dataclass per sort of device."""

from dataclasses import dataclass

from bearcub.config import Table, choice, setting
from bearcub.errors import ConfigError

_RATE = {"low": 0.1, "high": 1000.0}
_BAUD = {"low": 300, "high": 4_000_000}


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialDevice(Table):
    """A sensor on a serial line that sends or answers by itself."""

    port: str = setting("", "/dev/ttyUSB0, better /dev/serial/by-id/..., or tcp://HOST:PORT")
    baud: int = setting(
        0, "speed of the line; 0: the device's factory setting", low=0, high=4_000_000
    )
    rate_hz: float = setting(0.0, "values a second [Hz]; 0: the device's usual", low=0.0, high=1e3)


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltDevice(SerialDevice):
    """A tilt sensor or IMU."""

    invert_pitch: bool = setting(False, "pitch has the other sign: `bearcub doctor --signs` tells")
    invert_roll: bool = setting(False, "roll has the other sign: `bearcub doctor --signs` tells")


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuDevice(TiltDevice):
    """An IMU, which tells its attitude and also the accelerations and rates behind it."""

    fused: bool = setting(
        False, "take raw values, without the acceleration that the drive's wheels tell of"
    )

    def __post_init__(self) -> None:
        Table.__post_init__(self)
        if self.fused and (self.invert_pitch or self.invert_roll):
            raise ConfigError("fused = true: takes no invert_pitch and invert_roll; mount it level")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lms2xxDevice(Table):
    """A SICK LMS2xx LADAR on its serial line."""

    port: str = setting("", "/dev/ttyUSB0, better /dev/serial/by-id/..., or tcp://HOST:PORT")
    baud: int = setting(38400, "to stream with; 500000 needs RS-422", **_BAUD)
    fov_deg: int = setting(180, "field of view [deg]: 180 or 100", low=100, high=180)
    resolution_deg: float = setting(0.5, "between beams [deg]: 1, 0.5, 0.25", low=0.25, high=1.0)
    unit: str = choice("", "mm: up to 8 m, cm: up to 80 m; kept in the scanner", "", "mm", "cm")
    measuring_mode: int = setting(
        -1, "as in its manual, kept in the scanner; -1: as it is", low=-1, high=15
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ColaDevice(Table):
    """A SICK LMS1xx, LMS5xx or TiM LADAR on the network."""

    address: str = setting("", "HOST or HOST:PORT (2112)")
    dialect: str = choice("B", "CoLa-A or CoLa-B", "A", "B")
    rate_hz: float = setting(15.0, "scans a second, as the scanner is set [Hz]", **_RATE)
    step_deg: float = setting(0.0, "between beams [deg]; 0: sweep as it is", low=0.0, high=10.0)
    start_deg: float = setting(-135.0, "first beam of a set sweep [deg]", low=-180, high=180)
    stop_deg: float = setting(135.0, "last beam of a set sweep [deg]", low=-180, high=180)
    set_rate: bool = setting(False, "set its turns to rate_hz too; a TiM cannot")
    remission: bool = setting(False, "ask for the brightness of the echoes too")
    nearest: float = setting(0.05, "what is nearer counts as too close [m]", low=0.0, high=10.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CarmenDevice(Table):
    """A CARMEN log of a LADAR, played as if it were one."""

    source: str = setting("", "a .clf or .clf.bz2 file; from this file's folder")
    no_return: float = setting(50.0, "range of beams that met nothing [m]", low=0.0, high=1000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsdDevice(Table):
    """A gpsd server."""

    address: str = setting("127.0.0.1", "HOST or HOST:PORT (2947)")
    rate_hz: float = setting(1.0, "positions a second [Hz]", **_RATE)


@dataclass(frozen=True, slots=True, kw_only=True)
class GalilDevice(Table):
    """A Galil motor controller with the robot's two wheels."""

    address: str = setting("", "HOST or HOST:PORT (23)")
    wheel_radius: float = setting(0.0, "of a wheel under load [m]", low=0.0, high=2.0)
    track: float = setting(0.0, "between the middles of the tyres [m]", low=0.0, high=5.0)
    counts: float = setting(0.0, "encoder counts per turn of a wheel", low=0.0, high=1e8)
    left: str = setting("A", "axis of the left wheel")
    right: str = setting("B", "axis of the right wheel")
    invert_left: bool = setting(False, "counts go down when the left wheel rolls ahead")
    invert_right: bool = setting(False, "counts go down when the right wheel rolls ahead")
    speed: float = setting(1.0, "largest of a wheel [m/s]", low=0.01, high=20.0)
    acceleration: float = setting(1.0, "of a wheel [m/s²]", low=0.01, high=20.0)
    deceleration: float = setting(
        2.0, "of a wheel, also when it is stopped [m/s²]", low=0.01, high=20
    )
    rate_hz: float = setting(20.0, "commands and feedback a second [Hz]", low=5.0, high=200.0)
    silence: float = setting(
        0.3, "after it the controller itself stops the wheels [s]; 0: never", low=0.0, high=5.0
    )
    command_limit: float = setting(0.3, "how long a command counts [s]", low=0.05, high=5.0)
    ramp_step: int = setting(
        1024, "AC and DC are multiples of it, by model [counts/s²]", low=1, high=1_000_000
    )
    fastest: float = setting(12e6, "largest jog speed of the model [counts/s]", low=1.0, high=1e9)
    replace_program: bool = setting(False, "overwrite a program that the controller holds")


@dataclass(frozen=True, slots=True, kw_only=True)
class MavlinkDevice(Table):
    """An autopilot that turns the wheels."""

    port: str = setting("", "/dev/ttyACM0, better /dev/serial/by-id/..., or tcp://HOST:PORT")
    baud: int = setting(57600, "speed of the line", **_BAUD)
    speed: float = setting(1.0, "largest [m/s]", low=0.01, high=20.0)
    rate_hz: float = setting(10.0, "commands and feedback a second [Hz]", low=2.0, high=100.0)
    command_limit: float = setting(0.3, "how long a command counts [s]", low=0.05, high=5.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class DryRunDevice(Table):
    """A drive without wheels."""

    track: float = setting(0.5, "between the wheels [m]", low=0.01, high=5.0)
    acceleration: float = setting(1.0, "[m/s²]", low=0.01, high=20.0)
    command_limit: float = setting(0.3, "how long a command counts [s]", low=0.05, high=5.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDevice(Table):
    """A V4L2 camera, a network stream, or files played as if they were one."""

    source: str = setting("", "/dev/video0, /dev/v4l/by-id/..., rtsp://..., a video or a folder")
    right: str = setting("", "the right camera, where it is another device")
    side_by_side: bool = setting(False, "one picture holds the left and the right one")
    rig: str = setting("", "calibration of the pair, for `bearcub doctor`; from this file's folder")
    width: int = setting(0, "of the whole picture [px]; 0: as it is", low=0, high=20000)
    height: int = setting(0, "of the whole picture [px]; 0: as it is", low=0, high=20000)
    rate_hz: float = setting(15.0, "pictures a second [Hz]", **_RATE)
    format: str = choice("", "of the pixels", "", "MJPG", "YUYV", "GREY", "UYVY")
    exposure_ms: float = setting(0.0, "[ms]; 0: automatic", low=0.0, high=1000.0)
    gain: float = setting(-1.0, "in the camera's own scale; -1: as it is", low=-1.0, high=1e6)
    largest_skew_ms: float = setting(
        10.0, "farther apart, two devices' pictures are no pair [ms]", low=0.1, high=1000.0
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginDevice(Table):
    """A camera that needs its maker's software."""

    device: str = setting("", "serial number or identifier; empty: the first that is found")
    library: str = setting("", "GenTL producer (.cti) of a GenICam camera")
    rig: str = setting("", "calibration of the pair, for `bearcub doctor`; from this file's folder")
    width: int = setting(0, "of one picture [px]; 0: the camera's own", low=0, high=20000)
    height: int = setting(0, "of one picture [px]; 0: the camera's own", low=0, high=20000)
    rate_hz: float = setting(15.0, "pictures a second [Hz]", **_RATE)
    exposure_ms: float = setting(0.0, "[ms]; 0: automatic", low=0.0, high=1000.0)


def required(value: str | float, key: str, hint: str) -> None:
    """Raise `ConfigError` where a key that has no default was left out."""
    if not value:
        raise ConfigError(f"{key}: is missing; {hint}")
