"""Cameras: V4L2 and streams through OpenCV, files as live cameras, makers' software as plug-ins."""

from bearcub.devices.cameras.capture import Capture, Taken
from bearcub.devices.cameras.source import CameraSource, Skew

__all__ = ["CameraSource", "Capture", "Skew", "Taken"]
