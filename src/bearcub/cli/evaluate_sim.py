"""``bearcub evaluate sim``: the simulator's scenarios, answered and scored."""

import argparse
from collections.abc import Iterable
from pathlib import Path

from bearcub.cli.parsing import count
from bearcub.errors import InputError
from bearcub.evaluation import floors, sim
from bearcub.evaluation.baselines import BASELINES
from bearcub.evaluation.contenders import OURS
from bearcub.evaluation.dump import line
from bearcub.evaluation.pictures import save_pictures
from bearcub.evaluation.runner import Track
from bearcub.evaluation.simulated import RENDERERS, Method, cores
from bearcub.evaluation.table import Section
from bearcub.evaluation.verdict import Record


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``bearcub evaluate sim``."""
    parser.add_argument(
        "--quick", action="store_true", help="a small part, against the recorded floors"
    )
    add_baselines(parser)
    parser.add_argument(
        "--scenario", nargs="+", default=[], metavar="NAME", help="these scenarios alone"
    )
    parser.add_argument(
        "--jobs", type=count, default=cores(), metavar="N", help="processes; default: all cores"
    )
    parser.add_argument(
        "--frames", type=Path, metavar="DIR", help="keep rendered frames here and use them again"
    )
    parser.add_argument(
        "--frames-json", type=Path, metavar="FILE", help="write a line of JSON for every frame"
    )
    parser.add_argument(
        "--save", type=Path, metavar="DIR", help="draw the best and worst frames of every row"
    )
    parser.add_argument(
        "--renderer", choices=RENDERERS, default=RENDERERS[0], help="rays: slow, no grass"
    )


def add_baselines(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the baselines to compare with."""
    parser.add_argument(
        "--against",
        type=_baselines,
        default=(),
        metavar="NAMES",
        help=f"compare with baselines: {','.join(BASELINES)}",
    )


def evaluate(args: argparse.Namespace, track: Track) -> list[Section]:
    """Answer and score the chosen cases, and write what was asked for."""
    cases = sim.cases(args.scenario, quick=args.quick)
    method = Method(
        baselines=args.against, renderer=args.renderer, frames=args.frames, jobs=args.jobs
    )
    result = sim.evaluate(cases, method, track)
    if args.frames_json is not None:
        _write_lines(args.frames_json, result.records)
    if args.save is not None:
        save_pictures(result.shown, cases, method, args.save)
    sections = list(result.sections)
    if args.quick and not args.scenario:
        sections.append(floors.held(sections[0].rows, floors.read()))
    return sections


def failed(args: argparse.Namespace, sections: Iterable[Section]) -> bool:
    """Tell whether a promise was not kept; of the quick suite, whether a figure fell too low."""
    if args.quick:
        return any(section.missed for section in sections if section.name == floors.NAME)
    return any(section.missed for section in sections)


def command(args: argparse.Namespace) -> list[str]:
    """Return the words after ``bearcub evaluate sim`` that give the same table."""
    words = ["--quick"] if args.quick else []
    words += ["--against", ",".join(args.against)] if args.against else []
    words += ["--scenario", *args.scenario] if args.scenario else []
    return words


def _write_lines(path: Path, records: Iterable[Record]) -> None:
    text = "".join(f"{line(record, OURS)}\n" for record in records)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error


def _baselines(text: str) -> tuple[str, ...]:
    names = tuple(name for name in text.split(",") if name)
    unknown = [name for name in names if name not in BASELINES]
    if unknown or not names:
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected some of {','.join(BASELINES)}, separated by commas"
        )
    return names
