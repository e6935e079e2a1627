"""What was measured against what was promised, as a table for people, Markdown and JSON."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
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
    limit : float, tuple of two floats or None
        None when the number is for information; two bound it from below and above.
    sense : {"at most", "at least"}
        On which side of a single limit `value` must be.
    note : str
        Where it is worst, or what is behind it.
    low, high : float
        Its 95 % confidence interval; NaN where it has none.
    count : int or None
        How many things or frames it rests on; None where that is not said.
    rivals : mapping of str to float
        The same number of each baseline; NaN for one that does not answer.
    """

    measure: str
    value: float
    unit: str = ""
    limit: float | tuple[float, float] | None = None
    sense: Literal["at most", "at least"] = "at most"
    note: str = ""
    low: float = math.nan
    high: float = math.nan
    count: int | None = None
    rivals: Mapping[str, float] = field(default_factory=dict)

    @property
    def passed(self) -> bool | None:
        """Whether the limit was kept; None without a limit."""
        if self.limit is None:
            return None
        if isinstance(self.limit, tuple):
            return bool(self.limit[0] <= self.value <= self.limit[1])
        kept = self.value <= self.limit if self.sense == "at most" else self.value >= self.limit
        return bool(kept)

    @property
    def best(self) -> bool | None:
        """Whether every baseline that answers is worse; None without baselines.

        Where nothing can be better (0, or 100 %), as good is good enough.
        """
        if not self.rivals:
            return None
        mine = self._badness(self.value)
        perfect = mine == (0.0 if self.sense == "at most" else -100.0)
        others = [self._badness(rival) for rival in self.rivals.values() if not math.isnan(rival)]
        return all(mine < other or (perfect and mine == other) for other in others)

    def _badness(self, value: float) -> float:
        """Return a number that is smaller the better `value` is."""
        if isinstance(self.limit, tuple):
            return abs(value - 0.5 * sum(self.limit))
        return value if self.sense == "at most" else -value

    @property
    def target(self) -> str:
        """The limit in words; empty without one.

        Examples
        --------
        >>> Row(measure="height error", value=2.0, unit="%", limit=5.0).target
        'at most 5 %'
        """
        if self.limit is None:
            return ""
        if isinstance(self.limit, tuple):
            return f"{self.limit[0]:g} to {_quantity(self.limit[1], self.unit)}"
        return f"{self.sense} {_quantity(self.limit, self.unit)}"

    @property
    def reached(self) -> str:
        """The value in words; a dash where it could not be measured."""
        return _quantity(self.value, self.unit)

    @property
    def interval(self) -> str:
        """The confidence interval in words; empty without one."""
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            return ""
        return f"{_short(self.low)} to {_short(self.high)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Figures for information, in more than one direction.

    Attributes
    ----------
    title : str
    columns : tuple of str
        The first heads the names of the lines.
    lines : tuple of tuple of str
    """

    title: str
    columns: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]


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
    grids : tuple of Grid
        What stands below the rows.
    """

    name: str
    title: str
    about: str
    rows: tuple[Row, ...] = ()
    skipped: str = ""
    grids: tuple[Grid, ...] = ()

    @property
    def missed(self) -> tuple[Row, ...]:
        """The rows that do not keep their limit."""
        return tuple(row for row in self.rows if row.passed is False)


def to_dict(sections: Iterable[Section]) -> dict[str, Any]:
    """Return the sections as one JSON-able object (``bearcub.accuracy/1``).

    A number that is not known is None.
    """
    kept = tuple(sections)
    return {
        "schema": "bearcub.accuracy/1",
        "rows": [
            {
                "set": section.name,
                "measure": row.measure,
                "value": _json_number(row.value),
                "unit": row.unit,
                "target": row.target or None,
                "passed": row.passed,
                "note": row.note,
                **_json_extent(row),
            }
            for section in kept
            for row in section.rows
        ],
        "grids": [
            {"set": section.name, "title": grid.title, "columns": grid.columns, "lines": grid.lines}
            for section in kept
            for grid in section.grids
        ],
        "skipped": {s.name: s.skipped for s in kept if s.skipped},
    }


def _json_extent(row: Row) -> dict[str, Any]:
    """Return the interval, the count and the baselines of a row that has them."""
    found: dict[str, Any] = {}
    if row.count is not None:
        found = {
            "low": _json_number(row.low),
            "high": _json_number(row.high),
            "count": row.count,
        }
    if row.rivals:
        found["rivals"] = {name: _json_number(value) for name, value in row.rivals.items()}
        found["best"] = row.best
    return found


def _json_number(value: float) -> float | None:
    return round(value, 4) if math.isfinite(value) else None


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
        if section.skipped:
            blocks.append(f"Skipped: {section.skipped}.")
        elif section.rows:
            columns = _columns(section)
            cells = [[column.show(row) for column in columns] for row in section.rows]
            blocks.append(_markdown([column.head for column in columns], cells))
        for grid in section.grids:
            blocks += [f"**{grid.title}**", _markdown(grid.columns, grid.lines)]
    return "\n\n".join(blocks)


def to_rich(section: Section) -> list[Table]:
    """Return one section as tables for the terminal, its grids after its rows.

    Beside baselines there is no room for the notes; Markdown and JSON have them.
    """
    tables = [_rich_rows(section)] if section.rows or section.skipped else []
    return tables + [_rich_grid(grid) for grid in section.grids]


def _rich_rows(section: Section) -> Table:
    columns = _columns(section)
    if any(row.rivals for row in section.rows):
        columns.pop()
    table = Table(title=section.title, title_justify="left", expand=True)
    for column in columns:
        table.add_column(
            column.head,
            ratio=column.ratio,
            justify="right" if column.number else "left",
            overflow="fold",
            min_width=len("MISSED") if column.show is _verdict else None,
        )
    for row in section.rows:
        colour = {True: "green", False: "bold red", None: ""}[row.passed]
        table.add_row(*(column.show(row) for column in columns), style=colour or None)
    if section.skipped:
        table.add_row("skipped", *[""] * (len(columns) - 2), section.skipped)
    return table


def _rich_grid(grid: Grid) -> Table:
    table = Table(title=grid.title, title_justify="left")
    for k, name in enumerate(grid.columns):
        table.add_column(name, justify="right" if k else "left")
    for line in grid.lines:
        table.add_row(*line)
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """One column of a section's table: its head, its share of the width and what it shows."""

    head: str
    ratio: int
    show: Callable[[Row], str]
    number: bool = False


def _columns(section: Section) -> list[_Column]:
    """Return the columns that a section has something for."""
    columns = [
        _Column(head="measure", ratio=5, show=lambda row: row.measure),
        _Column(head="reached", ratio=2, show=lambda row: row.reached, number=True),
        _Column(head="promised", ratio=3, show=lambda row: row.target),
        _Column(head="", ratio=2, show=_verdict),
    ]
    if any(row.count is not None for row in section.rows):
        columns[2:2] = [
            _Column(head="95 % interval", ratio=3, show=lambda row: row.interval, number=True),
            _Column(head="of", ratio=1, show=_count, number=True),
        ]
    names = dict.fromkeys(name for row in section.rows for name in row.rivals)
    columns += [_rival(name) for name in names]
    return [*columns, _Column(head="", ratio=6, show=lambda row: row.note)]


def _rival(name: str) -> _Column:
    return _Column(
        head=name,
        ratio=2,
        show=lambda row: _quantity(row.rivals.get(name, math.nan), row.unit),
        number=True,
    )


def _count(row: Row) -> str:
    return "" if row.count is None else f"{row.count}"


def _markdown(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    head = "".join(f" {name} |" if name else " |" for name in heads)
    rows = ["|" + head, "|" + "---|" * len(heads)]
    rows += [
        "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |" for cells in lines
    ]
    return "\n".join(rows)


def _verdict(row: Row) -> str:
    return {True: "kept", False: "MISSED", None: ""}[row.passed]


def _quantity(value: float, unit: str) -> str:
    return f"{_short(value)} {unit}".strip() if math.isfinite(value) else "-"


def _short(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
