"""Telegrams of SICK's CoLa protocol over TCP, in its two dialects.

CoLa-A is text between STX and ETX, numbers in hexadecimal; CoLa-B is four STX, a length, the same
commands with binary arguments (big-endian), and an XOR of the payload [1]_. Both ask and answer
alike: ``sRN`` is answered by ``sRA``, ``sWN`` by ``sWA``, ``sMN`` by ``sAN``, ``sEN`` by ``sEA``;
``sSN`` is sent unasked, and ``sFA`` says what went wrong.

References
----------
.. [1] SICK 8014631, "Telegram Listing, Ranging sensors LMS1xx, LMS5xx, TiM".
"""

import re
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from bearcub.devices.framing import Framer
from bearcub.devices.sick.cola_fields import (
    BinaryFields,
    Field,
    Fields,
    TextFields,
    as_binary,
    as_text,
)
from bearcub.devices.sick.cutting import cutter
from bearcub.errors import FormatError

_HEADER = 8  # four STX, length
_LONGEST_PAYLOAD = 0xFFFF  # five echoes with remission of the finest scan take 46 kB in CoLa-B
_LONGEST = _HEADER + _LONGEST_PAYLOAD + 1

ERRORS = {
    0x01: "the method needs a login (METHODIN_ACCESSDENIED)",
    0x02: "there is no such method (METHODIN_UNKNOWNINDEX)",
    0x03: "there is no such variable (VARIABLE_UNKNOWNINDEX)",
    0x04: "its state does not allow that now (LOCALCONDITIONFAILED)",
    0x05: "the values are invalid (INVALID_DATA)",
    0x06: "for an unknown reason (UNKNOWN_ERROR)",
    0x07: "too much data (BUFFER_OVERFLOW)",
    0x08: "too little data (BUFFER_UNDERFLOW)",
    0x09: "unknown type (ERROR_UNKNOWN_TYPE)",
    0x0A: "writing the variable needs a login (VARIABLE_WRITE_ACCESSDENIED)",
    0x0B: "unknown command for its name server (UNKNOWN_CMD_FOR_NAMESERVER)",
    0x0C: "unknown command (UNKNOWN_COLA_COMMAND)",
    0x0D: "it is still busy with the method (METHODIN_SERVER_BUSY)",
    0x0E: "an array is too long (FLEX_OUT_OF_BOUNDS)",
    0x0F: "there is no such event (EVENTREG_UNKNOWNINDEX)",
    0x10: "a value is too large (COLA_A_VALUE_OVERFLOW)",
    0x11: "an invalid character (COLA_A_INVALID_CHARACTER)",
    0x12: "no message inside it (OSAI_NO_MESSAGE)",
    0x13: "no answer inside it (OSAI_NO_ANSWER_MESSAGE)",
    0x14: "an internal error (INTERNAL)",
    0x15: "a corrupt hub address (HubAddressCorrupted)",
    0x16: "a hub address that it cannot decode (HubAddressDecoding)",
    0x17: "too many hub addresses (HubAddressAddressExceeded)",
    0x18: "a blank is missing in the hub address (HubAddressBlankExpected)",
    0x19: "asynchronous methods are suppressed (AsyncMethodsAreSuppressed)",
    0x1A: "arrays of this kind are not supported (ComplexArraysNotSupported)",
}
"""What the number in ``sFA`` means."""


class Dialect(Enum):
    """Which of the two forms a telegram has."""

    A = "CoLa-A"
    B = "CoLa-B"


class Message(NamedTuple):
    """What one telegram says.

    Attributes
    ----------
    kind : str
        ``sRN``, ``sRA``, ...
    name : str
        Of the variable, method or event; empty in ``sFA``.
    arguments : bytes
        As they came: text in CoLa-A, binary in CoLa-B.
    dialect : Dialect
    """

    kind: str
    name: str
    arguments: bytes = b""
    dialect: Dialect = Dialect.B

    @property
    def error(self) -> str:
        """What an ``sFA`` says, in words; empty for anything else."""
        if self.kind != "sFA":
            return ""
        if self.dialect is Dialect.B:
            code = int.from_bytes(self.arguments, "big")
        else:
            try:
                code = int(self.arguments, 16)
            except ValueError:
                return f"error {self.arguments!r}"
        return f"error {code:X}: {ERRORS.get(code, 'not in the list of errors')}"


def encode(kind: str, name: str, *fields: Field, dialect: Dialect) -> bytes:
    r"""Return the bytes of a telegram.

    Parameters
    ----------
    kind, name : str
        ``sMN`` and ``Run``, for example.
    *fields : tuple of str and value
        See `Field`.
    dialect : Dialect

    Examples
    --------
    >>> encode("sMN", "SetAccessMode", ("u8", 3), ("u32", 0xF4724744), dialect=Dialect.A)
    b'\x02sMN SetAccessMode 3 F4724744\x03'
    >>> encode("sWN", "EIHstCola", ("u8", 1), dialect=Dialect.B).hex(" ", 4)
    '02020202 0000000f 73574e20 45494873 74436f6c 61200109'
    """
    if dialect is Dialect.A:
        words = [kind, name, *(as_text(*field) for field in fields)]
        return b"\x02" + " ".join(filter(None, words)).encode("latin-1") + b"\x03"
    payload = " ".join(filter(None, (kind, name))).encode("ascii")
    if fields:
        payload += b" " + b"".join(as_binary(*field) for field in fields)
    return wrap(payload)


def wrap(payload: bytes) -> bytes:
    """Return the bytes of a CoLa-B telegram with that payload."""
    return b"\x02" * 4 + len(payload).to_bytes(4, "big") + payload + bytes([_xor(payload)])


def fields_of(message: Message) -> Fields:
    """Return the arguments of a telegram, to be taken one after another."""
    if message.dialect is Dialect.A:
        return TextFields(message.arguments)
    return BinaryFields(message.arguments)


_COMMAND = re.compile(rb"s(?:FA.*|[REMWAS][NA] [A-Za-z]\w*(?: .*)?)", re.DOTALL)
_TEXT = re.compile(rb"\x02s[ -~\x80-\xff]*")


def _xor(payload: bytes) -> int:
    return int(np.bitwise_xor.reduce(np.frombuffer(payload, np.uint8)))


def decode(data: bytes) -> Message:
    r"""Return what the bytes of exactly one telegram say.

    Raises
    ------
    FormatError
        If its frame, its length, its checksum or its command is wrong.

    Examples
    --------
    >>> decode(b"\x02sRA SCdevicestate 1\x03")
    Message(kind='sRA', name='SCdevicestate', arguments=b'1', dialect=<Dialect.A: 'CoLa-A'>)
    >>> decode(b"\x02sFA A\x03").error
    'error A: writing the variable needs a login (VARIABLE_WRITE_ACCESSDENIED)'
    """
    length = _FRAMING.length(data, 0) if data[:1] == b"\x02" else 0
    if not length or length != len(data):
        raise FormatError(
            f"CoLa telegram: {len(data)} bytes that begin with {data[:8].hex(' ')}, expected "
            f"{'STX' if not length else f'{length} as it announces'}"
        )
    if data[1:2] == b"\x02" and data[-1] != _xor(data[_HEADER:-1]):
        raise FormatError(
            f"CoLa telegram: checksum 0x{data[-1]:02X}, expected 0x{_xor(data[_HEADER:-1]):02X}; "
            "part of it is damaged"
        )
    if fault := _FRAMING.fault(data):
        raise FormatError(f"CoLa telegram: {fault}, found {data[:16]!r}")
    return _FRAMING.telegram(data)


@dataclass(frozen=True, slots=True)
class _Framing:
    """Telegrams of both dialects, which may follow one another."""

    start: re.Pattern[bytes]

    def length(self, data: bytes, start: int) -> int | None:
        if data[start + 1 : start + 2] == b"s":
            text = _TEXT.match(data, start)
            end = text.end() if text else start
            if end == len(data):
                return None
            return end + 1 - start if data[end] == 0x03 else 0
        if len(data) - start < _HEADER:
            return None
        payload = int.from_bytes(data[start + 4 : start + _HEADER], "big")
        return _HEADER + payload + 1 if 3 <= payload <= _LONGEST_PAYLOAD else 0

    def fault(self, raw: bytes) -> str:
        if raw[1] == 0x02:
            if _xor(raw[_HEADER:-1]) != raw[-1]:
                return "wrong checksum"
            return "" if _COMMAND.fullmatch(raw, _HEADER, len(raw) - 1) else "no CoLa command"
        return "" if _COMMAND.fullmatch(raw, 1, len(raw) - 1) else "no CoLa command"

    def telegram(self, raw: bytes) -> Message:
        dialect = Dialect.B if raw[1] == 0x02 else Dialect.A
        payload = raw[_HEADER if dialect is Dialect.B else 1 : -1]
        kind = payload[:3].decode("ascii")
        if kind == "sFA":
            return Message(kind, "", payload[4:] if payload[3:4] == b" " else payload[3:], dialect)
        name, _, arguments = payload[4:].partition(b" ")
        return Message(kind, name.decode("latin-1"), arguments, dialect)


# Looks ahead, so that it is also found in a row of more than four STX.
_FRAMING = _Framing(re.compile(rb"\x02(?=s|\x02(?:\x02(?:\x02|\Z)|\Z)|\Z)"))


def parser() -> Framer[Message]:
    """Return a parser of either end's bytes, in either dialect."""
    return Framer(cutter(_FRAMING), longest=_LONGEST)
