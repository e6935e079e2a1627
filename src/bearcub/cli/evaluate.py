"""``bearcub evaluate``: what is promised against what is reached."""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import cv2
from rich.console import Console
from rich.progress import Progress

from bearcub.cli import evaluate_sim
from bearcub.cli.parsing import number
from bearcub.cli.rig_options import add_rig_options, load_rig
from bearcub.errors import InputError
from bearcub.evaluation.drive import evaluate_drive
from bearcub.evaluation.folder import evaluate_folder
from bearcub.evaluation.kitti import HALF_WIDTH
from bearcub.evaluation.real import SETS, evaluate_real
from bearcub.evaluation.rendered import evaluate_scenes
from bearcub.evaluation.runner import Runner, Watch
from bearcub.evaluation.sample import evaluate_sample
from bearcub.evaluation.table import Section, to_dict, to_markdown, to_rich
from bearcub.messages import Answer, Snapshot
from bearcub.rig import Rig
from bearcub.viewer.frame import annotate

HELP = "score answers against real recordings or rendered scenes"

_T = TypeVar("_T")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``bearcub evaluate``."""
    commands = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
    rendered = commands.add_parser("sim", help="the simulator's scenarios: the accuracy table")
    evaluate_sim.configure(rendered)
    real = commands.add_parser("real", help="recordings in a folder")
    real.add_argument("path", type=Path, metavar="PATH", help=f"holds {', '.join(SETS)}")
    real.add_argument(
        "--only", action="append", choices=tuple(SETS), default=[], help="this set alone; repeat"
    )
    folder = commands.add_parser("folder", help="pairs with truth in the project's own layout")
    folder.add_argument("path", type=Path, metavar="PATH", help="holds left, right, rig and truth")
    evaluate_sim.add_baselines(folder)
    drive = commands.add_parser("drive", help="a recording with poses: where it drove was free")
    drive.add_argument("path", type=Path, metavar="PATH", help="holds the left and right pictures")
    drive.add_argument("--poses", type=Path, required=True, metavar="FILE", help="as KITTI's")
    drive.add_argument("--half-width", type=number, default=HALF_WIDTH, metavar="M")
    add_rig_options(drive)
    sample = commands.add_parser("sample", help="the sample's scene at every attitude")
    scenes = commands.add_parser("scenes", help="other rendered scenes, for information")
    for command in (rendered, real, folder, drive, sample, scenes):
        form = command.add_mutually_exclusive_group()
        form.add_argument("--json", action="store_true", help="print one JSON object")
        form.add_argument("--markdown", action="store_true", help="print Markdown")
    for command in (real, drive, sample, scenes):
        command.add_argument(
            "--save", type=Path, metavar="DIR", help="write every annotated frame here"
        )


def execute(args: argparse.Namespace) -> int:
    """Evaluate and print; 1 when a promise was not kept, else 0."""
    with _progress(getattr(args, "save", None) if args.what != "sim" else None) as runner:
        sections = _sections(args, runner)
    _print(sections, args)
    if args.what == "sim":
        return 1 if evaluate_sim.failed(args, sections) else 0
    return 1 if any(section.missed for section in sections) else 0


def _sections(args: argparse.Namespace, runner: Runner) -> list[Section]:
    if args.what == "sim":
        return evaluate_sim.evaluate(args, runner.track)
    if args.what == "real":
        return evaluate_real(args.path, runner, only=args.only)
    if args.what == "folder":
        return list(evaluate_folder(args.path, runner.track, baselines=args.against).sections)
    if args.what == "drive":
        rig = load_rig(args, args.path if args.rig is None else args.rig)
        return [evaluate_drive(args.path, rig, args.poses, runner, half_width=args.half_width)]
    if args.what == "sample":
        return evaluate_sample(runner)
    return [evaluate_scenes(runner)]


def _print(sections: list[Section], args: argparse.Namespace) -> None:
    if args.json:
        print(json.dumps(to_dict(sections), allow_nan=False))
    elif args.markdown:
        print(to_markdown(sections, command=_command(args)))
    else:
        console = Console()
        for table in (table for section in sections for table in to_rich(section)):
            console.print(table)


def _command(args: argparse.Namespace) -> str:
    words = ["bearcub", "evaluate", args.what]
    if args.what == "real":
        words += [args.path.as_posix(), *(f"--only {name}" for name in args.only)]
    if args.what == "sim":
        words += evaluate_sim.command(args)
    if args.what in {"folder", "drive"}:
        words += [args.path.as_posix()]
    return " ".join(words)


@contextmanager
def _progress(folder: Path | None) -> Iterator[Runner]:
    """Provide a runner that shows progress on stderr and saves what it sees, if asked to."""
    console = Console(file=sys.stderr)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:

        def track(items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:
            task = progress.add_task(name, total=total)
            for item in items:
                yield item
                progress.advance(task)
            progress.remove_task(task)

        yield Runner(track=track) if folder is None else Runner(track=track, watch=_saver(folder))


def _saver(folder: Path) -> Watch:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from error

    def save(name: str, rig: Rig, snapshot: Snapshot, answer: Answer) -> None:
        height, width = answer.layers.labels.shape
        picture = annotate(answer, snapshot.left, rig.for_image(width=width, height=height))
        path = folder / f"{name}.png"
        if not cv2.imwrite(str(path), picture):
            raise InputError(f"{path}: cannot be written")

    return save
