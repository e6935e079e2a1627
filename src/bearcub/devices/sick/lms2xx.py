"""Telegrams of the SICK LMS2xx (LMS200, 211, 220, 221, 291) on its serial line.

A telegram is STX, address, length (2 bytes), command, data, status (from the scanner only) and CRC
(2 bytes), integers little-endian [1]_. Before each reply the scanner sends a single ACK; a single
NAK says that what it received was damaged.

References
----------
.. [1] SICK 8007954, "Telegram Listing LMS2xx".
"""

import functools
import re
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bearcub.devices.framing import Framer
from bearcub.devices.sick.cutting import cutter
from bearcub.errors import FormatError

LONGEST = 814
"""Of all telegrams [byte]: 401 points with both of the optional index bytes."""

_HEADER = 4  # STX, address, length
_CRC = 2


class Acknowledgement(IntEnum):
    """The single byte before a reply."""

    ACK = 0x06
    NAK = 0x15


class Reply(IntEnum):
    """Commands of telegrams that come from the scanner."""

    POWER_ON = 0x90
    RESET = 0x91
    REJECTED = 0x92
    MODE = 0xA0
    SCAN = 0xB0
    STATUS = 0xB1
    ERRORS = 0xB2
    MEAN_SCAN = 0xB6
    SUBRANGE_SCAN = 0xB7
    TYPE = 0xBA
    VARIANT = 0xBB
    CONFIG = 0xF4
    CONFIG_WRITTEN = 0xF7


class Telegram(NamedTuple):
    """What one telegram says.

    Attributes
    ----------
    command : int
        A `Reply` where it came from the scanner; those have bit 7 set.
    data : bytes
        What stands between the command and the status or, without one, the CRC.
    status : int or None
        The scanner's status byte; None in what was sent to the scanner.
    address : int
        The scanner's, plus 0x80 where it is the sender; 0 means any scanner.
    """

    command: int
    data: bytes = b""
    status: int | None = None
    address: int = 0

    @property
    def fault(self) -> str:
        """What the status byte complains of, in words; empty if all is well (bits 0 to 7)."""
        status = self.status or 0
        words = ["", "information", "warning", "error", "fatal error"][min(status & 0b111, 4)]
        pollution = "the front window is dirty" if status & 0x80 else ""
        implausible = "measured values are implausible" if status & 0x40 else ""
        return ", ".join(filter(None, (words, pollution, implausible)))


@functools.cache
def _remainders() -> NDArray[np.uint16]:
    """Return what a byte adds to the CRC, by its distance from the end; shape (LONGEST, 256).

    The CRC shifts once per byte, not per bit, and takes in each byte twice: as low byte, and one
    step later as high byte. It is linear, so every byte's share can be known beforehand.
    """

    def shifted(crc: NDArray[np.uint16]) -> NDArray[np.uint16]:
        return (crc << np.uint16(1)) ^ np.where(crc & 0x8000, np.uint16(0x8005), np.uint16(0))

    octets = np.arange(256, dtype=np.uint16)
    table = np.empty((LONGEST, 256), np.uint16)
    table[0] = octets
    table[1] = shifted(octets) ^ (octets << np.uint16(8))
    for row in range(2, LONGEST):
        table[row] = shifted(table[row - 1])
    return table


@functools.cache
def _rows() -> NDArray[np.intp]:
    return np.arange(LONGEST) * 256


def crc(data: bytes) -> int:
    """Return the check sum over `data`, from STX to the last byte before the CRC itself.

    It is not the CRC-16 of that polynomial (0x8005): it shifts once for each byte.

    Examples
    --------
    >>> hex(crc(bytes.fromhex("02 00 01 00 31")))
    '0x1215'
    """
    from_end = np.frombuffer(data, np.uint8)[::-1]
    shares = _remainders().take(_rows()[: len(from_end)] + from_end)
    return int(np.bitwise_xor.reduce(shares))


def encode(telegram: Telegram) -> bytes:
    """Return the bytes of a telegram.

    Raises
    ------
    FormatError
        If it would be longer than the line allows (814 bytes).

    Examples
    --------
    >>> encode(Telegram(0x31)).hex(" ")
    '02 00 01 00 31 15 12'
    """
    status = b"" if telegram.status is None else bytes([telegram.status])
    body = bytes([telegram.command]) + telegram.data + status
    if _HEADER + len(body) + _CRC > LONGEST:
        raise FormatError(
            f"LMS2xx telegram 0x{telegram.command:02X}: {_HEADER + len(body) + _CRC} bytes, "
            f"expected at most {LONGEST}"
        )
    head = bytes([0x02, telegram.address]) + len(body).to_bytes(2, "little")
    return head + body + crc(head + body).to_bytes(2, "little")


def decode(data: bytes) -> Telegram:
    r"""Return what the bytes of exactly one telegram say.

    Raises
    ------
    FormatError
        If its beginning, its length or its CRC is wrong.

    Examples
    --------
    >>> decode(bytes.fromhex("02 80 03 00 A0 00 10 16 0A"))
    Telegram(command=160, data=b'\x00', status=16, address=128)
    """
    if data[:1] != b"\x02" or len(data) < _HEADER + 1 + _CRC:
        raise FormatError(
            f"LMS2xx telegram: begins with {data[:_HEADER].hex(' ') or 'nothing'}, expected STX "
            "(02) and 7 bytes or more"
        )
    length = int.from_bytes(data[2:4], "little") + _HEADER + _CRC
    if length != len(data) or length > LONGEST:
        raise FormatError(
            f"LMS2xx telegram: {len(data)} bytes, expected {length} as it announces, "
            f"and at most {LONGEST}"
        )
    found, expected = int.from_bytes(data[-2:], "little"), crc(data[:-2])
    if found != expected:
        raise FormatError(
            f"LMS2xx telegram: CRC 0x{found:04X}, expected 0x{expected:04X}; part of it is damaged"
        )
    return _unpack(data)


def _unpack(raw: bytes) -> Telegram:
    if not raw[1] & 0x80:
        return Telegram(raw[4], raw[5:-2], None, raw[1])
    return Telegram(raw[4], raw[5:-3], raw[-3], raw[1])


Message = Telegram | Acknowledgement


@dataclass(frozen=True, slots=True)
class _Framing:
    """Telegrams of one direction, and the single bytes that acknowledge those of the other."""

    start: re.Pattern[bytes]
    from_scanner: bool

    def length(self, data: bytes, start: int) -> int | None:
        if data[start] != 0x02:
            return 1
        if len(data) - start <= _HEADER:
            return None
        body = data[start + 2] | data[start + 3] << 8
        shortest = 2 if self.from_scanner else 1  # command and, from the scanner, status
        if not shortest <= body <= LONGEST - _HEADER - _CRC:
            return 0
        is_reply = bool(data[start + 4] & 0x80)
        return body + _HEADER + _CRC if is_reply == self.from_scanner else 0

    def fault(self, raw: bytes) -> str:
        wrong = len(raw) > 1 and crc(raw[:-2]) != int.from_bytes(raw[-2:], "little")
        return "wrong CRC" if wrong else ""

    def telegram(self, raw: bytes) -> Message:
        return Acknowledgement(raw[0]) if len(raw) == 1 else _unpack(raw)


def parser(*, from_scanner: bool = True) -> Framer[Message]:
    """Return a parser of what the scanner sends, or else of what it receives.

    It accepts replies of address 0x80 and 0x81: to a telegram without an address, scanners answer
    with one or the other. An acknowledgement is a byte 06 or 15 that stands before a telegram or
    at the end.
    """
    start = rb"\x02(?:[\x80\x81]|\Z)|[\x06\x15](?=\x02|\Z)" if from_scanner else rb"\x02(?:\x00|\Z)"
    framing = _Framing(re.compile(start), from_scanner)
    return Framer(cutter(framing), longest=LONGEST)
