"""``bearcub bench --matchers``: the matchers beside each other, in turns.

With several sizes and disparities it shows how the cost grows: what a candidate takes, one
disparity of one pixel, stays the same where that is linear in both.
"""

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from rich.console import RenderableType
from rich.table import Table

from bearcub.cli.bench_tables import as_json, empty_table, print_under
from bearcub.clock import MonotonicClock
from bearcub.config import Config
from bearcub.runtime.bench import on_threads
from bearcub.runtime.bench_matchers import (
    REFERENCE,
    Match,
    Score,
    contenders,
    disparities_for,
    mean,
    pairs_in,
    scene,
    score,
    take_turns,
)
from bearcub.stereo.native import NativeMatcher

_Times = Mapping[str, Mapping[str, float | None]]  # of every matcher
_Search = tuple[int, int, int]  # width, height and disparities
_Scores = Mapping[str, Mapping[str, Score]]  # of every pair and matcher


def compare(
    args: argparse.Namespace, config: Config, *, sizes: Sequence[tuple[int, int]], rounds: int
) -> int:
    """Print what every matcher takes at every size, and its errors on the pairs; return 0."""
    searches = [
        (width, height, count)
        for width, height in sizes
        for count in args.disparities or [disparities_for(width)]
    ]
    with on_threads(1):
        scores = _scores(args.matchers)
        times = _times(searches, threads=sorted({1, config.matching.threads}), rounds=rounds)
    if args.json:
        print(json.dumps(_figures(times, scores, rounds=rounds)))
        return 0
    tables: list[RenderableType] = [_speed_table(times)]
    if scores:
        tables += ["", _accuracy_table(scores)]
    print_under(
        f"a made pair, matched {rounds} times by each in turns, after 1 to warm up", *tables
    )
    return 0


def _times(
    searches: Sequence[_Search], *, threads: Sequence[int], rounds: int
) -> Mapping[_Search, _Times]:
    matchers, calls = {}, {}
    for width, height, count in searches:
        pair = scene(width, height)
        for name, match in contenders(count, threads=threads).items():
            matchers[(width, height, count), name] = match
            calls[(width, height, count), name] = partial(match, *pair)
    spent = take_turns(calls, rounds=rounds, clock=MonotonicClock())
    times: dict[_Search, dict[str, dict[str, float | None]]] = {}
    for (search, name), ms in spent.items():
        p50 = float(np.median(ms))
        times.setdefault(search, {})[name] = {
            "p50": p50,
            "p99": float(np.percentile(ms, 99)),
            "ratio": p50 / float(np.median(spent[search, REFERENCE])),
            "candidate_ps": 1e9 * p50 / math.prod(search),
            "memory_mb": _megabytes(matchers[search, name]),
        }
    return times


def _megabytes(match: Match) -> float | None:
    """Return what a matcher holds beyond the images and the answer; OpenCV's do not tell."""
    return match.working_memory * 1e-6 if isinstance(match, NativeMatcher) else None


def _scores(folders: Sequence[Path]) -> _Scores:
    scores: dict[str, dict[str, Score]] = {}
    for pair in chain.from_iterable(pairs_in(folder) for folder in folders):
        scores[pair.name] = {
            name: score(match(pair.left, pair.right), pair, first=pair.count)
            for name, match in contenders(pair.count).items()
        }
    if scores:
        everywhere = [name for name in contenders(16) if all(name in of for of in scores.values())]
        scores["mean"] = {name: mean(of[name] for of in scores.values()) for name in everywhere}
    return scores


def _figures(
    times: Mapping[_Search, _Times], scores: _Scores, *, rounds: int
) -> Mapping[str, object]:
    return as_json(
        rounds=rounds,
        reference=REFERENCE,
        sizes=[
            {
                "size": [width, height],
                "disparities": count,
                "matchers": [{"name": name, **figures} for name, figures in matchers.items()],
            }
            for (width, height, count), matchers in times.items()
        ],
        accuracy=[
            {"pair": pair, "matcher": name, **_known(found)}
            for pair, matchers in scores.items()
            for name, found in matchers.items()
        ],
    )


def _known(found: Score) -> dict[str, float | None]:
    return {key: None if math.isnan(value) else value for key, value in asdict(found).items()}


def _speed_table(times: Mapping[_Search, _Times]) -> Table:
    columns = {
        "p50 [ms]": ("p50", 2),
        "p99 [ms]": ("p99", 2),
        f"of {REFERENCE}": ("ratio", 3),
        "a candidate [ps]": ("candidate_ps", 0),
        "memory [MB]": ("memory_mb", 1),
    }
    table = empty_table(("Size", "Matcher"), columns)
    for search, matchers in times.items():
        for name, of in matchers.items():
            figures = [(of[key], digits) for key, digits in columns.values()]
            table.add_row(
                " x ".join(map(str, search)) if name == REFERENCE else "",
                name,
                *("" if value is None else f"{value:.{digits}f}" for value, digits in figures),
            )
    return table


def _accuracy_table(scores: _Scores) -> Table:
    titles = ("off by 2 px", "off by 3 px", "matched", "fraction [px]")
    table = empty_table(("Pair", "Matcher"), titles)
    for pair, matchers in scores.items():
        for name, of in matchers.items():
            shares = [f"{100 * share:.2f} %" for share in (of.bad_2, of.bad_3, of.density)]
            first = pair if name == REFERENCE else ""
            table.add_row(first, name, *shares, f"{of.sub_pixel:.3f}")
    return table
