"""Measure the native matcher beside OpenCV's: speed, accuracy, exposure.

    python tools/measure_matcher.py [DATA] [--rounds N]

``bearcub bench --matchers`` tells a user what this machine does, also how the cost grows with sizes
and disparities; this adds every instruction set, the left strip, and pairs whose cameras are
exposed differently. DATA is a
folder with pairs whose truth is known, in the layouts of Middlebury; without it only speed is
measured. Times are medians of runs that alternate, and are compared as ratios to OpenCV's
three-way semi-global matcher with one thread in the same run.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from bearcub.clock import MonotonicClock
from bearcub.messages import Float32, UInt8
from bearcub.runtime.bench_matchers import (
    REFERENCE,
    Match,
    Pair,
    Score,
    mean,
    pairs_in,
    scene,
    score,
    sgbm,
    take_turns,
)
from bearcub.stereo.images import shifted
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.native import NativeMatcher, levels

SIZES = ((640, 480, 64), (1242, 375, 128))
EXPOSURES = ((0.7, 1.0), (0.85, 1.0), (1.2, 1.0), (1.4, 1.0), (1.0, 0.8), (1.0, 1.25))


def main() -> None:
    """Print every table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, nargs="?")
    parser.add_argument("--rounds", type=int, default=11, metavar="N")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    print_speed(args.rounds)
    if args.data:
        pairs = pairs_in(args.data)
        print_accuracy(pairs)
        print_exposures(pairs)


def medians(matchers: dict[str, Match], pair: tuple[UInt8, UInt8], rounds: int) -> dict[str, float]:
    """Return what each takes [ms], by turns."""
    calls = {name: partial(match, *pair) for name, match in matchers.items()}
    times = take_turns(calls, rounds=rounds, clock=MonotonicClock())
    return {name: float(np.median(spent)) for name, spent in times.items()}


def print_speed(rounds: int) -> None:
    """Print times and ratios for the usual sizes, every level, one thread and two."""
    print(f"{'size':>13} {'matcher':<22} {'ms':>7} {'ratio':>6}")
    for width, height, count in SIZES:
        matchers: dict[str, Match] = {REFERENCE: sgbm(count)}
        for level in levels():
            for threads in (1, 2):
                name = f"native {level}, {threads} thr."
                search = SearchRange(0, count)
                matchers[name] = NativeMatcher(search, level=level, threads=threads)
        times = medians(matchers, scene(width, height), rounds)
        for name, spent in times.items():
            ratio = spent / times[REFERENCE]
            print(f"{width:>5}x{height}x{count:<3} {name:<22} {spent:7.2f} {ratio:6.3f}")


def print_accuracy(pairs: list[Pair]) -> None:
    """Print errors and density on every pair, with and without the left strip."""
    print(f"\n{'pair':<11} {'matcher':<12} {'bad-2':>6} {'bad-3':>6} {'density':>8} {'sub-px':>7}")
    for strip in (True, False):
        print("all columns:" if strip else "without the columns below the search range:")
        rows: dict[str, list[Score]] = {}
        for pair in pairs:
            matchers: dict[str, Match] = {
                f"{REFERENCE} 3": sgbm(pair.count, 3),
                f"{REFERENCE} 5": sgbm(pair.count, 5),
                "native": NativeMatcher(SearchRange(0, pair.count)),
            }
            for name, match in matchers.items():
                first = 0 if strip else pair.count
                found = score(match(pair.left, pair.right), pair, first=first)
                rows.setdefault(name, []).append(found)
                print_score(f"{pair.name:<11} {name:<12}", found)
        for name, scores in rows.items():
            print_score(f"{'mean':<11} {name:<12}", mean(scores))


def print_score(what: str, found: Score, *more: float) -> None:
    """Print one row."""
    shares = 100 * found.bad_2, 100 * found.bad_3, 100 * found.density
    print(
        f"{what} {shares[0]:6.2f} {shares[1]:6.2f} {shares[2]:8.1f} {found.sub_pixel:7.3f}",
        *(f"{value:14.1f}" for value in more),
    )


def print_exposures(pairs: list[Pair]) -> None:
    """Print means over the pairs with the right camera exposed otherwise.

    And the density where the true match is not clipped to white, with that of the same pixels in
    cameras exposed alike.
    """
    print(
        f"\n{'gain':>5} {'gamma':>6} {'matcher':<12} {'bad-2':>6} {'bad-3':>6} {'density':>8} "
        f"{'sub-px':>7} {'not clipped: density':>21} {'alike':>6}"
    )
    for gain, gamma in ((1.0, 1.0), *EXPOSURES):
        for name in (f"{REFERENCE} 3", "native"):
            scores, kept, alike = [], [], []
            for pair in pairs:
                other = np.clip(255 * gain * (pair.right / 255) ** gamma, 0, 255).astype(np.uint8)
                native = NativeMatcher(SearchRange(0, pair.count))
                match = native if name == "native" else sgbm(pair.count, 3)
                found, first = match(pair.left, other), pair.count
                scores.append(score(found, pair, first=first))
                visible = replace(pair, truth=where_not_clipped(pair.truth, other))
                kept.append(score(found, visible, first=first))
                alike.append(score(match(pair.left, pair.right), visible, first=first))
            densities = 100 * mean(kept).density, 100 * mean(alike).density
            print_score(f"{gain:5.2f} {gamma:6.2f} {name:<12}", mean(scores), *densities)


def where_not_clipped(truth: Float32, right: UInt8) -> Float32:
    """Return the truth of the pixels whose match has no white around it, in 5 x 5 pixels."""
    white = cv2.dilate((right == 255).astype(np.uint8), np.ones((5, 5), np.uint8))
    there = shifted(np.asarray(white, np.uint8), truth, interpolation=cv2.INTER_NEAREST)
    return np.where(there > 0, np.float32(np.nan), truth)


if __name__ == "__main__":
    main()
