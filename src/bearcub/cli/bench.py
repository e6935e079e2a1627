"""``bearcub bench``: how long the stages take on this machine."""

import argparse
import json
from dataclasses import fields, replace
from pathlib import Path

from bearcub.cli import bench_matchers, bench_video
from bearcub.cli.bench_tables import as_json, in_words, in_words_ms, print_under, stage_table
from bearcub.cli.parsing import count, disparities, size
from bearcub.cli.rig_options import add_rig_options
from bearcub.clock import MonotonicClock
from bearcub.config import Config, Matching
from bearcub.errors import InputError
from bearcub.pipeline import Pipeline
from bearcub.runtime.bench import FRAME_BUDGET_MS, WARM_UP, cases, measure, summarise
from bearcub.runtime.bench_matchers import REFERENCE, Yardstick

_MATCHERS = next(item for item in fields(Matching) if item.name == "matcher").metadata["choices"]
_SIZE = (640, 480)
_FRAMES = 200
_ROUNDS = 50


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--pair", action="store_true", help="also match the sample's pair")
    what.add_argument(
        "--matchers",
        nargs="*",
        type=Path,
        metavar="DIR",
        help="compare the matchers instead, their speed and, on the pairs with truth in DIR, their "
        "errors; Middlebury's layouts",
    )
    what.add_argument(
        "--video",
        nargs="*",
        type=Path,
        metavar="FILE",
        help="decode, rectify, match, answer and draw at the same time: a side-by-side video, or a "
        "left and a right one; no FILE: the sample, shaken",
    )
    parser.add_argument(
        "--frames",
        type=count,
        metavar="N",
        help=f"counted frames a case ({_FRAMES}; of --matchers {_ROUNDS})",
    )
    parser.add_argument(
        "--size", type=size, nargs="+", metavar="WxH", help="of the images, one or more (640x480)"
    )
    parser.add_argument(
        "--disparities",
        type=disparities,
        nargs="+",
        metavar="N",
        help="that --matchers search, one or more (a tenth of the width)",
    )
    parser.add_argument(
        "--threads", type=threads, metavar="N", help="that each stage may use, or all (1)"
    )
    parser.add_argument(
        "--matcher", choices=_MATCHERS, help="of --video, instead of the configuration's"
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML; see bearcub config")
    parser.add_argument("--json", action="store_true", help="a JSON object for every size")
    add_rig_options(parser)


def threads(text: str) -> int:
    """Return a number of threads, of ``all`` as many as may run at once; for argparse."""
    if text != "all":
        return count(text)
    from bearcub.evaluation.simulated import cores  # noqa: PLC0415 (slow to import)

    return cores()


def execute(args: argparse.Namespace) -> int:
    """Measure what was asked for and print what it took; return 0, or 130 after Ctrl-C."""
    config = _config(args)
    sizes = args.size or [_SIZE]
    if args.disparities is not None and args.matchers is None:
        raise InputError("--disparities is for --matchers; elsewhere the rig tells")
    if args.video:
        if args.size is not None:
            raise InputError("--size is for the sample; a video has a size of its own")
        return bench_video.play_files(args, config, frames=args.frames or _FRAMES)
    if args.rig is not None:
        raise InputError(f"--rig {args.rig} without a video of its own: give --video FILE, too")
    if args.video is not None:
        return bench_video.play_sample(args, config, sizes=sizes, frames=args.frames or _FRAMES)
    if args.matchers is not None:
        return bench_matchers.compare(args, config, sizes=sizes, rounds=args.frames or _ROUNDS)
    for number, each in enumerate(sizes):
        if number and not args.json:
            print()
        _measure_stages(args, config, each)
    return 0


def _config(args: argparse.Namespace) -> Config:
    config = Config() if args.config is None else Config.load(args.config)
    given = {"matcher": args.matcher, "threads": args.threads}
    changed = {name: value for name, value in given.items() if value is not None}
    return replace(config, matching=replace(config.matching, **changed))


def _measure_stages(args: argparse.Namespace, config: Config, size: tuple[int, int]) -> None:
    frames, threads = args.frames or _FRAMES, config.matching.threads
    results, yardsticks = {}, {}
    for case in cases(size=size, config=config, pair=args.pair):
        yardstick = Yardstick(width=size[0], height=size[1], clock=MonotonicClock())
        spent = measure(
            Pipeline(case.rig, case.config),
            case.snapshot,
            frames=frames,
            threads=threads,
            between=yardstick,
        )
        results[case.name], yardsticks[case.name] = summarise(spent), yardstick.p50
    if args.json:
        figures = as_json(
            size=list(size),
            frames=frames,
            warm_up=WARM_UP,
            threads=threads,
            budget_ms=FRAME_BUDGET_MS,
            cases=[
                {"name": name, "stages_ms": stages, "sgbm_3way_ms": yardsticks[name]}
                for name, stages in results.items()
            ],
        )
        print(json.dumps(figures))
        return
    print_under(
        f"{size[0]} x {size[1]} px, {frames} frames a case after {WARM_UP} to warm up, "
        f"{in_words(threads)}",
        stage_table(results, last="total", yardsticks=yardsticks),
        "",
        f"In turns with them OpenCV's {REFERENCE} matched the sample, {yardstick.count} "
        f"disparities on one thread, in {in_words_ms(yardsticks.values())}.",
    )
