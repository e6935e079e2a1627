"""PNI TCM2, TCM2.5, TCM2.6 and OceanServer OS5000: ``$C328.3P28.4R-12.4...E001*29`` lines.

Letters name the values: C heading, P pitch, R roll, X Y Z field, T temperature, E error bits; a
value that is switched off is absent. Pitch is positive with the front edge up and roll with the
right edge down (TCM2.5/2.6 manual, "Pitch and Roll"; bits of E: "Error Codes").
"""

import math
import re

from bearcub.devices.driver import Ask, Conversation, Measured, on_the_line
from bearcub.devices.nmea import lines
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import DeviceTimeout, FormatError
from bearcub.messages import Tilt

BAUD = 9600  # TCM2; an OS5000 has 19200
GO = b"go\r"  # ends a TCM2's standby

_VALUE = re.compile(r"E(?P<bits>[0-9A-F]{3})|(?P<letter>[A-DF-Z])(?P<number>[+-]?\d+(?:\.\d*)?)")
_DISTORTED, _TILT_RANGE, _FIELD_RANGE, _MEMORY = 0x001, 0x002, 0x004, 0xC00
_TIMEOUT = 0.5


class Tcm2:
    """The driver of a TCM2 or OS5000.

    Parameters
    ----------
    baud : int
        Of the line, for the latency.
    start : bytes
        What makes a silent device send; nothing for an OS5000, which always sends.
    convention : Convention
        Of its signs.
    """

    def __init__(
        self, *, baud: int = BAUD, start: bytes = GO, convention: Convention = AIRCRAFT
    ) -> None:
        self.parser = lines()
        self._baud = baud
        self._start = start
        self._convention = convention

    def value(self, telegram: str) -> Measured[Tilt] | None:
        """Return pitch, roll, and the heading unless its field is distorted or out of range."""
        values = _values(telegram)
        if "P" not in values or "R" not in values:
            return None
        errors = int(values.get("E", 0.0))
        if errors & (_TILT_RANGE | _MEMORY):
            what = "tilt out of its range" if errors & _TILT_RANGE else "memory corrupted"
            raise FormatError(f"${telegram}: error E{errors:03X}, {what}; its values are not used")
        doubtful = errors & (_DISTORTED | _FIELD_RANGE)
        heading = math.nan if doubtful else math.radians(values.get("C", math.nan))
        pitch, roll = (math.radians(values[letter]) for letter in "PR")
        tilt = tilt_from(self._convention, pitch=pitch, roll=roll, heading=heading)
        return Measured(tilt, on_the_line(len(telegram) + 6, self._baud))

    def conversation(self) -> Conversation[str]:
        """Listen; tell a silent device to go."""
        heard = yield Ask(b"", lambda _: True, _TIMEOUT)
        tries = 3 if self._start else 0
        while not heard and tries:
            tries -= 1
            heard = yield Ask(self._start, lambda _: True, _TIMEOUT)
        if not heard:
            raise DeviceTimeout("sends no line that begins with $; check power, cable and baud")

    def farewell(self) -> bytes:
        """Return nothing: it may go on sending."""
        return b""


def _values(text: str) -> dict[str, float]:
    """Return the values of a line by their letters; none for a line of another kind."""
    if not text.startswith("C") or "," in text:
        return {}
    found: dict[str, float] = {}
    place = 0
    while place < len(text):
        match = _VALUE.match(text, place)
        letter = text[place]
        if match is None or letter in found:
            raise FormatError(f"${text}: expected letters with one number each, at {text[place:]}")
        bits = match["bits"]
        found[letter] = float(match["number"]) if bits is None else float(int(bits, 16))
        place = match.end()
    return found
