"""Record what the quick suite must not fall below: ``python tools/record_floors.py``.

Runs ``bearcub evaluate sim --quick`` and writes its figures, with slack, to the package's
floors.toml. Do it after a change that makes figures better, and look at the difference: a floor
that went down is a promise taken back. A folder as argument keeps rendered frames for next time.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

from bearcub.evaluation import floors, sim
from bearcub.evaluation.simulated import Method, cores

_T = TypeVar("_T")


def untracked(items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:  # noqa: ARG001
    """Hand on the items."""
    return items


def main() -> None:
    """Write the floors."""
    frames = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    result = sim.evaluate(sim.cases(quick=True), Method(jobs=cores(), frames=frames), untracked)
    floors.write(result.sections[0].rows)
    for row in result.sections[0].rows:
        print(f"{row.measure}: {row.reached}, floor {floors.slackened(row)}")


if __name__ == "__main__":
    main()
