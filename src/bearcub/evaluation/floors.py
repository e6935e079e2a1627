"""Floors under the quick suite: what a change of the code must not fall below.

They are recorded from a measured run, with slack for other versions of the libraries and of the
software renderer: `tools/record_floors.py` writes the file.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from bearcub.errors import FormatError
from bearcub.evaluation.table import Row, Section

NAME = "sim_floors"
"""Of the section of the quick suite's floors."""

FILE = Path(__file__).parent / "floors.toml"

_POINTS = 5.0  # slack of a share [percentage points], or two things of those it counts
_THINGS = 2.0
_FACTOR = 1.3  # slack of an error or of a count
_LEAST = {"deg": 0.05, "%": 0.3, "": 1.0}  # and at least so much
_RANGE = 8.0  # slack of a coverage, to either side [percentage points]

Limit = float | tuple[float, float]


def slackened(row: Row) -> Limit | None:
    """Return the floor for a measured row; None where there is nothing to hold on to.

    Examples
    --------
    Two of 25 found less is no alarm:

    >>> slackened(
    ...     Row(measure="recall", value=96.0, unit="%", limit=98.0, sense="at least", count=25)
    ... )
    88.0
    """
    if row.limit is None or math.isnan(row.value):
        return None
    if isinstance(row.limit, tuple):
        low, high = min(row.value, row.limit[0]), max(row.value, row.limit[1])
        return round(max(low - _RANGE, 0.0), 2), round(min(high + _RANGE, 100.0), 2)
    if row.sense == "at least":
        things = 100.0 * _THINGS / row.count if row.count else 0.0
        return round(max(row.value - max(_POINTS, things), 0.0), 2)
    least = _LEAST.get(row.unit, 0.0)
    if not row.unit and row.count:  # false answers in 1,000 frames
        least = 1000.0 * _THINGS / row.count
    return round(max(_FACTOR * row.value, row.value + least), 4)


def read(path: Path = FILE) -> dict[str, Limit]:
    """Return the recorded floors by the rows' measures.

    Raises
    ------
    FormatError
        If the file cannot be read.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))["floors"]
    except (OSError, tomllib.TOMLDecodeError, KeyError) as error:
        raise FormatError(
            f"{path}: holds no floors: {error}; record them with tools/record_floors.py"
        ) from error
    return {name: tuple(v) if isinstance(v, list) else float(v) for name, v in table.items()}


def write(rows: Iterable[Row], path: Path = FILE) -> None:
    """Record the floors of measured rows."""
    lines = ["# Written by tools/record_floors.py: the quick suite must not fall below these.", ""]
    lines.append("[floors]")
    for row in rows:
        limit = slackened(row)
        if limit is not None:
            value = list(limit) if isinstance(limit, tuple) else limit
            lines.append(f'"{row.measure}" = {value}')
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def held(rows: Iterable[Row], floors: Mapping[str, Limit]) -> Section:
    """Return the rows with their floors in the place of what is promised.

    A row that has a floor and was not measured is missed.
    """
    measured = {row.measure: row for row in rows}
    unknown = Row(measure="", value=math.nan)
    return Section(
        name=NAME,
        title="Quick suite: recorded floors",
        about="What a change of the code must not fall below.",
        rows=tuple(
            replace(measured.get(name, unknown), measure=name, limit=limit, rivals={}, note="")
            for name, limit in floors.items()
        ),
    )
