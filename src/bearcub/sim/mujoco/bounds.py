"""Boxes that hold the parts of a scene."""

import numpy as np

from bearcub.messages import Float64
from bearcub.sim.solids import Box, Cone, Cylinder, Part
from bearcub.sim.world import PitInside

_ASIDE = (np.array([-1e6, 0.0]), np.array([0.0, -1e6]))  # eyes so far off see a disc's half


def corners(part: Part) -> Float64 | None:
    """Return corners, level [m], shape (3, N), between which all that is seen of a part lies.

    None of what has no end: the pieces of the ground. What is seen of a pit is seen through its
    mouth.
    """
    if isinstance(part, PitInside):
        plane, outline = part.plane, part.pit.outline()
        return np.array([[x, y, plane.at(x, y)] for x, y in outline]).T
    if isinstance(part, Box | Cylinder | Cone):
        outline = np.vstack([part.outline(eye) for eye in _ASIDE])
        (x0, y0), (x1, y1) = outline.min(axis=0), outline.max(axis=0)
        zs = (part.bottom, part.top)
        return np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in zs]).T
    return None
