"""One kind of device, from both ends of its line."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bearcub.devices.driver import Driver
from bearcub.emulators.emulator import Emulator
from bearcub.emulators.faults import FAULTS, Fault


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """One kind of device, from both ends of its line.

    Attributes
    ----------
    purpose : str
        What it is, for the command line.
    emulator : callable
        Makes the device.
    driver : callable
        Makes what talks to it; `Streaming` runs it.
    rate_hz : float
        At which values come [Hz].
    tcp_port : int or None
        Where the real device listens; None for one on a serial line.
    faults : mapping of str to Fault
        Those that only this kind has, beside `FAULTS`.
    """

    purpose: str
    emulator: Callable[[], Emulator]
    driver: Callable[[], Driver[Any, Any]]
    rate_hz: float
    tcp_port: int | None = None
    faults: Mapping[str, Fault] = field(default_factory=dict)

    @property
    def all_faults(self) -> dict[str, Fault]:
        """The common faults that can happen to it, and its own."""
        other = "reset" if self.tcp_port is None else "wrong-baud"  # of the other sort of line
        return {name: fault for name, fault in FAULTS.items() if name != other} | dict(self.faults)
