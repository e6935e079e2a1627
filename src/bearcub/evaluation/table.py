"""What was measured against what was promised, as a table for people, Markdown and JSON."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rich.table import Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One measured number and the limit it was promised to keep.

    Attributes
    ----------
    measure : str
        What was measured.
    value : float
        NaN where it could not be measured, which keeps no limit.
    unit : str
        Of `value` and `limit`.
    limit : float or None
        None when the number is for information.
    sense : {"at most", "at least"}
        On which side of the limit `value` must be.
    note : str
        Where it is worst, or what is behind it.
    """

    measure: str
    value: float
    unit: str = ""
    limit: float | None = None
    sense: Literal["at most", "at least"] = "at most"
    note: str = ""

    @property
    def passed(self) -> bool | None:
        """Whether the limit was kept; None without a limit."""
        if self.limit is None:
            return None
        kept = self.value <= self.limit if self.sense == "at most" else self.value >= self.limit
        return bool(kept)

    @property
    def target(self) -> str:
        """The limit in words; empty without one.

        Examples
        --------
        >>> Row(measure="height error", value=2.0, unit="%", limit=5.0).target
        'at most 5 %'
        """
        return "" if self.limit is None else f"{self.sense} {_quantity(self.limit, self.unit)}"

    @property
    def reached(self) -> str:
        """The value in words; a dash where it could not be measured."""
        return _quantity(self.value, self.unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """The rows of one set, or the reason why there are none.

    Attributes
    ----------
    name : str
        Short, as on the command line.
    title : str
        For a heading.
    about : str
        How truth and numbers are defined.
    rows : tuple of Row
    skipped : str
        Why nothing was measured; empty when it was.
    """

    name: str
    title: str
    about: str
    rows: tuple[Row, ...] = ()
    skipped: str = ""

    @property
    def missed(self) -> tuple[Row, ...]:
        """The rows that do not keep their limit."""
        return tuple(row for row in self.rows if row.passed is False)


def to_dict(sections: Iterable[Section]) -> dict[str, Any]:
    """Return the sections as one JSON-able object (``bearcub.accuracy/1``).

    A number that is not known is None.
    """
    return {
        "schema": "bearcub.accuracy/1",
        "rows": [
            {
                "set": section.name,
                "measure": row.measure,
                "value": round(row.value, 4) if math.isfinite(row.value) else None,
                "unit": row.unit,
                "target": row.target or None,
                "passed": row.passed,
                "note": row.note,
            }
            for section in sections
            for row in section.rows
        ],
        "skipped": {s.name: s.skipped for s in sections if s.skipped},
    }


def to_markdown(sections: Sequence[Section], *, command: str) -> str:
    """Return the sections as Markdown, with the command that remakes them above.

    Examples
    --------
    >>> row = Row(measure="false obstacles", value=0, limit=1, note="51 frames")
    >>> road = Section(name="road", title="Road", about="A drive.", rows=(row,))
    >>> print(to_markdown([road], command="bearcub evaluate real DATA"))
        bearcub evaluate real DATA
    <BLANKLINE>
    ### Road
    <BLANKLINE>
    A drive.
    <BLANKLINE>
    | measure | reached | promised | | |
    |---|---|---|---|---|
    | false obstacles | 0 | at most 1 | kept | 51 frames |
    """
    blocks = [f"    {command}"]
    for section in sections:
        blocks += [f"### {section.title}", section.about]
        blocks.append(f"Skipped: {section.skipped}." if section.skipped else _grid(section.rows))
    return "\n\n".join(blocks)


def to_rich(section: Section) -> Table:
    """Return one section as a table for the terminal."""
    table = Table(title=section.title, title_justify="left", expand=True)
    table.add_column("measure", ratio=5)
    table.add_column("reached", justify="right", ratio=2)
    table.add_column("promised", ratio=3)
    table.add_column("", width=6, no_wrap=True)
    table.add_column("", style="dim", ratio=6)
    for row in section.rows:
        colour = {True: "green", False: "bold red", None: ""}[row.passed]
        table.add_row(
            row.measure, row.reached, row.target, _verdict(row), row.note, style=colour or None
        )
    if section.skipped:
        table.add_row("skipped", "", "", "", section.skipped)
    return table


def _grid(rows: Iterable[Row]) -> str:
    lines = ["| measure | reached | promised | | |", "|---|---|---|---|---|"]
    for row in rows:
        cells = (row.measure, row.reached, row.target, _verdict(row), row.note)
        lines.append("| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |")
    return "\n".join(lines)


def _verdict(row: Row) -> str:
    return {True: "kept", False: "MISSED", None: ""}[row.passed]


def _quantity(value: float, unit: str) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:.3g} {unit}".strip() if abs(value) < 100 else f"{value:.0f} {unit}".strip()
