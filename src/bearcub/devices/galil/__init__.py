"""Galil DMC motion controllers, which turn the robot's two wheels."""

from bearcub.devices.galil.drive import GalilDrive
from bearcub.devices.galil.driver import GalilSetup

__all__ = ["GalilDrive", "GalilSetup"]
