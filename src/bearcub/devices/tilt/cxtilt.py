"""Crossbow CXTILT02: a binary tilt sensor that is asked for each value, 9600 baud.

Request ``G``; reply ``FF``, pitch and roll as big-endian i16, and the sum of these four bytes. The
angle is minus ``raw * 90 / 32768`` degrees: its maker confirms that the data sheet's sign is
wrong. Only ``G`` is ever sent, because resets and filter settings have wedged units.
"""

import math
import struct

from bearcub.devices.driver import Ask, Conversation, Every, Measured, on_the_line
from bearcub.devices.framing import Cut, Framer
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import DeviceTimeout, FormatError
from bearcub.messages import Tilt

REQUEST = b"G"
BAUD = 9600
LSB = math.radians(90 / 32768)  # radians per count

_REPLY = struct.Struct(">xhhB")
_LATENCY = on_the_line(_REPLY.size, BAUD)
_TIMEOUT = 0.1
_TRIES = 5

Raw = tuple[int, int]


class Cxtilt:
    """The `bearcub.devices.driver.Driver` of a CXTILT02.

    Parameters
    ----------
    rate_hz : float
        How often it is asked; the line allows 100 Hz, its filter changes at some 10 Hz.
    convention : Convention
        Of its signs.
    """

    def __init__(self, *, rate_hz: float = 20.0, convention: Convention = AIRCRAFT) -> None:
        self.parser: Framer[Raw] = Framer(_cut, longest=_REPLY.size)
        self._skipped = 0
        self._period = 1.0 / rate_hz
        self._convention = convention

    def value(self, telegram: Raw) -> Measured[Tilt]:
        """Return pitch and roll, unless bytes had to be skipped since the last reply.

        A sum of four bytes is right by chance once in 256 times, so a reply found in noise is not
        to be believed.
        """
        before, self._skipped = self._skipped, self.parser.tally.rejected_bytes
        if self._skipped > before:
            raise FormatError(f"a reply among {self._skipped - before} bytes of noise")
        pitch, roll = (-count * LSB for count in telegram)
        return Measured(tilt_from(self._convention, pitch=pitch, roll=roll), _LATENCY)

    def conversation(self) -> Conversation[Raw]:
        """Ask for ever; give up after five requests without reply."""
        unanswered = 0
        while unanswered < _TRIES:
            yield Every(self._period)
            reply = yield Ask(REQUEST, lambda _: True, _TIMEOUT)
            unanswered = 0 if reply else unanswered + 1
        raise DeviceTimeout(f"no reply to {_TRIES} requests; check power, cable and {BAUD} baud")

    def farewell(self) -> bytes:
        """Return nothing: it is silent when it is not asked."""
        return b""


def _cut(data: bytes, start: int) -> Cut[Raw]:
    if data[start] != 0xFF:
        found = data.find(b"\xff", start)
        return Cut((found if found >= 0 else len(data)) - start)
    if len(data) - start < _REPLY.size:
        return Cut(0)
    pitch, roll, given = _REPLY.unpack_from(data, start)
    if sum(data[start + 1 : start + 5]) & 0xFF != given:
        return Cut(1, None, "wrong checksum")
    return Cut(_REPLY.size, (pitch, roll))
