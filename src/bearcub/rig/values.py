"""Numbers and keys out of files that anybody may have written."""

import math
import re
import reprlib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np
import yaml

from bearcub.errors import BearcubError, CalibrationError, FormatError
from bearcub.rig.camera import Camera, Lens

Document = Mapping[str, Any]
"""A parsed YAML file: nested dictionaries and lists, every scalar still text."""

LARGEST_NUMBER = 1e9
"""No calibration has a larger one; below it no product of three overflows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """What a calibration file gave.

    Attributes
    ----------
    camera : Camera
        The rectified pair; not yet checked.
    lenses : tuple of Lens, or None
        The raw left and right camera, where there is something to rectify.
    mount : mapping of str to float
        The ``[mount]`` table, empty in formats without one.
    source : str
        The file or files, for messages.
    """

    camera: Camera
    lenses: tuple[Lens, Lens] | None = None
    mount: Mapping[str, float] = field(default_factory=dict)
    source: str = ""


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Add the file's name to the project's errors raised inside."""
    try:
        yield
    except BearcubError as error:
        if not source:
            raise
        raise type(error)(f"{error} (in {source})") from None


def number(value: object, name: str) -> float:
    """Return a number given as such or as text.

    Raises
    ------
    FormatError
        If it is none, not finite, or larger than any calibration's.
    """
    try:
        result = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        result = math.nan
    if not abs(result) <= LARGEST_NUMBER:
        raise FormatError(f"{name} = {reprlib.repr(value)}: expected a finite number")
    return result


def numbers(value: object, name: str, *counts: int) -> tuple[float, ...]:
    """Return a matrix or list, nested or flat or OpenCV's ``{data: [...]}``, row by row.

    Raises
    ------
    FormatError
        If it is no list of numbers or has a length that is none of `counts`.
    """
    data = value.get("data") if isinstance(value, dict) else value
    rows = data if isinstance(data, list | tuple) else [data]
    flat: list[Any] = []
    for row in rows:
        flat.extend(row if isinstance(row, list | tuple) else [row])
    if len(flat) not in counts:
        expected = " or ".join(str(count) for count in counts)
        raise FormatError(
            f"{name}: expected {expected} numbers, found {len(flat)}: {reprlib.repr(value)}"
        )
    return tuple(number(item, name) for item in flat)


def rotation(value: object, name: str) -> tuple[float, ...]:
    """Return the nine numbers of a rotation matrix.

    Raises
    ------
    FormatError
        If they are none.
    CalibrationError
        If they are not those of a rotation.
    """
    entries = numbers(value, name, 9)
    matrix = np.array(entries).reshape(3, 3)
    near_one = bool(np.allclose(matrix @ matrix.T, np.eye(3), rtol=0.0, atol=1e-3))
    if not near_one or np.linalg.det(matrix) < 0.0:
        raise CalibrationError(f"{name} = {reprlib.repr(entries)}: expected a rotation matrix")
    return entries


def distortion(value: object, model: object, name: str) -> tuple[str, tuple[float, ...]]:
    """Return a distortion model by its name in this project, and its coefficients.

    Raises
    ------
    FormatError
        If the model is unknown or has another number of coefficients.
    """
    known = _MODELS.get(model) if isinstance(model, str) else None
    if known is None:
        raise FormatError(
            f"distortion model {reprlib.repr(model)}: expected one of {', '.join(_MODELS)}"
        )
    if known == "none":
        return "plumb_bob", ()
    return known, numbers(value, name, *_COEFFICIENTS[known])


_MODELS = {
    "plumb_bob": "plumb_bob",
    "radtan": "plumb_bob",
    "rational_polynomial": "rational_polynomial",
    "equidistant": "equidistant",
    "fisheye": "equidistant",
    "none": "none",
}
_COEFFICIENTS = {
    "plumb_bob": (0, 4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant": (0, 4),
}


def whole(value: object, name: str) -> int:
    """Return a whole number, not negative.

    Raises
    ------
    FormatError
        If it is none.
    """
    result = number(value, name)
    if result < 0.0 or not result.is_integer():
        raise FormatError(f"{name} = {reprlib.repr(value)}: expected a whole number, 0 or more")
    return int(result)


def named_lines(text: str, separator: str) -> list[tuple[str, str]]:
    r"""Return the name and the rest of every line; the name is empty where there is none.

    Examples
    --------
    >>> named_lines("P0: 1 2\n3 4", ":")
    [('P0', '1 2'), ('', '3 4')]
    """
    lines = [line if separator in line else separator + line for line in text.splitlines()]
    parts = [line.partition(separator) for line in lines if line.strip() != separator]
    return [(name.strip(), rest.strip()) for name, _, rest in parts]


def lookup(found: Mapping[str, Any], *names: str) -> Any:
    """Return the value of the first of `names` that is there.

    Raises
    ------
    CalibrationError
        If none is, naming the key that looks most like the first one.
    """
    for name in names:
        if name in found:
            return found[name]
    raise CalibrationError(f"{names[0]} is missing{_nearest(names[0], found)}")


def _nearest(name: str, found: Collection[str]) -> str:
    near = get_close_matches(name, [key for key in found if len(key) < 80], n=1, cutoff=0.8)
    return f": is {near[0]} meant to be it?" if near else ""


def parse_yaml(text: str) -> Document:
    """Return the first document of a YAML text, every scalar still as text.

    OpenCV writes ``%YAML:1.0``, which is no YAML directive, and tags its matrices; PyYAML's base
    loader ignores tags, builds no objects, and leaves numbers such as ``1e5`` to `float`.

    Raises
    ------
    FormatError
        If it is no YAML, or no mapping.
    """
    try:
        loader = yaml.BaseLoader(re.sub(r"\A\s*%YAML[: ].*", "", text))
        document = loader.get_data()
    except yaml.MarkedYAMLError as error:
        line = f" at line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FormatError(f"is not valid{line}: {error.problem}") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise FormatError(f"is not valid: {str(error).splitlines()[0]}") from None
    if not isinstance(document, dict):
        raise FormatError("has no named values")
    return document
