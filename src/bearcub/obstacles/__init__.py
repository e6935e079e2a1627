"""The paper's answers: what stands on the floor, what is missing from it, how it lies."""

from bearcub.obstacles.stage import Findings, ObstacleStage

__all__ = ["Findings", "ObstacleStage"]
