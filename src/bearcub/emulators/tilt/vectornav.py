"""A VectorNav VN-100 made of software."""

import math

from bearcub.devices.nmea import Sentence, encode, lines
from bearcub.devices.tilt.vectornav import BAUD, RATES
from bearcub.emulators.emulator import Serial, Ticker
from bearcub.emulators.tilt.attitude import Attitude, heading_deg, inertial, rocking

_NOTHING, _YMR = 0, 14  # values of register 6


class VectorNavEmulator(Serial):
    """Sends ``VNYMR`` once register 6 asks for it, at the rate of register 7.

    Parameters
    ----------
    attitude : callable
        The body's true attitude, REP-103, at a time [ns].
    """

    baud = BAUD

    def __init__(self, attitude: Attitude = rocking) -> None:
        self._attitude = attitude
        self._commands = lines()
        self._replies = b""
        self.restart()

    def restart(self) -> None:
        """Forget the registers, as they were not saved."""
        self._output = _NOTHING
        self._ticker = Ticker(40.0)

    def receive(self, data: bytes) -> None:
        """Take register writes; a garbled one is answered by error 3."""
        refused = self._commands.tally.errors
        for text in self._commands.feed(data):
            name, *fields = text.split(",")
            self._replies += self._answer(Sentence(name, tuple(fields)))
        if self._commands.tally.errors > refused:
            self._replies += encode("VNERR,03")

    def _answer(self, command: Sentence) -> bytes:
        if command.name != "VNWRG" or len(command.fields) != 2:
            return encode("VNERR,04")
        register, text = command.fields
        value = int(text) if text.isdecimal() else -1
        if register == "06" and value in (_NOTHING, _YMR):
            self._output = value
        elif register == "07" and value in RATES:
            self._ticker = Ticker(value)
        else:
            return encode("VNERR,07" if register in ("06", "07") else "VNERR,08")
        return encode(str(command)[1:])

    def poll(self, now_ns: int) -> bytes:
        """Return the replies, then the measurement of this moment when it is time."""
        replies, self._replies = self._replies, b""
        if self._output != _YMR or not self._ticker.due(now_ns):
            return replies
        tilt, raw = self._attitude(now_ns), inertial(self._attitude, now_ns)
        ax, ay, az = raw.acceleration
        p, q, r = raw.rate
        yaw, pitch, roll = heading_deg(tilt), -math.degrees(tilt.pitch), math.degrees(tilt.roll)
        return replies + encode(
            f"VNYMR,{(yaw + 180) % 360 - 180:+08.3f},{pitch:+08.3f},{roll:+08.3f},"
            f"+00.2000,+00.0000,+00.4500,{ax:+07.3f},{-ay:+07.3f},{-az:+07.3f},"
            f"{p:+010.6f},{-q:+010.6f},{-r:+010.6f}"
        )
