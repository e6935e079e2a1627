"""The receivers and the drive among the emulated devices."""

import math
from functools import partial

from bearcub.devices.galil.driver import GalilDriver, GalilSetup
from bearcub.devices.gps import Gpsd, NmeaGps
from bearcub.devices.wheels import Wheels
from bearcub.emulators.faults import Unheard
from bearcub.emulators.galil import GalilEmulator
from bearcub.emulators.gps import GpsdEmulator, NmeaEmulator
from bearcub.emulators.kind import Kind

EMULATED_WHEELS = Wheels(radius=0.5 / math.pi, track=0.5, counts=10000)
"""Wheels of one metre of circumference: 10000 counts per metre."""


def _standing() -> GalilDriver:
    """Return a driver that commands nothing and reads the encoders."""
    return GalilDriver(GalilSetup(wheels=EMULATED_WHEELS), target=lambda: None)


DRIVE_KINDS = {
    "gps": Kind(
        purpose="GPS receiver that sends NMEA 0183 sentences",
        emulator=NmeaEmulator,
        driver=NmeaGps,
        rate_hz=5.0,
    ),
    "gpsd": Kind(
        purpose="gpsd server with a GPS receiver",
        emulator=GpsdEmulator,
        driver=Gpsd,
        rate_hz=5.0,
        tcp_port=2947,
    ),
    "galil": Kind(
        purpose="Galil DMC-40x0 motor controller with two wheels",
        emulator=GalilEmulator,
        driver=_standing,
        rate_hz=20.0,
        tcp_port=23,
        faults={"refusing": partial(Unheard, answer=b"?")},
    ),
}
