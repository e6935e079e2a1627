"""Talks to a Galil DMC controller: from connecting to the cycle of commands and feedback."""

import itertools
import re
from collections.abc import Callable
from dataclasses import dataclass

from bearcub.devices.driver import Conversation, Measured
from bearcub.devices.galil.codes import FAULTS, axis_faults
from bearcub.devices.galil.commands import Commands, Steps
from bearcub.devices.galil.record import AxisState, Layout, decode_record, decode_text, query
from bearcub.devices.galil.replies import Reply, ReplyParser
from bearcub.devices.galil.watchdog import LABEL, heartbeat, is_watchdog, watchdog_program
from bearcub.devices.wheels import Rolled, Wheels
from bearcub.errors import ConfigError, DeviceError, FormatError
from bearcub.messages import WheelState

_REVISION = "\x12\x16"  # ^R^V
_EXPECTED = re.compile(r"(DMC\S+|RIO\S+) +Rev")
_DOWNLOAD = 2.0  # to its program memory [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class GalilSetup:
    """How the controller is wired and how it may drive.

    Attributes
    ----------
    wheels : Wheels
    left, right : str
        Letters of the axes.
    speed : float
        Largest of a wheel [m/s].
    acceleration, deceleration : float
        Of a wheel [m/s²].
    rate_hz : float
        Commands and feedback per second [Hz].
    silence : float
        After which the controller stops the wheels by itself [s]; 0 for no program on it.
    replace_program : bool
        Whether a program that the controller holds already may be overwritten.
    ramp_step : int
        Of which AC and DC are multiples, by model [counts/s²].
    fastest : float
        Largest jog speed of the model [counts/s].
    """

    wheels: Wheels
    left: str = "A"
    right: str = "B"
    speed: float = 1.0
    acceleration: float = 1.0
    deceleration: float = 2.0
    rate_hz: float = 20.0
    silence: float = 0.3
    replace_program: bool = False
    ramp_step: int = 1024
    fastest: float = 12e6

    def __post_init__(self) -> None:
        if self.left == self.right or not all(
            len(axis) == 1 and axis in "ABCDEFGH" for axis in (self.left, self.right)
        ):
            raise ConfigError(
                f"galil axes {self.left!r} and {self.right!r}: must be two different letters A to H"
            )
        for name in ("speed", "acceleration", "deceleration", "rate_hz"):
            if not getattr(self, name) > 0:
                raise ConfigError(f"galil.{name} = {getattr(self, name)}: must be more than 0")
        if self.speed * self.wheels.counts_per_metre > self.fastest:
            raise ConfigError(
                f"galil.speed = {self.speed}: more than {self.fastest:g} encoder counts a second, "
                "which the controller does not reach; check wheels.counts"
            )
        if self.silence:
            heartbeat(self.silence)
            if self.silence * self.rate_hz < 2:
                raise ConfigError(
                    f"galil.silence = {self.silence}: must be at least two periods of "
                    f"rate_hz = {self.rate_hz}"
                )

    @property
    def axes(self) -> str:
        """Both letters, left first."""
        return self.left + self.right

    def ramp(self, acceleration: float) -> int:
        """Return an acceleration [m/s²] in the controller's steps [counts/s²], at least one."""
        steps = round(acceleration * self.wheels.counts_per_metre / self.ramp_step)
        return max(1, steps) * self.ramp_step


class GalilDriver:
    """The controller's language; see `bearcub.devices.driver.Driver`.

    Parameters
    ----------
    setup : GalilSetup
    target : callable
        Returns (speed, turn rate) [m/s], [rad/s] as commanded, or None to stop.

    Attributes
    ----------
    parser : ReplyParser
    revision : str
        Model and firmware; empty before the first connection.
    enable_wanted : bool
        Set it to switch the motors on again after a fault.
    """

    def __init__(
        self, setup: GalilSetup, *, target: Callable[[], tuple[float, float] | None]
    ) -> None:
        self.parser = ReplyParser()
        self.revision = ""
        self.enable_wanted = False
        self._setup = setup
        self._target = target
        self._rolled = Rolled(setup.wheels)
        self._layout: Layout | None = None
        self._by_text = False  # whether it is asked in text, for want of records
        self._collecting = False  # what is printed now are the axes' states
        self._texts: list[str] = []
        self._axes: tuple[AxisState, ...] = ()
        self._switched_on = False  # the motors, since the connection was made
        self._rejections: tuple[str, ...] = ()

    def value(self, telegram: Reply) -> Measured[WheelState] | None:
        """Return what a data record, or the second of two answers in text, says of the wheels.

        Raises
        ------
        FormatError
            If it is not what was asked for.
        """
        if telegram.record:
            layout = self._layout or Layout.of(telegram.record)
            self._axes = decode_record(telegram.record, layout, axes=self._setup.axes)
        elif self._collecting and telegram.text:
            self._texts.append(telegram.text)
            if len(self._texts) < len(self._setup.axes):
                return None
            self._collecting = False
            self._axes = tuple(decode_text(text) for text in self._texts)
        else:
            return None
        return Measured(self._state(*self._axes))

    def conversation(self) -> Conversation[Reply]:
        """Return the steps of `converse`, for a link that `Streaming` runs over."""
        return self.converse(Steps()).__await__()

    async def converse(self, controller: Commands) -> None:
        """Prepare a controller that was just connected, then command and ask it until cancelled.

        Parameters
        ----------
        controller : Commands
            Every reply it gives has to be shown to `value` before it goes on.

        Raises
        ------
        DeviceError
            If it cannot go on: the line is to be closed, and everything begins anew.
        """
        self._by_text = self._switched_on = self._collecting = False
        self._axes = ()
        self._rolled.restart()
        await self._identify(controller)
        await self._settle(controller)
        if self._setup.silence:
            await self._guard(controller)
        self._by_text = self._layout is None
        for turn in itertools.count():
            if self._setup.silence and turn % round(self._setup.rate_hz) == 0:
                await self._require_guard(controller)
            await self._cycle(controller)
            await controller.beat(1 / self._setup.rate_hz)

    def farewell(self) -> bytes:
        """Return the command to stop."""
        return f"ST {self._setup.axes}\r".encode("ascii")

    def _state(self, left: AxisState, right: AxisState) -> WheelState:
        setup = self._setup
        self._rolled.update(left.position, right.position)
        speed, turn_rate = setup.wheels.motion(left.velocity, right.velocity)
        named = (("left", left), ("right", right))
        faults = tuple(f"{side} wheel: {why}" for side, axis in named for why in self._faults(axis))
        return WheelState(
            left=self._rolled.left,
            right=self._rolled.right,
            speed=speed,
            turn_rate=turn_rate,
            enabled=not (left.motor_off or right.motor_off),
            faults=faults + self._rejections,
        )

    def _faults(self, axis: AxisState) -> tuple[str, ...]:
        return axis_faults(
            stop_code=axis.stop_code,
            motor_off=axis.motor_off and self._switched_on,
            forward_limit=axis.forward_limit,
            reverse_limit=axis.reverse_limit,
        )

    async def _identify(self, controller: Commands) -> None:
        (reply,) = await controller.ask([_REVISION])
        if not _EXPECTED.match(reply.text):
            raise DeviceError(
                f"answered {reply.text[:40]!r} to ^R^V, expected a Galil controller such as "
                "'DMC4040 Rev 1.2d'; check its address"
            )
        self.revision = reply.text
        positions = await controller.ask([f"MG _TP{axis}" for axis in self._setup.axes])
        for axis, answer in zip(self._setup.axes, positions, strict=True):
            if not answer.accepted:
                raise DeviceError(f"{self.revision} has no axis {axis}; check galil.left and right")

    async def _settle(self, controller: Commands) -> None:
        """Stop what a predecessor left running; set ramps and the stop on position error."""
        setup, settings = self._setup, []
        for axis in setup.axes:
            settings += [
                f"AC{axis}={setup.ramp(setup.acceleration)}",
                f"DC{axis}={setup.ramp(setup.deceleration)}",
                f"OE{axis}=1",
            ]
        await controller.require(["CW 1", f"ST {setup.axes}", *settings])
        (shape,) = await controller.ask(["QZ"])
        self._layout = _layout(shape)

    async def _guard(self, controller: Commands) -> None:
        """Bring the watchdog into the controller and start it."""
        listing = await controller.listing()
        if listing and not is_watchdog(listing) and not self._setup.replace_program:
            raise DeviceError(
                f"{self.revision} holds a program of its own, which the watchdog would replace: "
                "save it and set replace_program = true, or silence = 0 to go without"
            )
        program = watchdog_program(
            self._setup.axes, deceleration=self._setup.ramp(self._setup.deceleration)
        )
        # DL itself prints nothing; the backslash that ends it is answered by two colons.
        await controller.require(["HX", f"DL\r{program}\r\\"], answers=3, within=_DOWNLOAD)
        await controller.require([f"XQ {LABEL}"])

    async def _require_guard(self, controller: Commands) -> None:
        """Begin anew if the watchdog was halted by someone else; asked once a second."""
        (reply,) = await controller.ask(["MG _XQ0"])
        if not reply.accepted or reply.text.startswith("-"):
            raise DeviceError(
                f"{self.revision}: its watchdog does not run any more; starts it anew"
            )

    async def _cycle(self, controller: Commands) -> None:
        commands = self._commands()
        self._texts.clear()
        commands += [query(axis) for axis in self._setup.axes] if self._by_text else ["QR"]
        self._collecting = self._by_text
        answers = list(zip(commands, await controller.ask(commands), strict=True))
        refused = [(command, reply.text) for command, reply in answers if not reply.accepted]
        for command, why in refused:
            if command == "QR" or command.startswith("MG"):
                raise DeviceError(f"refused {command}, which it answered before: {why}")
        self._rejections = tuple(f"{command} refused: {why}" for command, why in refused)

    def _commands(self) -> list[str]:
        """Return the commands of this cycle; none before the state of the axes is known."""
        setup, target = self._setup, self._target()
        commands: list[str] = []
        if not self._axes:
            return commands
        if self._enables(commanded=target is not None):
            self.enable_wanted, self._switched_on = False, True
            commands.append(f"SH {setup.axes}")
        moving = [axis for axis, state in zip(setup.axes, self._axes, strict=True) if state.moving]
        if target is None:
            return [*commands, f"ST {setup.axes}"] if moving else commands
        rates = setup.wheels.rates(*setup.wheels.limited(*target, speed=setup.speed))
        # Older models take even jog speeds only.
        speeds = [2 * round(rate / 2) for rate in rates]
        if setup.silence:
            commands.append(heartbeat(setup.silence))
        commands += [f"JG{a}={speed}" for a, speed in zip(setup.axes, speeds, strict=True)]
        standing = "".join(axis for axis in setup.axes if axis not in moving)
        return [*commands, f"BG {standing}"] if standing and any(speeds) else commands

    def _enables(self, *, commanded: bool) -> bool:
        """Tell whether to switch the motors on.

        The first command after connecting does, unless a fault has stopped one of them: then
        someone has to look, and say so.
        """
        faulty = any(axis.stop_code in FAULTS for axis in self._axes)
        return self.enable_wanted or (commanded and not faulty and not self._switched_on)


def _layout(shape: Reply) -> Layout | None:
    """Return how data records are laid out; None where the controller has none."""
    if not (shape.accepted and shape.text):
        return None
    try:
        return Layout.parse(shape.text)
    except FormatError as error:
        raise DeviceError(str(error)) from error
