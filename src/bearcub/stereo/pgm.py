"""Portable grey maps (Netpbm PGM), read and written byte by byte.

A reader of its own, because a disparity map needs what general image readers hide: the raw 16-bit
words whatever their byte order, and a plain sentence when a transfer has damaged the file.

References
----------
.. [1] Netpbm, "PGM Format Specification": ``P5``/``P2``, width, height, maxval, one white space,
   raster; two bytes a pixel, most significant first, where maxval is 256 or more.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import FormatError

_LARGEST_SIDE = 32768
_LARGEST_VALUE = 65535
_WHITE_SPACE = b" \t\r\n\v\f"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pgm:
    """One grey map.

    Attributes
    ----------
    values : ndarray of uint8 or uint16, shape (H, W)
        Grey values, 16-bit words taken as big-endian, as the format says.
    maxval : int
        The largest value the header allows.
    """

    values: NDArray[np.uint8] | NDArray[np.uint16]
    maxval: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    plain: bool
    width: int
    height: int
    maxval: int
    end: int  # offset of the raster's first byte


def parse_pgm(data: bytes, *, name: str, any_word: bool = False) -> Pgm:
    r"""Decode a PGM file, binary (P5) or plain (P2).

    Parameters
    ----------
    data : bytes
        The whole file.
    name : str
        What to call it in an error.
    any_word : bool
        Accept 16-bit words above maxval, which a file of the wrong byte order has.

    Returns
    -------
    Pgm

    Raises
    ------
    FormatError
        If `data` is not one complete PGM image; the sentence gives offset, expected and found.

    Examples
    --------
    >>> parse_pgm(b"P5 2 1 255 \x07\xff", name="two.pgm").values
    array([[  7, 255]], dtype=uint8)
    """
    header = _parse_header(data, name)
    values = _plain_raster(data, header, name) if header.plain else _raster(data, header, name)
    swapped_words = any_word and header.maxval > 255 and not header.plain
    if not swapped_words and int(values.max()) > header.maxval:
        row, column = np.argwhere(values > header.maxval)[0]
        raise FormatError(
            f"{name}: row {row}, column {column} holds {values[row, column]}, "
            f"more than the header's largest value {header.maxval}: the file is damaged"
        )
    if header.maxval < 256:
        return Pgm(values=values.astype(np.uint8), maxval=header.maxval)
    return Pgm(values=values.astype(np.uint16), maxval=header.maxval)


def encode_pgm(values: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """Encode grey values of shape (H, W) as a binary PGM, 8 or 16 bits by their type."""
    height, width = values.shape
    maxval = 255 if values.dtype == np.uint8 else _LARGEST_VALUE
    raster = values if values.dtype == np.uint8 else values.astype(">u2")
    return b"P5\n%d %d\n%d\n" % (width, height, maxval) + raster.tobytes()


def _parse_header(data: bytes, name: str) -> _Header:
    magic = data[:2]
    if magic not in (b"P5", b"P2"):
        raise FormatError(f"{name}: expected a PGM beginning with P5 or P2, found {magic!r}")
    offset, numbers = 2, []
    for what in ("width", "height", "largest value"):
        value, offset = _number(data, offset, what=what, name=name)
        numbers.append(value)
    width, height, maxval = numbers
    if not (0 < width <= _LARGEST_SIDE and 0 < height <= _LARGEST_SIDE):
        raise FormatError(
            f"{name}: the header says {width} x {height} pixels, "
            f"expected 1 to {_LARGEST_SIDE} each way"
        )
    if not 0 < maxval <= _LARGEST_VALUE:
        raise FormatError(f"{name}: largest value {maxval}, expected 1 to {_LARGEST_VALUE}")
    if data[offset : offset + 1] not in {bytes([c]) for c in _WHITE_SPACE}:
        found = data[offset : offset + 1]
        raise FormatError(
            f"{name}: offset {offset}: expected white space after the header, found {found!r}"
        )
    return _Header(plain=magic == b"P2", width=width, height=height, maxval=maxval, end=offset + 1)


def _number(data: bytes, offset: int, *, what: str, name: str) -> tuple[int, int]:
    """Return the next decimal number of the header and the offset behind it."""
    start = _skip_blanks(data, offset)
    end = start
    while end < len(data) and data[end : end + 1].isdigit():
        end += 1
    digits = data[start:end]
    if start == offset or not 0 < len(digits) <= 9:
        raise FormatError(
            f"{name}: offset {start}: expected the {what} in decimal digits, "
            f"found {data[start : start + 8]!r}"
        )
    return int(digits), end


def _skip_blanks(data: bytes, offset: int) -> int:
    """Return the offset of the next byte that is neither white space nor in a comment."""
    while offset < len(data):
        if data[offset] in _WHITE_SPACE:
            offset += 1
        elif data[offset : offset + 1] == b"#":
            line_end = data.find(b"\n", offset)
            offset = len(data) if line_end < 0 else line_end + 1
        else:
            break
    return offset


def _raster(data: bytes, header: _Header, name: str) -> NDArray[np.uint8] | NDArray[np.uint16]:
    wide = header.maxval > 255
    expected = header.width * header.height * (2 if wide else 1)
    found = len(data) - header.end
    if found != expected:
        raise FormatError(_wrong_size(data, header, name=name, expected=expected, found=found))
    shape = (header.height, header.width)
    if wide:
        return np.frombuffer(data, ">u2", offset=header.end).astype(np.uint16).reshape(shape)
    return np.frombuffer(data, np.uint8, offset=header.end).reshape(shape)


def _wrong_size(data: bytes, header: _Header, *, name: str, expected: int, found: int) -> str:
    """Say what most likely happened to a raster of the wrong length."""
    size = (
        f"{name}: {header.width} x {header.height} pixels of {header.maxval} need {expected} "
        f"bytes from offset {header.end}, found {found}"
    )
    raster = data[header.end :]
    # The line feed of the header's last CR LF lies in front of the raster and counts as found.
    pairs = data[header.end - 1 :].count(b"\r\n")
    if found > expected and pairs == found - expected:
        return (
            f"{size}: {pairs} line feeds were turned into CR LF by a text-mode transfer; "
            "copy the file again in binary mode"
        )
    if found > expected:
        return f"{size}: {found - expected} bytes too many"
    missing = expected - found
    if missing <= raster.count(b"\n") and b"\r\n" not in data and missing * 1000 < expected:
        return (
            f"{size}: {missing} are missing and no CR LF is left, as after a text-mode transfer; "
            "copy the file again in binary mode"
        )
    return f"{size}: the file is truncated, {missing} bytes are missing"


def _plain_raster(data: bytes, header: _Header, name: str) -> NDArray[np.uint16]:
    words = data[header.end :].split()
    expected = header.width * header.height
    if len(words) != expected:
        raise FormatError(
            f"{name}: {header.width} x {header.height} pixels need {expected} numbers "
            f"from offset {header.end}, found {len(words)}"
        )
    for index, word in enumerate(words):
        if not word.isdigit() or len(word) > 9 or int(word) > _LARGEST_VALUE:
            raise FormatError(
                f"{name}: pixel {index} of the plain raster: expected a number up to "
                f"{_LARGEST_VALUE}, found {word[:12]!r}"
            )
    values = np.array([int(word) for word in words], dtype=np.uint16)
    return values.reshape(header.height, header.width)
