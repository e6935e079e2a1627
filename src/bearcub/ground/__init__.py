"""Which pixels belong to the floor."""

from bearcub.ground.stage import GroundStage
from bearcub.ground.surface import floor_disparity

__all__ = ["GroundStage", "floor_disparity"]
