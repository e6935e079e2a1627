"""The LADARs among the emulated devices."""

from bearcub.devices.sick.cola_setup import Cola
from bearcub.devices.sick.lms2xx_setup import Lms2xx
from bearcub.emulators.cola import COLA_FAULTS, ColaEmulator
from bearcub.emulators.kind import Kind
from bearcub.emulators.lms2xx import LMS2XX_FAULTS, Lms2xxEmulator

LADAR_KINDS = {
    "lms2xx": Kind(
        purpose="SICK LMS2xx LADAR",
        emulator=Lms2xxEmulator,
        driver=Lms2xx,
        rate_hz=Lms2xx().rate_hz,
        faults=LMS2XX_FAULTS,
    ),
    "cola": Kind(
        purpose="SICK TiM LADAR (CoLa)",
        emulator=ColaEmulator,
        driver=Cola,
        rate_hz=15.0,
        tcp_port=2112,
        faults=COLA_FAULTS,
    ),
}
