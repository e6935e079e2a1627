# What the compiled core offers; native/src/bindings.cpp defines it.

import numpy as np
from numpy.typing import NDArray

_Three = tuple[float, float, float]
_Lens = tuple[float, float, float, float, float]
"""fx, fy, cx, cy, baseline."""

def levels() -> list[str]: ...

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

class Refiner:
    def __init__(self, *, height: int, width: int, threads: int, level: str | None) -> None: ...
    def refine(
        self,
        left: NDArray[np.uint8],
        right: NDArray[np.uint8],
        disparity: NDArray[np.float32],
        refined: NDArray[np.float32],
    ) -> None: ...
