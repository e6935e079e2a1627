"""The arguments of CoLa telegrams: numbers and texts, hexadecimal (CoLa-A) or binary (CoLa-B)."""

import struct
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import FormatError

Value = int | float | str | Sequence[int] | NDArray[np.integer]
Field = tuple[str, Value]
"""Kind and value: ``u8 u16 u32 i32 f32`` are numbers, ``x8`` a number that CoLa-A writes with two
digits, ``d16`` one that it writes in decimal, ``chars`` characters without their count, ``text``
with it, ``u8[]`` and ``u16[]`` numbers in a row."""

_FORMATS = {
    "u8": ">B",
    "x8": ">B",
    "u16": ">H",
    "d16": ">H",
    "u32": ">I",
    "i32": ">i",
    "f32": ">f",
}


def as_text(kind: str, value: Value) -> str:
    """Return how CoLa-A writes a `Field`."""
    if kind.endswith("[]"):
        return " ".join(f"{number:X}" for number in value)  # type: ignore[union-attr]
    if kind == "text":
        return f"{len(str(value)):X} {value}"
    if kind == "chars":
        return str(value)
    if kind == "x8":
        return f"{value:02X}"
    if kind == "d16":
        return f"{value:+d}"
    return f"{int.from_bytes(struct.pack(_FORMATS[kind], value), 'big'):X}"


def as_binary(kind: str, value: Value) -> bytes:
    """Return how CoLa-B writes a `Field`."""
    if kind.endswith("[]"):
        return np.asarray(value).astype(">u2" if kind == "u16[]" else "u1").tobytes()
    if kind in {"text", "chars"}:
        characters = str(value).encode("latin-1")
        return (len(characters).to_bytes(2, "big") if kind == "text" else b"") + characters
    return struct.pack(_FORMATS[kind], value)


class Fields(Protocol):
    """Takes the arguments of a telegram one after another, the same way in both dialects.

    Every method raises `FormatError` that names `what` if it is not there or no such value.
    """

    def number(self, kind: str, what: str) -> int:
        """Return the next integer, of kind ``u8 u16 u32 i32``."""
        ...

    def real(self, what: str) -> float:
        """Return the next floating-point number."""
        ...

    def characters(self, count: int, what: str) -> str:
        """Return the next `count` characters."""
        ...

    def row(self, kind: str, count: int, what: str) -> NDArray[np.integer]:
        """Return the next `count` integers, of kind ``u8 u16``, shape (count,)."""
        ...


class BinaryFields:
    """The `Fields` of CoLa-B."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def number(self, kind: str, what: str) -> int:
        """Return the next integer."""
        format_ = _FORMATS[kind]
        (value,) = struct.unpack(format_, self._take(struct.calcsize(format_), what))
        return int(value)

    def real(self, what: str) -> float:
        """Return the next floating-point number."""
        (value,) = struct.unpack(">f", self._take(4, what))
        return float(value)

    def characters(self, count: int, what: str) -> str:
        """Return the next `count` characters."""
        return self._take(count, what).decode("latin-1")

    def row(self, kind: str, count: int, what: str) -> NDArray[np.integer]:
        """Return the next `count` integers."""
        size = 2 if kind == "u16" else 1
        data = np.frombuffer(self._take(size * count, what), f">u{size}")
        return data.astype(f"u{size}")

    def _take(self, count: int, what: str) -> bytes:
        start, self._at = self._at, self._at + count
        if self._at > len(self._data):
            raise FormatError(
                f"CoLa telegram: ends after {len(self._data)} bytes of arguments, expected "
                f"{what} up to byte {self._at}"
            )
        return self._data[start : self._at]


class TextFields:
    """The `Fields` of CoLa-A."""

    def __init__(self, data: bytes) -> None:
        self._rest = data

    def number(self, kind: str, what: str) -> int:
        """Return the next integer: hexadecimal, or decimal with its sign."""
        (word,) = self._words(1, what)
        value = _integer(word, what)
        return value - 2**32 if kind == "i32" and value >= 2**31 else value

    def real(self, what: str) -> float:
        """Return the next floating-point number, which is written as its four bytes."""
        value = self.number("u32", what)
        if not 0 <= value < 2**32:
            raise FormatError(f"CoLa telegram: {what} is {value:X}, expected up to 8 digits")
        (real,) = struct.unpack(">f", value.to_bytes(4, "big"))
        return float(real)

    def characters(self, count: int, what: str) -> str:
        """Return the next `count` characters, which may be blanks."""
        found, self._rest = self._rest[:count], self._rest[count + 1 :]
        if len(found) < count:
            raise FormatError(
                f"CoLa telegram: ends after {found!r}, expected {what} of {count} characters"
            )
        return found.decode("latin-1")

    def row(self, kind: str, count: int, what: str) -> NDArray[np.integer]:
        """Return the next `count` integers."""
        largest = 0xFFFF if kind == "u16" else 0xFF
        values = [_integer(word, what) for word in self._words(count, what)]
        if values and not (min(values) >= 0 and max(values) <= largest):
            raise FormatError(f"CoLa telegram: {what} exceeds {largest:X}")
        return np.array(values, np.uint16 if kind == "u16" else np.uint8)

    def _words(self, count: int, what: str) -> list[bytes]:
        if not count:
            return []
        *words, rest = (self._rest + b" ").split(b" ", count) if self._rest else [b""]
        if len(words) < count:
            raise FormatError(f"CoLa telegram: ends before {what}")
        self._rest = rest[:-1]
        return words


def _integer(word: bytes, what: str) -> int:
    try:
        return int(word, 10 if word[:1] in {b"+", b"-"} else 16)
    except ValueError:
        raise FormatError(
            f"CoLa telegram: {what} is {word[:16]!r}, expected a hexadecimal number"
        ) from None
