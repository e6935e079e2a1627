"""SICK laser scanners: LMS2xx on a serial line; LMS1xx, LMS5xx and TiM over TCP."""

from bearcub.devices.sick.cola import Dialect
from bearcub.devices.sick.cola_setup import Cola, Sweep
from bearcub.devices.sick.lms2xx_setup import Lms2xx

__all__ = ["Cola", "Dialect", "Lms2xx", "Sweep"]
