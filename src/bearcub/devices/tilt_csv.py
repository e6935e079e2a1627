"""Tilt readings in a file: one line of pitch and roll in degrees for every frame."""

import math
from pathlib import Path

from bearcub.errors import InputError
from bearcub.messages import Tilt

HEADER = "pitch_deg,roll_deg"


def parse_degrees(text: str) -> float:
    """Return an angle that a user wrote in degrees.

    Raises
    ------
    InputError
        If it is not a plain number, or not between -90 and 90.

    Examples
    --------
    >>> parse_degrees(" -12.5")
    -12.5
    >>> parse_degrees("0.2rad")
    Traceback (most recent call last):
    bearcub.errors.InputError: '0.2rad': expected degrees as a plain number such as 12.5
    """
    try:
        degrees = float(text)
    except ValueError:
        raise InputError(f"{text!r}: expected degrees as a plain number such as 12.5") from None
    if not abs(degrees) <= 90.0:
        raise InputError(f"{text.strip()}: expected degrees between -90 and 90")
    return degrees


def read_tilts(path: Path) -> list[Tilt | None]:
    """Read one tilt a frame from a CSV of pitch and roll in degrees.

    A line is ``pitch,roll``; a line whose two fields are empty (``,``) is a frame without a
    reading. A first line that holds names, blank lines and lines after ``#`` are left out.

    Raises
    ------
    InputError
        If the file cannot be read or a line is neither, naming the line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not text (UTF-8)") from error
    rows = [(number, line.strip()) for number, line in enumerate(lines, 1)]
    rows = [(number, line) for number, line in rows if line and not line.startswith("#")]
    if rows and rows[0][1].replace(" ", "").casefold() in {"pitch,roll", HEADER}:
        rows = rows[1:]
    if not rows:
        raise InputError(f"{path}: expected lines 'pitch,roll' in degrees, found none")
    return [_tilt_of_line(line, where=f"{path}: line {number}") for number, line in rows]


def format_tilt(tilt: Tilt | None) -> str:
    """Return the line of one frame, exact to a ten-thousandth of a degree.

    Examples
    --------
    >>> format_tilt(Tilt(pitch=0.0, roll=0.2)), format_tilt(None)
    ('0.0000,11.4592', ',')
    """
    if tilt is None:
        return ","
    return f"{math.degrees(tilt.pitch):.4f},{math.degrees(tilt.roll):.4f}"


def _tilt_of_line(line: str, *, where: str) -> Tilt | None:
    values = [field.strip() for field in line.split(",")]
    if len(values) != 2:
        raise InputError(f"{where}: {line!r}: expected 'pitch,roll' in degrees")
    if values == ["", ""]:
        return None
    try:
        pitch, roll = map(parse_degrees, values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Tilt(pitch=math.radians(pitch), roll=math.radians(roll))
