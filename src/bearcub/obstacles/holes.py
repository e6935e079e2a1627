"""Holes: ground that is missing."""

import numpy as np

from bearcub.messages import Bool, Float32, Ground, Hole, Int32
from bearcub.obstacles.measure import View


def find_holes(
    disparity: Float32,
    floor: Float32,
    below: Bool,
    labels: Int32,
    view: View,
    ground: Ground,
    *,
    sigmas: float,
    farthest: float,
) -> tuple[tuple[Hole, ...], Int32]:
    """Find pits and drops (to come)."""
    del disparity, floor, below, view, ground, sigmas, farthest
    return (), np.zeros_like(labels)
