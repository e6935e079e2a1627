"""Evaluate the simulator's scenarios: cases are answered, answers judged, verdicts tabulated."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from bearcub.evaluation import targets
from bearcub.evaluation.breakdown import grids
from bearcub.evaluation.contenders import OURS
from bearcub.evaluation.metrics import Figure, Metrics
from bearcub.evaluation.runner import Track
from bearcub.evaluation.simulated import Method, answered
from bearcub.evaluation.table import Section
from bearcub.evaluation.verdict import Record, judge
from bearcub.sim import scenario
from bearcub.sim.case import Case


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """An evaluation.

    Attributes
    ----------
    sections : tuple of Section
        The table of promises, the intervals by number, and the break-downs.
    shown : mapping of str to Figure
        By the measure of a row, the frames that show it.
    records : tuple of Record
        Every frame with its answers.
    """

    sections: tuple[Section, ...]
    shown: Mapping[str, Figure]
    records: tuple[Record, ...]


def cases(names: Iterable[str] = (), *, quick: bool = False) -> list[Case]:
    """Return the cases of some scenarios, of all without names.

    Raises
    ------
    ConfigError
        If there is no scenario of a name.
    """
    chosen = list(names) or list(scenario.names())
    return [case for name in chosen for case in scenario.load(name).cases(quick=quick)]


def evaluate(chosen: Sequence[Case], method: Method, track: Track) -> Result:
    """Answer cases and score the answers."""
    results = track(answered(chosen, method), total=len(chosen), name="frames")
    return score(tuple(results), baselines=method.baselines)


def score(
    records: Sequence[Record], *, baselines: Sequence[str] = (), where: str = "simulated frames"
) -> Result:
    """Score answered frames.

    Parameters
    ----------
    records : sequence of Record
    baselines : sequence of str
        Contenders to compare with.
    where : str
        What the frames are, for the headings.
    """
    verdicts = [judge(record, OURS) for record in records]
    ours = Metrics(verdicts)
    rivals = {
        name: Metrics([judge(record, name) for record in records], intervals=False)
        for name in baselines
    }
    table, shown = targets.rows(targets.promises(), ours, rivals)
    table += targets.comparison(table)
    heading = where[:1].upper() + where[1:]
    numbers, _ = targets.rows(targets.by_number(), ours, {})
    return Result(
        sections=(
            targets.section(table, frames=len(records), where=heading),
            Section(
                name="sim_intervals",
                title=f"{heading}: intervals by number",
                about="How often the stated interval of each number contains the truth.",
                rows=tuple(numbers),
            ),
            Section(
                name="sim_breakdown",
                title=f"{heading}: where figures come from",
                about="For information; all frames that count, whatever their noise.",
                grids=grids(Metrics(verdicts, intervals=False)),
            ),
        ),
        shown=shown,
        records=tuple(records),
    )
