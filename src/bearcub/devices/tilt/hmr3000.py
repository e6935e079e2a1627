"""Honeywell HMR3000: ``$PTNTHPR,heading,status,pitch,status,roll,status`` sentences, 19200 baud.

A status is N normal, M or O a warning (low, high), L or P an alarm (low, high), C tuning; with an
alarm the value is absent. The EEPROM says whether angles are degrees or mils (User's Guide 900240,
"HPR").
"""

import math

from bearcub.devices.driver import Listening, Measured, on_the_line
from bearcub.devices.nmea import Sentence, sentences
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import FormatError
from bearcub.messages import Tilt

NAME = "PTNTHPR"
BAUD = 19200

_USABLE = {"N": "normal", "M": "low warning", "O": "high warning"}
_REFUSED = {"L": "low alarm", "P": "high alarm", "C": "tuning"}


class Hmr3000(Listening):
    """The driver of an HMR3000, which sends as its EEPROM says.

    Parameters
    ----------
    mils : bool
        Whether its angles are mils (6400 a turn) instead of degrees.
    baud : int
        Of the line, for the latency.
    convention : Convention
        Of its signs.
    """

    def __init__(
        self, *, mils: bool = False, baud: int = BAUD, convention: Convention = AIRCRAFT
    ) -> None:
        self.parser = sentences()
        self._unit = math.tau / (6400 if mils else 360)
        self._baud = baud
        self._convention = convention

    def value(self, telegram: Sentence) -> Measured[Tilt] | None:
        """Return pitch, roll, and the heading where its status allows."""
        if telegram.name != NAME:
            return None
        if len(telegram.fields) != 6:
            raise FormatError(f"{telegram}: {len(telegram.fields)} fields, expected 6")
        heading, field_status, pitch, pitch_status, roll, roll_status = telegram.fields
        for what, status in (("pitch", pitch_status), ("roll", roll_status)):
            if status not in _USABLE:
                meaning = _REFUSED.get(status, "unknown")
                raise FormatError(f"{telegram}: {what} has status {status}, {meaning}")
        angles = [self._angle(text, telegram) for text in (pitch, roll)]
        usable = heading and field_status in _USABLE
        tilt = tilt_from(
            self._convention,
            pitch=angles[0],
            roll=angles[1],
            heading=self._angle(heading, telegram) if usable else math.nan,
        )
        return Measured(tilt, on_the_line(len(str(telegram)) + 5, self._baud))

    def _angle(self, text: str, telegram: Sentence) -> float:
        return telegram.number(text) * self._unit
