"""How one talks to a SICK LMS2xx until it streams: find its baud rate, set it up, start it.

References
----------
.. [1] SICK 8007954, "Telegram Listing LMS2xx", operating modes (20h), variants (3Bh),
   configuration (74h, 77h).
"""

from collections.abc import Collection, Generator
from dataclasses import replace
from typing import TypeVar

from bearcub.devices.driver import Ask, Baud, Conversation, Measured, Pause, Step
from bearcub.devices.sick.lms2xx import (
    LONGEST,
    Acknowledgement,
    Message,
    Reply,
    Telegram,
    encode,
    parser,
)
from bearcub.devices.sick.lms2xx_scan import MEASURING_MODES, Lms2xxSetting, decode_scan
from bearcub.devices.sick.lms2xx_status import decode_errors, decode_status
from bearcub.errors import ConfigError, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Scan

R = TypeVar("R")
_Steps = Generator[Step[Message], Message | None, R]

BAUDS = {9600: 0x42, 19200: 0x41, 38400: 0x40, 500000: 0x48}
"""Modes of command 20h that set the line's speed."""

START_CONTINUOUS = Telegram(0x20, b"\x24")
STOP = Telegram(0x20, b"\x25")  # monitor on request
ENTER_INSTALLATION = Telegram(0x20, b"\x00SICK_LMS")  # the maker's password
READ_TYPE = Telegram(0x3A)
READ_STATUS = Telegram(0x31)
READ_ERRORS = Telegram(0x32)
READ_CONFIG = Telegram(0x74)

_SEARCH_ORDER = (9600, 38400, 19200, 500000)
_PROBE = 0.15  # within which a scanner that hears a command has answered it at 9600 baud [s]
_ROUNDS = 3
_ANSWER = 0.5  # a change of mode may take 3 s; late answers are heard by a later try [s]
_FIRST_SCAN = 0.5
_CONFIGURE = 7.0  # the scanner writes its EEPROM [s]
_TRIES = 6
_AFTER_NAK = 0.03  # a command may be repeated after that [s]
_AFTER_BAUD = 0.25
_PACED_FROM = 500_000  # baud at which the scanner misses bytes that follow one another at once
_BYTE_GAP = 60e-6  # 55 us to 6 ms; a timer of the system may make 1 ms of it [s]
_MODE_OF_CONFIG, _UNIT_OF_CONFIG = 5, 6
_UNITS = {"cm": 0, "mm": 1}
_SCANS = (Reply.SCAN, Reply.MEAN_SCAN, Reply.SUBRANGE_SCAN)
_OVERHEAD = 8  # STX, address, length, command, status, CRC [byte]


def set_baud(baud: int) -> Telegram:
    """Return the command that sets the line's speed to `baud`, a key of `BAUDS`."""
    return Telegram(0x20, bytes([BAUDS[baud]]))


def set_variant(fov_deg: int, resolution_deg: float) -> Telegram:
    """Return the command that sets field of view and resolution [deg]."""
    hundredths = round(resolution_deg * 100)
    return Telegram(0x3B, fov_deg.to_bytes(2, "little") + hundredths.to_bytes(2, "little"))


class Lms2xx:
    """The driver of a SICK LMS200, 211, 220, 221 or 291; its values are `Scan`.

    Parameters
    ----------
    fov_deg : int, optional
        Field of view [deg], 180 or 100.
    resolution_deg : float, optional
        1, 0.5 or, of 100 deg, 0.25 [deg].
    baud : int, optional
        To stream with: 9600, 19200, 38400 or, on RS-422 only, 500000.
    measuring_mode : int, optional
        To set the scanner to: a key of `lms2xx_scan.MEASURING_MODES`; by default it stays as it is.
    unit : str, optional
        "mm" (up to 8 m, or 32 m by the measuring mode) or "cm"; by default it stays as it is.

    Raises
    ------
    ConfigError
        If the scanner cannot be set so.

    Attributes
    ----------
    rate_hz : float
        Scans per second to expect [Hz].
    identity : str
        Type, firmware and settings, once it has told them.
    complaints : tuple of str
        What it says is wrong with it, when it was first met.

    Notes
    -----
    Measuring mode and unit are kept in the scanner's EEPROM, so they are only written where they
    differ.
    """

    def __init__(
        self,
        *,
        fov_deg: int = 180,
        resolution_deg: float = 0.5,
        baud: int = 38400,
        measuring_mode: int | None = None,
        unit: str | None = None,
    ) -> None:
        if baud not in BAUDS:
            raise ConfigError(f"LMS2xx: {baud} baud; expected one of {', '.join(map(str, BAUDS))}")
        if unit not in {None, *_UNITS}:
            raise ConfigError(f"LMS2xx: unit {unit!r}; expected 'mm' or 'cm'")
        self._wanted = Lms2xxSetting(
            fov_deg=fov_deg, resolution_deg=resolution_deg, measuring_mode=measuring_mode or 0
        )
        self._fixed: dict[int, int] = {}  # bytes of the configuration
        if measuring_mode is not None:
            self._fixed[_MODE_OF_CONFIG] = measuring_mode
        if unit is not None:
            self._fixed[_UNIT_OF_CONFIG] = _UNITS[unit]
        self._stream_baud = baud
        self._baud = baud
        self._setting = None if measuring_mode is None else self._wanted  # as far as known
        self._met = False  # has it ever answered? Then only a loss of power changes its speed
        self._talking = False  # to a scanner, which tells its measuring mode in time
        self._introduced = False
        self._model = ""
        self.identity = ""
        self.complaints: tuple[str, ...] = ()
        self.parser = parser()

    @property
    def rate_hz(self) -> float:
        """Scans per second to expect [Hz]."""
        return self._wanted.rate_hz(self._stream_baud)

    def value(self, telegram: Message) -> Measured[Scan] | None:
        """Return the scan in a telegram; None of anything else, and until the mode is known.

        What the scanner says of its configuration is heard here too, so that a recording of a
        whole session can be decoded.
        """
        if isinstance(telegram, Acknowledgement):
            return None
        if telegram.command == Reply.POWER_ON:
            text = telegram.data.decode("ascii", "replace").strip()
            raise DeviceError(f"LMS2xx {text}: was switched on anew")
        if telegram.command == Reply.CONFIG and len(telegram.data) > _UNIT_OF_CONFIG:
            mode = telegram.data[_MODE_OF_CONFIG]
            known = mode in MEASURING_MODES
            self._setting = replace(self._wanted, measuring_mode=mode) if known else None
        if telegram.command not in _SCANS or (self._setting is None and self._talking):
            return None
        if self._setting is None:
            raise FormatError("LMS2xx: a scan, but its measuring mode is not known; give it")
        on_the_line = (_OVERHEAD + len(telegram.data)) * 10 / self._baud
        return Measured(decode_scan(telegram, self._setting), on_the_line)

    def farewell(self) -> bytes:
        """Return the command that ends the stream."""
        return encode(STOP)

    def conversation(self) -> Conversation[Message]:
        """Find the baud rate, stop the stream, set up what differs, and start the stream."""
        self._setting, self._talking = None, True
        yield from self._find()
        yield from self._change_baud()
        identity = yield from self._ask(READ_TYPE, {Reply.TYPE}, "its type")
        self._model = identity.data.decode("ascii", "replace").strip()
        self.identity = self.identity or self._model
        yield from self._configure()
        variant = set_variant(self._wanted.fov_deg, self._wanted.resolution_deg)
        answer = yield from self._ask(variant, {Reply.VARIANT}, "its field of view")
        if answer.data[:5] != b"\x01" + variant.data:
            raise DeviceError(
                f"LMS2xx {self._model}: cannot scan {self._wanted.fov_deg} deg in steps of "
                f"{self._wanted.resolution_deg} deg; choose another field of view or resolution"
            )
        yield from self._introduce()
        yield from self._change_mode(START_CONTINUOUS, "continuous output")
        first = yield Ask(b"", _is_scan, _FIRST_SCAN + 2 / self.rate_hz)
        if first is None:
            raise DeviceTimeout(f"LMS2xx {self._model}: agreed to send scans and sends none")

    def _find(self) -> _Steps[None]:
        """Set the line to the scanner's speed, which may be any, and end its stream."""
        bauds = (self._baud, *(baud for baud in _SEARCH_ORDER if baud != self._baud))
        for attempt in range(_ROUNDS):
            for baud in bauds:
                # Where it may be streaming, its answer waits for the end of a scan.
                streams = baud == self._baud or (attempt > 0 and not self._met)
                scan = LONGEST * 10 / baud if streams else 0.0
                yield Baud(baud)
                last = yield from _paced(encode(STOP), baud)
                found = yield Ask(last, _is_telegram, _PROBE + scan)
                if found is not None:
                    self._baud, self._met = baud, True
                    yield from self._change_mode(STOP, "output on request")
                    return
        raise DeviceTimeout(
            "LMS2xx: no answer at 9600, 19200, 38400 or 500000 baud; check its power, its cable "
            "and, for RS-422, the bridge of pins 7 and 8 in its connector"
        )

    def _change_baud(self) -> _Steps[None]:
        if self._baud == self._stream_baud:
            return
        before = self._baud
        yield from self._change_mode(set_baud(self._stream_baud), f"{self._stream_baud} baud")
        yield Baud(self._stream_baud)
        yield Pause(_AFTER_BAUD)
        last = yield from _paced(encode(STOP), self._stream_baud)
        if (yield Ask(last, _is_telegram, _ANSWER)) is None:
            hint = "; 500000 baud need RS-422" if self._stream_baud > 38400 else ""
            raise DeviceTimeout(
                f"LMS2xx: no answer at {self._stream_baud} baud after it agreed to them at "
                f"{before}; choose a lower baud{hint}"
            )
        self._baud = self._stream_baud

    def _introduce(self) -> _Steps[None]:
        """Ask for status and errors, once; a scanner that does not tell is none the worse."""
        if self._introduced:
            return
        self._introduced = True
        for command, reply in ((READ_STATUS, Reply.STATUS), (READ_ERRORS, Reply.ERRORS)):
            try:
                answer = yield from self._ask(command, {reply}, "how it is", tries=1)
                self._take_status(answer)
            except (DeviceError, FormatError):
                continue

    def _take_status(self, answer: Telegram) -> None:
        if answer.command == Reply.ERRORS:
            self.complaints += tuple(
                f"error {number} of type {kind}" for kind, number in decode_errors(answer)
            )
            return
        status = decode_status(answer)
        if status.settings is not None:
            self.identity = f"{self._model}, {status.settings}"
        if status.defective:
            self.complaints += ("reports a fault of its own",)

    def _configure(self) -> _Steps[None]:
        """Write what differs from what is wanted; `value` hears the result."""
        config = yield from self._read_config()
        if any(config[at] != byte for at, byte in self._fixed.items()):
            wanted = bytearray(config)
            for at, byte in self._fixed.items():
                wanted[at] = byte
            yield from self._change_mode(ENTER_INSTALLATION, "installation mode")
            write = Telegram(0x77, bytes(wanted))
            # Once: the EEPROM wears. What was lost is noticed when it is read again.
            yield from self._ask(
                write, {Reply.CONFIG_WRITTEN}, "to be configured", timeout=_CONFIGURE, tries=1
            )
            yield from self._change_mode(STOP, "output on request")
            config = yield from self._read_config()
            if config != wanted:
                raise DeviceError(
                    f"LMS2xx {self._model}: keeps measuring mode 0x{config[_MODE_OF_CONFIG]:02X} "
                    f"and unit {config[_UNIT_OF_CONFIG]}; leave both as they are in the scanner"
                )
        if config[_MODE_OF_CONFIG] not in MEASURING_MODES:
            raise DeviceError(
                f"LMS2xx {self._model}: measuring mode 0x{config[_MODE_OF_CONFIG]:02X} has no "
                "distances that are known; set measuring_mode to 0"
            )

    def _read_config(self) -> _Steps[bytes]:
        answer = yield from self._ask(READ_CONFIG, {Reply.CONFIG}, "its configuration")
        if len(answer.data) <= _UNIT_OF_CONFIG:
            raise DeviceError(
                f"LMS2xx {self._model}: a configuration of {len(answer.data)} bytes, "
                "expected 32 or 34"
            )
        return answer.data

    def _change_mode(self, command: Telegram, purpose: str) -> _Steps[None]:
        answer = yield from self._ask(command, {Reply.MODE}, purpose)
        if answer.data[:1] != b"\x00":
            raise DeviceError(
                f"LMS2xx {self._model}: refuses {purpose}, code {answer.data.hex()}; "
                "expected 00, 01 is a wrong password"
            )

    def _ask(
        self,
        command: Telegram,
        replies: Collection[int],
        purpose: str,
        *,
        timeout: float = _ANSWER,
        tries: int = _TRIES,
    ) -> _Steps[Telegram]:
        """Return the reply to a command, which is repeated after a NAK or a silence."""

        def wanted(message: Message) -> bool:
            if isinstance(message, Acknowledgement):
                return message is Acknowledgement.NAK
            return message.command in {*replies, Reply.REJECTED}

        for _ in range(tries):
            last = yield from _paced(encode(command), self._baud)
            answer = yield Ask(last, wanted, timeout)
            if isinstance(answer, Acknowledgement):
                yield Pause(_AFTER_NAK)
            elif answer is not None:
                if answer.command == Reply.REJECTED:
                    raise DeviceError(
                        f"LMS2xx {self._model}: rejects {purpose} "
                        f"(command 0x{command.command:02X}) in its present state; "
                        "switch it off and on"
                    )
                return answer
        raise DeviceTimeout(
            f"LMS2xx {self._model}: no answer when asked for {purpose} "
            f"(command 0x{command.command:02X}, tried {tries} times)"
        )


def _paced(data: bytes, baud: int) -> _Steps[bytes]:
    """Send all but the last byte, with the gaps that the scanner needs; return the last one."""
    if baud < _PACED_FROM:
        return data
    for at in range(len(data) - 1):
        yield Ask(data[at : at + 1], lambda _: False, _BYTE_GAP)
    return data[-1:]


def _is_telegram(message: Message) -> bool:
    return isinstance(message, Telegram)


def _is_scan(message: Message) -> bool:
    return isinstance(message, Telegram) and message.command in _SCANS
