"""``bearcub detect``: the six questions, answered for a pair, a map or a sequence of them."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from bearcub import sample
from bearcub.cli.codes import INTERRUPTED
from bearcub.cli.detect_options import configure
from bearcub.cli.report import FullReport, JsonLines, LineReport, Report, terminal
from bearcub.cli.rig_options import load_rig
from bearcub.config import Config
from bearcub.devices import FrameSource, open_frames, open_sink
from bearcub.devices.tilt_csv import read_tilts
from bearcub.errors import InputError
from bearcub.messages import Answer, Tilt
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig
from bearcub.runtime.classic import ClassicPipeline
from bearcub.runtime.feed import Decoding, Feed, Shot
from bearcub.runtime.loop import Stage, answers, deferred_interrupt
from bearcub.runtime.notes import Notes
from bearcub.runtime.pictures import Pictures, RectifiedLeft, require_separate
from bearcub.runtime.tilt import (
    require_degrees,
    same_tilt,
    tilt_from_degrees,
    tilt_per_frame,
)
from bearcub.viewer import figures

__all__ = ["configure", "execute"]

_SAMPLE = "the embedded sample: a garbage can 10 ft ahead, the robot rolled by 12°"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Input:
    """What to look at.

    Attributes
    ----------
    left, right, disparity : Path or None
    rig : Path
    tilts : iterator of Tilt or None
        One for every frame.
    title : str
        What it is, when the names of its files do not tell.
    """

    left: Path | None
    right: Path | None
    disparity: Path | None
    rig: Path
    tilts: Iterator[Tilt | None]
    title: str = ""

    @property
    def files(self) -> str:
        """The files' names."""
        given = (self.left, self.right, self.disparity)
        return " and ".join(str(path) for path in given if path is not None)


def execute(args: argparse.Namespace) -> int:
    """Answer every frame; return 0, or 130 when Ctrl-C ended it."""
    given = _input(args)
    rig = load_rig(args, given.rig)
    build = _stage_builder(args.method, _config(args))
    notes = Notes(lambda note: print(f"note: {note}", file=sys.stderr))
    with contextlib.ExitStack() as stack:
        frames = stack.enter_context(
            open_frames(
                given.left, given.right, disparity=given.disparity, side_by_side=args.side_by_side
            )
        )
        feed = _feed(args, given, frames, rig)
        single = 1 in (frames.count, args.limit)
        takers = _takers(args, given, stack, rate_hz=frames.rate_hz, single=single)
        screen = terminal()
        report = _report(args, given, screen, single=single)
        interruption = stack.enter_context(deferred_interrupt())
        advance = stack.enter_context(_progress(args, frames, screen, single=single))
        done = 0
        for shot, answer in answers(feed, build, interruption=interruption, limit=args.limit):
            if done == 0:
                prefix = "--" if args.tilt_file is None else f"{args.tilt_file}: "
                require_degrees(shot.snapshot.tilt, answer.ground, rig.mount, prefix=prefix)
            notes.add((*shot.notes, *answer.notes))
            for take in (report.frame, *takers):
                take(shot, answer)
            done += 1
            advance()
    report.end()
    notes.repeat(frames=done)
    if interruption.requested:
        print(f"bearcub: interrupted after {done} frames", file=sys.stderr)
        return INTERRUPTED
    return 0


def _input(args: argparse.Namespace) -> _Input:
    nothing = (args.left, args.right, args.disparity) == (None, None, None)
    if nothing and not args.side_by_side:
        return _sample_input(args)
    if args.rig is None:
        raise InputError(
            "these pictures need a rig: give the calibration of their camera with --rig FILE"
        )
    return _Input(
        left=args.left,
        right=args.right,
        disparity=args.disparity,
        rig=args.rig,
        tilts=_tilts(args, None),
    )


def _sample_input(args: argparse.Namespace) -> _Input:
    if args.rig is not None:
        raise InputError(
            f"--rig {args.rig} without pictures: give LEFT and RIGHT, or --disparity; the "
            "embedded sample has a rig of its own"
        )
    found = sample.load()
    return _Input(
        left=found.left,
        right=found.right,
        disparity=None,
        rig=found.rig,
        tilts=_tilts(args, found.tilt),
        title=_SAMPLE,
    )


def _tilts(args: argparse.Namespace, otherwise: Tilt | None) -> Iterator[Tilt | None]:
    tilt = tilt_from_degrees(args.pitch, args.roll)
    if args.tilt_file is None:
        return same_tilt(tilt or otherwise)
    if tilt is not None:
        raise InputError(f"{args.tilt_file}: replaces --pitch and --roll; give one of both")
    return tilt_per_frame(read_tilts(args.tilt_file), source=args.tilt_file)


def _config(args: argparse.Namespace) -> Config:
    config = Config() if args.config is None else Config.load(args.config)
    if args.nearest is None:
        return config
    return replace(config, matching=replace(config.matching, nearest=args.nearest))


def _stage_builder(method: str, config: Config) -> Callable[[Rig], Stage]:
    if method == "bearcub":
        return lambda rig: Pipeline(rig, config)
    return lambda rig: ClassicPipeline(rig, config, printed=method == "classic-printed")


def _feed(args: argparse.Namespace, given: _Input, frames: FrameSource, rig: Rig) -> Feed:
    decoding = Decoding(
        encoding=args.encoding, byte_order=args.byte_order, scale=args.disparity_scale
    )
    return Feed(
        frames, rig, tilts=given.tilts, source=given.files, decoding=decoding, scale=args.scale
    )


def _takers(
    args: argparse.Namespace,
    given: _Input,
    stack: contextlib.ExitStack,
    *,
    rate_hz: float | None,
    single: bool,
) -> list[Callable[[Shot, Answer], None]]:
    """Return what draws the frames, opened now: a bad path is said before any work is done."""
    inputs = (given.left, given.right, given.disparity, given.rig, args.config, args.tilt_file)
    for output in (args.save, args.figures):
        if output is not None:
            require_separate(output, [path for path in inputs if path is not None])
    takers: list[Callable[[Shot, Answer], None]] = []
    if args.save is not None:
        sink = stack.enter_context(open_sink(args.save, rate_hz=rate_hz, single=single))
        takers.append(Pictures(sink, fixed_reach=not single).write)
    if args.figures is not None:
        takers.append(_FirstFigures(args.figures))
    return takers


class _FirstFigures:
    """Draws the paper's figures of the first frame it is given."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._done = False

    def __call__(self, shot: Shot, answer: Answer) -> None:
        """Draw the figures, once."""
        if not self._done:
            figures(answer, RectifiedLeft()(shot), self._folder)
            self._done = True


def _report(args: argparse.Namespace, given: _Input, screen: Console, *, single: bool) -> Report:
    if args.json:
        if given.title:
            print(f"note: no input given, this is {given.title}", file=sys.stderr)
        return JsonLines()
    title = given.title[:1].upper() + given.title[1:]
    if single:
        return FullReport(screen, title=title)
    return LineReport(screen, title=given.files)


@contextlib.contextmanager
def _progress(
    args: argparse.Namespace, frames: FrameSource, screen: Console, *, single: bool
) -> Iterator[Callable[[], None]]:
    """Show how far a sequence has come, where a terminal shows it and no JSON.

    On one terminal the bar has to share the console of the lines, or they overwrite each other.
    """
    if single or not sys.stderr.isatty() or (args.json and screen.is_terminal):
        yield lambda: None
        return
    known = [total for total in (frames.count, args.limit) if total is not None]
    with Progress(
        TextColumn("frames"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=screen if screen.is_terminal else terminal(stderr=True),
        redirect_stdout=screen.is_terminal,
        transient=True,
    ) as bar:
        task = bar.add_task("frames", total=min(known, default=None))
        yield lambda: bar.advance(task)
