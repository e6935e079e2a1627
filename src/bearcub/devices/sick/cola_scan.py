"""``LMDscandata``: the scan of SICK's LMS1xx, LMS5xx and TiM, with all that travels beside it.

References
----------
.. [1] SICK 8014631, "Telegram Listing, Ranging sensors LMS1xx, LMS5xx, TiM", ``LMDscandata``.
"""

import functools
import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bearcub.devices.sick.cola import Message, fields_of
from bearcub.devices.sick.cola_fields import Fields
from bearcub.errors import FormatError
from bearcub.messages import BeamFlag, Float32, Float64, Scan

NAME = "LMDscandata"

_AHEAD_DEG = 90.0  # of the scanners' own angles
_RESERVED = 16  # raw distances below are codes
_CODE_RANGES = np.full(_RESERVED, math.nan, np.float32)
_CODE_RANGES[[0, 2]] = math.inf  # no echo, or too weak a one; TiM scanners send 2 for it
_DAZZLED = 1
_MOST_CHANNELS = 32
_LARGEST = 1e6  # scale or offset
_MOST_ENCODERS = 8
_FINEST_STEP_PARTS = 12  # steps are fractions of a degree; 0.3333 means a third
_STATUS = {
    1: "reports an error",
    2: "the front window is getting dirty",
    4: "the front window is dirty",
    5: "the front window is dirty",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channel:
    """One kind of measured value over all beams.

    Attributes
    ----------
    content : str
        ``DIST1`` to ``DIST5`` (echoes), ``RSSI1`` ... (their remission), ``ANGL1``, ``VANG1``.
    scale, offset : float
        A value is ``raw * scale + offset``; distances are in mm then.
    start_deg, step_deg : float
        Of the beams [deg], in the scanner's own angles: 90 ahead, counter-clockwise.
    raw : ndarray of uint8 or uint16, shape (N,)
    """

    content: str
    scale: float
    offset: float
    start_deg: float
    step_deg: float
    raw: NDArray[np.integer]

    @property
    def values(self) -> Float32:
        """The scaled values, codes included; shape (N,)."""
        return (self.raw * np.float32(self.scale) + np.float32(self.offset)).astype(np.float32)

    @property
    def angles(self) -> Float64:
        """Of the beams [rad], 0 ahead, counter-clockwise; shape (N,)."""
        return _angles(self.start_deg, self.step_deg, len(self.raw))


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Where the scanner says that it is mounted: x, y, z and the rotations about them."""

    place: tuple[float, float, float]
    rotation: tuple[float, float, float]
    kind: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """An event at an input or encoder during the scan."""

    kind: str
    encoder: int
    time_us: int
    angle_deg: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScanData:
    """One ``LMDscandata`` telegram, whole.

    Attributes
    ----------
    version, device, serial_number : int
    status : tuple of int
        Two bytes: 0 0 all well, 0 1 error, 0 2 pollution warning, 0 4 and 0 5 pollution error.
    telegram_counter, scan_counter : int
        16 bits, both wrap.
    start_us, transmitted_us : int
        When the scan was measured and sent [us], 32 bits since power-up.
    inputs, outputs : tuple of int
        Digital, two bytes each.
    layer_deg : float
        Of multi-layer scanners [deg].
    scan_hz, measurement_hz : float
        Turns and single measurements per second [Hz].
    encoders : tuple of (int, int)
        Position and speed of each.
    channels : tuple of Channel
        Those of 16 bits, then those of 8.
    position : Position or None
    device_name, comment : str
        Empty where none was sent.
    time : str
        The scanner's own clock, ``YYYY-MM-DDThh:mm:ss.ffffff``; empty where none was sent.
    event : Event or None
    """

    version: int
    device: int
    serial_number: int
    status: tuple[int, int]
    telegram_counter: int
    scan_counter: int
    start_us: int
    transmitted_us: int
    inputs: tuple[int, int]
    outputs: tuple[int, int]
    layer_deg: float
    scan_hz: float
    measurement_hz: float
    encoders: tuple[tuple[int, int], ...]
    channels: tuple[Channel, ...]
    position: Position | None
    device_name: str
    comment: str
    time: str
    event: Event | None

    def channel(self, content: str) -> Channel | None:
        """Return the channel of that content; None if it was not sent."""
        return next((c for c in self.channels if c.content == content), None)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the scanner says of itself."""
        low = self.status[1]
        return (_STATUS.get(low, f"status {self.status[0]} {low}"),) if any(self.status) else ()

    @property
    def delay(self) -> float:
        """From measuring to sending [s]; 0 where the scanner's clock gives no sensible value."""
        microseconds = (self.transmitted_us - self.start_us) % 2**32
        return microseconds * 1e-6 if microseconds < 1_000_000 else 0.0


def decode_scan_data(message: Message) -> ScanData:
    """Return what an ``LMDscandata`` telegram says, in either dialect.

    Raises
    ------
    FormatError
        If it is another telegram, or ends too early.
    """
    if message.name != NAME or message.kind not in {"sSN", "sRA"}:
        raise FormatError(f"CoLa telegram: {message.kind} {message.name}, expected sSN {NAME}")
    fields = fields_of(message)
    number = fields.number
    return ScanData(
        version=number("u16", "the version"),
        device=number("u16", "the device number"),
        serial_number=number("u32", "the serial number"),
        status=_pair(fields, "the status"),
        telegram_counter=number("u16", "the telegram counter"),
        scan_counter=number("u16", "the scan counter"),
        start_us=number("u32", "the time since start-up"),
        transmitted_us=number("u32", "the time of transmission"),
        inputs=_pair(fields, "the inputs"),
        outputs=_pair(fields, "the outputs"),
        layer_deg=_signed(number("u16", "the layer angle")) / 200.0,
        scan_hz=number("u32", "the scan frequency") / 100.0,
        measurement_hz=number("u32", "the measurement frequency") * 100.0,
        encoders=_encoders(fields),
        channels=_channels(fields, "u16") + _channels(fields, "u8"),
        position=_position(fields),
        device_name=_text(fields, "the device name"),
        comment=_text(fields, "the comment"),
        time=_time(fields),
        event=_event(fields),
    )


def to_scan(data: ScanData, *, nearest: float = 0.05) -> Scan:
    """Return the first echoes as a `Scan`, after REP-117.

    Parameters
    ----------
    data : ScanData
    nearest : float, optional
        What is measured nearer than this [m] is too close to be measured right, hence -inf.

    Raises
    ------
    FormatError
        If there is no distance in it.
    """
    distances = data.channel("DIST1")
    if distances is None:
        contents = ", ".join(channel.content for channel in data.channels) or "no channel"
        raise FormatError(f"{NAME}: holds {contents}, expected DIST1; enable echo 1 in the scanner")
    remission = data.channel("RSSI1")
    if remission is not None and len(remission.raw) != len(distances.raw):
        remission = None
    span_deg = distances.step_deg * (len(distances.raw) - 1)
    largest = float(np.iinfo(distances.raw.dtype).max)
    return Scan(
        ranges=_ranges(distances, nearest),
        angles=distances.angles,
        nearest=nearest,
        farthest=(largest * distances.scale + distances.offset) * 1e-3,
        intensities=None if remission is None else remission.values,
        flags=np.where(distances.raw == _DAZZLED, np.uint8(BeamFlag.DAZZLED), np.uint8(0)),
        duration=span_deg / 360.0 / data.scan_hz if data.scan_hz else math.nan,
        warnings=data.warnings,
    )


def _ranges(distances: Channel, nearest: float) -> Float32:
    ranges = distances.values * np.float32(1e-3)
    ranges[ranges < nearest] = -math.inf
    coded = distances.raw < _RESERVED
    ranges[coded] = _CODE_RANGES[distances.raw[coded]]
    return ranges


@functools.lru_cache(maxsize=64)
def _angles(start_deg: float, step_deg: float, count: int) -> Float64:
    """Return the angles of the beams [rad]; the step was rounded for the telegram."""
    exact = float(Fraction(step_deg).limit_denominator(_FINEST_STEP_PARTS))
    step = exact if abs(exact - step_deg) < 1e-4 else step_deg
    angles: Float64 = np.deg2rad(start_deg - _AHEAD_DEG + step * np.arange(count))
    angles.flags.writeable = False
    return angles


def _pair(fields: Fields, what: str) -> tuple[int, int]:
    return fields.number("u8", what), fields.number("u8", what)


def _signed(value: int) -> int:
    return value - 0x10000 if value >= 0x8000 else value


def _encoders(fields: Fields) -> tuple[tuple[int, int], ...]:
    count = _count(fields, "encoders", _MOST_ENCODERS)
    return tuple(
        (fields.number("u32", "an encoder's position"), fields.number("u16", "an encoder's speed"))
        for _ in range(count)
    )


def _count(fields: Fields, what: str, most: int) -> int:
    count = fields.number("u16", f"the number of {what}")
    if not 0 <= count <= most:
        raise FormatError(f"{NAME}: {count} {what}, expected up to {most}")
    return count


def _channels(fields: Fields, kind: str) -> tuple[Channel, ...]:
    return tuple(
        _channel(fields, kind) for _ in range(_count(fields, f"channels of {kind}", _MOST_CHANNELS))
    )


def _channel(fields: Fields, kind: str) -> Channel:
    content = fields.characters(5, "a channel's content")
    scale, offset = fields.real(f"the scale of {content}"), fields.real(f"the offset of {content}")
    start = fields.number("i32", f"the start angle of {content}")
    step = fields.number("u16", f"the angular step of {content}")
    count = fields.number("u16", f"the number of values of {content}")
    if not (abs(scale) < _LARGEST and abs(offset) < _LARGEST) or step <= 0 or count < 0:
        raise FormatError(
            f"{NAME}: {content} with scale {scale}, offset {offset}, step {step} and {count} "
            "values; expected sensible numbers and a positive step"
        )
    return Channel(
        content=content,
        scale=scale,
        offset=offset,
        start_deg=start / 10_000,
        step_deg=step / 10_000,
        raw=fields.row(kind, count, f"the values of {content}"),
    )


def _flag(fields: Fields, what: str) -> bool:
    return fields.number("u16", f"whether there is {what}") != 0


def _position(fields: Fields) -> Position | None:
    what = "the position"
    if not _flag(fields, what):
        return None
    x, y, z, about_x, about_y, about_z = (fields.real(what) for _ in range(6))
    kind = fields.number("u8", what)
    return Position(place=(x, y, z), rotation=(about_x, about_y, about_z), kind=kind)


def _text(fields: Fields, what: str) -> str:
    if not _flag(fields, what):
        return ""
    count = fields.number("u16", f"the length of {what}")
    if count < 0:
        raise FormatError(f"{NAME}: {count} characters for {what}, expected 0 or more")
    return fields.characters(count, what)


def _time(fields: Fields) -> str:
    what = "the time"
    if not _flag(fields, what):
        return ""
    year = fields.number("u16", what)
    month, day, hour, minute, second = (fields.number("u8", what) for _ in range(5))
    microsecond = fields.number("u32", what)
    return f"{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{microsecond:06}"


def _event(fields: Fields) -> Event | None:
    what = "the event"
    if not _flag(fields, what):
        return None
    return Event(
        kind=fields.characters(4, what),
        encoder=fields.number("u32", what),
        time_us=fields.number("u32", what),
        angle_deg=fields.number("i32", what) / 10_000,
    )
