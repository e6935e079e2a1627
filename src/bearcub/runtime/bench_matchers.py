"""The matchers beside each other: what a pair takes, and how far off it is on pairs with truth.

Everything is compared with OpenCV's three-way semi-global matcher on one thread, by its manual's
settings.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np

from bearcub.clock import Clock
from bearcub.devices.images import read_image
from bearcub.errors import InputError
from bearcub.messages import Float32, Float64, UInt8
from bearcub.runtime.bench import on_threads, sample_pair
from bearcub.stereo import read_disparity
from bearcub.stereo.images import grey
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.native import MOST_DISPARITIES, NativeMatcher, reason_missing

Match = Callable[[UInt8, UInt8], Float32]
_Name = TypeVar("_Name", bound=Hashable)

REFERENCE = "SGBM 3WAY"
"""The name of the matcher that all are compared with."""

_GOOD = 1.0  # what is nearer to the truth counts for the sub-pixel error [px]
_LAYOUTS = (
    # left, right, disparity of the left one, its steps a pixel
    ("im0.png", "im1.png", "disp0.pfm", 1),  # Middlebury 2014 and 2021
    ("im2.png", "im6.png", "disp2.p?m", 4),  # Middlebury 2003
    ("im2.png", "im6.png", "disp2.png", 4),
    ("*_left.png", "*_right.png", "*_disp.npz", 1),  # as scikit-image has the motorcycle
    ("*L.jpg", "*R.jpg", "*GT.png", 1),  # as OpenCV has the aloe
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A rectified grey pair whose truth is known.

    Attributes
    ----------
    name : str
    left, right : ndarray of uint8, shape (H, W)
    truth : ndarray of float32, shape (H, W)
        Disparity [px], NaN where it is not known.
    """

    name: str
    left: UInt8
    right: UInt8
    truth: Float32

    @property
    def count(self) -> int:
        """How many disparities from 0 on have to be tried."""
        return 16 * (int(np.nanmax(self.truth)) // 16 + 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How far off a disparity map is; NaN where nothing is matched.

    Attributes
    ----------
    bad_2, bad_3 : float
        Share of the matched pixels that are off by more than 2 and 3 px.
    density : float
        Share of the pixels with truth that are matched.
    sub_pixel : float
        Median error of those off by less than 1 px [px].
    """

    bad_2: float
    bad_3: float
    density: float
    sub_pixel: float


def disparities_for(width: int) -> int:
    """Return how many disparities are searched in images of a width: about a tenth of it.

    Examples
    --------
    >>> disparities_for(320), disparities_for(640), disparities_for(1242)
    (32, 64, 128)
    """
    return 16 * max(round(width / 160), 1)


def contenders(count: int, *, threads: Iterable[int] = (1,)) -> dict[str, Match]:
    """Return the matchers to compare, `REFERENCE` the first, with `count` disparities to try.

    Parameters
    ----------
    count : int
    threads : iterable of int
        Of the native matcher, which is one contender for each.
    """
    found: dict[str, Match] = {
        REFERENCE: sgbm(count),
        "SGBM": sgbm(count, mode=cv2.STEREO_SGBM_MODE_SGBM),
        "BM": bm(count),
    }
    if not reason_missing() and count <= MOST_DISPARITIES:
        for number in threads:
            name = f"native, {number} thread{'s' * (number > 1)}"
            found[name] = NativeMatcher(SearchRange(0, count), threads=number)
    return found


def sgbm(count: int, block: int = 5, *, mode: int = cv2.STEREO_SGBM_MODE_SGBM_3WAY) -> Match:
    """Return OpenCV's semi-global matcher with its own speckle filter, as its manual sets it.

    Parameters
    ----------
    count : int
        Of disparities from 0 on.
    block : int
        Side of the matched block [px].
    mode : int
        OpenCV's.
    """
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
        mode=mode,
    )

    return _in_pixels(core)


def bm(count: int, block: int = 15) -> Match:
    """Return OpenCV's block matcher with its own speckle filter and checks as `sgbm` has them."""
    core = cv2.StereoBM.create(count, block)
    core.setUniquenessRatio(10)
    core.setDisp12MaxDiff(1)
    core.setSpeckleWindowSize(100)
    core.setSpeckleRange(2)
    return _in_pixels(core)


def _in_pixels(core: Any) -> Match:
    def match(left: UInt8, right: UInt8) -> Float32:
        found = np.asarray(core.compute(left, right), dtype=np.float32) / np.float32(16)
        return np.where(found < 0, np.float32(np.nan), found)

    return match


class Yardstick:
    """What this core is worth at the moment: how long `REFERENCE` takes on the sample.

    Parameters
    ----------
    width, height : int
        Of the images [px], of the sample's aspect.
    clock : Clock

    Attributes
    ----------
    count : int
        Of disparities that are searched.
    """

    def __init__(self, *, width: int, height: int, clock: Clock) -> None:
        left, right = sample_pair(width=width, height=height)
        self.count = disparities_for(width)
        self._calls = {REFERENCE: partial(sgbm(self.count), grey(left), grey(right))}
        self._clock = clock
        self._spent: list[float] = []

    def __call__(self) -> None:
        """Match the pair once, on one thread."""
        with on_threads(1):
            times = take_turns(self._calls, rounds=1, clock=self._clock)
        self._spent.append(float(times[REFERENCE][0]))

    @property
    def p50(self) -> float:
        """The median so far [ms]."""
        return float(np.median(self._spent))


def take_turns(
    calls: Mapping[_Name, Callable[[], object]], *, rounds: int, clock: Clock
) -> dict[_Name, Float64]:
    """Call all again and again, in turns: what disturbs one disturbs all.

    Parameters
    ----------
    calls : mapping of str to callable
    rounds : int
        That count; one more warms up.
    clock : Clock

    Returns
    -------
    dict of str to ndarray of float64, shape (rounds,)
        Milliseconds.
    """
    spent: dict[_Name, list[float]] = {name: [] for name in calls}
    for _ in range(rounds + 1):
        for name, call in calls.items():
            start_ns = clock.now_ns()
            call()
            spent[name].append((clock.now_ns() - start_ns) * 1e-6)
    return {name: np.array(times[1:]) for name, times in spent.items()}


def scene(width: int, height: int) -> tuple[UInt8, UInt8]:
    """Return a textured floor with six boxes on it, as both cameras see it with some noise."""
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


def pairs_in(folder: Path) -> list[Pair]:
    """Read every pair with truth in a folder and those below it, in the layouts of Middlebury.

    Raises
    ------
    InputError
        If there is none.
    FormatError
        If one cannot be read.
    """
    found = sorted(_files(folder))
    if not found:
        raise InputError(
            f"{folder}: holds no pair with truth; expected im0.png, im1.png and disp0.pfm, or "
            "im2.png, im6.png and disp2.png, in a folder for each"
        )
    return [
        Pair(
            name=left.parent.name,
            left=grey(read_image(left)),
            right=grey(read_image(right)),
            truth=_truth(truth, steps),
        )
        for left, right, truth, steps in found
    ]


def _files(folder: Path) -> Iterator[tuple[Path, Path, Path, int]]:
    for *patterns, disparity, steps in _LAYOUTS:
        for truth in folder.rglob(str(disparity)):
            sides = [sorted(truth.parent.glob(str(pattern))) for pattern in patterns]
            if all(len(side) == 1 for side in sides):
                yield sides[0][0], sides[1][0], truth, int(steps)


def _truth(path: Path, steps: int) -> Float32:
    """Return disparity; a truth of 0 or infinity is none."""
    if path.suffix in (".pfm", ".npz"):
        values = read_disparity(path).disparity
    else:
        values = grey(read_image(path)).astype(np.float32) / np.float32(steps)
    return np.where(np.isfinite(values) & (values > 0), values, np.float32(np.nan))


def score(found: Float32, pair: Pair, *, first: int) -> Score:
    """Score a disparity map of a pair from a column on.

    Parameters
    ----------
    found : ndarray of float32, shape (H, W)
        [px]; NaN unmatched.
    pair : Pair
    first : int
        The first column that counts: `Pair.count` where what OpenCV cannot search is left out.
    """
    truth = pair.truth[:, first:]
    error = np.abs(found[:, first:] - truth)
    error = error[np.isfinite(error)]
    good = error[error < _GOOD]
    return Score(
        bad_2=float((error > 2).mean()) if len(error) else math.nan,
        bad_3=float((error > 3).mean()) if len(error) else math.nan,
        density=len(error) / int(np.isfinite(truth).sum()),
        sub_pixel=float(np.median(good)) if len(good) else math.nan,
    )


def mean(scores: Iterable[Score]) -> Score:
    """Return the mean of every figure."""
    scores = list(scores)
    return Score(
        **{
            item.name: float(np.mean([getattr(one, item.name) for one in scores]))
            for item in fields(Score)
        }
    )
