"""Compasses and inclinometers made of software that send lines of text by themselves."""

import math

from bearcub.devices.nmea import encode
from bearcub.devices.tilt import hmr3000, tcm2, xdr
from bearcub.emulators.emulator import Serial, Ticker
from bearcub.emulators.tilt.attitude import Attitude, heading_deg, rocking
from bearcub.messages import Tilt


class Talker(Serial):
    """Sends what `lines` says at its rate; each kind of device has its own lines.

    Parameters
    ----------
    attitude : callable
        The body's true attitude, REP-103, at a time [ns].
    rate_hz : float
    """

    def __init__(self, attitude: Attitude = rocking, *, rate_hz: float = 10.0) -> None:
        self._attitude = attitude
        self._ticker = Ticker(rate_hz)

    def receive(self, data: bytes) -> None:
        """Listen to nothing."""

    def poll(self, now_ns: int) -> bytes:
        """Return the lines of this moment, when it is time."""
        return self.lines(self._attitude(now_ns)) if self._ticker.due(now_ns) else b""

    def lines(self, tilt: Tilt) -> bytes:
        """Return what it sends of an attitude."""
        raise NotImplementedError


class Tcm2Emulator(Talker):
    """A PNI TCM2, which listens to ``h`` (halt) and ``go``.

    Parameters
    ----------
    attitude, rate_hz
        As for `Talker`.
    halted : bool
        Whether it was left in standby.
    """

    baud = tcm2.BAUD

    def __init__(
        self, attitude: Attitude = rocking, *, rate_hz: float = 10.0, halted: bool = True
    ) -> None:
        super().__init__(attitude, rate_hz=rate_hz)
        self._halted = halted
        self._command = b""
        self._prompts = 0

    def receive(self, data: bytes) -> None:
        """Take commands, each ended by a carriage return."""
        *commands, self._command = (self._command + data)[-64:].split(b"\r")
        for command in commands:
            self._halted = {b"h": True, b"go": False}.get(command.strip(), self._halted)
            self._prompts += 1

    def poll(self, now_ns: int) -> bytes:
        """Return a prompt for each command, then the line of this moment unless it is halted."""
        prompts, self._prompts = b":\r\n" * self._prompts, 0
        return prompts + (b"" if self._halted else super().poll(now_ns))

    def restart(self) -> None:
        """Come up in standby."""
        self._halted = True

    def lines(self, tilt: Tilt) -> bytes:
        """Return the standard output word."""
        pitch, roll = -math.degrees(tilt.pitch), math.degrees(tilt.roll)
        return encode(f"C{heading_deg(tilt):.1f}P{pitch:.1f}R{roll:.1f}T22.3E000")


class Os5000Emulator(Talker):
    """An OceanServer OS5000."""

    baud = 19200

    def lines(self, tilt: Tilt) -> bytes:
        """Return heading, pitch, roll and temperature."""
        pitch, roll = -math.degrees(tilt.pitch), math.degrees(tilt.roll)
        return encode(f"C{heading_deg(tilt):.1f}P{pitch:.1f}R{roll:.1f}T22.3")


class Hmr3000Emulator(Talker):
    """A Honeywell HMR3000."""

    baud = hmr3000.BAUD

    def lines(self, tilt: Tilt) -> bytes:
        """Return heading, pitch and roll, all normal."""
        pitch, roll = -math.degrees(tilt.pitch), math.degrees(tilt.roll)
        return encode(f"PTNTHPR,{heading_deg(tilt):.1f},N,{pitch:.1f},N,{roll:.1f},N")


class XdrEmulator(Talker):
    """An attitude sensor that speaks NMEA 0183, as ships have them."""

    baud = xdr.BAUD

    def lines(self, tilt: Tilt) -> bytes:
        """Return the heading and the attitude."""
        pitch, roll = -math.degrees(tilt.pitch), math.degrees(tilt.roll)
        heading = encode(f"HCHDT,{heading_deg(tilt):.1f},T")
        return heading + encode(f"YXXDR,A,{pitch:.2f},D,PITCH,A,{roll:.2f},D,ROLL")
