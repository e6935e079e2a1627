"""A Crossbow CXTILT02 made of software."""

import struct

from bearcub.devices.tilt.cxtilt import BAUD, LSB
from bearcub.emulators.emulator import Serial
from bearcub.emulators.tilt.attitude import Attitude, rocking


class CxtiltEmulator(Serial):
    """Answers each ``G`` with the attitude of that moment, nothing else.

    Parameters
    ----------
    attitude : callable
        The body's true attitude, REP-103, at a time [ns].
    """

    baud = BAUD

    def __init__(self, attitude: Attitude = rocking) -> None:
        self._attitude = attitude
        self._requests = 0

    def receive(self, data: bytes) -> None:
        """Count the requests."""
        self._requests += data.count(b"G")

    def poll(self, now_ns: int) -> bytes:
        """Return a reply to each request."""
        requests, self._requests = self._requests, 0
        return requests * self._reply(now_ns) if requests else b""

    def _reply(self, now_ns: int) -> bytes:
        tilt = self._attitude(now_ns)
        # The device's pitch is positive nose up, and its counts have the opposite sign.
        body = struct.pack(">hh", round(tilt.pitch / LSB), round(-tilt.roll / LSB))
        return b"\xff" + body + bytes([sum(body) & 0xFF])
