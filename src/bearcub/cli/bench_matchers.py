"""``bearcub bench --matchers``: the matchers beside each other, in turns."""

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path

from rich.console import RenderableType
from rich.table import Table

from bearcub.cli.bench_tables import as_json, empty_table, print_under
from bearcub.clock import MonotonicClock
from bearcub.config import Config
from bearcub.runtime.bench import on_threads, summarise
from bearcub.runtime.bench_matchers import (
    REFERENCE,
    Score,
    contenders,
    disparities_for,
    mean,
    pairs_in,
    scene,
    score,
    take_turns,
)

_Times = Mapping[str, Mapping[str, float]]  # of every matcher: p50, p99 [ms] and ratio
_Scores = Mapping[str, Mapping[str, Score]]  # of every pair and matcher


def compare(
    args: argparse.Namespace, config: Config, *, sizes: Sequence[tuple[int, int]], rounds: int
) -> int:
    """Print what every matcher takes at every size, and its errors on the pairs; return 0."""
    threads = sorted({1, config.matching.threads})
    with on_threads(1):
        scores = _scores(args.matchers)
        times = {size: _times(size, threads=threads, rounds=rounds) for size in sizes}
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


def _times(size: tuple[int, int], *, threads: Sequence[int], rounds: int) -> _Times:
    matchers = contenders(disparities_for(size[0]), threads=threads)
    spent = summarise(take_turns(matchers, scene(*size), rounds=rounds, clock=MonotonicClock()))
    reference = spent[REFERENCE]["p50"]
    return {
        name: {"p50": ms["p50"], "p99": ms["p99"], "ratio": ms["p50"] / reference}
        for name, ms in spent.items()
    }


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
    times: Mapping[tuple[int, int], _Times], scores: _Scores, *, rounds: int
) -> Mapping[str, object]:
    return as_json(
        rounds=rounds,
        reference=REFERENCE,
        sizes=[
            {
                "size": list(size),
                "disparities": disparities_for(size[0]),
                "matchers": [{"name": name, **figures} for name, figures in matchers.items()],
            }
            for size, matchers in times.items()
        ],
        accuracy=[
            {"pair": pair, "matcher": name, **_known(found)}
            for pair, matchers in scores.items()
            for name, found in matchers.items()
        ],
    )


def _known(found: Score) -> dict[str, float | None]:
    return {key: None if math.isnan(value) else value for key, value in asdict(found).items()}


def _speed_table(times: Mapping[tuple[int, int], _Times]) -> Table:
    table = empty_table(("Size", "Matcher"), ("p50 [ms]", "p99 [ms]", f"of {REFERENCE}"))
    for (width, height), matchers in times.items():
        for name, of in matchers.items():
            size = f"{width} x {height} x {disparities_for(width)}" if name == REFERENCE else ""
            table.add_row(size, name, f"{of['p50']:.2f}", f"{of['p99']:.2f}", f"{of['ratio']:.3f}")
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
