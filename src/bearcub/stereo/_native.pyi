# What the compiled core offers; native/src/{bindings,after_bindings}.cpp define it.

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

_Three: TypeAlias = tuple[float, float, float]
_Lens: TypeAlias = tuple[float, float, float, float, float]
"""fx, fy, cx, cy, baseline."""

_Bool: TypeAlias = NDArray[np.bool_]
_Bytes: TypeAlias = NDArray[np.uint8]
_Float: TypeAlias = NDArray[np.float32]
_Double: TypeAlias = NDArray[np.float64]
_Int: TypeAlias = NDArray[np.int32]
_Long: TypeAlias = NDArray[np.int64]
_Word: TypeAlias = NDArray[np.uint16]

def levels() -> list[str]: ...
def held_bytes() -> int: ...
def count_valid(disparity: _Float) -> tuple[int, int]: ...
def sort_pixels(
    whole: _Float,
    plane: list[float],
    bend: _Float,
    tolerance: _Float,
    farthest_level: float,
    part: tuple[int, int, int, int, int, int],
    disparity: _Float,
    floor: _Float,
    residual: _Float,
    allowed: _Float,
    standing: _Bool,
    on_floor: _Bool,
    below: _Bool,
    /,
) -> None: ...
def count_standing(
    disparity: _Float, floor: _Float, standing: _Bool, nearest: float, farthest: float, /
) -> tuple[int, float]: ...
def to_cells(
    disparity: _Float,
    floor: _Float,
    standing: _Bool,
    nearest: float,
    farthest: float,
    shift: _Int,
    level: _Int,
    width: int,
    tall: float,
    overhead: float,
    index: _Long,
    column: _Int,
    cell: _Int,
    is_tall: _Bool,
    is_overhead: _Bool,
    /,
) -> None: ...
def mark_peaks(
    cell: _Int,
    tall: _Bool,
    overhead: _Bool,
    levels: int,
    columns: int,
    which: int,
    least: int,
    number: _Word,
    least_rows: _Float,
    gap: int,
    closed: _Bytes,
    /,
) -> tuple[int, int]: ...
def number_pixels(
    cell: _Int,
    tall: _Bool,
    overhead: _Bool,
    levels: int,
    columns: int,
    which: int,
    peaks: _Word,
    foot_levels: int,
    foot_columns: int,
    numbered: int,
    number: _Word,
    /,
) -> None: ...
def let_go(overhead: _Bool, index: _Long, columns: int, share: float, number: _Word, /) -> None: ...
def count_heights(number: _Word, column: _Int, heights: _Int, /) -> None: ...
def find_strips(heights: _Int, gap: int, share: float, /) -> tuple[list[int], bool, bool]: ...
def find_ends(
    disparity: _Float,
    floor: _Float,
    on_floor: _Bool,
    labels: _Int,
    u: _Long,
    v: _Long,
    lens: _Lens,
    rotation: list[list[float]],
    origin: list[float],
    first: float,
    step: float,
    directions: int,
    blocks: _Bool,
    nearest: float,
    farthest: float,
    cells: int,
    gap: int,
    hits: int,
    /,
) -> tuple[list[float], list[float], list[float]]: ...

class TrimTuning:
    def __init__(
        self,
        *,
        narrow_columns: int,
        narrow_rows: int,
        fringe: float,
        widest_fringe: int,
        edge: int,
        grows: float,
    ) -> None: ...

def all_pixels(
    labels: _Word,
    step: int,
    number: int,
    index: _Long,
    whole: _Float,
    plane: list[float],
    bend: _Float,
    tolerance: _Float,
    nearest: float,
    farthest: float,
    within: float,
    left: _Bytes | None,
    right: _Bytes | None,
    offset: float,
    tuning: TrimTuning,
) -> tuple[_Long, _Long]: ...
def find_nearer(
    labels: _Word,
    step: int,
    number: int,
    whole: _Float,
    u: _Long,
    v: _Long,
    beside: tuple[tuple[int, int], ...],
    found: _Bool,
    /,
) -> None: ...

class FeetTuning:
    def __init__(
        self,
        *,
        sure: float,
        least_share: float,
        most_share: float,
        noise: float,
        around_columns: int,
        around_rows: int,
    ) -> None: ...

def find_feet(
    left: _Bytes,
    right: _Bytes,
    plane: list[float],
    bend: _Float,
    offset: float,
    strip: tuple[int, int, int, int],
    bands: list[tuple[float, float, int, int, int, int]],
    tuning: FeetTuning,
    level: str | None = None,
) -> list[tuple[int, int, float, float]]: ...
def likeliest_wall(
    right: _Float,
    u: _Float,
    floor: _Float,
    v: _Float,
    left: _Float,
    misfit: _Float,
    known: _Bool,
    odds: tuple[float, float, float, float],
    every: int,
    least: int,
    /,
) -> tuple[int, int, int, int, float]: ...

class FaceTuning:
    def __init__(
        self,
        *,
        near: int,
        leans: float,
        sharpest: float,
        rounds: float,
        no_noise: float,
        roundest: float,
        straight: int,
        on_line: float,
        most: float,
    ) -> None: ...

class Cloud:
    def __init__(
        self,
        lens: _Lens,
        rotation: list[list[float]],
        origin: list[float],
        u: _Double,
        v: _Double,
        disparity: _Float,
        tuning: FaceTuning,
        /,
    ) -> None: ...
    def sides(self, step: float, share: float, /) -> tuple[float, float]: ...
    def heights(self, step: float, share: float, /) -> tuple[float, float]: ...
    def face(
        self, right: float, left: float, pixel: float, blur: float, alike: float, /
    ) -> tuple[float, float, float, float, float, float]: ...
    def range(self, share: float, /) -> float: ...
    def height_before(self, limit: float, share: float, /) -> float: ...
    def squares(self) -> float: ...
    def spread(self) -> tuple[float, float, float]: ...

class FitTuning:
    def __init__(
        self,
        *,
        draws: list[float],
        steps: list[float],
        scored: int,
        finalists: int,
        refined: int,
        anneal: float,
        least_steps: int,
        most_steps: int,
        settled: float,
        few: int,
        least_noise: float,
        most_noise: float,
        remote: float,
        below: float,
        near: float,
        whole: float,
        half_width: float,
        close: float,
        biweight: float,
    ) -> None: ...

def fit_plane(
    disparity: NDArray[np.float32],
    lens: _Lens,
    expected: tuple[float, ...],
    unevenness: float,
    tuning: FitTuning,
) -> tuple[_Three, float, list[_Three], int, int, int, int] | None: ...

class ProfileTuning:
    def __init__(
        self,
        *,
        knee: float,
        near_bin: float,
        far_bin: float,
        near_bins: int,
        iqr: float,
        farthest: float,
        rows: int,
        columns: int,
        half_width: float,
        least: int,
        share: float,
        step: float,
        correlated: float,
        deep: float,
        again: int,
        highest_step: float,
        mixed: float,
        smallest: float,
        largest: float,
        rounding: float,
        most: float,
    ) -> None: ...

def follow_floor(
    disparity: NDArray[np.float32],
    lens: _Lens,
    plane: _Three,
    noise: float,
    height: float,
    pitch: float,
    steepest: float,
    tuning: ProfileTuning,
) -> tuple[list[tuple[float, float, float, float]], list[int], float]: ...

class Matcher:
    def __init__(
        self,
        *,
        height: int,
        width: int,
        smallest: int,
        disparities: int,
        bits: int,
        small_step: int,
        small_drop: int,
        large_step: int,
        least_step: int,
        edge_discount: int,
        uniqueness: int,
        left_right: int,
        texture: float,
        speckle_area: int,
        speckle_step: float,
        threads: int,
        level: str | None,
    ) -> None: ...
    def match(
        self,
        left: NDArray[np.uint8] | NDArray[np.uint16],
        right: NDArray[np.uint8] | NDArray[np.uint16],
        disparity: NDArray[np.float32],
        confidence: NDArray[np.uint8] | None,
    ) -> None: ...
    @property
    def bytes(self) -> int: ...

class Rectifier:
    def __init__(
        self,
        *,
        left: NDArray[np.int16],
        left_shares: NDArray[np.uint16],
        right: NDArray[np.int16],
        right_shares: NDArray[np.uint16],
        threads: int,
        level: str | None,
    ) -> None: ...
    def rectify(
        self,
        left: NDArray[np.uint8],
        right: NDArray[np.uint8],
        rectified_left: NDArray[np.uint8],
        rectified_right: NDArray[np.uint8],
    ) -> None: ...

class _Stage:
    def run(
        self,
        left: NDArray[np.uint8],
        right: NDArray[np.uint8],
        disparity: NDArray[np.float32],
        answer: NDArray[np.float32],
    ) -> None: ...

class Gate(_Stage):
    def __init__(
        self,
        *,
        height: int,
        width: int,
        agreement: float,
        least: float,
        speckle_area: int,
        threads: int,
        level: str | None,
    ) -> None: ...

class Refiner(_Stage):
    def __init__(self, *, height: int, width: int, threads: int, level: str | None) -> None: ...
