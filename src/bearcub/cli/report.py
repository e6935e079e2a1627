"""What ``bearcub detect`` prints: JSON lines, one frame in full, or a sequence line by line."""

import math
import sys
from collections.abc import Iterable, Sequence
from typing import Protocol

from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from bearcub.cli import wording
from bearcub.messages import Answer, Terrain
from bearcub.runtime.feed import Shot
from bearcub.viewer.wording import number

_PIPED_WIDTH = 120  # characters, where no terminal says how many fit


def terminal(*, stderr: bool = False) -> Console:
    """Return a console that colours terminals only and never guesses what to highlight."""
    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else _PIPED_WIDTH
    return Console(stderr=stderr, width=width, highlight=False, markup=False, emoji=False)


def print_trimmed(console: Console, *parts: RenderableType) -> None:
    """Print without the spaces that tables put at the ends of lines."""
    with console.capture() as captured:
        console.print(*parts, sep="\n")
    print("\n".join(line.rstrip() for line in captured.get().splitlines()))


class Report(Protocol):
    """Takes every answer as it comes."""

    def frame(self, shot: Shot, answer: Answer) -> None:
        """Print one frame."""
        ...

    def end(self) -> None:
        """Print what can only be said of all frames."""
        ...


class JsonLines:
    """One JSON object a frame on stdout, and nothing else."""

    def frame(self, shot: Shot, answer: Answer) -> None:  # noqa: ARG002 (the answer says it all)
        """Print one frame, complete, at once."""
        print(answer.to_json(), flush=True)

    def end(self) -> None:
        """Print nothing."""


class FullReport:
    """The six questions and their answers, for one frame."""

    def __init__(self, console: Console, *, title: str) -> None:
        self._console = console
        self._title = title

    def frame(self, shot: Shot, answer: Answer) -> None:
        """Print one frame."""
        print_trimmed(
            self._console,
            Text(self._title or shot.source, style="bold"),
            _facts(("Camera", wording.camera(answer)), ("Floor", wording.floor(answer))),
            "",
            *_obstacles(answer),
            "",
            *_slope(answer.terrain),
            "",
            *_holes(answer),
            _facts(
                ("How far is the way free?", wording.free_way(answer.free_range)),
                ("Time", wording.timing(answer)),
            ),
        )

    def end(self) -> None:
        """Print nothing."""


def _obstacles(answer: Answer) -> list[RenderableType]:
    if not answer.obstacles:
        questions = Text("How far? At what angle? How large? How high?", style="cyan")
        return [questions, f"  {wording.no_obstacle(answer)}"]
    titles = ("#", "How far?", "At what angle?", "How large? (width)", "How high?", "Sure", "")
    return [_table(titles, [wording.obstacle_cells(thing) for thing in answer.obstacles])]


def _slope(terrain: Terrain) -> list[RenderableType]:
    parts: list[RenderableType] = [
        _facts(("How does the ground slope?", wording.slope(terrain))),
    ]
    bands = [band for band in terrain.profile if math.isfinite(band.slope)]
    if bands:
        titles = [f"{band.start:g} to {band.end:g} m" for band in bands]
        cells = [wording.degrees(band.slope, band.sigma) for band in bands]
        parts.append(Padding(_table(titles, [cells]), (0, 0, 0, 2)))
    return parts


def _holes(answer: Answer) -> list[RenderableType]:
    if not answer.holes:
        return [_facts(("Is there a hole?", wording.no_hole(answer)))]
    titles = ("Kind", "Distance", "Bearing", "Width", "Length", "Depth", "Sure", "")
    table = _table(titles, [wording.hole_cells(hole) for hole in answer.holes])
    return [_facts(("Is there a hole?", f"yes, {len(answer.holes)}")), Padding(table, (0, 0, 0, 2))]


def _facts(*rows: tuple[str, str]) -> RenderableType:
    """Return questions and answers as two columns."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="cyan", min_width=26, no_wrap=True)
    table.add_column()
    for question, answer in rows:
        table.add_row(question, answer)
    return table


def _table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> RenderableType:
    """Return a table whose columns keep their width, but for one without a title."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="cyan")
    for title in titles:
        table.add_column(title, no_wrap=bool(title))
    for row in rows:
        table.add_row(*row)
    return table


class LineReport:
    """One line a frame, for sequences, and a summary."""

    _COLUMNS = ("Frame", "Obstacles", "Nearest", "Bearing", "Slope", "Holes", "Time")
    _WIDTHS = (24, 10, 17, 13, 14, 7, 9)

    def __init__(self, console: Console, *, title: str) -> None:
        self._console = console
        self._title = title
        self._answers: list[tuple[int, int, float]] = []

    def frame(self, shot: Shot, answer: Answer) -> None:
        """Print one frame."""
        if not self._answers:
            self._say(self._title, style="bold")
            self._say(self._line(self._COLUMNS), style="cyan")
        first = answer.obstacles[0] if answer.obstacles else None
        terrain = answer.terrain
        self._say(
            self._line(
                (
                    shot.name,
                    str(len(answer.obstacles)),
                    wording.metres(first.distance, first.sigma_distance) if first else "-",
                    wording.bearing(first.bearing) if first else "-",
                    wording.degrees(terrain.slope, terrain.sigma),
                    str(len(answer.holes)) if answer.ground.seen else "?",
                    f"{number(answer.timing.total, 1)} ms",
                )
            )
        )
        self._answers.append((len(answer.obstacles), len(answer.holes), answer.timing.total))

    def _say(self, text: str, *, style: str = "") -> None:
        self._console.print(Text(text, style=style), soft_wrap=True)

    def _line(self, cells: Iterable[str]) -> str:
        return "".join(
            f"{cell if len(cell) < width else '…' + cell[2 - width :]:<{width}}"
            for cell, width in zip(cells, self._WIDTHS, strict=True)
        ).rstrip()

    def end(self) -> None:
        """Print the summary."""
        frames = len(self._answers)
        if not frames:
            return
        obstacles, holes, times = zip(*self._answers, strict=True)
        median = sorted(times)[frames // 2]
        rate = f" ({1000.0 / median:.0f} frames/s)" if median > 0 and math.isfinite(median) else ""
        self._say(
            f"{frames} frames: {sum(obstacles)} obstacles in {sum(map(bool, obstacles))} of them, "
            f"{sum(holes)} holes in {sum(map(bool, holes))}; median {number(median, 1)} ms{rate}",
            style="bold",
        )
