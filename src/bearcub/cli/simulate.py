"""``bearcub simulate``: worlds with truth, shown as a table or written as files."""

import argparse
import itertools
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

from rich.table import Table

from bearcub.cli.parsing import count
from bearcub.cli.report import print_trimmed, terminal
from bearcub.errors import InputError
from bearcub.sim import folder, ladar, scenario
from bearcub.sim.case import Case
from bearcub.sim.render import Rendered
from bearcub.sim.sensor import Strength
from bearcub.sim.studio import Renderer, has_mujoco, open_studio

_FEW = 5  # frames, where nobody says how many

_STRENGTHS: Mapping[str, Strength | None] = {
    "weak": "weak",
    "medium": "medium",
    "strong": "strong",
    "none": None,
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="a scenario; see --list")
    parser.add_argument("--list", action="store_true", help="print the scenarios")
    parser.add_argument(
        "--save",
        type=Path,
        metavar="DIR",
        help="write pairs, exact disparity, labels, truth, rig, tilt and LADAR here",
    )
    parser.add_argument(
        "--frames", type=count, default=_FEW, metavar="N", help=f"at most so many ({_FEW})"
    )
    parser.add_argument("--seed", type=_seed, metavar="S", help="draw everything anew")
    parser.add_argument(
        "--noise",
        choices=tuple(_STRENGTHS),
        help="of the camera; default: the scenario's",
    )
    parser.add_argument(
        "--renderer",
        choices=get_args(Renderer),
        help="raycast needs no extra package, is slow and shows no grass; default: mujoco where "
        "it is installed",
    )


def execute(args: argparse.Namespace) -> int:
    """List, show or write frames."""
    if args.list:
        _print_list()
        return 0
    if args.name is None:
        raise InputError("which scenario? `bearcub simulate --list` prints their names")
    found = scenario.load(args.name)
    if args.seed is not None:
        found = found.with_seed(args.seed)
    cases = list(itertools.islice(found.cases(), args.frames))
    if args.save is None:
        _print_truth(_shots(cases, noise=args.noise, renderer=_renderer(args.renderer)))
    else:
        _save(found.name, cases, args)
    return 0


def _seed(text: str) -> int:
    """Return a whole number; for argparse."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, 0 or more")
    return int(text)


def _print_list() -> None:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="cyan")
    table.add_column("Scenario", no_wrap=True)
    table.add_column("Frames", justify="right")
    table.add_column("What it shows")
    for name in scenario.names():
        found = scenario.load(name)
        table.add_row(name, str(len(found)), found.about)
    print_trimmed(terminal(), table)


def _renderer(wanted: Renderer | None) -> Renderer:
    if wanted is not None:
        return wanted
    if has_mujoco():
        return "mujoco"
    print(
        "note: MuJoCo is not installed, so this takes seconds a frame: pip install 'bearcub[sim]'",
        file=sys.stderr,
    )
    return "raycast"


def _shots(
    cases: Iterable[Case], *, noise: str | None, renderer: Renderer
) -> Iterator[tuple[Case, Rendered]]:
    """Render case after case; MuJoCo's model is built once for all frames of a world."""
    for _, frames in itertools.groupby(cases, key=lambda case: id(case.scene)):
        first, *rest = frames
        with open_studio(first, renderer) as studio:
            for case in (first, *rest):
                strength = _STRENGTHS[noise or case.noise]
                yield case, studio.shot(body=case.body, noise=strength, seed=case.seed)


def _save(name: str, cases: list[Case], options: argparse.Namespace) -> None:
    """Write one folder, or one in it for every rig."""
    rigs = [list(frames) for _, frames in itertools.groupby(cases, key=lambda case: case.rig)]
    console, renderer = terminal(), _renderer(options.renderer)
    for index, frames in enumerate(rigs):
        place = options.save if len(rigs) == 1 else options.save / f"rig-{index:03d}"
        shots = _shots(frames, noise=options.noise, renderer=renderer)
        written = folder.write(place, _taken(shots), rig=frames[0].rig, title=name)
        console.print(f"{place}: {written} frame{'s' * (written > 1)}")
    if len(rigs) > 1:
        console.print("One folder for every rig, because a folder has one rig.toml.")


def _taken(shots: Iterable[tuple[Case, Rendered]]) -> Iterator[folder.Taken]:
    for case, rendered in shots:
        scan = ladar.sweep(case.scene, case.body, seed=case.seed)
        tags = {"case": case.name, **case.tags}
        yield folder.Taken(rendered=rendered, tilt=case.tilt, scan=scan, tags=tags)


def _print_truth(shots: Iterable[tuple[Case, Rendered]]) -> None:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="cyan")
    for title in ("Frame", "What is there"):
        table.add_column(title, no_wrap=True)
    for title in ("distance [m]", "bearing [deg]", "width [m]", "height [m]", "seen"):
        table.add_column(title, justify="right", no_wrap=True)
    for case, rendered in shots:
        rows = list(_rows(rendered.truth)) or [("nothing but ground", *[""] * 5)]
        for index, row in enumerate(rows):
            table.add_row("" if index else case.name, *row)
    print_trimmed(terminal(), table)


def _rows(truth: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield what stands there, then holes (their depth as a negative height)."""
    for thing in truth["obstacles"]:
        note = " (passable)" if thing["passable"] else ""
        seen = f"{100 * thing['visible_share']:.0f} %"
        yield thing["name"] + note, *_numbers(thing), f"{thing['height']:.2f}", seen
    for hole in truth["holes"]:
        seen = f"{hole['pixels']} px"
        yield hole["kind"], *_numbers(hole), f"{-hole['depth']:.2f}", seen


def _numbers(thing: Mapping[str, Any]) -> tuple[str, str, str]:
    return f"{thing['distance']:.2f}", f"{thing['bearing_deg']:.1f}", f"{thing['width']:.2f}"
