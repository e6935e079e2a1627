"""Disparity and depth files in, disparity files out.

Every reader ends in the one internal form: float32 pixels, NaN where unmatched, 0 at infinity.
What the numbers of a file mean is decided in `bearcub.stereo.encodings`.
"""

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import FormatError, InputError
from bearcub.messages import Float32
from bearcub.stereo.encodings import MANY_JUMPS, Encoding, decode, encode, read_both_ways
from bearcub.stereo.pfm import encode_pfm, parse_pfm
from bearcub.stereo.pgm import encode_pgm, parse_pgm

ByteOrder = Literal["auto", "big", "little"]

_LARGEST_ARRAY = 1 << 28  # pixels; a file that claims more is damaged
_TELLING = 64  # pixels from which on jumps tell a wrong byte order

# What NumPy and zipfile raise for bytes that are not theirs.
_NOT_NUMPY = (
    ValueError,
    EOFError,
    OSError,
    RuntimeError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityFile:
    """What a file held, and how it was understood.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched, 0 at infinity; before the rig's `doffs` is added.
    encoding : Encoding
        As read, never `Encoding.AUTO`.
    note : str
        One line for the user on what had to be guessed, or on what was asked for but looks wrong;
        empty when there is neither.
    """

    disparity: Float32
    encoding: Encoding
    note: str = ""


def read_disparity(
    path: Path,
    *,
    encoding: Encoding | str = Encoding.AUTO,
    byte_order: ByteOrder = "auto",
    offset: float = 0.0,
    minimum: int = 0,
    scale: float = 1.0,
    focal_baseline: float = math.nan,
) -> DisparityFile:
    """Read a disparity map, or a depth image, from a file.

    By itself (`Encoding.AUTO`) an 8-bit PGM is taken for Point Grey's 8 bits, a 16-bit PGM for
    its 8.8 fixed point, a 16-bit PNG for KITTI's disparity, int16 for OpenCV's sixteenths and
    floats for pixels; whatever else must be named.

    Parameters
    ----------
    path : Path
        A ``.pgm``, ``.png``, ``.tif``, ``.tiff``, ``.pfm``, ``.npy`` or ``.npz`` file.
    encoding : Encoding or str
        What the numbers mean; see the table in `Encoding`.
    byte_order : {"auto", "big", "little"}
        Of a 16-bit PGM; `auto` decides for 8.8 words by what can be a disparity map.
    offset : float
        Added to every disparity [px]: the smallest disparity of a Triclops extended range.
    minimum : int
        OpenCV's ``minDisparity`` [px], for `Encoding.OPENCV16`.
    scale : float
        Stored units a pixel, for `Encoding.INTEGER` (4 for Middlebury's quarter-size maps).
    focal_baseline : float
        ``fx B`` [px m], needed for depths.

    Returns
    -------
    DisparityFile

    Raises
    ------
    FormatError
        If the file is not what its suffix, `encoding` or `byte_order` says, or is damaged.
    InputError
        If it cannot be read, or `encoding` is unknown or lacks a number.
    """
    wanted = as_encoding(encoding)
    values, found, notes = _read_values(path, _bytes_of(path), wanted, byte_order)
    disparity = decode(
        values,
        found,
        name=str(path),
        minimum=minimum,
        scale=scale,
        focal_baseline=focal_baseline,
    )
    disparity += np.float32(offset)
    disparity.flags.writeable = False
    return DisparityFile(disparity=disparity, encoding=found, note=notes)


def write_disparity(path: Path, disparity: Float32, *, encoding: Encoding | str) -> None:
    """Write a disparity map; the suffix of `path` must be the encoding's own.

    `pointgrey8` and `pointgrey16` go to ``.pgm``, `kitti` to ``.png`` and `pixels` to ``.pfm``
    or ``.npy``.

    Raises
    ------
    InputError
        If the encoding cannot be written, cannot hold a disparity, does not belong to the
        suffix, or the file cannot be written.
    """
    wanted = as_encoding(encoding)
    codes = encode(disparity, wanted, name=str(path))
    writers: dict[tuple[Encoding, str], Callable[[NDArray[Any]], bytes]] = {
        (Encoding.POINTGREY8, ".pgm"): encode_pgm,
        (Encoding.POINTGREY16, ".pgm"): encode_pgm,
        (Encoding.KITTI, ".png"): _encode_png,
        (Encoding.PIXELS, ".npy"): _encode_npy,
        (Encoding.PIXELS, ".pfm"): _encode_unknown_as_infinity,
    }
    suffix = path.suffix.lower()
    if (wanted, suffix) not in writers:
        fitting = " or ".join(s for e, s in writers if e is wanted)
        raise InputError(f"{path}: {wanted} is written to {fitting}, not to {suffix!r}")
    try:
        path.write_bytes(writers[wanted, suffix](codes))
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error


def as_encoding(encoding: Encoding | str) -> Encoding:
    """Return the encoding of that name.

    Raises
    ------
    InputError
        If there is none.
    """
    try:
        return Encoding(encoding)
    except ValueError as error:
        raise InputError(f"encoding {encoding!r}: expected one of {', '.join(Encoding)}") from error


def _bytes_of(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if not data:
        raise FormatError(f"{path}: the file is empty")
    return data


def _read_values(
    path: Path, data: bytes, wanted: Encoding, byte_order: ByteOrder
) -> tuple[NDArray[Any], Encoding, str]:
    """Return the stored values, their encoding and what was guessed."""
    name, suffix = str(path), path.suffix.lower()
    if suffix == ".pgm":
        return _read_pgm(data, wanted, byte_order, name=name)
    values = _load(data, suffix, name=name)
    if wanted is not Encoding.AUTO:
        return values, wanted, ""
    if suffix == ".png" and values.dtype == np.uint16:
        note = "16-bit PNG read as KITTI disparity; millimetres of depth need encoding depth_mm"
        return values, Encoding.KITTI, note
    if np.issubdtype(values.dtype, np.floating):
        return values, Encoding.PIXELS, ""
    if values.dtype == np.int16:
        return values, Encoding.OPENCV16, "int16 read as OpenCV's sixteenths of a pixel"
    choices = ", ".join(e for e in Encoding if e is not Encoding.AUTO)
    raise InputError(
        f"{name}: {values.dtype.name} values can mean several things: name the encoding ({choices})"
    )


def _read_pgm(
    data: bytes, wanted: Encoding, byte_order: ByteOrder, *, name: str
) -> tuple[NDArray[Any], Encoding, str]:
    pgm = parse_pgm(data, name=name, any_word=True)
    wide = pgm.values.dtype == np.uint16
    found = wanted
    if wanted is Encoding.AUTO:
        found = Encoding.POINTGREY16 if wide else Encoding.POINTGREY8
    if not wide or data.startswith(b"P2"):
        return pgm.values, found, ""
    words = pgm.values.astype(np.uint16)
    if found is not Encoding.POINTGREY16:
        return words.byteswap() if byte_order == "little" else words, found, ""
    order, note = _settle_order(words, byte_order, name=name)
    return words.byteswap() if order == "little" else words, found, note


def _settle_order(
    words: NDArray[np.uint16], wanted: ByteOrder, *, name: str
) -> tuple[ByteOrder, str]:
    """Return the byte order to read in, and a note; raise when it cannot be the one wanted."""
    big, little = read_both_ways(words)
    likely: ByteOrder = "little" if little < big else "big"
    if wanted == "auto":
        return likely, f"read as {likely}-endian"
    if wanted == likely:
        return wanted, ""
    asked, other = (big, little) if wanted == "big" else (little, big)
    telling = words.size >= _TELLING and other.jumps < asked.jumps / 2
    if telling and asked.jumps > MANY_JUMPS:
        raise FormatError(
            f"{name}: read as {wanted}-endian, as asked for, {100 * asked.jumps:.0f} % of the "
            f"disparities jump from their neighbours, expected at most {100 * MANY_JUMPS:.0f} %; "
            f"it looks like {likely}-endian, where {100 * other.jumps:.0f} % do"
        )
    if other.fractional == asked.fractional and other.jumps > asked.jumps - 0.1:
        return wanted, ""  # a guess no better than the user's
    note = f"looks like {likely}-endian; read as {wanted}-endian because it was asked for"
    return wanted, note


def _load(data: bytes, suffix: str, *, name: str) -> NDArray[Any]:
    if suffix == ".pfm":
        return parse_pfm(data, name=name)
    if suffix in (".npy", ".npz"):
        return _load_numpy(data, name=name)
    if suffix in (".png", ".tif", ".tiff"):
        return _load_image(data, name=name)
    raise InputError(
        f"{name}: expected a disparity file ending in .pgm, .png, .tif, .tiff, .pfm, .npy or .npz"
    )


def _load_numpy(data: bytes, *, name: str) -> NDArray[Any]:
    try:
        if data.startswith(b"PK"):
            return _only_member(data, name=name)
        return _array(io.BytesIO(data), size=len(data), name=name)
    except FormatError:
        raise
    except _NOT_NUMPY as error:
        raise FormatError(f"{name}: is not a NumPy array: {error}") from error


def _only_member(data: bytes, *, name: str) -> NDArray[Any]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        if len(members) != 1:
            raise FormatError(f"{name}: expected one array, found {len(members)}")
        with archive.open(members[0]) as member:
            return _array(member, size=members[0].file_size, name=name)


def _array(file: Any, *, size: int, name: str) -> NDArray[Any]:
    """Read one array whose header claims no more bytes than the file has."""
    version = np.lib.format.read_magic(file)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise FormatError(f"{name}: NumPy format {version}, expected (1, 0) or (2, 0)")
    shape, fortran, dtype = readers[version](file)
    if dtype.kind not in "iuf" or len(shape) != 2:
        raise FormatError(
            f"{name}: expected an array of numbers of shape (H, W), found {shape} of {dtype}"
        )
    expected = math.prod(shape) * dtype.itemsize
    if not 0 < expected <= min(size, _LARGEST_ARRAY * dtype.itemsize):
        raise FormatError(f"{name}: {shape} of {dtype} need {expected} bytes, the file has {size}")
    raster = file.read(expected)
    if len(raster) != expected:
        raise FormatError(
            f"{name}: {shape} of {dtype} need {expected} bytes, found {len(raster)}: truncated"
        )
    values = np.frombuffer(raster, dtype).reshape(shape, order="F" if fortran else "C")
    return np.ascontiguousarray(values, dtype=dtype.newbyteorder("="))


def _load_image(data: bytes, *, name: str) -> NDArray[Any]:
    if data.startswith(b"\x89PNG"):
        _check_png(data, name=name)
    try:
        values = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise FormatError(f"{name}: cannot be decoded as an image: {error.err}") from error
    if values is None:
        raise FormatError(f"{name}: cannot be decoded as an image, it begins with {data[:8]!r}")
    return np.asarray(values)


def _check_png(data: bytes, *, name: str) -> None:
    """Raise for a PNG that is absurdly large, cut or altered; the decoder would fill in zeros."""
    width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if not 0 < width * height <= _LARGEST_ARRAY:
        raise FormatError(f"{name}: the header says {width} x {height} pixels")
    offset, kind = 8, b""
    while kind != b"IEND":
        length = int.from_bytes(data[offset : offset + 4], "big")
        kind, end = data[offset + 4 : offset + 8], offset + 8 + length
        if end + 4 > len(data):
            raise FormatError(
                f"{name}: offset {offset}: the chunk {kind!r} needs {length} bytes and a "
                f"checksum, the file has {len(data)} bytes in all: truncated"
            )
        if zlib.crc32(data[offset + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            raise FormatError(
                f"{name}: offset {offset}: the chunk {kind!r} contradicts its checksum: "
                "the file is damaged"
            )
        offset = end + 4


def _encode_png(values: NDArray[Any]) -> bytes:
    return bytes(cv2.imencode(".png", values)[1].tobytes())


def _encode_npy(values: NDArray[Any]) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, values)
    return buffer.getvalue()


def _encode_unknown_as_infinity(values: NDArray[Any]) -> bytes:
    return encode_pfm(np.where(np.isnan(values), np.inf, values).astype(np.float32))
