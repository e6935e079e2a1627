"""Xsens MTi with MTData2 messages over Xbus, 115200 baud.

``FA FF``, message, length (FF: two more bytes of length), data, and a byte that makes the sum of
all but ``FA`` zero. MTData2 is a list of (identifier u16, length u8, data); an identifier's last
digit tells number format (0 float, 1 and 2 fixed point, 3 double) and the coordinates of
orientations (0 ENU, 4 NED, 8 NWU). Its axes are x ahead, y left, z up, its pitch is positive nose
down, as in REP-103 (MT Low-Level Communication Protocol, "MTData2").
"""

import math
import struct
from collections.abc import Generator
from dataclasses import dataclass

from bearcub.devices.driver import Ask, Conversation, Measured, Step, on_the_line
from bearcub.devices.framing import Cut, Framer
from bearcub.devices.tilt.angles import AIRCRAFT, REP_103, Convention, tilt_from
from bearcub.errors import DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Inertial, Tilt

BAUD = 115200
GO_TO_CONFIG, GO_TO_MEASUREMENT, SET_OUTPUT, MT_DATA_2 = 0x30, 0x10, 0xC0, 0x36
WAKE_UP, ERROR = 0x3E, 0x42
EULER, QUATERNION, ACCELERATION, RATE = 0x2030, 0x2010, 0x4020, 0x8020

_PREAMBLE = b"\xfa\xff"
_LONGEST = 2048  # of a whole message; the device's own limit is lower
_TIMEOUT = 0.3
_TRIES = 4
_NED = 0x4


@dataclass(frozen=True, slots=True)
class Message:
    """One Xbus message."""

    kind: int
    data: bytes


def encode(kind: int, data: bytes = b"") -> bytes:
    """Return a message's bytes.

    Examples
    --------
    >>> encode(GO_TO_CONFIG).hex(" ").upper()
    'FA FF 30 00 D1'
    """
    length = bytes([len(data)]) if len(data) < 255 else b"\xff" + len(data).to_bytes(2, "big")
    body = b"\xff" + bytes([kind]) + length + data
    return b"\xfa" + body + bytes([-sum(body) & 0xFF])


def parser() -> Framer[Message]:
    """Return a parser of messages."""
    return Framer(_cut, longest=_LONGEST)


def items(message: Message) -> dict[int, bytes]:
    """Return what an MTData2 message holds, by identifier.

    Raises
    ------
    FormatError
        If its lengths do not add up.
    """
    found: dict[int, bytes] = {}
    data, place = message.data, 0
    while place < len(data):
        end = place + 3 + (data[place + 2] if place + 3 <= len(data) else len(data))
        if end > len(data):
            raise FormatError(f"MTData2 of {len(data)} bytes: an item ends behind it, at {end}")
        found[int.from_bytes(data[place : place + 2], "big")] = data[place + 3 : end]
        place = end
    return found


class _Xsens:
    """What the driver of its angles and that of its raw values have in common."""

    wanted: tuple[int, ...] = ()

    def __init__(self, *, rate_hz: int = 50, baud: int = BAUD) -> None:
        self.parser = parser()
        self._rate_hz = rate_hz
        self._baud = baud

    def conversation(self) -> Conversation[Message]:
        """Choose what it measures, which is possible in its configuration state only."""
        yield from _command(GO_TO_CONFIG)
        output = b"".join(struct.pack(">HH", which, self._rate_hz) for which in self.wanted)
        yield from _command(SET_OUTPUT, output)
        yield from _command(GO_TO_MEASUREMENT)

    def farewell(self) -> bytes:
        """Return nothing: it may go on sending."""
        return b""

    def _found(self, telegram: Message) -> dict[int, bytes]:
        """Return the items of a measurement; none of another message."""
        if telegram.kind == WAKE_UP:
            raise DeviceError("has started anew; its settings are chosen again")
        return items(telegram) if telegram.kind == MT_DATA_2 else {}

    def _latency(self, telegram: Message) -> float:
        return on_the_line(len(telegram.data) + 5, self._baud)


class Xsens(_Xsens):
    """The driver of an MTi's own attitude.

    Parameters
    ----------
    rate_hz : int
        How often it shall measure [Hz].
    baud : int
        Of the line, for the latency.
    convention : Convention or None
        Of its signs; None takes what each message says of its coordinates.
    """

    wanted = (EULER,)

    def __init__(
        self, *, rate_hz: int = 50, baud: int = BAUD, convention: Convention | None = None
    ) -> None:
        super().__init__(rate_hz=rate_hz, baud=baud)
        self._convention = convention

    def value(self, telegram: Message) -> Measured[Tilt] | None:
        """Return its attitude, from Euler angles."""
        found = self._found(telegram)
        which = next((which for which in found if which & 0xFFF0 == EULER), None)
        if which is None:
            return None
        roll, pitch, yaw = (math.radians(value) for value in _numbers(found[which], which))
        own = AIRCRAFT if which & 0xC == _NED else REP_103
        tilt = tilt_from(self._convention or own, pitch=pitch, roll=roll, heading=yaw)
        return Measured(tilt, self._latency(telegram))


class XsensInertial(_Xsens):
    """The driver of an MTi's raw accelerations and rates, for `complementary.Fused`.

    Parameters
    ----------
    rate_hz : int
        How often it shall measure [Hz].
    baud : int
        Of the line, for the latency.
    """

    wanted = (ACCELERATION, RATE)

    def value(self, telegram: Message) -> Measured[Inertial] | None:
        """Return accelerations and rates in ``base_link`` axes, which are the device's own."""
        found = {which & 0xFFF0: (which, data) for which, data in self._found(telegram).items()}
        if ACCELERATION not in found or RATE not in found:
            return None
        (first, acceleration), (second, rate) = found[ACCELERATION], found[RATE]
        inertial = Inertial(acceleration=_numbers(acceleration, first), rate=_numbers(rate, second))
        return Measured(inertial, self._latency(telegram))


def _numbers(data: bytes, which: int) -> tuple[float, float, float]:
    """Return three numbers in the format that their identifier tells."""
    form = which & 0x3
    sizes = {0: 12, 1: 12, 2: 18, 3: 24}
    if len(data) != sizes[form]:
        raise FormatError(
            f"MTData2 item {which:04X}: {len(data)} bytes, expected {sizes[form]} for three numbers"
        )
    if form == 1:  # fixed point 12.20
        x, y, z = (value / 2**20 for value in struct.unpack(">iii", data))
    elif form == 2:  # fixed point 16.32: the fraction comes first
        low_high = struct.unpack(">IhIhIh", data)
        x, y, z = (low_high[i + 1] + low_high[i] / 2**32 for i in (0, 2, 4))
    else:
        x, y, z = struct.unpack(">ddd" if form == 3 else ">fff", data)
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise FormatError(f"MTData2 item {which:04X}: {x}, {y}, {z}: expected finite numbers")
    return x, y, z


def _command(kind: int, data: bytes = b"") -> Generator[Step[Message], Message | None, None]:
    """Send a command until it is acknowledged by the message of the next number."""
    for _ in range(_TRIES):
        reply = yield Ask(encode(kind, data), lambda m: m.kind in (kind + 1, ERROR), _TIMEOUT)
        if reply is not None and reply.kind == ERROR:
            raise DeviceError(f"refuses message {kind:02X} with error {reply.data.hex()}")
        if reply is not None:
            return
    raise DeviceTimeout(f"no reply to message {kind:02X}; check power, cable and baud")


def _cut(data: bytes, start: int) -> Cut[Message]:
    if data[start] != _PREAMBLE[0] or data[start + 1 : start + 2] not in (b"", _PREAMBLE[1:]):
        found = data.find(_PREAMBLE[:1], start + 1)
        return Cut((found if found >= 0 else len(data)) - start)
    head = data[start + 2 : start + 6]
    if len(head) < 2 or (head[1] == 0xFF and len(head) < 4):
        return Cut(0)
    begin = start + (6 if head[1] == 0xFF else 4)
    length = int.from_bytes(head[2:4], "big") if head[1] == 0xFF else head[1]
    end = begin + length
    if end + 1 - start > _LONGEST:
        return Cut(1, None, "impossible length")
    if len(data) <= end:
        return Cut(0)
    if sum(data[start + 1 : end + 1]) & 0xFF:
        return Cut(1, None, "wrong checksum")
    return Cut(end + 1 - start, Message(head[0], data[begin:end]))
