"""The mouth of a hole: its extents, and what the image cuts of it."""

import math
from dataclasses import replace

from bearcub.geometry import Float64
from bearcub.messages import Hole
from bearcub.obstacles.measure import cut_sides
from bearcub.robust import quantile


def cut(hole: Hole, shape: tuple[int, int]) -> Hole:
    """Name the image borders that cut a hole; what they cut has no sigma."""
    sides = cut_sides(hole.box, shape)
    return replace(
        hole,
        truncated=sides,
        sigma_width=math.nan if {"left", "right"} & set(sides) else hole.sigma_width,
        sigma_length=math.nan if "bottom" in sides else hole.sigma_length,
    )


def across_and_along(rim: Float64, bearing: float) -> tuple[float, float]:
    """Return how far a rim reaches across and along the line of sight [m]."""
    c, s = math.cos(bearing), math.sin(bearing)
    return _extent(rim[1] * c - rim[0] * s), _extent(rim[0] * c + rim[1] * s)


def _extent(values: Float64) -> float:
    """Return how far values reach, but for the outermost hundredth at either end."""
    return quantile(values, 0.99) - quantile(values, 0.01)
