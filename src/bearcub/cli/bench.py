"""``bearcub bench``: how long the stages take on this machine."""

import argparse
import json

from rich.table import Table

from bearcub.cli.parsing import count, size
from bearcub.cli.report import print_trimmed, terminal
from bearcub.config import Config
from bearcub.pipeline import Pipeline
from bearcub.runtime.bench import FRAME_BUDGET_MS, WARM_UP, cases, machine, measure, summarise

Summary = dict[str, dict[str, float]]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "--frames", type=count, default=200, metavar="N", help="counted frames a case (200)"
    )
    parser.add_argument(
        "--size", type=size, default=(640, 480), metavar="WxH", help="of the images (640x480)"
    )
    parser.add_argument("--pair", action="store_true", help="also match the sample's pair")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def execute(args: argparse.Namespace) -> int:
    """Measure every case and print what it took."""
    results = {
        case.name: summarise(
            measure(Pipeline(case.rig, case.config), case.snapshot, frames=args.frames)
        )
        for case in cases(size=args.size, config=Config(), pair=args.pair)
    }
    if args.json:
        print(_to_json(args, results))
    else:
        _print_table(args, results)
    return 0


def _to_json(args: argparse.Namespace, results: dict[str, Summary]) -> str:
    measured = [{"name": name, "stages_ms": stages} for name, stages in results.items()]
    return json.dumps(
        {
            "schema": "bearcub.bench/1",
            "machine": machine(),
            "size": list(args.size),
            "frames": args.frames,
            "warm_up": WARM_UP,
            "threads": 1,
            "budget_ms": FRAME_BUDGET_MS,
            "cases": measured,
        }
    )


def _print_table(args: argparse.Namespace, results: dict[str, Summary]) -> None:
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="cyan")
    for title in ("Case", "Stage"):
        table.add_column(title, no_wrap=True)
    for title in ("p50 [ms]", "p99 [ms]", "max [ms]", f"of {FRAME_BUDGET_MS:.1f} ms"):
        table.add_column(title, justify="right", no_wrap=True)
    for name, stages in results.items():
        for stage, spent in stages.items():
            table.add_row(
                name if stage == next(iter(stages)) else "",
                stage,
                *(f"{spent[key]:.2f}" for key in ("p50", "p99", "max")),
                f"{100 * spent['share']:.1f} %",
                style="bold" if stage == "total" else "",
            )
    found = machine()
    versions = ", ".join(
        f"{name} {found[name]}" for name in ("bearcub", "python", "numpy", "opencv")
    )
    print_trimmed(
        terminal(),
        f"{args.size[0]} x {args.size[1]} px, {args.frames} frames a case after {WARM_UP} to warm "
        "up, one thread",
        f"{found['processor']}, {found['system']}; {versions}",
        "",
        table,
    )
