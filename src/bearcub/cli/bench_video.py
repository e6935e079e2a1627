"""``bearcub bench --video``: every stage at work at the same time, on a video."""

import argparse
import contextlib
import itertools
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from bearcub import sample
from bearcub.cli.bench_tables import as_json, in_words, print_under, stage_table
from bearcub.cli.codes import INTERRUPTED
from bearcub.cli.report import terminal
from bearcub.cli.rig_options import load_rig
from bearcub.clock import MonotonicClock
from bearcub.config import Config
from bearcub.devices import open_frames
from bearcub.errors import InputError
from bearcub.messages import Tilt
from bearcub.rig import Rig
from bearcub.runtime.bench import FRAME_BUDGET_MS, WARM_UP, summarise
from bearcub.runtime.bench_video import AGE, Played, play
from bearcub.runtime.feed import Feed
from bearcub.runtime.loop import deferred_interrupt
from bearcub.runtime.sample_video import sample_video
from bearcub.runtime.tilt import same_tilt
from bearcub.stereo.choice import matcher_in_place


def play_files(args: argparse.Namespace, config: Config, *, frames: int) -> int:
    """Play the user's video and print what it took; return 0, or 130 after Ctrl-C.

    Raises
    ------
    BearcubError
        If the files cannot be played, or there are more than two.
    """
    if len(args.video) > 2:
        names = " ".join(str(path) for path in args.video)
        raise InputError(f"--video {names}: expected one side-by-side video, or left and right")
    if args.rig is None:
        raise InputError("a video needs a rig: give the calibration of its camera with --rig FILE")
    return _play(args, config, args.video, load_rig(args, args.rig), tilt=None, frames=frames)


def play_sample(
    args: argparse.Namespace, config: Config, *, sizes: Sequence[tuple[int, int]], frames: int
) -> int:
    """Play the embedded sample at every size and print what it took; as `play_files`."""
    tilt = sample.load().tilt
    for number, size in enumerate(sizes):
        if number and not args.json:
            print()
        with sample_video(size=size, frames=frames + WARM_UP) as (path, rig):
            code = _play(args, config, [path], rig, tilt=tilt, frames=frames)
        if code:
            return code
    return 0


def _play(
    args: argparse.Namespace,
    config: Config,
    paths: Sequence[Path],
    rig: Rig,
    *,
    tilt: Tilt | None,
    frames: int,
) -> int:
    source = " and ".join(str(path) for path in paths)
    with (
        open_frames(*paths, side_by_side=len(paths) == 1) as opened,
        deferred_interrupt() as interruption,
        _progress(min(frames + WARM_UP, opened.count or frames + WARM_UP)) as advance,
    ):
        feed = Feed(opened, rig, tilts=same_tilt(tilt), source=source)
        played = play(
            itertools.islice(feed, frames + WARM_UP),
            config,
            clock=MonotonicClock(),
            interruption=interruption,
            advance=advance,
        )
    if played.frames:
        _print(args, config, played)
    elif not interruption.requested:
        raise InputError(f"{source}: too short; expected more than {WARM_UP} frames to warm up")
    if interruption.requested:
        print(f"bearcub: interrupted after {played.frames} frames", file=sys.stderr)
        return INTERRUPTED
    return 0


def _print(args: argparse.Namespace, config: Config, played: Played) -> None:
    spent = summarise(played.times)
    matcher, threads = matcher_in_place(config.matching), config.matching.threads
    width, height = played.size
    if args.json:
        age = spent.pop(AGE)
        figures = as_json(
            size=[width, height],
            frames=played.frames,
            warm_up=WARM_UP,
            threads=threads,
            matcher=matcher,
            budget_ms=FRAME_BUDGET_MS,
            rate_hz=played.rate_hz,
            age_ms=age,
            stages_ms=spent,
        )
        print(json.dumps(figures))
        return
    print_under(
        f"{width} x {height} px, {played.frames} frames after {WARM_UP} to warm up, matched by "
        f"{matcher}, {in_words(threads)} a stage",
        stage_table({"video": spent}, last=AGE),
        "",
        f"{played.rate_hz:.1f} frames per second, the stages at work at the same time",
    )


@contextlib.contextmanager
def _progress(total: int) -> Iterator[Callable[[], None]]:
    """Show on stderr how far it has come, where that is a terminal."""
    columns = TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    console = terminal(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("frames", total=total)
        yield lambda: bar.advance(task)
