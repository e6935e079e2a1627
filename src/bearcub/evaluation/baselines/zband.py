"""Fixed height band: what costmap layers do with a point cloud.

Mount and tilt reading are taken as they are; the image corrects nothing. Points from 0.1 m to the
robot's height (2 m) above that floor and up to 12 m away mark cells of 0.1 m; a cell counts from 5
points on, a group of touching cells from 50. No holes: layers of this kind mark, and do not miss.
"""

import numpy as np

from bearcub.evaluation.baselines.clusters import clustered
from bearcub.evaluation.baselines.frame import LEAST_HEIGHT, Frame, measured
from bearcub.evaluation.report import Report

_HIGHEST = 2.0  # [m]


def answer(frame: Frame) -> Report:
    """Answer one frame."""
    height, down = frame.rig.mount.height, frame.expected.down()
    points = frame.points(down=down, height=height)
    with np.errstate(invalid="ignore"):
        standing = (points[..., 2] > LEAST_HEIGHT) & (points[..., 2] < _HIGHEST)
    kept = points[standing]
    return frame.report(measured(kept, clustered(kept)), height=height, down=down)
