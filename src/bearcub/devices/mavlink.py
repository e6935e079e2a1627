"""Drives behind a MAVLink autopilot (ArduPilot Rover, PX4): velocities of the body, no more.

The autopilot keeps its own loops, failsafes and arming; nothing here arms it. It has to be in
GUIDED mode (PX4: offboard). MAVLink's axes are x ahead, y right, z down (NED), so turn rates change
their sign [1]_.

References
----------
.. [1] MAVLink common message set, SET_POSITION_TARGET_LOCAL_NED (84), LOCAL_POSITION_NED (32),
   ATTITUDE (30), HEARTBEAT (0).
"""

import importlib
import math
from collections.abc import Callable
from typing import Any

from bearcub.clock import Clock
from bearcub.devices.driver import Ask, Conversation, Measured
from bearcub.devices.framing import Tally
from bearcub.devices.health import Health
from bearcub.devices.link import Link
from bearcub.devices.protocols import Drive, Reading
from bearcub.devices.stream import Streaming
from bearcub.devices.target import Target
from bearcub.errors import ConfigError, DeviceError, DeviceTimeout
from bearcub.messages import WheelState

_ONLY_VELOCITY = 0b0000_0101_1100_0111  # ignore position, acceleration and yaw; use yaw rate
_BODY_NED = 8
_SET_MESSAGE_INTERVAL = 511
_LOCAL_POSITION_NED, _ATTITUDE = 32, 30
_ARMED = 128
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
_ARDUPILOT, _GUIDED = 3, 15  # Rover's number for it
_HEARTBEAT_WAIT = 2.5  # an autopilot sends one a second [s]
_SYSTEM, _COMPONENT = 255, 190  # of a ground station and of its planner
_BAD = "no valid MAVLink message"


class MavlinkParser:
    """Messages out of bytes, by pymavlink; see `bearcub.devices.framing.Parser`."""

    def __init__(self) -> None:
        self.tally = Tally()
        self._decoder: Any = None

    def use(self, dialect: Any) -> None:
        """Take ``pymavlink.dialects.v20.ardupilotmega``; before it, all bytes are ignored."""
        self._decoder = dialect.MAVLink(None)
        self._decoder.robust_parsing = True

    def feed(self, data: bytes) -> list[Any]:
        """Take the next bytes and return the messages that they complete."""
        if self._decoder is None:
            return []
        messages = []
        for message in self._decoder.parse_buffer(data) or ():
            if message.get_type() != "BAD_DATA":
                messages.append(message)
                continue
            self.tally.rejected_bytes += len(message.data)
            self.tally.refuse(_BAD)
        return messages

    def silence(self) -> list[Any]:
        """Forget what is unfinished."""
        self.reset()
        return []

    def reset(self) -> None:
        """Forget what is unfinished; the tally stays."""
        if self._decoder is not None:
            self._decoder = type(self._decoder)(None)
            self._decoder.robust_parsing = True


class MavlinkDriver:
    """The autopilot's language; see `bearcub.devices.driver.Driver`.

    Parameters
    ----------
    target : callable
        Returns (speed, turn rate) [m/s], [rad/s], or None to stop.
    speed : float
        Largest that is ever sent [m/s].
    rate_hz : float
        Commands and feedback per second [Hz].
    """

    def __init__(
        self,
        *,
        target: Callable[[], tuple[float, float] | None],
        speed: float,
        rate_hz: float,
    ) -> None:
        self.parser = MavlinkParser()
        self._mav: Any = None
        self._target = target
        self._speed = speed
        self._rate_hz = rate_hz
        self._autopilot: Any = None
        self._yaw = self._turn_rate = math.nan

    def value(self, telegram: Any) -> Measured[WheelState] | None:
        """Return the motion that a LOCAL_POSITION_NED tells, with the attitude before it."""
        kind = telegram.get_type()
        if kind == "HEARTBEAT" and telegram.autopilot != _NO_AUTOPILOT:
            self._autopilot = telegram
        if kind == "ATTITUDE":
            self._yaw, self._turn_rate = telegram.yaw, -telegram.yawspeed
        if kind != "LOCAL_POSITION_NED":
            return None
        # The yaw is not known before the first ATTITUDE; the speed then is NaN.
        speed = telegram.vx * math.cos(self._yaw) + telegram.vy * math.sin(self._yaw)
        return Measured(
            WheelState(
                left=math.nan,
                right=math.nan,
                speed=speed,
                turn_rate=self._turn_rate,
                enabled=self._armed,
                faults=self._faults(),
            )
        )

    def conversation(self) -> Conversation[Any]:
        """Wait for an autopilot, ask it for its motion, then command it again and again."""
        dialect = _dialect()
        self._mav = dialect.MAVLink(None, srcSystem=_SYSTEM, srcComponent=_COMPONENT)
        self.parser.use(dialect)
        found = yield Ask(b"", _is_autopilot, _HEARTBEAT_WAIT)
        if found is None:
            raise DeviceTimeout(
                f"no heartbeat of an autopilot within {_HEARTBEAT_WAIT} s; check the baud rate "
                "and that this port speaks MAVLink"
            )
        system, component = found.get_srcSystem(), found.get_srcComponent()
        self._autopilot = found
        turn = 0
        while True:
            data = self._setpoint(system, component)
            if turn % max(1, round(self._rate_hz)) == 0:  # once a second: also after its restart
                data += self._heartbeat() + self._requests(system, component)
            turn += 1
            yield Ask(data, _nothing, 1 / self._rate_hz)

    def farewell(self) -> bytes:
        """Return the command to stop."""
        if self._autopilot is None:
            return b""
        return self._velocity(
            self._autopilot.get_srcSystem(), self._autopilot.get_srcComponent(), 0.0, 0.0
        )

    @property
    def _armed(self) -> bool:
        return self._autopilot is not None and bool(self._autopilot.base_mode & _ARMED)

    def _faults(self) -> tuple[str, ...]:
        found = [] if self._armed else ["autopilot: not armed"]
        heard = self._autopilot
        if heard is not None and heard.autopilot == _ARDUPILOT and heard.custom_mode != _GUIDED:
            found.append(f"autopilot: in mode {heard.custom_mode}, takes commands in GUIDED only")
        return tuple(found)

    def _setpoint(self, system: int, component: int) -> bytes:
        speed, turn_rate = self._target() or (0.0, 0.0)
        limited = max(-self._speed, min(self._speed, speed))
        share = limited / speed if speed else 1.0  # keep the bend
        return self._velocity(system, component, limited, turn_rate * share)

    def _velocity(self, system: int, component: int, speed: float, turn_rate: float) -> bytes:
        message = self._mav.set_position_target_local_ned_encode(
            0, system, component, _BODY_NED, _ONLY_VELOCITY,
            0, 0, 0, speed, 0, 0, 0, 0, 0, 0, -turn_rate,
        )  # fmt: skip
        return bytes(message.pack(self._mav))

    def _heartbeat(self) -> bytes:
        message = self._mav.heartbeat_encode(_GROUND_STATION, _NO_AUTOPILOT, 0, 0, 0)
        return bytes(message.pack(self._mav))

    def _requests(self, system: int, component: int) -> bytes:
        period_us = round(1e6 / self._rate_hz)
        messages = [
            self._mav.command_long_encode(
                system, component, _SET_MESSAGE_INTERVAL, 0, number, period_us, 0, 0, 0, 0, 0
            )
            for number in (_ATTITUDE, _LOCAL_POSITION_NED)
        ]
        return b"".join(bytes(message.pack(self._mav)) for message in messages)


def _dialect() -> Any:
    try:  # only who has an autopilot needs it
        return importlib.import_module("pymavlink.dialects.v20.ardupilotmega")
    except ImportError:
        raise DeviceError("a MAVLink drive needs pymavlink; run: pip install pymavlink") from None


def _is_autopilot(message: Any) -> bool:
    return bool(message.get_type() == "HEARTBEAT" and message.autopilot != _NO_AUTOPILOT)


def _nothing(_: Any) -> bool:
    return False


class MavlinkDrive(Drive):
    """A robot whose wheels an autopilot turns.

    Parameters
    ----------
    link : Link
        Serial, or TCP as of a simulated autopilot.
    clock : Clock
    speed : float
        Largest [m/s].
    rate_hz : float
        Commands and feedback per second [Hz].
    command_limit : float
        How long a command counts [s].
    role : str
        What it is called in messages.
    """

    def __init__(
        self,
        link: Link,
        *,
        clock: Clock,
        speed: float = 1.0,
        rate_hz: float = 10.0,
        command_limit: float = 0.3,
        role: str = "drive",
    ) -> None:
        for name, value in (("speed", speed), ("rate_hz", rate_hz)):
            if not 0 < value < math.inf:
                raise ConfigError(f"mavlink {name} = {value}: must be more than 0")
        self._target = Target(clock, limit=command_limit)
        driver = MavlinkDriver(target=self._target.current, speed=speed, rate_hz=rate_hz)
        self._stream = Streaming(link, driver, clock=clock, rate_hz=rate_hz, role=role)

    @property
    def name(self) -> str:
        """What it is called in messages."""
        return self._stream.name

    def start(self) -> None:
        """Begin to connect, without waiting for it."""
        self._stream.start()

    def command(self, speed: float, turn_rate: float) -> None:
        """Drive at `speed` [m/s] and `turn_rate` [rad/s]; sent within one period."""
        self._target.set(speed, turn_rate)

    def stop(self) -> None:
        """Stop; sent within one period."""
        self._target.clear()

    def feedback(self) -> Reading[WheelState] | None:
        """Return what the autopilot says of the motion; the wheels' ways are not known (NaN)."""
        return self._stream.latest()

    def health(self) -> Health:
        """Return how it is."""
        return self._stream.health()

    def close(self) -> None:
        """Stop the robot and let go of the autopilot."""
        self._target.clear()
        self._stream.close()
