"""The frozen values that stages exchange: what sensors measure, and the answer of one frame.

Units are SI and radians; degrees appear only in names that say so and in the JSON. NaN is "not
known" everywhere and becomes ``null`` in the JSON. Frame of every position: ``base_link``.
"""

from bearcub.messages.answer import SCHEMA, Answer
from bearcub.messages.arrays import (
    Bool,
    Float32,
    Float64,
    Int32,
    UInt8,
    as_disparity,
    as_image,
)
from bearcub.messages.findings import (
    FreeRange,
    Ground,
    Hole,
    Layers,
    Limit,
    Obstacle,
    Painting,
    Pixel,
    SlopeBand,
    Terrain,
    Timing,
    Vote,
)
from bearcub.messages.sensors import (
    BeamFlag,
    Fix,
    FixQuality,
    Inertial,
    Orientation,
    Scan,
    Tilt,
    Vector,
    WheelState,
)
from bearcub.messages.snapshot import DisparityMap, Snapshot

__all__ = [
    "SCHEMA",
    "Answer",
    "BeamFlag",
    "Bool",
    "DisparityMap",
    "Fix",
    "FixQuality",
    "Float32",
    "Float64",
    "FreeRange",
    "Ground",
    "Hole",
    "Inertial",
    "Int32",
    "Layers",
    "Limit",
    "Obstacle",
    "Orientation",
    "Painting",
    "Pixel",
    "Scan",
    "SlopeBand",
    "Snapshot",
    "Terrain",
    "Tilt",
    "Timing",
    "UInt8",
    "Vector",
    "Vote",
    "WheelState",
    "as_disparity",
    "as_image",
]
