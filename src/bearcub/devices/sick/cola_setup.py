"""How one talks to a SICK LMS1xx, LMS5xx or TiM until it streams: log in, set up, start.

References
----------
.. [1] SICK 8014631, "Telegram Listing, Ranging sensors LMS1xx, LMS5xx, TiM".
"""

from collections.abc import Generator
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

from bearcub.devices.driver import Ask, Conversation, Measured, Pause, Step
from bearcub.devices.framing import Framer
from bearcub.devices.sick.cola import Dialect, Message, encode, fields_of, parser
from bearcub.devices.sick.cola_fields import Field
from bearcub.devices.sick.cola_scan import NAME, decode_scan_data, to_scan
from bearcub.errors import ConfigError, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Scan

R = TypeVar("R")
_Steps = Generator[Step[Message], Message | None, R]

ANSWERS = {"sRN": "sRA", "sWN": "sWA", "sMN": "sAN", "sEN": "sEA"}

_ANSWER = 0.5  # they answer within milliseconds [s]
_TRIES = 3
_READY = 30.0  # a scanner that is switched on spins up for so long [s]
_FIRST_SCAN = 1.0  # [s]
_AGAIN = 0.1  # between two looks at its state [s]
_READY_STATE, _ERROR_STATE = 1, 2  # SCdevicestate
_MEASURING = 7  # STlms
_LARGEST_GAP = 1000  # of the telegram counter; a larger one is a scanner that started anew


class Access(Enum):
    """Who one logs in as, and the hash of the password that scanners leave the factory with."""

    MAINTENANCE = (2, 0xB21ACE26)
    CLIENT = (3, 0xF4724744)
    SERVICE = (4, 0x81BE23AA)
    SAFETY_CLIENT = (3, 0x6FD62C05)  # of safety scanners


class Echo(Enum):
    """Which echoes a scanner with an echo filter (LMS5xx, TiM) sends."""

    FIRST = 0
    ALL = 1
    LAST = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """What to scan; what is left out stays as it is in the scanner.

    Attributes
    ----------
    start_deg, stop_deg : float
        First and last beam [deg]: 0 ahead, counter-clockwise.
    step_deg : float
        Between beams [deg].
    scan_hz : float or None
        Turns per second [Hz]; None where they cannot be set (TiM).

    Raises
    ------
    ConfigError
        If there is nothing between first and last beam.
    """

    start_deg: float
    stop_deg: float
    step_deg: float
    scan_hz: float | None = None

    def __post_init__(self) -> None:
        if not 0 < self.step_deg <= self.stop_deg - self.start_deg <= 360:
            raise ConfigError(
                f"SICK scanner: from {self.start_deg} to {self.stop_deg} deg in steps of "
                f"{self.step_deg}; expected start_deg < stop_deg and a positive step"
            )

    @property
    def step(self) -> int:
        """Between beams [1/10000 deg]."""
        return round(self.step_deg * 10_000)

    @property
    def fields(self) -> tuple[Field, Field, Field]:
        """Step, start and stop as the scanner counts them: 1/10000 deg, 90 deg ahead."""
        return (
            ("u32", self.step),
            ("i32", round((self.start_deg + 90) * 10_000)),
            ("i32", round((self.stop_deg + 90) * 10_000)),
        )


class Cola:
    """The driver of a SICK LMS1xx, LMS5xx or TiM over TCP; its values are `Scan`.

    Parameters
    ----------
    dialect : Dialect, optional
        To ask for. The scanner's own is used where it does not change (port 2111 of some).
    access : Access, optional
        To log in as.
    sweep : Sweep, optional
        What to scan; by default what the scanner is set to.
    remission : bool, optional
        Whether to send the brightness of the echoes too.
    echo : Echo, optional
        Which echoes to send; by default what the scanner is set to.
    nearest : float, optional
        What is measured nearer than this [m] counts as too close, -inf.

    Attributes
    ----------
    identity : str
        What the scanner calls itself, once it has been asked.

    Notes
    -----
    The sequence of commands is the one that the maker's own driver uses for the TiM5xx; commands
    that a model does not know are left out after it says so.
    """

    def __init__(
        self,
        *,
        dialect: Dialect = Dialect.B,
        access: Access = Access.CLIENT,
        sweep: Sweep | None = None,
        remission: bool = False,
        echo: Echo | None = None,
        nearest: float = 0.05,
    ) -> None:
        self._wanted = self._dialect = dialect
        self._access = access
        self._sweep = sweep
        self._remission = remission
        self._echo = echo
        self._nearest = nearest
        self._changed = False  # whether it was asked to speak the other dialect
        self._counter: int | None = None
        self._model = "scanner"
        self.identity = ""
        self.parser: Framer[Message] = parser()

    def value(self, telegram: Message) -> Measured[Scan] | None:
        """Return the scan in a telegram; None of anything else."""
        if not _is_scan(telegram):
            return None
        data = decode_scan_data(telegram)
        self._count_drops(data.telegram_counter)
        return Measured(to_scan(data, nearest=self._nearest), data.delay)

    def farewell(self) -> bytes:
        """Return the command that ends the stream."""
        return encode("sEN", NAME, ("u8", 0), dialect=self._dialect)

    def conversation(self) -> Conversation[Message]:
        """Log in, choose the dialect, set up what is wanted, and start the stream."""
        self._counter = None
        yield from self._greet()
        yield from self._log_in()
        yield from self._change_dialect()
        yield from self._identify()
        yield from self._wait_for("SCdevicestate", _READY_STATE)
        yield from self._choose_sweep()
        yield from self._choose_content()
        yield from self._start()

    def _count_drops(self, counter: int) -> None:
        if self._counter is not None:
            missed = (counter - self._counter - 1) % 0x10000
            self.parser.tally.drops += missed if missed < _LARGEST_GAP else 0
        self._counter = counter

    def _greet(self) -> _Steps[None]:
        """Find out which dialect it speaks."""
        other = Dialect.A if self._dialect is Dialect.B else Dialect.B
        for dialect in (self._dialect, other) * _TRIES:
            request = encode("sRN", "DeviceIdent", dialect=dialect)
            if (yield Ask(request, lambda message: message.kind != "sSN", _ANSWER)) is not None:
                self._dialect = dialect
                return
        raise DeviceTimeout(
            "SICK scanner: connected, but no answer in CoLa-A or CoLa-B; check that the port is "
            "2111 or 2112 and that no other program is connected to it"
        )

    def _log_in(self) -> _Steps[None]:
        level, password = self._access.value
        answer = yield from self._ask("sMN", "SetAccessMode", ("u8", level), ("u32", password))
        if self._number(answer) != 1:
            raise DeviceError(
                f"SICK {self._model}: refuses the login as {self._access.name.lower()}; "
                "its password was changed, set it back in SOPAS"
            )

    def _change_dialect(self) -> _Steps[None]:
        if self._dialect is self._wanted or self._changed:
            return
        self._changed = True  # once: not every port can
        number = 1 if self._wanted is Dialect.B else 0
        if (yield from self._ask("sWN", "EIHstCola", ("u8", number), optional=True)) is not None:
            before, self._dialect = self._dialect, self._wanted
            raise DeviceError(
                f"SICK {self._model}: changes from {before.value} to {self._wanted.value}, "
                "which needs a new connection"
            )

    def _identify(self) -> _Steps[None]:
        answer = yield from self._ask("sRN", "DeviceIdent", optional=True)
        if answer is None:
            return
        fields = fields_of(answer)
        try:
            words = [
                fields.characters(fields.number("u16", "a length"), "its name").strip()
                for _ in range(2)
            ]
        except FormatError:
            return  # some models answer in a form of their own; it is only for messages
        self.identity = self._model = " ".join(words)

    def _wait_for(self, variable: str, state: int) -> _Steps[None]:
        """Wait until a variable, where it is known, says that the scanner is ready."""
        for _ in range(round(_READY / _AGAIN)):
            answer = yield from self._ask("sRN", variable, optional=True)
            kind = "u8" if variable == "SCdevicestate" else "u16"
            found = state if answer is None else self._number(answer, kind)
            if found == state:
                return
            if variable == "SCdevicestate" and found == _ERROR_STATE:
                raise DeviceError(
                    f"SICK {self._model}: reports an error ({variable} {found}); "
                    "switch it off and on, or read its errors in SOPAS"
                )
            yield Pause(_AGAIN)
        raise DeviceTimeout(
            f"SICK {self._model}: {variable} is {found} after {_READY:g} s, expected {state}"
        )

    def _choose_sweep(self) -> _Steps[None]:
        """Set up what to scan; what is set so already stays alone, for it stops the mirror."""
        sweep = self._sweep
        if sweep is None:
            return
        if sweep.scan_hz is not None:
            frequency: Field = ("u32", round(sweep.scan_hz * 100))
            found = yield from self._ask("sRN", "LMPscancfg")
            if self._numbers(found, "u32", "u16", "u32")[::2] != (frequency[1], sweep.step):
                yield from self._ask("sMN", "LMCstopmeas", optional=True)
                answer = yield from self._ask(
                    "sMN", "mLMPsetscancfg", frequency, ("d16", 1), *sweep.fields
                )
                if self._number(answer) != 0:
                    raise DeviceError(
                        f"SICK {self._model}: cannot scan at {sweep.scan_hz} Hz in steps of "
                        f"{sweep.step_deg} deg; choose a pair of its manual"
                    )
        found = yield from self._ask("sRN", "LMPoutputRange")
        wanted = tuple(value for _, value in sweep.fields)
        if self._numbers(found, "u16", "u32", "i32", "i32")[1:] != wanted:
            yield from self._ask("sWN", "LMPoutputRange", ("u16", 1), *sweep.fields)

    def _choose_content(self) -> _Steps[None]:
        if self._echo is not None:
            yield from self._ask("sWN", "FREchoFilter", ("u8", self._echo.value))
        yield from self._ask("sWN", "LMDscandatacfg", *content_fields(remission=self._remission))

    def _start(self) -> _Steps[None]:
        yield from self._ask("sMN", "LMCstartmeas", optional=True)
        yield from self._ask("sMN", "Run")
        yield from self._wait_for("STlms", _MEASURING)
        answer = yield from self._ask("sEN", NAME, ("u8", 1))
        if self._number(answer) != 1:
            raise DeviceError(f"SICK {self._model}: does not start to send; switch it off and on")
        if (yield Ask(b"", _is_scan, _FIRST_SCAN)) is None:
            raise DeviceTimeout(f"SICK {self._model}: agreed to send scans and sends none")

    def _ask(
        self, kind: str, name: str, *fields: Field, optional: bool = False
    ) -> _Steps[Message | None]:
        """Return the answer to a command; None to an optional one that it refuses."""

        def wanted(message: Message) -> bool:
            return message.kind == "sFA" or (message.kind, message.name) == (ANSWERS[kind], name)

        request = encode(kind, name, *fields, dialect=self._dialect)
        for _ in range(_TRIES):
            answer = yield Ask(request, wanted, _ANSWER)
            if answer is None:
                continue
            if answer.kind != "sFA":
                return answer
            if optional:
                return None
            raise DeviceError(f"SICK {self._model}: refuses {kind} {name}: {answer.error}")
        raise DeviceTimeout(
            f"SICK {self._model}: no answer to {kind} {name}, {_TRIES} times; switch it off and on"
        )

    def _number(self, answer: Message | None, kind: str = "u8") -> int:
        return self._numbers(answer, kind)[0]

    def _numbers(self, answer: Message | None, *kinds: str) -> tuple[int, ...]:
        """Return the numbers that an answer begins with."""
        if answer is None:
            return (-1,) * len(kinds)
        fields = fields_of(answer)
        try:
            return tuple(fields.number(kind, f"argument {at}") for at, kind in enumerate(kinds, 1))
        except FormatError as error:
            raise DeviceError(
                f"SICK {self._model}: answers {answer.kind} {answer.name} "
                f"{answer.arguments[:32]!r}: {error}"
            ) from error


def _is_scan(message: Message) -> bool:
    return message.kind == "sSN" and message.name == NAME


def content_fields(*, remission: bool, wide: bool = True, time: bool = False) -> tuple[Field, ...]:
    """Return the arguments of ``LMDscandatacfg``: the first echo of every scan.

    The channel mask has its low byte first, unlike everything else.

    Parameters
    ----------
    remission : bool
        Whether the brightness of the echoes is sent too.
    wide : bool, optional
        Whether that has 16 bits, else 8.
    time : bool, optional
        Whether the scanner's own clock is sent.
    """
    return (
        ("x8", 0x01),
        ("x8", 0x00),
        ("u8", int(remission)),
        ("u8", int(wide)),
        ("u8", 0),  # unit
        ("x8", 0x00),  # encoders
        ("x8", 0x00),
        ("u8", 0),  # position
        ("u8", 0),  # device name
        ("u8", 0),  # comment
        ("u8", int(time)),
        ("d16", 1),  # output interval
    )
