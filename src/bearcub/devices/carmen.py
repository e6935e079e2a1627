"""Scans of CARMEN logs (``.clf``, also ``.clf.bz2``), as robots with a SICK LMS recorded them.

A log is text, one message a line. ``FLASER`` has the ranges alone, ``RAWLASER1`` and
``ROBOTLASER1`` also say what scanner it was.
"""

import bz2
import functools
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from bearcub.clock import Clock
from bearcub.devices.images import require_file
from bearcub.devices.replay import Replay
from bearcub.errors import FormatError
from bearcub.messages import Float64, Scan

_FIELDS_OF_VIEW = {  # readings: first beam [deg], step [deg]; without a last beam as robots had it
    101: (-50.0, 1.0),
    180: (-90.0, 1.0),
    181: (-90.0, 1.0),
    201: (-50.0, 0.5),
    360: (-90.0, 0.5),
    361: (-90.0, 0.5),
    401: (-50.0, 0.25),
}
_CODES = 81.83  # 0x1FF7 cm and above: what the LMS sends instead of a distance [m]
_AFTER_READINGS = 9  # pose, odometry, stamp, host, logger's stamp
_SETTINGS = 8  # type, start, field of view, step, farthest, accuracy, remission mode, count


def read_carmen(path: Path, *, no_return: float = 50.0) -> Iterator[tuple[float, Scan]]:
    """Walk through the scans of a log, in its order.

    Parameters
    ----------
    path : Path
    no_return : float, optional
        The range [m] that a ``FLASER`` message gives a beam that met nothing, exactly; it becomes
        +inf, as do the scanner's own codes from 81.83 m on.

    Yields
    ------
    seconds : float
        The message's stamp [s]; not always ascending.
    scan : Scan
        REP-117; 0 is -inf, too close.

    Raises
    ------
    InputError
        If there is no such file.
    FormatError
        If a line is not what it begins as, or the file is cut off.
    """
    require_file(path)
    decode: dict[str, Callable[[list[str]], tuple[float, Scan]]] = {
        "FLASER": functools.partial(_flaser, no_return=no_return),
        "RAWLASER1": _laser1,
        "ROBOTLASER1": _laser1,
    }
    for number, line in _lines(path):
        kind, _, rest = line.rstrip().partition(" ")
        if kind not in decode:
            continue
        try:
            yield decode[kind](rest.split())
        except (ValueError, IndexError) as error:
            raise FormatError(f"{path}, line {number}: no whole {kind} message: {error}") from error


def open_carmen(path: Path, *, clock: Clock, no_return: float = 50.0) -> Replay[Scan]:
    """Return the scans of a log as a source that gives each when its time has come.

    Parameters
    ----------
    path : Path
    clock : Clock
    no_return : float, optional
        See `read_carmen`.

    Raises
    ------
    InputError, FormatError
        As `read_carmen`; also if there is no scan in it.
    """
    scans = sorted(read_carmen(path, no_return=no_return), key=lambda stamped: stamped[0])
    if not scans:
        raise FormatError(f"{path}: holds no scan; expected FLASER, RAWLASER1 or ROBOTLASER1 lines")
    first, last = scans[0][0], scans[-1][0]
    rate_hz = (len(scans) - 1) / (last - first) if last > first else 1.0
    return Replay(
        [(seconds - first, scan) for seconds, scan in scans],
        clock=clock,
        rate_hz=rate_hz,
        name=f"ladar ({path})",
    )


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    opener = bz2.open if path.suffix == ".bz2" else open
    try:
        with opener(path, "rt", encoding="ascii", errors="replace") as file:
            yield from enumerate(file, 1)
    except (OSError, EOFError) as error:
        raise FormatError(
            f"{path}: cannot be unpacked, it is damaged or cut off: {error}"
        ) from None


def _flaser(words: list[str], *, no_return: float) -> tuple[float, Scan]:
    count = int(words[0])
    if count not in _FIELDS_OF_VIEW:
        raise ValueError(
            f"{count} readings, expected one of {', '.join(map(str, _FIELDS_OF_VIEW))}"
        )
    if len(words) != 1 + count + _AFTER_READINGS:
        raise ValueError(f"{len(words)} values, expected {1 + count + _AFTER_READINGS}")
    ranges = np.array(list(map(float, words[1 : 1 + count])))
    ranges[ranges == no_return] = math.inf
    start_deg, step_deg = _FIELDS_OF_VIEW[count]
    return float(words[-3]), _scan(
        ranges, _angles(math.radians(start_deg), math.radians(step_deg), count), _CODES
    )


def _laser1(words: list[str]) -> tuple[float, Scan]:
    start, step, farthest = float(words[1]), float(words[3]), float(words[4])
    count = int(words[_SETTINGS - 1])
    n_remissions = int(words[_SETTINGS + count])
    if count < 0 or len(words) < _SETTINGS + count + 1 + n_remissions + 3:
        raise ValueError(f"{len(words)} values for {count} readings")
    ranges = np.array(list(map(float, words[_SETTINGS : _SETTINGS + count])))
    return float(words[-3]), _scan(ranges, _angles(start, step, count), farthest)


@functools.lru_cache(maxsize=16)
def _angles(start: float, step: float, count: int) -> Float64:
    with np.errstate(all="ignore"):  # a `Scan` refuses what is not finite
        angles: Float64 = start + step * np.arange(count, dtype=np.float64)
    return angles


def _scan(ranges: Float64, angles: Float64, farthest: float) -> Scan:
    ranges[ranges >= farthest] = math.inf
    ranges[ranges == 0] = -math.inf
    ranges[(ranges < 0) & np.isfinite(ranges)] = math.nan
    with np.errstate(over="ignore"):  # beyond what a float32 holds is beyond reach
        short = ranges.astype(np.float32)
    return Scan(ranges=short, angles=angles, farthest=farthest)
