"""What a person sees: the annotated picture, the plan view, and the paper's figures."""

from bearcub.viewer.birdseye import birdseye
from bearcub.viewer.figures import figures
from bearcub.viewer.frame import annotate, side_by_side
from bearcub.viewer.overlay import overlay

__all__ = ["annotate", "birdseye", "figures", "overlay", "side_by_side"]
