"""The column analysis of 2005, on floating-point disparity cut to whole levels.

The floor is where mount and tilt reading say, with the printed band of three levels; the tilt is
corrected as it was meant. A level stands for its middle, half a pixel above its number, which
takes the bias out of distances and sizes. Objects only: no holes, no slope, no base height.
"""

import math

import numpy as np

from bearcub.classic import ClassicConfig, ClassicObject, detect
from bearcub.evaluation.baselines.frame import Frame
from bearcub.evaluation.report import Found, Report
from bearcub.messages import Float64


def answer(frame: Frame) -> Report:
    """Answer one frame."""
    height, down = frame.rig.mount.height, frame.expected.down()
    projection = frame.rig.camera.projection
    plane = projection.plane(height=height, down=down)
    config = ClassicConfig.from_plane(plane, shape=frame.disparity.shape)
    things = detect(frame.disparity, projection, config=config).objects
    turn = frame.level_from_optical(down)
    found = tuple(_found(thing, frame, turn) for thing in things)
    return frame.report(found, height=height, down=down)


def _found(thing: ClassicObject, frame: Frame, turn: Float64) -> Found:
    """Place the middle of an object's face in ``base_link``."""
    u, v = np.array([thing.peak.centre]), np.array([0.5 * (thing.top + thing.bottom)])
    middle = thing.peak.level + 0.5
    ahead = turn @ frame.rig.camera.projection.points(u, v, np.array([middle]))[0]
    x, y = ahead[0] + frame.rig.mount.x, ahead[1] + frame.rig.mount.y
    return Found(
        distance=math.hypot(x, y),
        bearing=math.atan2(y, x),
        width=thing.width * thing.peak.level / middle,
        height=thing.height * thing.peak.level / middle,
    )
