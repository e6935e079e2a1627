"""MicroStrain MIP (3DM-GX3 and later): packets of fields with a Fletcher checksum, 115200 baud.

``75 65``, descriptor set, payload length, fields of (length, descriptor, data), two check bytes
over all before. Set 01 commands the device, 0C its data, 80 is IMU data, 82 the filter's. Axes x
ahead, y right, z down; big-endian floats.
"""

import math
import struct
from collections.abc import Generator
from dataclasses import dataclass

from bearcub.devices.driver import Ask, Conversation, Measured, Step, on_the_line
from bearcub.devices.framing import Cut, Framer
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Inertial, Tilt

BAUD = 115200
BASE, DATA, IMU, FILTER = 0x01, 0x0C, 0x80, 0x82  # descriptor sets
IDLE, RESUME, BASE_RATE, MESSAGE_FORMAT, STREAM = 0x02, 0x06, 0x06, 0x08, 0x11
BASE_RATE_REPLY, ACK = 0x83, 0xF1
ACCELERATION, RATE, EULER, FILTER_EULER = 0x04, 0x05, 0x0C, 0x05

_SYNC = b"\x75\x65"
_LONGEST = 4 + 255 + 2
_TIMEOUT = 0.3
_TRIES = 4
G = 9.80665  # the unit of its accelerations [m/s²]
_ANGLES = struct.Struct(">fff")


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet: its descriptor set, and descriptor and data of each field."""

    kind: int
    fields: tuple[tuple[int, bytes], ...]

    def field(self, descriptor: int) -> bytes | None:
        """Return the data of the first field of this descriptor."""
        return next((data for found, data in self.fields if found == descriptor), None)


def encode(kind: int, *fields: tuple[int, bytes]) -> bytes:
    """Return a packet's bytes.

    Examples
    --------
    >>> encode(BASE, (0x01, b"")).hex(" ").upper()  # ping
    '75 65 01 02 02 01 E0 C6'
    """
    payload = b"".join(bytes([len(data) + 2, which]) + data for which, data in fields)
    body = _SYNC + bytes([kind, len(payload)]) + payload
    return body + _check(body)


def parser() -> Framer[Packet]:
    """Return a parser of packets."""
    return Framer(_cut, longest=_LONGEST)


class _Mip:
    """What the driver of its angles and that of its raw values have in common."""

    wanted: tuple[int, ...] = ()

    def __init__(self, *, rate_hz: float = 50.0, baud: int = BAUD) -> None:
        self.parser = parser()
        self._rate_hz = rate_hz
        self._baud = baud

    def conversation(self) -> Conversation[Packet]:
        """Stop its data, choose what it sends and how often, start it again."""
        yield from _command(BASE, IDLE)
        reply = yield from _command(DATA, BASE_RATE)
        data = reply.field(BASE_RATE_REPLY)
        if data is None or len(data) != 2 or data == b"\0\0":
            raise DeviceError("tells no base rate of its IMU; expected a MIP device with one")
        skip = max(1, round(int.from_bytes(data, "big") / self._rate_hz))
        entries = b"".join(struct.pack(">BH", which, skip) for which in self.wanted)
        yield from _command(DATA, MESSAGE_FORMAT, bytes([1, len(self.wanted)]) + entries)
        yield from _command(DATA, STREAM, b"\x01\x01\x01")
        yield from _command(BASE, RESUME)

    def farewell(self) -> bytes:
        """Return nothing: it may go on sending."""
        return b""

    def _latency(self, packet: Packet) -> float:
        n_bytes = 6 + sum(len(data) + 2 for _, data in packet.fields)
        return on_the_line(n_bytes, self._baud)


class Mip(_Mip):
    """The driver of a MIP device's own attitude, of its IMU (set 80) or its filter (set 82).

    Parameters
    ----------
    rate_hz : float
        How often it shall send [Hz]; the device takes whole parts of its base rate.
    baud : int
        Of the line, for the latency.
    convention : Convention
        Of its signs.
    """

    wanted = (EULER,)

    def __init__(
        self, *, rate_hz: float = 50.0, baud: int = BAUD, convention: Convention = AIRCRAFT
    ) -> None:
        super().__init__(rate_hz=rate_hz, baud=baud)
        self._convention = convention

    def value(self, telegram: Packet) -> Measured[Tilt] | None:
        """Return its attitude."""
        data = None
        if telegram.kind == IMU:
            data = telegram.field(EULER)
        elif telegram.kind == FILTER:
            data = telegram.field(FILTER_EULER)
            if data is not None and int.from_bytes(data[12:], "big") & 1 == 0:
                raise FormatError("MIP filter attitude: its valid flag is 0; expected 1")
        if data is None:
            return None
        roll, pitch, yaw = _vector(data[:12])
        tilt = tilt_from(self._convention, pitch=pitch, roll=roll, heading=yaw)
        return Measured(tilt, self._latency(telegram))


class MipInertial(_Mip):
    """The driver of a MIP device's raw accelerations and rates, for `complementary.Fused`.

    Parameters
    ----------
    rate_hz : float
        How often it shall send [Hz].
    baud : int
        Of the line, for the latency.
    """

    wanted = (ACCELERATION, RATE)

    def value(self, telegram: Packet) -> Measured[Inertial] | None:
        """Return accelerations and rates in ``base_link`` axes."""
        acceleration, rate = telegram.field(ACCELERATION), telegram.field(RATE)
        if telegram.kind != IMU or acceleration is None or rate is None:
            return None
        ax, ay, az = (G * value for value in _vector(acceleration))
        p, q, r = _vector(rate)
        inertial = Inertial(acceleration=(ax, -ay, -az), rate=(p, -q, -r))
        return Measured(inertial, self._latency(telegram))


def _vector(data: bytes) -> tuple[float, float, float]:
    if len(data) != _ANGLES.size:
        raise FormatError(f"MIP field: {len(data)} bytes, expected 12 for three floats")
    x, y, z = _ANGLES.unpack(data)
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise FormatError(f"MIP field: {x}, {y}, {z}: expected three finite numbers")
    return x, y, z


def _command(
    kind: int, which: int, data: bytes = b""
) -> Generator[Step[Packet], Packet | None, Packet]:
    """Send a command, several times if need be, and return the reply with its acknowledgement."""

    def answers(packet: Packet) -> bool:
        ack = packet.field(ACK)
        return packet.kind == kind and ack is not None and ack[:1] == bytes([which])

    for _ in range(_TRIES):
        reply = yield Ask(encode(kind, (which, data)), answers, _TIMEOUT)
        if reply is None:
            continue
        ack = reply.field(ACK)
        if ack is not None and ack[1:] == b"\0":
            return reply
        code = ack[1:].hex() if ack else "none"
        raise DeviceError(f"refuses command {kind:02X} {which:02X} with error {code}")
    raise DeviceTimeout(f"no reply to command {kind:02X} {which:02X}; check power, cable and baud")


def _check(body: bytes) -> bytes:
    """Return the two bytes of an 8-bit Fletcher checksum."""
    first = second = 0
    for byte in body:
        first += byte
        second += first
    return bytes([first & 0xFF, second & 0xFF])


def _cut(data: bytes, start: int) -> Cut[Packet]:
    if data[start] != _SYNC[0] or data[start + 1 : start + 2] not in (b"", _SYNC[1:]):
        found = data.find(_SYNC[:1], start + 1)
        return Cut((found if found >= 0 else len(data)) - start)
    if len(data) - start < 4 or len(data) - start < data[start + 3] + 6:
        return Cut(0)
    end = start + 4 + data[start + 3]
    if _check(data[start:end]) != data[end : end + 2]:
        return Cut(1, None, "wrong checksum")
    fields = []
    place = start + 4
    while place < end:
        length = data[place]
        if length < 2 or place + length > end:
            return Cut(end + 2 - start, None, "fields that do not fit into their packet")
        fields.append((data[place + 1], data[place + 2 : place + length]))
        place += length
    return Cut(end + 2 - start, Packet(data[start + 2], tuple(fields)))
