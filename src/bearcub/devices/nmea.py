"""Lines like ``$GPGGA,...*47``: cut from a stream, checked, split into fields (NMEA 0183, 5.3)."""

import math
from dataclasses import dataclass
from functools import reduce
from operator import xor

from bearcub.devices.framing import INCOMPLETE, Cut, Framer
from bearcub.errors import FormatError

LONGEST = 256  # NMEA 0183 allows 82; proprietary sentences are longer


@dataclass(frozen=True, slots=True)
class Sentence:
    """One sentence whose checksum was right.

    Attributes
    ----------
    name : str
        ``GPGGA``, ``PTNTHPR``.
    fields : tuple of str
        What follows the name, split at the commas.
    """

    name: str
    fields: tuple[str, ...]

    def number(self, text: str) -> float:
        """Return one of its fields as a finite number.

        Raises
        ------
        FormatError
            If it is none; the sentence is named.
        """
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise FormatError(f"{self}: {text!r}, expected a number")
        return value

    def __str__(self) -> str:
        return ",".join((f"${self.name}", *self.fields))


def sentences() -> Framer[Sentence]:
    """Return a parser of sentences with a checksum; one without is refused."""
    return Framer(_cut, longest=LONGEST)


def lines() -> Framer[str]:
    """Return a parser of such lines whose fields are not separated by commas.

    A telegram is what stands between ``$`` and ``*``.
    """
    return Framer(_cut_text, longest=LONGEST)


def checksum(text: str) -> int:
    """Return the checksum of what stands between ``$`` and ``*``: exclusive or of its bytes.

    Examples
    --------
    >>> f"{checksum('VNWRG,07,40'):02X}"
    '59'
    """
    return reduce(xor, text.encode("latin-1"), 0)


def encode(text: str) -> bytes:
    r"""Return a whole sentence made of what stands between ``$`` and ``*``.

    Examples
    --------
    >>> encode("HCHDT,128.0,T")
    b'$HCHDT,128.0,T*22\r\n'
    """
    return f"${text}*{checksum(text):02X}\r\n".encode("latin-1")


def _cut(data: bytes, start: int) -> Cut[Sentence]:
    cut = _cut_text(data, start)
    if cut.telegram is None:
        return Cut(cut.used, None, cut.reason)
    name, *fields = cut.telegram.split(",")
    return Cut(cut.used, Sentence(name, tuple(fields)))


def _cut_text(data: bytes, start: int) -> Cut[str]:
    if data[start] != ord("$"):
        found = data.find(b"$", start)
        return Cut((found if found >= 0 else len(data)) - start)
    end = data.find(b"\n", start)
    again = data.find(b"$", start + 1, end if end >= 0 else len(data))
    if again >= 0:
        return Cut(again - start, None, INCOMPLETE)
    if end < 0:
        return Cut(0)
    body, star, given = data[start + 1 : end].rstrip(b"\r").rpartition(b"*")
    text = body.decode("latin-1")
    reason = _fault(text, given) if star else "no checksum"
    return Cut(end + 1 - start, None if reason else text, reason)


def _fault(text: str, given: bytes) -> str:
    """Return what is wrong with a line and the checksum given for it; nothing if all is well."""
    if not text.isascii() or not text.isprintable():
        return "bytes that are no text"
    return "" if given.upper() == b"%02X" % checksum(text) else "wrong checksum"
