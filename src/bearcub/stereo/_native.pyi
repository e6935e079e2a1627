# What the compiled core offers; native/src/bindings.cpp defines it.

import numpy as np
from numpy.typing import NDArray

def levels() -> list[str]: ...

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
