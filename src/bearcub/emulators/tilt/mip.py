"""A MicroStrain 3DM-GX made of software that speaks MIP."""

import math
import struct

from bearcub.devices.tilt import mip
from bearcub.emulators.emulator import Serial, Ticker
from bearcub.emulators.tilt.attitude import Attitude, heading_deg, inertial, rocking
from bearcub.messages import Vector

_BASE_RATE_HZ = 500
_DONE, _UNKNOWN, _PARAMETER = 0x00, 0x01, 0x03


class MipEmulator(Serial):
    """Sends the fields that its message format names, in IMU data packets.

    Parameters
    ----------
    attitude : callable
        The body's true attitude, REP-103, at a time [ns].
    """

    baud = mip.BAUD

    def __init__(self, attitude: Attitude = rocking) -> None:
        self._attitude = attitude
        self._commands = mip.parser()
        self._replies = b""
        self.restart()

    def restart(self) -> None:
        """Forget the message format, as it was not saved."""
        self._idle = False
        self._enabled = False
        self._format: tuple[int, ...] = ()
        self._ticker = Ticker(_BASE_RATE_HZ)

    def receive(self, data: bytes) -> None:
        """Take commands, each of one field."""
        for packet in self._commands.feed(data):
            for which, content in packet.fields:
                code = self._obey(packet.kind, which, content)
                answer = [(mip.ACK, bytes([which, code]))]
                if (packet.kind, which) == (mip.DATA, mip.BASE_RATE):
                    answer.append((mip.BASE_RATE_REPLY, struct.pack(">H", _BASE_RATE_HZ)))
                self._replies += mip.encode(packet.kind, *answer)

    def _obey(self, kind: int, which: int, content: bytes) -> int:
        """Do what a command says and return its error code."""
        if kind == mip.BASE and which in (mip.IDLE, mip.RESUME):
            self._idle = which == mip.IDLE
        elif (kind, which) == (mip.DATA, mip.MESSAGE_FORMAT):
            return self._set_format(content)
        elif (kind, which) == (mip.DATA, mip.STREAM):
            self._enabled = content == b"\x01\x01\x01"
        elif (kind, which) != (mip.DATA, mip.BASE_RATE):
            return _UNKNOWN
        return _DONE

    def _set_format(self, content: bytes) -> int:
        if content[:1] != b"\x01" or len(content) != 2 + 3 * content[1] or len(content) < 5:
            return _PARAMETER
        entries = list(struct.iter_unpack(">BH", content[2:]))
        if any(which not in (mip.ACCELERATION, mip.RATE, mip.EULER) for which, _ in entries):
            return _PARAMETER
        self._format = tuple(which for which, _ in entries)
        self._ticker = Ticker(_BASE_RATE_HZ / max(1, entries[0][1]))
        return _DONE

    def poll(self, now_ns: int) -> bytes:
        """Return the replies, then the packet of this moment when it is time."""
        replies, self._replies = self._replies, b""
        if self._idle or not self._enabled or not self._ticker.due(now_ns):
            return replies
        fields = [
            (which, struct.pack(">fff", *self._field(which, now_ns))) for which in self._format
        ]
        return replies + mip.encode(mip.IMU, *fields)

    def _field(self, which: int, now_ns: int) -> Vector:
        if which == mip.EULER:
            tilt = self._attitude(now_ns)
            heading = math.remainder(math.radians(heading_deg(tilt)), math.tau)
            return tilt.roll, -tilt.pitch, heading
        raw = inertial(self._attitude, now_ns)
        x, y, z = raw.rate if which == mip.RATE else raw.acceleration
        unit = 1.0 if which == mip.RATE else mip.G
        return x / unit, -y / unit, -z / unit
