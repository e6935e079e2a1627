"""What the benchmarks print alike: where they ran, and a table of milliseconds."""

from collections.abc import Iterable, Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table

from bearcub.cli.report import print_trimmed, terminal
from bearcub.runtime.bench import FRAME_BUDGET_MS, machine
from bearcub.runtime.bench_matchers import REFERENCE

Summary = Mapping[str, Mapping[str, float]]
"""Of every stage p50, p99 and max [ms], and the median's share of a frame's time."""

SCHEMA = "bearcub.bench/1"


def in_words(threads: int) -> str:
    """Return a number of threads as text.

    Examples
    --------
    >>> in_words(1), in_words(2)
    ('one thread', '2 threads')
    """
    return "one thread" if threads == 1 else f"{threads} threads"


def in_words_ms(times: Iterable[float]) -> str:
    """Return milliseconds as text, one number or from the least to the most.

    Examples
    --------
    >>> in_words_ms([43.21]), in_words_ms([64.4, 43.21])
    ('43.2 ms', '43.2 to 64.4 ms')
    """
    texts = [f"{time:.1f}" for time in sorted(times)]
    return f"{' to '.join(dict.fromkeys([texts[0], texts[-1]]))} ms"


def as_json(**figures: Any) -> dict[str, Any]:
    """Return what every benchmark says of itself, and its figures."""
    return {"schema": SCHEMA, "machine": machine(), **figures}


def print_under(heading: str, *parts: RenderableType) -> None:
    """Print `parts` under a heading and what machine ran it."""
    found = machine()
    versions = ", ".join(
        f"{name} {found[name]}" for name in ("bearcub", "python", "numpy", "opencv")
    )
    print_trimmed(
        terminal(), heading, f"{found['processor']}, {found['system']}; {versions}", "", *parts
    )


def stage_table(
    results: Mapping[str, Summary], *, last: str, yardsticks: Mapping[str, float] | None = None
) -> Table:
    """Return the milliseconds of every stage of every case.

    Parameters
    ----------
    results : mapping of str to mapping
        A summary for every case.
    last : str
        The stage that sums the others up.
    yardsticks : mapping of str to float, optional
        What OpenCV's matcher took in turns with every case [ms], to compare the medians with.
    """
    titles = ["p50 [ms]", "p99 [ms]", "max [ms]", f"of {FRAME_BUDGET_MS:.1f} ms"]
    if yardsticks:
        titles.append(f"of {REFERENCE}")
    table = empty_table(("Case", "Stage"), titles)
    for name, stages in results.items():
        for stage, spent in stages.items():
            table.add_row(
                name if stage == next(iter(stages)) else "",
                stage,
                *(f"{spent[key]:.2f}" for key in ("p50", "p99", "max")),
                f"{100 * spent['share']:.1f} %",
                *([f"{spent['p50'] / yardsticks[name]:.3f}"] if yardsticks else []),
                style="bold" if stage == last else "",
            )
    return table


def empty_table(words: Iterable[str], numbers: Iterable[str]) -> Table:
    """Return a table of columns for words, and for numbers to the right of them."""
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="cyan")
    for title in words:
        table.add_column(title, no_wrap=True)
    for title in numbers:
        table.add_column(title, justify="right", no_wrap=True)
    return table
