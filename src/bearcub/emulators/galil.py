"""An emulated Galil DMC-40x0 motion controller: its command line, its axes, its program.

It answers byte for byte as the controller does (``:`` and ``?`` for every command, values before
them, TC latched, no servo without SH, jog speeds changed on the fly, ramps at AC and DC) and really
runs the program that was downloaded, so that a watchdog can be seen to work.
"""

import re
import struct
from collections.abc import Callable

from bearcub.emulators.galil_motion import Axis
from bearcub.emulators.galil_program import Program

_REVISION = b"\x12\x16"  # ^R^V
_LONGEST_LINE = 80
_LONGEST_LEAP_NS = 10_000_000_000  # of a host that did not ask for so long, only the end is lived
_TEXTS = {
    0: "",
    1: "Unrecognized command",
    4: "Operand error",
    6: "Number out of range",
    9: "Variable error",
    10: "Empty program line or undefined label",
    17: "ED, BN and DL not valid while program running",
    20: "Begin not valid with motor off",
    21: "Begin not valid while running",
    22: "Begin not possible due to Limit Switch",
}
_SETTINGS = {  # command: attribute, lowest, highest
    "JG": ("jog", -15_000_000, 15_000_000),
    "AC": ("acceleration", 1024, 1_073_740_800),
    "DC": ("deceleration", 1024, 1_073_740_800),
    "ER": ("error_limit", -1, 2**31 - 1),
    "OE": ("off_on_error", 0, 1),
    "DP": ("position", -(2**31), 2**31 - 1),
}
_GENERAL, _COORDINATED, _AXIS = 52, 26, 36  # DMC-40x0, bytes
_NAME = re.compile(r"[a-z][a-z0-9]{0,7}", re.IGNORECASE)


class _Rejected(Exception):  # noqa: N818 (not an error of the program, but the controller's answer)
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class GalilEmulator:
    """The controller as a pure object: bytes in, bytes out, time passed in.

    Parameters
    ----------
    axes : int
        1 to 8.
    revision : str
        What it answers to ^R^V.
    records : bool
        Whether it knows QR and QZ, as models with Ethernet do.

    Attributes
    ----------
    axes : dict of str to Axis
        By letter.
    variables : dict of str to float
    """

    baud = None

    def __init__(
        self, *, axes: int = 4, revision: str = "DMC40{axes}0 Rev 1.2d", records: bool = True
    ) -> None:
        self.axes = {chr(ord("A") + index): Axis() for index in range(axes)}
        self.variables: dict[str, float] = {}
        self._revision = revision.format(axes=axes)
        self._records = records
        self._program = self._load([])
        self._now_ns: int | None = None
        self._line = bytearray()
        self._download: list[str] | None = None
        self._output = bytearray()
        self._error = 0
        self._message_mark = 0  # CW 1 sets bit 7 of what a program prints
        self._commands: dict[str, Callable[[str], str]] = {
            "SH": lambda text: self._each(text, lambda axis: axis.servo()),
            "MO": lambda text: self._each(text, lambda axis: axis.off()),
            "BG": lambda text: self._each(text, lambda axis: axis.begin(), check=_may_begin),
            "ST": lambda text: self._each(text, lambda axis: axis.stop()),
            "AB": lambda _: self._each("", lambda axis: axis.abort()),
            "TP": lambda text: self._list(text, lambda axis: axis.position),
            "TV": lambda text: self._list(text, lambda axis: round(axis.measured_speed)),
            "TE": lambda text: self._list(text, lambda axis: axis.error),
            "SC": lambda text: self._list(text, lambda axis: axis.stop_code),
            "TS": lambda text: self._list(text, _switches),
            "MG": self._print,
            "TC": self._tell_code,
            "CW": self._mark,
            "EO": lambda _: "",
            "ID": lambda _: f"FW, {self._revision}",
            "XQ": self._execute,
            "HX": self._halt,
            "LS": lambda _: "\r\n".join(
                f"{n} {line}" for n, line in enumerate(self._program.lines)
            ),
            "QZ": self._record_shape,
        }

    def receive(self, data: bytes) -> None:
        """Take bytes from the host; what they cause is in the next `poll`."""
        for byte in data:
            if byte == ord("\r"):
                line = bytes(self._line)
                self._line.clear()
                self._take(line)
            elif byte != ord("\n") and len(self._line) <= _LONGEST_LINE:
                self._line.append(byte)

    def poll(self, now_ns: int) -> bytes:
        """Let time pass until `now_ns` and return what the controller has sent."""
        if self._now_ns is None:
            self._now_ns = now_ns
        skipped_ns = now_ns - self._now_ns - _LONGEST_LEAP_NS
        if skipped_ns > 0:
            self._now_ns += skipped_ns
            self._program.wake_ns += skipped_ns
        while self._program.running and self._program.wake_ns <= now_ns:
            self._move(self._program.wake_ns)
            try:
                self._program.run(self._program.wake_ns)
            except _Rejected as rejection:
                self._program.running = False
                self._error = rejection.code
        self._move(now_ns)
        sent = bytes(self._output)
        self._output.clear()
        return sent

    def connect(self) -> None:
        """Forget the half of a line that a lost connection left; motors and program run on."""
        self._line.clear()
        self._output.clear()
        self._download = None

    def _move(self, now_ns: int) -> None:
        seconds = (now_ns - (self._now_ns or 0)) * 1e-9
        if seconds > 0:
            for axis in self.axes.values():
                axis.advance(seconds)
            self._now_ns = now_ns

    def _take(self, line: bytes) -> None:
        if line == _REVISION:
            self._say(f"{self._revision}\r\n:")
            return
        text = line.decode("ascii", "replace").strip()
        if self._download is not None:
            self._downloaded(text)
            return
        for part in text.split(";"):
            if part.strip() == "QR" and self._records:
                self._output += self._record() + b":"
                continue
            try:
                printed = self._perform(part.strip())
            except _Rejected as rejection:
                self._error = rejection.code
                self._say("?")
                return
            if self._download is None:  # DL is silent until its end
                self._say(f"{printed}\r\n:" if printed else ":")

    def _downloaded(self, text: str) -> None:
        assert self._download is not None  # noqa: S101 (the caller looked)
        lines, end, _ = text.partition("\\")
        if lines:
            self._download.append(lines)
        if end:
            self._program = self._load(self._download)
            self._download = None
            self._say("::")

    def _load(self, lines: list[str]) -> Program:
        return Program(lines, evaluate=self._value, command=self._from_program)

    def _from_program(self, statement: str) -> bool:
        try:
            printed = self._perform(statement)
        except _Rejected as rejection:
            self._error = rejection.code
            return False
        if printed:
            self._output += bytes(
                byte | self._message_mark for byte in f"{printed}\r\n".encode("ascii", "replace")
            )
        return True

    def _perform(self, text: str) -> str:
        """Execute one command and return what it prints."""
        if not text:
            return ""
        name, rest = text[:2], text[2:].strip()
        if name == "DL":
            if self._program.running:
                raise _Rejected(17)
            self._download = []
            return ""
        if name in _SETTINGS:
            return self._setting(name, rest)
        if name in self._commands and (self._records or name != "QZ"):
            return self._commands[name](rest)
        variable, assigned, value = text.partition("=")
        if assigned and _NAME.fullmatch(variable.strip()) and not variable.strip().isupper():
            self.variables[variable.strip()] = self._value(value)
            return ""
        raise _Rejected(1)

    def _named(self, letters: str) -> list[Axis]:
        if not letters.strip():
            return list(self.axes.values())
        named = [self.axes.get(letter) for letter in letters.replace(" ", "")]
        found = [axis for axis in named if axis is not None]
        if len(found) < len(named):
            raise _Rejected(4)
        return found

    def _each(
        self,
        letters: str,
        act: Callable[[Axis], None],
        *,
        check: Callable[[Axis], None] = lambda _: None,
    ) -> str:
        named = self._named(letters)
        for axis in named:
            check(axis)
        for axis in named:
            act(axis)
        return ""

    def _list(self, letters: str, value: Callable[[Axis], float]) -> str:
        return " " + ", ".join(f"{value(axis):.0f}" for axis in self._named(letters))

    def _setting(self, name: str, rest: str) -> str:
        letter, assigned, value = rest.partition("=")
        if assigned:
            pairs = [(axis, value) for axis in self._named(letter)]
        else:
            values = rest.split(",")
            if len(values) > len(self.axes):
                raise _Rejected(4)
            pairs = [(a, v) for a, v in zip(self.axes.values(), values, strict=False) if v.strip()]
        if not pairs:
            raise _Rejected(4)
        printed = [self._set(name, axis, value.strip()) for axis, value in pairs]
        return " " + ", ".join(text for text in printed if text) if any(printed) else ""

    def _set(self, name: str, axis: Axis, value: str) -> str:
        attribute, low, high = _SETTINGS[name]
        if value == "?":
            return f"{getattr(axis, attribute):.0f}"
        number = self._value(value)
        if not low <= number <= high:
            raise _Rejected(6)
        if name == "DP":
            axis.actual = axis.commanded = number
        elif name == "OE":
            axis.off_on_error = bool(number)
        else:
            setattr(axis, attribute, number)
        return ""

    def _value(self, text: str) -> float:
        """Return an expression's value: terms are taken from left to right."""
        parts = re.findall(r"[+\-*/]|_?[A-Za-z][A-Za-z0-9]*|[0-9.]+", text.replace(" ", ""))
        if "".join(parts) != text.replace(" ", "") or not parts:
            raise _Rejected(4)
        total, operator = 0.0, "+"
        for part in parts:
            if part in "+-*/":
                operator = part
            else:
                total = _apply(total, operator, self._term(part))
        if abs(total) >= 2**31:
            raise _Rejected(6)
        return total

    def _term(self, text: str) -> float:
        if text.startswith("_"):
            return self._operand(text[1:3], text[3:])
        if text[0].isdigit() or text[0] == ".":
            try:
                return float(text)
            except ValueError:
                raise _Rejected(4) from None
        if text not in self.variables:
            raise _Rejected(9)
        return self.variables[text]

    def _operand(self, name: str, letter: str) -> float:
        if name == "XQ":
            return 0.0 if self._program.running else -1.0
        axis = self.axes.get(letter)
        if axis is None:
            raise _Rejected(4)
        values: dict[str, float] = {
            "TP": axis.position,
            "TV": axis.measured_speed,
            "TE": axis.error,
            "SC": axis.stop_code,
            "BG": axis.moving,
            "MO": axis.motor_off,
            "LF": not axis.forward_limit,
            "LR": not axis.reverse_limit,
            "JG": axis.jog,
        }
        if name not in values:
            raise _Rejected(4)
        return float(values[name])

    def _print(self, rest: str) -> str:
        if rest.startswith('"') and rest.endswith('"'):
            return rest[1:-1]
        return "".join(f" {self._value(term):.4f}" for term in rest.split(","))

    def _tell_code(self, rest: str) -> str:
        code, self._error = self._error, 0
        return f"{code} {_TEXTS.get(code, '')}".strip() if rest == "1" else f" {code}"

    def _mark(self, rest: str) -> str:
        self._message_mark = 0x80 if rest == "1" else 0
        return ""

    def _execute(self, rest: str) -> str:
        label = (rest or "#AUTO").partition(",")[0]
        if not self._program.start(label, now_ns=self._now_ns or 0):
            raise _Rejected(10)
        return ""

    def _halt(self, _: str) -> str:
        self._program.running = False
        return ""

    def _record_shape(self, _: str) -> str:
        return f" {len(self.axes)}, {_GENERAL}, {_COORDINATED}, {_AXIS}"

    def _record(self) -> bytes:
        """Return the binary data record of QR."""
        size = 4 + _GENERAL + _COORDINATED + len(self.axes) * _AXIS
        letters = (1 << len(self.axes)) - 1
        sample = ((self._now_ns or 0) // 1_000_000) & 0xFFFF
        head = struct.pack("<BBHH", 0x87, letters, size, sample)
        blocks = [_axis_block(axis) for axis in self.axes.values()]
        return head.ljust(4 + _GENERAL + _COORDINATED, b"\0") + b"".join(blocks)

    def _say(self, text: str) -> None:
        self._output += text.encode("ascii", "replace")


def _may_begin(axis: Axis) -> None:
    if axis.motor_off:
        raise _Rejected(20)
    if axis.moving:
        raise _Rejected(21)
    if axis.blocked(axis.jog):
        raise _Rejected(22)


def _apply(total: float, operator: str, value: float) -> float:
    if operator == "/":
        if value == 0:
            raise _Rejected(6)
        return total / value
    return total * value if operator == "*" else total + (value if operator == "+" else -value)


def _switches(axis: Axis) -> int:
    return (
        0x80 * axis.moving
        + 0x40 * (abs(axis.error) > axis.error_limit)
        + 0x20 * axis.motor_off
        + 0x08 * (not axis.forward_limit)
        + 0x04 * (not axis.reverse_limit)
    )


def _axis_block(axis: Axis) -> bytes:
    status = (
        0x0001 * axis.motor_off
        + 0x0080 * (axis.speed < 0)
        + 0x8000 * axis.moving
        + 0x0800 * axis.stopping
    )
    position, error = axis.position, axis.error
    commanded = (position + error + 2**31) % 2**32 - 2**31
    velocity = round(axis.measured_speed * 64)
    return struct.pack(
        "<HBBiiiii",
        status,
        _switches(axis) & 0x0C,
        axis.stop_code,
        commanded,
        position,
        max(-(2**31), min(2**31 - 1, error)),
        0,
        max(-(2**31), min(2**31 - 1, velocity)),
    ).ljust(_AXIS, b"\0")
