"""What sensors measure, as frozen values: SI units, radians, frames of REP-103.

None of them carries a stamp: `bearcub.devices.protocols.Reading` gives a value its stamp and age.
NaN is "not known".
"""

import math
from dataclasses import dataclass
from enum import IntEnum, IntFlag

import numpy as np

from bearcub.errors import InputError
from bearcub.messages.arrays import Float32, Float64, UInt8

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tilt:
    """A tilt sensor's reading of the body against gravity, REP-103 [rad].

    Attributes
    ----------
    pitch : float
        Positive nose down.
    roll : float
        Positive right side down.
    """

    pitch: float
    roll: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Orientation(Tilt):
    """A tilt and the heading, of a sensor with a compass that does not doubt it, REP-103 [rad].

    Attributes
    ----------
    yaw : float
        Counter-clockwise from east.
    """

    yaw: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertial:
    """Raw reading of an accelerometer and a gyro, in ``base_link`` axes: x ahead, y left, z up.

    Attributes
    ----------
    acceleration : tuple of float
        Specific force [m/s²]: (0, 0, +9.81) at rest on level ground.
    rate : tuple of float
        Angular rates about x, y, z [rad/s], right-handed.
    """

    acceleration: Vector
    rate: Vector


class BeamFlag(IntFlag):
    """What a scanner says of one beam beside its range."""

    FIELD_A = 1  # the beam ends inside the scanner's own monitored field A
    FIELD_B = 2
    FIELD_C = 4
    DAZZLED = 8  # blinded by a light source; its range is NaN


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """One sweep of a LADAR, ranges after REP-117.

    Attributes
    ----------
    ranges : ndarray of float32, shape (N,)
        [m]; -inf something too close to measure (an obstacle), NaN no measurement, +inf nothing
        within reach.
    angles : ndarray of float64, shape (N,)
        Of the beams in the scanner's frame [rad]: 0 ahead, counter-clockwise, ascending.
    nearest, farthest : float
        Between which the scanner can measure [m]; NaN unknown.
    intensities : ndarray of float32, shape (N,), or None
        Of the echoes, in the device's own scale.
    flags : ndarray of uint8, shape (N,), or None
        `BeamFlag` of every beam.
    duration : float
        From the first to the last beam [s]; NaN unknown. The reading's stamp is that of the last.
    warnings : tuple of str
        What the device says of itself: "window polluted".

    Raises
    ------
    InputError
        If the arrays differ in length, or the angles do not ascend or are not finite.
    """

    ranges: Float32
    angles: Float64
    nearest: float = math.nan
    farthest: float = math.nan
    intensities: Float32 | None = None
    flags: UInt8 | None = None
    duration: float = math.nan
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        arrays = [
            a for a in (self.ranges, self.angles, self.intensities, self.flags) if a is not None
        ]
        if len({a.shape for a in arrays}) != 1 or self.ranges.ndim != 1:
            shapes = ", ".join(str(a.shape) for a in arrays)
            raise InputError(f"scan: arrays of shapes {shapes}; expected one length for all")
        ascending = bool(np.all(self.angles[1:] > self.angles[:-1]))  # false of NaN
        if not ascending or not np.all(np.isfinite(self.angles)):
            raise InputError("scan: its angles do not ascend; expected counter-clockwise beams")
        for array in arrays:
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.ranges)


class FixQuality(IntEnum):
    """How good a GPS position is, by the numbers of NMEA 0183's GGA sentence."""

    NONE = 0
    GPS = 1
    DGPS = 2
    PPS = 3
    RTK_FIXED = 4
    RTK_FLOAT = 5
    DEAD_RECKONING = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Fix:
    """A GPS receiver's position, WGS 84; it travels with its quality, also without a position.

    Attributes
    ----------
    latitude_deg, longitude_deg : float
        North and east positive [deg]; NaN without a fix.
    altitude : float
        Above mean sea level [m].
    quality : FixQuality
    satellites : int or None
        Used for it.
    hdop : float
        Horizontal dilution of precision, without unit.
    sigma : float
        Of the horizontal position, one standard deviation [m].
    speed : float
        Over ground [m/s].
    course : float
        Direction of motion [rad], REP-103: counter-clockwise from east.
    utc_ns : int or None
        The receiver's own time, nanoseconds since 1970-01-01 UTC.
    """

    latitude_deg: float
    longitude_deg: float
    quality: FixQuality
    altitude: float = math.nan
    satellites: int | None = None
    hdop: float = math.nan
    sigma: float = math.nan
    speed: float = math.nan
    course: float = math.nan
    utc_ns: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelState:
    """What a drive says of its wheels.

    Attributes
    ----------
    left, right : float
        Way that each wheel has rolled since the drive was opened [m], ahead positive.
    speed : float
        Of the robot [m/s], ahead positive.
    turn_rate : float
        [rad/s], left positive.
    enabled : bool
        Whether the motors have power.
    faults : tuple of str
        What keeps it from moving, in words: "left wheel: forward limit switch".
    """

    left: float
    right: float
    speed: float
    turn_rate: float
    enabled: bool
    faults: tuple[str, ...] = ()
