"""What every builder of a device needs: its place on the robot, and the line to it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bearcub.clock import Clock
from bearcub.devices.link import Link, SerialLink, TcpLink
from bearcub.devices.protocols import Drive, Reading, Source
from bearcub.errors import ConfigError
from bearcub.messages import WheelState
from bearcub.runtime.device_settings import required

_PORT_HINT = "give the serial port that `bearcub devices` lists, or tcp://HOST:PORT"
_HOST_HINT = "give HOST or HOST:PORT"
_TCP = "tcp://"


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """What a builder is told beside the settings.

    Attributes
    ----------
    role : str
        The table's name, which messages use.
    clock : Clock
    folder : Path
        Of the configuration file; relative paths start here.
    wheels : callable
        Returns what the robot's drive says, None where it has none.
    """

    role: str
    clock: Clock
    folder: Path
    wheels: Callable[[], Reading[WheelState] | None]


Build = Callable[[Any, Place], Source[Any] | Drive]


def serial_line(port: str, baud: int) -> Link:
    """Return a serial line, or the TCP connection that stands in for one.

    Raises
    ------
    ConfigError
        If it is not said which.
    """
    required(port, "port", _PORT_HINT)
    if port.startswith(_TCP):
        return network(port.removeprefix(_TCP), default=0)
    return SerialLink(port, baud=baud)


def network(address: str, *, default: int) -> Link:
    """Return a TCP connection to HOST or HOST:PORT.

    Raises
    ------
    ConfigError
        If it is not said where to, or not in that form.
    """
    required(address, "address", _HOST_HINT)
    host, _, port = (address if ":" in address else f"{address}:{default}").rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError(f"address = {address!r}: expected HOST:PORT such as 192.168.0.1:2112")
    return TcpLink(host, int(port))
