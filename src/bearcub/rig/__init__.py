"""The camera and where it sits on the robot, read from any calibration."""

from bearcub.rig.camera import Camera, Lens, Rectification
from bearcub.rig.model import Rig
from bearcub.rig.mount import Mount

__all__ = ["Camera", "Lens", "Mount", "Rectification", "Rig"]
