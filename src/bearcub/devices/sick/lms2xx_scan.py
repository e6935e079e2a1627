"""Scans of the SICK LMS2xx: what the words of a telegram mean depends on how it is set.

The low bits of each word are the distance, the high bits flags or the brightness of reflectors;
how many are which, the *measuring mode* says, which is not in the telegram [1]_.

References
----------
.. [1] SICK 8007954, "Telegram Listing LMS2xx", measured values and configuration (B0h, 77h).
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bearcub.devices.sick.lms2xx import Reply, Telegram
from bearcub.errors import ConfigError, FormatError
from bearcub.messages import BeamFlag, Float32, Float64, Scan, UInt8

MIRROR_HZ = 75.0
FIELDS_OF_VIEW_DEG = {180: (1.0, 0.5), 100: (1.0, 0.5, 0.25)}
"""Resolutions [deg] that each field of view can be scanned with."""

_UNITS = {0: 0.01, 1: 0.001, 2: 0.1}  # metres per count
_CODES = 9  # the highest distances of every mode stand for something else
_CODE_RANGES = np.full(_CODES, math.nan, np.float32)
_CODE_RANGES[[0, 8]] = math.inf  # 1FF7: beyond the range; 1FFF: no echo
_DAZZLED_CODE = 7  # 1FFE


@dataclass(frozen=True, slots=True)
class MeasuringMode:
    """How the 16 bits of a measured value are shared out.

    Attributes
    ----------
    distance_bits : int
        The low bits that hold the distance.
    flags : tuple of BeamFlag
        What the other bits say, from the lowest; empty where they are a reflector's level.
    """

    distance_bits: int
    flags: tuple[BeamFlag, ...] = ()

    @property
    def mask(self) -> int:
        """The distance's bits."""
        return (1 << self.distance_bits) - 1

    @property
    def has_reflectors(self) -> bool:
        """Whether the high bits are the brightness of the echo in a few levels."""
        return not self.flags and self.distance_bits < 16

    def beam_flags(self, words: NDArray[np.uint16]) -> UInt8:
        """Return the `BeamFlag` of every word, shape (N,)."""
        return _flag_table(self.flags).take(words >> self.distance_bits)


@functools.cache
def _flag_table(flags: tuple[BeamFlag, ...]) -> UInt8:
    table = [
        sum(flag for bit, flag in enumerate(flags) if high & 1 << bit) for high in range(1 << 3)
    ]
    return np.array(table, np.uint8)


_A, _B, _C = BeamFlag.FIELD_A, BeamFlag.FIELD_B, BeamFlag.FIELD_C
MEASURING_MODES = {
    0x00: MeasuringMode(13, (_A, _B, BeamFlag.DAZZLED)),  # 8 m in mm, 80 m in cm
    0x01: MeasuringMode(13),
    0x02: MeasuringMode(13, (_A, _B, _C)),
    0x03: MeasuringMode(14),  # 16 m in mm
    0x04: MeasuringMode(14, (_A, _B)),
    0x05: MeasuringMode(15),  # 32 m in mm
    0x06: MeasuringMode(15, (_A,)),
    0x0F: MeasuringMode(16),
}
"""By the configuration's byte 5."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lms2xxSetting:
    """How the scanner is set, as far as its telegrams do not say it themselves.

    Attributes
    ----------
    fov_deg : int
        Field of view [deg], 180 or 100, around straight ahead.
    resolution_deg : float
        1, 0.5 or, of 100 deg, 0.25 [deg].
    measuring_mode : int
        A key of `MEASURING_MODES`.

    Raises
    ------
    ConfigError
        If the scanner cannot be set so.
    """

    fov_deg: int = 180
    resolution_deg: float = 0.5
    measuring_mode: int = 0

    def __post_init__(self) -> None:
        if self.resolution_deg not in FIELDS_OF_VIEW_DEG.get(self.fov_deg, ()):
            raise ConfigError(
                f"LMS2xx: {self.fov_deg} deg in steps of {self.resolution_deg} deg; expected 180 "
                "deg in steps of 1 or 0.5, or 100 deg in steps of 1, 0.5 or 0.25"
            )
        if self.measuring_mode not in MEASURING_MODES:
            raise ConfigError(
                f"LMS2xx: measuring mode 0x{self.measuring_mode:02X}; expected one of "
                f"{', '.join(f'0x{mode:02X}' for mode in MEASURING_MODES)}"
            )

    @property
    def count(self) -> int:
        """Beams of a whole scan."""
        return round(self.fov_deg / self.resolution_deg) + 1

    @property
    def start_deg(self) -> float:
        """Angle of the first beam [deg], right negative."""
        return -self.fov_deg / 2

    @property
    def turns(self) -> int:
        """Turns of the mirror that a whole scan takes, each measuring every 1 deg."""
        return round(1 / self.resolution_deg)

    def rate_hz(self, baud: int) -> float:
        """Return the whole scans per second [Hz]: those that find the line free; 10 bits a byte."""
        on_the_line = (2 * self.count + 10) * 10.0 / baud
        scan = self.turns / MIRROR_HZ
        return 1.0 / (scan * math.ceil(on_the_line / scan))


@dataclass(frozen=True, slots=True)
class _Words:
    """The measured values of one telegram and where their beams point."""

    words: NDArray[np.uint16]
    unit: float
    start_deg: float
    step_deg: float
    turns: int


def decode_scan(telegram: Telegram, setting: Lms2xxSetting) -> Scan:
    """Return the scan in a telegram B0 (all or part of a turn), B6 (mean) or B7 (subrange).

    The scanner's codes become what REP-117 says: beyond its range or no echo is +inf; dazzled,
    overflow, too noisy and the rest NaN. Distance 0 is -inf.

    Parameters
    ----------
    telegram : Telegram
    setting : Lms2xxSetting
        How the scanner was set when it measured.

    Raises
    ------
    FormatError
        If it is no such telegram, or does not fit to `setting`.
    """
    measured = _words(telegram, setting)
    mode = MEASURING_MODES[setting.measuring_mode]
    flags = mode.beam_flags(measured.words) if mode.flags else None
    ranges = _ranges(measured, mode, flags)
    count = len(ranges)
    levels = measured.words >> mode.distance_bits if mode.has_reflectors else None
    span_deg = (count - 1) * measured.step_deg
    return Scan(
        ranges=ranges,
        angles=_angles(measured.start_deg, measured.step_deg, count),
        nearest=measured.unit,
        farthest=(mode.mask - _CODES) * measured.unit,
        intensities=None if levels is None else levels.astype(np.float32),
        flags=flags,
        duration=(measured.turns - 1 + span_deg / 360) / MIRROR_HZ,
        warnings=(telegram.fault,) if telegram.fault else (),
    )


def _ranges(measured: _Words, mode: MeasuringMode, flags: UInt8 | None) -> Float32:
    """Return the ranges [m]; sets the flag of beams that a code says were dazzled."""
    counts = measured.words & mode.mask
    ranges = counts * np.float32(measured.unit)
    ranges[counts == 0] = -math.inf
    codes = counts.astype(np.int32) - (mode.mask - _CODES + 1)
    coded = codes >= 0
    if coded.any():
        ranges[coded] = _CODE_RANGES[codes[coded]]
        if flags is not None:
            flags[codes == _DAZZLED_CODE] |= np.uint8(BeamFlag.DAZZLED)
    if flags is not None:
        ranges[flags & BeamFlag.DAZZLED != 0] = math.nan
    return ranges


def _words(telegram: Telegram, setting: Lms2xxSetting) -> _Words:
    """Return the words of a telegram; raise `FormatError` unless they fit to `setting`."""
    first, before = 0, 0
    if telegram.command == Reply.SUBRANGE_SCAN:
        first, before = int.from_bytes(telegram.data[:2], "little") - 1, 4
    elif telegram.command == Reply.MEAN_SCAN:
        before = 1
    elif telegram.command != Reply.SCAN:
        raise FormatError(f"LMS2xx: telegram 0x{telegram.command:02X}, expected a scan (0xB0)")
    header = int.from_bytes(telegram.data[before : before + 2], "little")
    count, index, unit = header & 0x3FF, header >> 11 & 0b11, header >> 14
    start = before + 2
    # Two index bytes may follow the words, as the availability byte of the configuration says.
    if not 0 <= len(telegram.data) - start - 2 * count <= 2 or not count:
        raise FormatError(
            f"LMS2xx: a scan of {count} values in {len(telegram.data)} bytes, expected "
            f"{start + 2 * count} to {start + 2 * count + 2}"
        )
    if unit not in _UNITS:
        raise FormatError(f"LMS2xx: a scan in unit {unit}, expected 0 (cm), 1 (mm) or 2 (10 cm)")
    words = np.frombuffer(telegram.data, "<u2", count, start).astype(np.uint16, copy=False)
    if header & 0x2000:
        return _partial(words, _UNITS[unit], index, setting)
    whole = telegram.command != Reply.SUBRANGE_SCAN
    if (count != setting.count) if whole else not 0 <= first <= setting.count - count:
        raise FormatError(
            f"LMS2xx: a scan of {count} values from the {first + 1}. on, expected {setting.count} "
            f"for {setting.fov_deg} deg in steps of {setting.resolution_deg} deg; set both to what "
            "the scanner uses"
        )
    step = setting.resolution_deg
    return _Words(words, _UNITS[unit], setting.start_deg + first * step, step, setting.turns)


def _partial(words: NDArray[np.uint16], unit: float, index: int, setting: Lms2xxSetting) -> _Words:
    """Return one turn's beams: 1 deg apart, the first `index` quarters of a degree in."""
    expected = setting.fov_deg + (index == 0)
    if len(words) != expected:
        raise FormatError(
            f"LMS2xx: a part {index} of a scan with {len(words)} values, expected {expected} for "
            f"{setting.fov_deg} deg"
        )
    return _Words(words, unit, setting.start_deg + 0.25 * index, 1.0, 1)


@functools.lru_cache(maxsize=64)
def _angles(start_deg: float, step_deg: float, count: int) -> Float64:
    angles: Float64 = np.deg2rad(start_deg + step_deg * np.arange(count))
    return angles
