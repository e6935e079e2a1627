"""The camera and where it sits on the robot."""

from bearcub.rig.model import Camera, Mount, Rig

__all__ = ["Camera", "Mount", "Rig"]
