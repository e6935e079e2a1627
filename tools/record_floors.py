"""Record what the quick suite must not fall below: ``python tools/record_floors.py``.

Runs ``bearcub evaluate sim --quick`` with the native matcher and with OpenCV's, which stands in for
it, and writes the worse of their figures, with slack, to the package's floors.toml. Do it after a
change that makes figures better, and look at the difference: a floor that went down is a promise
taken back. A folder as argument keeps rendered frames for next time.
"""

import math
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from bearcub.config import Config
from bearcub.evaluation import floors, sim
from bearcub.evaluation.simulated import Method, cores
from bearcub.evaluation.table import Row

_T = TypeVar("_T")


def untracked(items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:  # noqa: ARG001
    """Hand on the items."""
    return items


def rows_of(matcher: str, frames: Path | None) -> list[Row]:
    """Return the rows of the quick suite by one matcher."""
    config = Config()
    config = replace(config, matching=replace(config.matching, matcher=matcher))
    method = Method(jobs=cores(), frames=frames, config=config)
    return list(sim.evaluate(sim.cases(quick=True), method, untracked).sections[0].rows)


def worse(one: Row, other: Row) -> Row:
    """Return the row whose figure is the worse one; of shares that have a range, the smaller."""
    if math.isnan(one.value) or math.isnan(other.value):
        return other if math.isnan(one.value) else one
    wanted = max if one.sense == "at most" and not isinstance(one.limit, tuple) else min
    return wanted(one, other, key=lambda row: row.value)


def main() -> None:
    """Write the floors."""
    frames = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    both = zip(rows_of("native", frames), rows_of("sgbm", frames), strict=True)
    rows = [worse(*pair) for pair in both]
    floors.write(rows)
    for row in rows:
        print(f"{row.measure}: {row.reached}, floor {floors.slackened(row)}")


if __name__ == "__main__":
    main()
