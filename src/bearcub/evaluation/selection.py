"""Which frames and things a row of the table counts."""

from collections.abc import Callable

from bearcub.evaluation.target import Target
from bearcub.evaluation.verdict import Verdict

APART = ("tall-grass", "gravel")
"""Surfaces whose false obstacles are reported apart: blades and stones do stand there."""


def usual(verdict: Verdict) -> bool:
    """Tell frames with medium noise."""
    return verdict.tags.get("noise", "medium") == "medium"


def smooth(verdict: Verdict) -> bool:
    """Tell frames with medium noise whose ground has no blades and stones."""
    return usual(verdict) and verdict.tags.get("surface") not in APART


def empty(verdict: Verdict) -> bool:
    """Tell frames of an empty floor without blades and stones."""
    return smooth(verdict) and bool(verdict.tags.get("empty"))


def large(target: Target) -> bool:
    """Tell obstacles of at least 0.3 m either way, 1 to 8 m away."""
    return near(target) and target.width >= 0.3 and target.height >= 0.3


def near(target: Target) -> bool:
    """Tell what is 1 to 8 m away."""
    return 1.0 <= target.distance <= 8.0


def between(start: float, end: float) -> Callable[[Target], bool]:
    """Tell large obstacles farther than `start`, up to `end` [m] away."""
    return lambda target: large(target) and start < target.distance <= end


def named(kind: str, distance: float) -> Callable[[Target], bool]:
    """Tell things of one kind about so far away (within 0.3 m)."""
    return lambda target: target.kind == kind and abs(target.distance - distance) <= 0.3


def steep(target: Target) -> bool:
    """Tell walls and banks steeper than 30 deg and at least 0.3 m high, 1 to 8 m away."""
    return near(target) and target.height >= 0.3 and target.kind in {"wall", "bank", "step"}


def crater(target: Target) -> bool:
    """Tell holes 0.4 to 1 m wide."""
    return target.kind == "pit" and 0.39 <= target.width <= 1.01


def reading(*kinds: str) -> Callable[[Verdict], bool]:
    """Tell frames by what the tilt sensor was like."""
    return lambda verdict: usual(verdict) and verdict.tags.get("tilt") in kinds


def ramp(verdict: Verdict) -> bool:
    """Tell frames of ramps and cross slopes up to 15 deg with nothing on them."""
    return smooth(verdict) and verdict.tags.get("kind") in {"ramp", "cross slope"}


def on(*surfaces: str) -> Callable[[Verdict], bool]:
    """Tell empty frames by their surface."""
    return lambda verdict: (
        usual(verdict)
        and bool(verdict.tags.get("empty"))
        and verdict.tags.get("surface") in surfaces
    )
