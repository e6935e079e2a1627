"""Obstacles and holes of an answer against the truth of a rendered scene."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bearcub.evaluation.score import match
from bearcub.messages import Answer, Hole, Obstacle

_GATE = 0.5  # farther than this from where it should be, it is another thing [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Error:
    """How far one number is from the truth, and how far it claims to be (1-sigma)."""

    value: float
    truth: float
    sigma: float

    @property
    def absolute(self) -> float:
        """Found minus true; NaN when not known."""
        return self.value - self.truth

    @property
    def percent(self) -> float:
        """Relative to the truth."""
        return 100.0 * self.absolute / self.truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One answer against the truth.

    Attributes
    ----------
    errors : tuple of dict
        For everything found: "distance", "width", "height" [m] and "bearing" [deg] of an
        obstacle; "distance", "width", "length", "depth" [m] of a hole.
    missed, false : int
        What is there and was not found, what was found and is not there.
    """

    errors: tuple[Mapping[str, Error], ...]
    missed: int
    false: int


def compare_obstacles(answer: Answer, truth: Mapping[str, Any]) -> Comparison:
    """Compare obstacles; `truth` is a ``bearcub.truth/1`` object."""
    things = truth["obstacles"]
    pairs = match(
        [_polar(o.distance, o.bearing) for o in answer.obstacles],
        [_polar(t["distance"], math.radians(t["bearing_deg"])) for t in things],
        gate=_GATE,
    )
    errors = [_obstacle(answer.obstacles[i], things[j]) for i, j in pairs]
    return _comparison(errors, answer.obstacles, things)


def compare_holes(answer: Answer, truth: Mapping[str, Any]) -> Comparison:
    """Compare holes; the depth that counts is that which a pixel shows."""
    things = truth["holes"]
    pairs = match(
        [_polar(h.distance, h.bearing) for h in answer.holes],
        [_polar(t["distance"], math.radians(t["bearing_deg"])) for t in things],
        gate=_GATE,
    )
    errors = [_hole(answer.holes[i], things[j]) for i, j in pairs]
    return _comparison(errors, answer.holes, things)


def _comparison(
    errors: list[dict[str, Error]], found: Sequence[object], things: Sequence[object]
) -> Comparison:
    return Comparison(
        errors=tuple(errors), missed=len(things) - len(errors), false=len(found) - len(errors)
    )


def _polar(distance: float, bearing: float) -> tuple[float, float]:
    return distance * math.cos(bearing), distance * math.sin(bearing)


def _obstacle(found: Obstacle, thing: Mapping[str, Any]) -> dict[str, Error]:
    return {
        "distance": _error(found.distance, thing["distance"], found.sigma_distance),
        "width": _error(found.width, thing["width"], found.sigma_width),
        "height": _error(found.height, thing["height"], found.sigma_height),
        "bearing": _error(
            math.degrees(found.bearing), thing["bearing_deg"], math.degrees(found.sigma_bearing)
        ),
    }


def _hole(found: Hole, thing: Mapping[str, Any]) -> dict[str, Error]:
    return {
        "distance": _error(found.distance, thing["distance"], found.sigma_distance),
        "width": _error(found.width, thing["width"], found.sigma_width),
        "length": _error(found.length, thing["length"], found.sigma_length),
        "depth": _error(found.depth, thing["depth_seen"], found.sigma_depth),
    }


def _error(value: float, truth: float | None, sigma: float) -> Error:
    return Error(value=value, truth=np.nan if truth is None else truth, sigma=sigma)
