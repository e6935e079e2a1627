"""The binary data record (QR): one consistent sample of both wheels.

Little-endian. A header of 4 bytes (bits of the blocks that follow, and the record's size), then
general, coordinated-motion and axis blocks, whose sizes QZ tells. The fields used here stand at the
same place in the axis block of every model; what differs is where the blocks begin and how long
they are (command reference, QR and QZ).
"""

import struct
from dataclasses import dataclass

from bearcub.errors import FormatError

HEADER = 4  # bytes
_MOVING = 0x8000
_MOTOR_OFF = 0x0001
_REVERSE_SWITCH, _FORWARD_SWITCH = 0x04, 0x08  # of the switch byte; set: not active
_VELOCITY_SCALE = 64.0  # TV in the record is 64 times counts/s
_AXIS = struct.Struct("<HBBiiiii")  # status, switches, stop code, RP, TP, TE, TD, TV


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How many axes a record has and how long its blocks are [bytes], as QZ tells."""

    axes: int
    general: int
    coordinated: int
    axis: int

    @property
    def size(self) -> int:
        """The whole record's size [bytes]."""
        return HEADER + self.general + self.coordinated + self.axes * self.axis

    @classmethod
    def parse(cls, text: str) -> "Layout":
        """Read the reply to QZ, such as ``4, 52, 26, 36`` (DMC-40x0).

        Raises
        ------
        FormatError
            If that is not four numbers, or no record could be laid out so.

        Examples
        --------
        >>> Layout.parse(" 4, 52, 26, 36").size
        226
        """
        words = text.split(",")
        if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
            raise FormatError(f"QZ: {text!r}: expected four numbers such as 4, 52, 26, 36")
        layout = cls(**dict(zip(("axes", "general", "coordinated", "axis"), map(int, words))))  # noqa: B905
        if not (1 <= layout.axes <= 8 and _AXIS.size <= layout.axis <= 64) or layout.size > 1024:
            raise FormatError(f"QZ: {text!r}: no data record is laid out so")
        return layout

    @classmethod
    def of(cls, record: bytes) -> "Layout":
        """Return the layout of a record whose controller was not asked, by its size.

        Raises
        ------
        FormatError
            If no known model sends records of that size for so many axes.
        """
        axes = record[1].bit_count() if len(record) >= HEADER else 0
        for blocks in _MODELS:
            layout = cls(axes=axes, **blocks)
            if axes and layout.size == len(record):
                return layout
        raise FormatError(f"QR: {len(record)} bytes for {axes} axes: no known model's record")


_MODELS = (
    {"general": 52, "coordinated": 26, "axis": 36},  # DMC-40x0, 41x3, 500x0
    {"general": 24, "coordinated": 16, "axis": 28},  # DMC-14xx, 2xxx, 21x3
    {"general": 18, "coordinated": 16, "axis": 36},  # DMC-300x0
)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisState:
    """One axis as the controller sees it.

    Attributes
    ----------
    position : int
        Encoder (TP) [counts], wrapping at 2^31.
    velocity : float
        Encoder velocity, averaged over about 0.25 s (TV) [counts/s].
    stop_code : int
        See `bearcub.devices.galil.codes`.
    moving, motor_off, forward_limit, reverse_limit : bool
        A limit is True where its switch is active.
    """

    position: int
    velocity: float
    stop_code: int
    moving: bool
    motor_off: bool
    forward_limit: bool
    reverse_limit: bool


def decode_record(record: bytes, layout: Layout, *, axes: str) -> tuple[AxisState, ...]:
    """Return the state of the named axes.

    Parameters
    ----------
    record : bytes
        Without the ``:`` that follows it.
    layout : Layout
    axes : str
        Letters, such as ``AB``.

    Raises
    ------
    FormatError
        If the record is not of the layout's size, in fact or by its header, or an axis is not in
        it.
    """
    stated = int.from_bytes(record[2:HEADER], "little")
    if len(record) != layout.size or stated != layout.size:
        raise FormatError(
            f"QR: {len(record)} bytes with a header that says {stated}, expected {layout.size}"
        )
    return tuple(_axis(record, layout, letter) for letter in axes)


def _axis(record: bytes, layout: Layout, letter: str) -> AxisState:
    index = ord(letter) - ord("A")
    if not 0 <= index < layout.axes or not record[1] >> index & 1:
        raise FormatError(f"QR: the record holds no axis {letter}")
    start = HEADER + layout.general + layout.coordinated + index * layout.axis
    status, switches, stop, _, position, _, _, velocity = _AXIS.unpack_from(record, start)
    return AxisState(
        position=position,
        velocity=velocity / _VELOCITY_SCALE,
        stop_code=stop,
        moving=bool(status & _MOVING),
        motor_off=bool(status & _MOTOR_OFF),
        forward_limit=not switches & _FORWARD_SWITCH,
        reverse_limit=not switches & _REVERSE_SWITCH,
    )


QUERY = "TP{0},_TV{0},_SC{0},_BG{0},_MO{0},_LF{0},_LR{0}"


def query(axis: str) -> str:
    """Return the command that asks for the same state as text, where QR is not to be had."""
    return "MG _" + QUERY.format(axis)


def decode_text(text: str) -> AxisState:
    """Read the reply to `query`: seven numbers apart by white space.

    Raises
    ------
    FormatError
        If it is something else.
    """
    try:
        numbers = [float(word) for word in text.split()]
        position, velocity, stop, moving, off, forward, reverse = numbers
        return AxisState(
            position=round(position),
            velocity=velocity,
            stop_code=round(stop),
            moving=moving != 0,
            motor_off=off != 0,
            forward_limit=forward == 0,  # _LF and _LR are 1 where the switch is not active
            reverse_limit=reverse == 0,
        )
    except (ValueError, OverflowError):
        raise FormatError(f"MG: {text!r}: expected seven numbers of an axis") from None
