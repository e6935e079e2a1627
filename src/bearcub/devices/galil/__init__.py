"""Galil DMC motion controllers, which turn the robot's two wheels."""

from bearcub.devices.galil.client import GalilClient
from bearcub.devices.galil.commands import CommandError
from bearcub.devices.galil.drive import GalilDrive
from bearcub.devices.galil.driver import GalilSetup

__all__ = ["CommandError", "GalilClient", "GalilDrive", "GalilSetup"]
