"""The column analysis of the 2005 Bearcat Cub paper, as printed and as meant: the baseline.

The paper [1]_ works on whole disparity levels. Its floor code walks the levels of one column
after another and cancels a band of rows where a flat floor would have that level::

    for every column i:                         in 1-based rows and columns, as in MATLAB
        Base = 220
        for killVal = 2..25:
            cancel the pixels of level killVal in rows Base..Base+Spread of column i
            Base = Base + FloorIncrement        (and + TiltFactor, where mod(i, 5) == 0)

What is left is counted per level and column; a peak of these counts is an object. Two slips of
the printed code are kept apart from what was meant by the argument `printed`:

1. ``TiltFactor`` ("rows per 5 columns") is added in every fifth column only, and ``Base`` is
   reset with every column. So the other columns are not corrected at all, and in every fifth one
   the shift grows with the level instead of the column. Meant is
   ``base(i) = base - tan(roll) (i - centre)`` for every level.
2. ``bitand(A, 255)``, to "strip off fractional portion", keeps the low byte of a 16-bit disparity,
   which is the fraction; the whole part is the high byte. It gave levels to the authors because
   their files were byte-swapped.

Rows and columns are 0-based here: MATLAB's row ``r`` is index ``r - 1``. `ClassicConfig.base` alone
stays 1-based, to read as printed. Only excerpts of the code are known; that ``TiltFactor`` is
added together with ``FloorIncrement``, after the band is cancelled, is our reading, and so are the
thresholds of a peak.

References
----------
.. [1] "Processing real-time stereo video for an autonomous robot using disparity maps and sensor
   fusion" (Bearcat Cub), 2005, sec. 3.1.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import ConfigError, InputError
from bearcub.geometry import Projection
from bearcub.messages import Bool, Float32, Float64, Int32, as_disparity

Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassicConfig:
    """The constants of the paper's code; the defaults are the printed ones, for a level robot.

    Attributes
    ----------
    base : float
        `Base`: first cancelled row of `first_level` in the centre column, 1-based [px].
    floor_increment : float
        `FloorIncrement`: rows that the floor moves down per level [px].
    spread : float
        `Spread`: the band is the rows ``base`` to ``base + spread``, both included [px].
    tilt_factor : float
        `TiltFactor`: rows that the floor moves down per `tilt_columns` columns to the right, so
        ``-tilt_columns tan(roll)`` (REP-103): 1 is about 12 deg with the left side down.
    tilt_columns : int
        The 5 of "rows per 5 columns" and of ``mod(i, 5)`` [px].
    first_level, last_level : int
        Range of `killVal`; objects are sought from `first_level` on.
    n_levels : int
        Levels that exist; 240 to 255 are the camera's codes for "no match".
    peak_count : int
        Pixels of one level that a column of an object has at least.
    peak_columns : int
        Neighbouring such columns that make an object.
    row_share : float
        Share of an object's columns that a row of it fills at least.
    """

    base: float = 220.0
    floor_increment: float = 10.0
    spread: float = 30.0
    tilt_factor: float = 0.0
    tilt_columns: int = 5
    first_level: int = 2
    last_level: int = 25
    n_levels: int = 240
    peak_count: int = 20
    peak_columns: int = 5
    row_share: float = 0.25

    def __post_init__(self) -> None:
        for name, low in (("floor_increment", 0.0), ("spread", 0), ("tilt_columns", 1)):
            if not getattr(self, name) >= low:
                raise ConfigError(f"classic.{name} = {getattr(self, name)}: must be at least {low}")
        if not 1 <= self.first_level <= self.last_level + 1 <= self.n_levels:
            raise ConfigError(
                f"classic levels {self.first_level} to {self.last_level} of {self.n_levels}: "
                "expected 1 <= first_level <= last_level + 1 <= n_levels"
            )

    @classmethod
    def from_plane(
        cls, plane: Float64, *, shape: tuple[int, int], tolerance: float | None = None
    ) -> "ClassicConfig":
        """Derive the constants for another rig from its floor in disparity space.

        Parameters
        ----------
        plane : ndarray of float64, shape (3,)
            (a, b, c) of the floor's disparity ``a u + b v + c`` [px]: `Projection.plane` of a
            known attitude and height, or one that was fitted.
        shape : tuple of int
            (rows, columns) of the disparity map.
        tolerance : float, optional
            How far a floor pixel's disparity may be off to either side [px]; the band of level k
            then is where the floor has ``k - tolerance`` to ``k + 1 + tolerance``. By default the
            band is laid as printed: three levels long, starting where the floor has level k.

        Raises
        ------
        InputError
            If the disparity of `plane` does not grow downwards.

        Examples
        --------
        The paper's rig has the printed constants, ``row = 200 + 10 level``:

        >>> from bearcub.geometry import Attitude
        >>> rig = Projection(fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
        >>> down = Attitude(roll=-np.radians(12), pitch=np.radians(5.9)).down()
        >>> tilted = ClassicConfig.from_plane(rig.plane(height=1.2, down=down), shape=(480, 640))
        >>> print(f"{tilted.base:.0f} {tilted.floor_increment:.0f} {tilted.tilt_factor:.1f}")
        220 10 1.1
        """
        a, b, c = (float(value) for value in plane)
        rows, columns = shape
        if not b > 0.0:
            raise InputError(f"floor plane ({a:g}, {b:g}, {c:g}): expected disparity to grow down")
        centre = (columns - 1) / 2
        lead, length = (0.0, 3.0) if tolerance is None else (tolerance, 1.0 + 2.0 * tolerance)
        nearest = math.floor(max(c, c + a * (columns - 1)) + b * (rows - 1))
        last_level = max(nearest, PAPER.first_level - 1)
        return replace(
            PAPER,
            base=(PAPER.first_level - lead - c - a * centre) / b + 1,
            floor_increment=1 / b,
            spread=length / b,
            tilt_factor=-PAPER.tilt_columns * a / b,
            last_level=last_level,
            # Things stand nearer than the floor at the lower edge: up to half its distance.
            n_levels=max(PAPER.n_levels, 2 * last_level),
        )


PAPER = ClassicConfig()


@dataclass(frozen=True, slots=True, kw_only=True)
class Peak:
    """A run of columns with many pixels of one level."""

    level: int
    first: int  # column
    last: int  # column, included
    area: int  # sum of the counts
    centre: float  # of area: sum(column * count) / sum(count)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassicObject:
    """One object in front of the camera.

    Attributes
    ----------
    peak : Peak
        Its level and columns.
    top, bottom : int
        Its first and last row, included.
    distance : float
        Depth ``f B / level`` along the optical axis [m].
    bearing : float
        Of the centre of area from the optical axis [rad], left positive.
    width, height : float
        Of its columns and rows at that depth [m]. The floor's band has eaten its lowest rows.
    """

    peak: Peak
    top: int
    bottom: int
    distance: float
    bearing: float
    width: float
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassicAnswer:
    """The objects of one frame, nearest first, with the level maps of shape (H, W) behind them."""

    objects: tuple[ClassicObject, ...]
    levels: Int32
    kept: Int32


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassicProfiles:
    """What the paper's figures show of L chosen levels, [before, after] cancelling the floor."""

    levels: tuple[int, ...]
    histogram: Counts  # (n_levels,), pixels of the whole map per level without level 0
    columns: Counts  # (2, L, W), pixels of the level per column
    rows: Counts  # (2, L, H), pixels of the level per row
    cancelled: Bool  # (H, W), the pixels taken for floor


def levels_from_words(words: NDArray[np.uint16], *, printed: bool) -> Int32:
    """Return the level of 16-bit disparities (8.8 fixed point) as printed or as meant.

    Examples
    --------
    16.5 px and "no match" (slip 2):

    >>> words = np.array([[0x1080, 0xFF00]], dtype=np.uint16)
    >>> levels_from_words(words, printed=False), levels_from_words(words, printed=True)
    (array([[ 16, 255]], dtype=int32), array([[128,   0]], dtype=int32))
    """
    return (words & 255 if printed else words >> 8).astype(np.int32)


def levels_from_disparity(disparity: Float32) -> Int32:
    """Return the whole part of disparities [px]; 0 for NaN, infinite and negative ones."""
    usable = (disparity > 0) & (disparity < 65536)
    return np.where(usable, disparity, 0.0).astype(np.int32)


def cancel_floor(levels: Int32, *, printed: bool, config: ClassicConfig = PAPER) -> Int32:
    """Return `levels`, shape (H, W), with 0 where a pixel lies in the floor's band of its level.

    `printed` says whether the tilt is corrected as printed or as meant (slip 1 of the module).
    """
    height, width = levels.shape
    base = _base_rows(config, width=width, printed=printed)
    first_row = base[np.clip(levels, 0, config.n_levels - 1), np.arange(width)]
    row = np.arange(1, height + 1)[:, np.newaxis]
    floor = (config.first_level <= levels) & (levels <= config.last_level)
    floor &= (first_row <= row) & (row <= first_row + config.spread)
    return np.where(floor, 0, levels).astype(np.int32)


def _base_rows(config: ClassicConfig, *, width: int, printed: bool) -> Int32:
    """Return `Base` of every level and column, shape (n_levels, width), 1-based rows."""
    passes = np.arange(config.n_levels)[:, np.newaxis] - config.first_level
    i = np.arange(1, width + 1)
    if printed:
        shift = np.where(i % config.tilt_columns == 0, config.tilt_factor * passes, 0.0)
    else:
        shift = config.tilt_factor / config.tilt_columns * (i - (width + 1) / 2)
    base: Int32 = np.floor(config.base + config.floor_increment * passes + shift + 0.5).astype(
        np.int32
    )
    return base


def column_histogram(levels: Int32, *, n_levels: int) -> Counts:
    """Count the pixels of every level in every column: the paper's array X, (n_levels, W).

    Level 0 and levels from `n_levels` on are not counted.

    Examples
    --------
    >>> column_histogram(np.array([[3, 0, 0], [3, 1, 9]]), n_levels=4)
    array([[0, 0, 0],
           [0, 1, 0],
           [0, 0, 0],
           [2, 0, 0]])
    """
    width = levels.shape[1]
    counted = (levels > 0) & (levels < n_levels)
    cell = levels * width + np.arange(width)
    counts = np.bincount(cell[counted], minlength=n_levels * width)
    return counts.astype(np.int64).reshape(n_levels, width)


def row_histogram(levels: Int32, *, n_levels: int) -> Counts:
    """Count the pixels of every level in every row, shape (H, n_levels).

    Examples
    --------
    >>> row_histogram(np.array([[3, 0, 0], [3, 1, 9]]), n_levels=4)
    array([[0, 0, 0, 1],
           [0, 1, 0, 1]])
    """
    return column_histogram(levels.T, n_levels=n_levels).T


def peaks(counts: Counts, *, config: ClassicConfig = PAPER) -> tuple[Peak, ...]:
    """Return the runs of columns with enough pixels of one level, farthest level first.

    `counts`, shape (n_levels, W), is the column histogram of a map without its floor.
    """
    high = counts >= config.peak_count
    high[: config.first_level] = False
    steps = np.diff(high.astype(np.int8), axis=1, prepend=0, append=0)
    levels, starts = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    found = []
    for level, first, end in zip(levels.tolist(), starts.tolist(), ends.tolist(), strict=True):
        if end - first >= config.peak_columns:
            run = counts[level, first:end]
            area = int(run.sum())
            centre = float(np.arange(first, end) @ run) / area
            found.append(Peak(level=level, first=first, last=end - 1, area=area, centre=centre))
    return tuple(found)


def detect(
    disparity: Float32,
    projection: Projection,
    *,
    config: ClassicConfig = PAPER,
    printed: bool = False,
) -> ClassicAnswer:
    """Find the objects of one disparity map the paper's way.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], adjusted for the principal points; NaN where unmatched, 0 at infinity.
    projection : Projection
        Turns levels into metres.
    config : ClassicConfig, optional
        The paper's rig by default; see `ClassicConfig.from_plane`.
    printed : bool, optional
        Correct the tilt as printed instead of as meant.

    Raises
    ------
    InputError
        If `disparity` is not a two-dimensional array of floats.
    """
    levels = levels_from_disparity(as_disparity(disparity, name="disparity"))
    kept = cancel_floor(levels, printed=printed, config=config)
    found = _strongest(peaks(column_histogram(kept, n_levels=config.n_levels), config=config))
    objects = [_measure(peak, kept, projection, config.row_share) for peak in found]
    objects.sort(key=lambda thing: thing.distance)
    return ClassicAnswer(objects=tuple(objects), levels=levels, kept=kept)


def _strongest(found: tuple[Peak, ...]) -> list[Peak]:
    """Leave out the weaker of two peaks that share columns at neighbouring levels.

    A face halfway between two levels shows at both; it is one thing.
    """
    strong: list[Peak] = []
    for peak in sorted(found, key=lambda peak: -peak.area):
        if not any(
            abs(peak.level - other.level) <= 1
            and peak.first <= other.last
            and other.first <= peak.last
            for other in strong
        ):
            strong.append(peak)
    return strong


def _measure(peak: Peak, kept: Int32, projection: Projection, row_share: float) -> ClassicObject:
    columns = peak.last - peak.first + 1
    per_row = np.count_nonzero(kept[:, peak.first : peak.last + 1] == peak.level, axis=1)
    # A row of stray pixels does not make an object taller; its fullest row always counts.
    rows = np.flatnonzero(per_row >= min(row_share * columns, per_row.max()))
    top, bottom = int(rows[0]), int(rows[-1])
    distance = projection.fx * projection.baseline / peak.level
    return ClassicObject(
        peak=peak,
        top=top,
        bottom=bottom,
        distance=distance,
        bearing=math.atan2(projection.cx - peak.centre, projection.fx),
        width=columns * distance / projection.fx,
        height=(bottom - top + 1) * distance / projection.fy,
    )


def profiles(
    answer: ClassicAnswer, *, levels: tuple[int, ...], config: ClassicConfig = PAPER
) -> ClassicProfiles:
    """Return the arrays behind the paper's plots of chosen levels.

    Raises
    ------
    InputError
        If a level is not from 1 to ``config.n_levels - 1``.
    """
    for level in levels:
        if not 1 <= level < config.n_levels:
            raise InputError(f"level {level}: expected one from 1 to {config.n_levels - 1}")
    before_after = (answer.levels, answer.kept)
    columns = [column_histogram(each, n_levels=config.n_levels) for each in before_after]
    rows = [row_histogram(each, n_levels=config.n_levels) for each in before_after]
    chosen = list(levels)
    return ClassicProfiles(
        levels=levels,
        histogram=columns[0].sum(axis=1),
        columns=np.stack([each[chosen] for each in columns]),
        rows=np.stack([each.T[chosen] for each in rows]),
        cancelled=answer.kept != answer.levels,
    )
