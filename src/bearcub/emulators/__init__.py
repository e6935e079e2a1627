"""Devices made of software: they answer with the real ones' bytes, over a pty, TCP, or directly.

An emulator is a plain object that takes bytes and gives bytes and is told the time; what it
measures comes from a function, so that a simulated world can stand behind it.
"""

from bearcub.emulators.emulator import Emulator
from bearcub.emulators.faults import FAULTS, Faulty
from bearcub.emulators.host import DirectLink, PtyHost, TcpHost

__all__ = ["FAULTS", "DirectLink", "Emulator", "Faulty", "PtyHost", "TcpHost"]
