"""A small ray caster: stereo pairs of simple scenes with exact truth."""

from bearcub.sim.render import SKY, Rendered, render
from bearcub.sim.sensor import degrade

__all__ = ["SKY", "Rendered", "degrade", "render"]
