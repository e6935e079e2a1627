"""Any NMEA 0183 device that sends its attitude as transducer values (``XDR``), 4800 baud.

``$YXXDR,A,-1.22,D,PITCH,A,0.58,D,ROLL*35``: groups of type, value, unit and name; an attitude is of
type A in degrees. The names differ between makers, pitch and roll may come in two sentences, and
the heading comes as ``HDT`` (true) or ``HDM`` (magnetic).
"""

import math
from collections.abc import Collection

from bearcub.devices.driver import Conversation, Listening, Measured, on_the_line
from bearcub.devices.nmea import Sentence, sentences
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import FormatError
from bearcub.messages import Tilt

BAUD = 4800


class Xdr(Listening):
    """The driver of a device that sends ``XDR`` sentences by itself.

    Parameters
    ----------
    pitch_names, roll_names : collection of str
        What the device calls them.
    baud : int
        Of the line, for the latency.
    convention : Convention
        Of its signs.
    """

    def __init__(
        self,
        *,
        pitch_names: Collection[str] = ("PITCH", "PTCH"),
        roll_names: Collection[str] = ("ROLL",),
        baud: int = BAUD,
        convention: Convention = AIRCRAFT,
    ) -> None:
        self.parser = sentences()
        self._letter = dict.fromkeys(pitch_names, "P") | dict.fromkeys(roll_names, "R")
        self._baud = baud
        self._convention = convention
        self._found: dict[str, float] = {}

    def conversation(self) -> Conversation[Sentence]:
        """Say nothing; forget the half of a value that came before the line was lost."""
        self._found = {}
        yield from ()

    def value(self, telegram: Sentence) -> Measured[Tilt] | None:
        """Return pitch and roll once both are there, with the heading that came before them."""
        if telegram.name[2:] in ("HDT", "HDM"):
            heading = telegram.fields[0] if telegram.fields else ""
            self._found["C"] = math.radians(telegram.number(heading))
        if telegram.name[2:] != "XDR":
            return None
        self._take(telegram)
        if not {"P", "R"} <= self._found.keys():
            return None
        found, self._found = self._found, {}
        tilt = tilt_from(
            self._convention,
            pitch=found["P"],
            roll=found["R"],
            heading=found.get("C", math.nan),
        )
        return Measured(tilt, on_the_line(len(str(telegram)) + 5, self._baud))

    def _take(self, telegram: Sentence) -> None:
        if len(telegram.fields) % 4:
            raise FormatError(f"{telegram}: {len(telegram.fields)} fields, expected groups of 4")
        for start in range(0, len(telegram.fields), 4):
            kind, text, unit, name = telegram.fields[start : start + 4]
            letter = self._letter.get(name.upper())
            if letter is None or kind != "A":
                continue  # another of the device's transducers
            if unit != "D":
                raise FormatError(f"{telegram}: {name} in unit {unit!r}, expected D for degrees")
            self._found[letter] = math.radians(telegram.number(text))
