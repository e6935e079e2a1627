"""Stereo obstacle perception and avoidance for ground robots, on a CPU.

``Pipeline(Rig.load("rig.toml"))(left, right)`` answers one frame.
"""

from bearcub.pipeline import Pipeline
from bearcub.rig.model import Rig

__all__ = ["Pipeline", "Rig"]
