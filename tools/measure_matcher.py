"""Measure the native matcher beside OpenCV's: speed, growth of the cost, accuracy, exposure.

    python tools/measure_matcher.py [DATA] [--rounds N] [--quick]

DATA is a folder with the Middlebury pairs: aloe/aloeL.jpg, aloeR.jpg, aloeGT.png;
middlebury/cones and teddy with im2.png, im6.png, disp2.pgm (4 levels a pixel);
middlebury/motorcycle with motorcycle_left.png, motorcycle_right.png, motorcycle_disp.npz. Without
it only speed is measured. Times are medians of runs that alternate, and are compared as ratios to
OpenCV's three-way semi-global matcher with one thread in the same run.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.clock import MonotonicClock
from bearcub.messages import Float32, UInt8
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.native import NativeMatcher, levels

Match = Callable[[UInt8, UInt8], Float32]
SIZES = ((640, 480, 64), (1242, 375, 128))
GROWTH = ((320, 240, 32), (640, 480, 64), (640, 480, 128), (1280, 720, 128), (1920, 1080, 256))
EXPOSURES = ((0.7, 1.0), (0.85, 1.0), (1.2, 1.0), (1.4, 1.0), (1.0, 0.8), (1.0, 1.25))
GOOD = 1.0  # px; what is nearer to the truth counts for the sub-pixel error


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A pair with the truth."""

    name: str
    left: UInt8
    right: UInt8
    truth: Float32
    count: int


def main() -> None:
    """Print every table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, nargs="?")
    parser.add_argument("--rounds", type=int, default=11, metavar="N")
    parser.add_argument("--quick", action="store_true", help="leave out the growth of the cost")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    print_speed(args.rounds)
    if not args.quick:
        print_growth(args.rounds)
    if args.data:
        pairs = list(pairs_of(args.data))
        print_accuracy(pairs)
        print_exposures(pairs)


def sgbm(count: int, block: int) -> Match:
    """Return OpenCV's matcher with the settings that it is compared with."""
    core = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=count,
        blockSize=block,
        P1=8 * block**2,
        P2=32 * block**2,
        disp12MaxDiff=1,
        preFilterCap=0,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )

    def match(left: UInt8, right: UInt8) -> Float32:
        found = np.asarray(core.compute(left, right), dtype=np.float32) / np.float32(16)
        return np.where(found < 0, np.float32(np.nan), found)

    return match


def scene(width: int, height: int) -> tuple[UInt8, UInt8]:
    """Return a textured floor with boxes on it, seen by both cameras."""
    random = np.random.default_rng(0)
    wide = cv2.GaussianBlur(random.normal(128, 60, (height, width + 200)), (0, 0), 1.0)
    rows = np.arange(height, dtype=np.float32)[:, None]
    disparity = np.repeat(np.maximum(rows / height - 0.3, 0.02) * 0.08 * width, width, axis=1)
    for i in range(6):
        top, left = int(height * (0.2 + 0.08 * i)), int(width * (0.05 + 0.15 * i))
        box = np.s_[top : top + height // 4, left : left + width // 12]
        disparity[box] = disparity[min(top + height // 4, height - 1), 0]
    columns = np.arange(width, dtype=np.float32) - disparity.astype(np.float32) + 100
    mapped = cv2.remap(wide, columns, np.repeat(rows, width, axis=1), cv2.INTER_CUBIC)
    noisy = [x + random.normal(0, 2, x.shape) for x in (mapped, wide[:, 100:-100])]
    left_image, right_image = (np.clip(x, 0, 255).astype(np.uint8) for x in noisy)
    return left_image, right_image


def medians(matchers: dict[str, Match], pair: tuple[UInt8, UInt8], rounds: int) -> dict[str, float]:
    """Return what each takes [ms], by turns."""
    clock = MonotonicClock()
    spent: dict[str, list[float]] = {name: [] for name in matchers}
    for number in range(rounds + 1):
        for name, match in matchers.items():
            start = clock.now_ns()
            match(*pair)
            if number:  # the first warms up
                spent[name].append((clock.now_ns() - start) / 1e6)
    return {name: median(times) for name, times in spent.items()}


def print_speed(rounds: int) -> None:
    """Print times and ratios for the usual sizes, every level, one thread and two."""
    print(f"{'size':>13} {'matcher':<22} {'ms':>7} {'ratio':>6}")
    for width, height, count in SIZES:
        matchers: dict[str, Match] = {"SGBM 3WAY": sgbm(count, 5)}
        for level in levels():
            for threads in (1, 2):
                name = f"native {level}, {threads} thr."
                search = SearchRange(0, count)
                matchers[name] = NativeMatcher(search, level=level, threads=threads)
        times = medians(matchers, scene(width, height), rounds)
        for name, spent in times.items():
            ratio = spent / times["SGBM 3WAY"]
            print(f"{width:>5}x{height}x{count:<3} {name:<22} {spent:7.2f} {ratio:6.3f}")


def print_growth(rounds: int) -> None:
    """Print what a pixel and a disparity cost at several sizes, and the working memory."""
    print(f"\n{'size':>13} {'ms':>8} {'ns per kilo-candidate':>22} {'MB':>6}")
    for width, height, count in GROWTH:
        matcher = NativeMatcher(SearchRange(0, count))
        spent = medians({"": matcher}, scene(width, height), rounds)[""]
        each = 1e9 * spent / (width * height * count)
        memory = matcher.working_memory / 1e6
        print(f"{width:>5}x{height}x{count:<3} {spent:8.2f} {each:22.1f} {memory:6.2f}")


def pairs_of(data: Path) -> Iterator[Pair]:
    """Read the pairs whose truth is known."""
    for name in ("cones", "teddy"):
        folder = data / "middlebury" / name
        truth = grey(folder / "disp2.pgm") / np.float32(4)
        yield pair(name, folder / "im2.png", folder / "im6.png", truth, 64)
    folder = data / "middlebury" / "motorcycle"
    truth = np.load(folder / "motorcycle_disp.npz")["arr_0"].astype(np.float32)
    left, right = folder / "motorcycle_left.png", folder / "motorcycle_right.png"
    yield pair("motorcycle", left, right, truth, 64)
    truth = grey(data / "aloe" / "aloeGT.png").astype(np.float32)
    yield pair("aloe", data / "aloe" / "aloeL.jpg", data / "aloe" / "aloeR.jpg", truth, 224)


def pair(name: str, left: Path, right: Path, truth: NDArray[Any], count: int) -> Pair:
    """Return the pair; a truth of 0 or infinity is none."""
    known = np.isfinite(truth) & (truth > 0)
    known_truth = np.where(known, truth, np.nan).astype(np.float32)
    return Pair(name=name, left=grey(left), right=grey(right), truth=known_truth, count=count)


def grey(path: Path) -> UInt8:
    """Read a grey image."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise SystemExit(f"{path}: not an image")
    return np.asarray(image, dtype=np.uint8)


def score(found: Float32, pair: Pair, first: int) -> tuple[float, float, float, float]:
    """Return bad-2, bad-3 and density [%] and the sub-pixel error [px] from a column on."""
    truth = pair.truth[:, first:]
    error = np.abs(found[:, first:] - truth)
    error = error[np.isfinite(error)]
    density = 100 * len(error) / np.isfinite(truth).sum()
    bad = [float(100 * (error > limit).mean()) for limit in (2, 3)]
    return bad[0], bad[1], float(density), float(np.median(error[error < GOOD]))


def print_accuracy(pairs: list[Pair]) -> None:
    """Print errors and density on every pair, with and without the left strip."""
    print(f"\n{'pair':<11} {'matcher':<12} {'bad-2':>6} {'bad-3':>6} {'density':>8} {'sub-px':>7}")
    for strip in (True, False):
        print("all columns:" if strip else "without the columns below the search range:")
        rows: dict[str, list[tuple[float, float, float, float]]] = {}
        for pair in pairs:
            matchers: dict[str, Match] = {
                "SGBM 3WAY 3": sgbm(pair.count, 3),
                "SGBM 3WAY 5": sgbm(pair.count, 5),
                "native": NativeMatcher(SearchRange(0, pair.count)),
            }
            for name, match in matchers.items():
                found = score(match(pair.left, pair.right), pair, 0 if strip else pair.count)
                rows.setdefault(name, []).append(found)
                print_score(pair.name, name, found)
        for name, scores in rows.items():
            print_score("mean", name, np.mean(scores, axis=0))


def print_score(pair: str, matcher: str, found: "Iterator[float] | tuple[float, ...]") -> None:
    """Print one row."""
    bad2, bad3, density, fine = found
    print(f"{pair:<11} {matcher:<12} {bad2:6.2f} {bad3:6.2f} {density:8.1f} {fine:7.3f}")


def print_exposures(pairs: list[Pair]) -> None:
    """Print means over the pairs with the right camera exposed otherwise."""
    print(f"\n{'gain':>5} {'gamma':>6} {'matcher':<12} {'bad-2':>6} {'bad-3':>6} {'density':>8}")
    for gain, gamma in ((1.0, 1.0), *EXPOSURES):
        for name in ("SGBM 3WAY 3", "native"):
            scores = []
            for pair in pairs:
                other = np.clip(255 * gain * (pair.right / 255) ** gamma, 0, 255).astype(np.uint8)
                native = NativeMatcher(SearchRange(0, pair.count))
                match = native if name == "native" else sgbm(pair.count, 3)
                scores.append(score(match(pair.left, other), pair, pair.count))
            bad2, bad3, density, _ = np.mean(scores, axis=0)
            print(f"{gain:5.2f} {gamma:6.2f} {name:<12} {bad2:6.2f} {bad3:6.2f} {density:8.1f}")


if __name__ == "__main__":
    main()
