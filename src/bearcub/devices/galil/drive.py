"""A robot on two wheels driven by a Galil controller."""

from bearcub.clock import Clock
from bearcub.devices.galil.driver import GalilDriver, GalilSetup
from bearcub.devices.health import Health
from bearcub.devices.link import Link
from bearcub.devices.protocols import Drive, Reading
from bearcub.devices.stream import Streaming
from bearcub.devices.target import Target
from bearcub.messages import WheelState

_COMMAND_LIMIT = 0.3  # s


class GalilDrive(Drive):
    """Commands the wheels by jog speeds and reads their encoders.

    Two guards stop the wheels when nobody commands them any more. The drive's own thread stops
    them when the loop has given no command for `command_limit`. When the thread, the computer or
    the network dies, the program on the controller does so after `GalilSetup.silence`.

    The first command switches the motors on, never the connection alone.

    Parameters
    ----------
    link : Link
        To the controller; a `TcpLink` to port 23, as a rule.
    setup : GalilSetup
    clock : Clock
    command_limit : float
        How long a command counts [s].
    role : str
        What it is called in messages.
    """

    def __init__(
        self,
        link: Link,
        setup: GalilSetup,
        *,
        clock: Clock,
        command_limit: float = _COMMAND_LIMIT,
        role: str = "drive",
    ) -> None:
        self._target = Target(clock, limit=command_limit)
        self._driver = GalilDriver(setup, target=self._target.current)
        self._stream = Streaming(link, self._driver, clock=clock, rate_hz=setup.rate_hz, role=role)

    @property
    def name(self) -> str:
        """What it is called in messages: ``drive (192.168.2.2:23)``."""
        return self._stream.name

    @property
    def identity(self) -> str:
        """The controller's model and firmware; empty before the first connection."""
        return self._driver.revision

    def start(self) -> None:
        """Begin to connect, without waiting for it."""
        self._stream.start()

    def command(self, speed: float, turn_rate: float) -> None:
        """Drive at `speed` [m/s] and `turn_rate` [rad/s]; sent within one period."""
        self._target.set(speed, turn_rate)

    def stop(self) -> None:
        """Stop at the set deceleration; sent within one period."""
        self._target.clear()

    def enable(self) -> None:
        """Switch the motors on again after a fault that switched them off or stopped them."""
        self._driver.enable_wanted = True

    def feedback(self) -> Reading[WheelState] | None:
        """Return what the wheels do; None before the first."""
        return self._stream.latest()

    def health(self) -> Health:
        """Return how it is."""
        return self._stream.health()

    def close(self) -> None:
        """Stop the wheels and let go of the controller, whose motors stay on and hold."""
        self._target.clear()
        self._stream.close()
