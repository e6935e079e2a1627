"""An Xsens MTi made of software."""

import math
import struct

from bearcub.devices.tilt import xsens
from bearcub.emulators.emulator import Serial, Ticker
from bearcub.emulators.tilt.attitude import Attitude, heading_deg, inertial, rocking
from bearcub.messages import Vector

_PACKET_COUNTER = 0x1020
_BAD_PARAMETER, _BAD_MESSAGE = b"\x21", b"\x04"


class XsensEmulator(Serial):
    """Sends MTData2 messages with what its output configuration names, ENU, single floats.

    Parameters
    ----------
    attitude : callable
        The body's true attitude, REP-103, at a time [ns].
    """

    baud = xsens.BAUD

    def __init__(self, attitude: Attitude = rocking) -> None:
        self._attitude = attitude
        self._commands = xsens.parser()
        self._replies = b""
        self._measuring = False
        self._outputs: tuple[int, ...] = (xsens.QUATERNION,)  # as it comes from the factory
        self._ticker = Ticker(100.0)
        self._count = 0

    def restart(self) -> None:
        """Wake up; it waits for a moment whether it shall be configured, then measures."""
        self._replies = xsens.encode(xsens.WAKE_UP)
        self._outputs = (xsens.QUATERNION,)
        self._measuring = True

    def receive(self, data: bytes) -> None:
        """Take messages and answer each with the next number, or an error."""
        for message in self._commands.feed(data):
            self._replies += self._answer(message)

    def _answer(self, message: xsens.Message) -> bytes:
        if message.kind in (xsens.GO_TO_CONFIG, xsens.GO_TO_MEASUREMENT):
            self._measuring = message.kind == xsens.GO_TO_MEASUREMENT
            return xsens.encode(message.kind + 1)
        if message.kind != xsens.SET_OUTPUT or self._measuring:
            return xsens.encode(xsens.ERROR, _BAD_MESSAGE)
        entries = list(struct.iter_unpack(">HH", message.data[: len(message.data) // 4 * 4]))
        known = (xsens.EULER, xsens.ACCELERATION, xsens.RATE)
        if not entries or any(which not in known for which, _ in entries):
            return xsens.encode(xsens.ERROR, _BAD_PARAMETER)
        self._outputs = tuple(which for which, _ in entries)
        self._ticker = Ticker(max(1, min(entries[0][1], 400)))
        return xsens.encode(xsens.SET_OUTPUT + 1, message.data)

    def poll(self, now_ns: int) -> bytes:
        """Return the replies, then the measurement of this moment when it is time."""
        replies, self._replies = self._replies, b""
        if not self._measuring or not self._ticker.due(now_ns):
            return replies
        self._count = (self._count + 1) & 0xFFFF
        data = struct.pack(">HBH", _PACKET_COUNTER, 2, self._count)
        for which in self._outputs:
            values = self._item(which, now_ns)
            data += struct.pack(f">HB{len(values)}f", which, 4 * len(values), *values)
        return replies + xsens.encode(xsens.MT_DATA_2, data)

    def _item(self, which: int, now_ns: int) -> Vector | tuple[float, float, float, float]:
        tilt = self._attitude(now_ns)
        if which == xsens.EULER:
            yaw = math.remainder(90.0 - heading_deg(tilt), 360.0)
            return math.degrees(tilt.roll), math.degrees(tilt.pitch), yaw
        if which == xsens.QUATERNION:
            return 1.0, 0.0, 0.0, 0.0  # no driver here reads it
        raw = inertial(self._attitude, now_ns)
        return raw.rate if which == xsens.RATE else raw.acceleration
