"""The longitudinal profile of a floor that bends: ramps, kerbs, crests."""

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32


def follow_floor(
    disparity: Float32, plane: Float64, *, noise: float, height: float
) -> tuple[Float64, Float64]:
    """Placeholder until bend."""
    return np.zeros(0), np.zeros(0)
