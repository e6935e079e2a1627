"""The fast simulator: MuJoCo draws the scenes and moves the robot."""

from bearcub.sim.mujoco.chassis import Area, Chassis
from bearcub.sim.mujoco.robot import Place, Sensors, Simulation
from bearcub.sim.mujoco.studio import Studio, render

__all__ = ["Area", "Chassis", "Place", "Sensors", "Simulation", "Studio", "render"]
