"""The laser scan of a pothole's mould: how deep and how wide the pothole is."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bearcub.errors import FormatError, InputError
from bearcub.messages import Float64

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "<i2",
    "ushort": "<u2",
    "int": "<i4",
    "uint": "<u4",
    "float": "<f4",
    "double": "<f8",
}
_TOP = 99.9  # percentile taken for the top: a few points of a scan fly above the surface


@dataclass(frozen=True, slots=True, kw_only=True)
class Mould:
    """A pothole's size [m].

    Attributes
    ----------
    depth : float
    narrowest, widest : float
        Extent of its mouth across the directions in which it is smallest and largest. A scan does
        not say from which side a camera looked.
    """

    depth: float
    narrowest: float
    widest: float


def read_points(path: Path) -> Float64:
    """Read the vertices of a binary PLY.

    Returns
    -------
    ndarray of float64, shape (N, 3)
        In the file's unit.

    Raises
    ------
    InputError
        If the file cannot be read.
    FormatError
        If it is not a little-endian binary PLY with x, y and z, or is cut off.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    head, mark, body = data.partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    if not mark or lines[:1] != [["ply"]] or ["format", "binary_little_endian", "1.0"] not in lines:
        raise FormatError(f"{path}: expected a binary little-endian PLY with a header")
    count, vertex = _vertex(lines, path)
    if len(body) < count * vertex.itemsize:
        raise FormatError(
            f"{path}: {len(body)} bytes after the header, expected {count} vertices of "
            f"{vertex.itemsize} bytes: the file is cut off"
        )
    points = np.frombuffer(body, dtype=vertex, count=count)
    return np.stack([points[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _vertex(lines: list[list[str]], path: Path) -> tuple[int, np.dtype[np.void]]:
    """Return the number and the layout of the vertices, which must come first."""
    elements = [k for k, words in enumerate(lines) if words[:1] == ["element"]]
    first = lines[elements[0]] if elements else []
    if len(first) != 3 or first[1] != "vertex" or not first[2].isdecimal():
        raise FormatError(f"{path}: expected `element vertex N` as the first element of the PLY")
    end = elements[1] if len(elements) > 1 else len(lines)
    fields = [words[1:] for words in lines[elements[0] : end] if words[:1] == ["property"]]
    known = all(len(f) == 2 and f[0] in _TYPES for f in fields)
    if not known or not {"x", "y", "z"} <= {f[-1] for f in fields}:
        raise FormatError(f"{path}: expected vertices of plain numbers with x, y and z")
    return int(first[2]), np.dtype([(name, _TYPES[kind]) for kind, name in fields])


def measure(points: Float64, *, unit: float = 0.001) -> Mould:
    """Return the size of the pothole from its mould.

    The mould stands on the face that was level with the road, at z = 0, as the scanner's turntable
    carried it: its height is the pothole's depth and its outline the pothole's mouth.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 3)
        z up.
    unit : float
        Metres per unit of `points`.

    Examples
    --------
    A block of 80 x 60 x 40 mm is 60 mm across one way and 100 mm across its diagonal.

    >>> corners = np.array([[x, y, z] for x in (0, 80) for y in (0, 60) for z in (0, 40.0)])
    >>> block = measure(corners)
    >>> print(f"{block.depth:.3f} {block.narrowest:.3f} {block.widest:.3f}")
    0.040 0.060 0.100
    """
    angles = np.radians(np.arange(0.0, 180.0))
    across = points[:, :2] @ np.stack([np.cos(angles), np.sin(angles)])
    extents = np.ptp(across, axis=0)
    return Mould(
        depth=float(np.percentile(points[:, 2], _TOP)) * unit,
        narrowest=float(extents.min()) * unit,
        widest=float(extents.max()) * unit,
    )
