"""What a contender answers of one frame, in the form in which all are compared."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from bearcub.messages import Answer, Hole, Obstacle, Terrain

_NAN = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """One obstacle or hole that is reported; NaN for what is not said of it.

    Attributes
    ----------
    distance, bearing, width : float
        As in `bearcub.messages.Obstacle` and `Hole` [m], [rad].
    height, base_height : float
        Of an obstacle [m].
    length, depth : float
        Of a hole [m].
    sigma : mapping of str to float
        1-sigma by the name of the number; what has none is absent.
    """

    distance: float
    bearing: float
    width: float
    height: float = _NAN
    base_height: float = _NAN
    length: float = _NAN
    depth: float = _NAN
    sigma: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """Everything a contender says of one frame; NaN for what it does not answer.

    Attributes
    ----------
    obstacles, holes : tuple of Found
    slope, cross_slope, sigma_slope : float
        Of the ground ahead, as in `bearcub.messages.Terrain` [rad].
    reference : str
        What the slopes are against: "gravity" or "robot".
    height, pitch, roll : float
        The camera above and against the ground [m], [rad].
    sigma : mapping of str to float
        1-sigma of "height", "pitch" and "roll".
    timing : mapping of str to float
        Milliseconds by stage.
    """

    obstacles: tuple[Found, ...] = ()
    holes: tuple[Found, ...] = ()
    slope: float = _NAN
    cross_slope: float = _NAN
    sigma_slope: float = _NAN
    reference: str = "robot"
    height: float = _NAN
    pitch: float = _NAN
    roll: float = _NAN
    sigma: Mapping[str, float] = field(default_factory=dict)
    timing: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, answer: Answer) -> "Report":
        """Return the pipeline's answer; a floor that was not seen has no height and attitude."""
        ground, terrain = answer.ground, answer.terrain
        seen = ground.seen
        return cls(
            obstacles=tuple(_obstacle(thing) for thing in answer.obstacles),
            holes=tuple(_hole(hole) for hole in answer.holes),
            **_slopes(terrain),
            height=ground.height if seen else _NAN,
            pitch=ground.pitch if seen else _NAN,
            roll=ground.roll if seen else _NAN,
            sigma={
                "height": ground.sigma_height,
                "pitch": ground.sigma_pitch,
                "roll": ground.sigma_roll,
            }
            if seen
            else {},
            timing=asdict(answer.timing),
        )


def _slopes(terrain: Terrain) -> dict[str, Any]:
    return {
        "slope": terrain.slope,
        "cross_slope": terrain.cross_slope,
        "sigma_slope": terrain.sigma,
        "reference": terrain.reference,
    }


def _obstacle(thing: Obstacle) -> Found:
    return Found(
        distance=thing.distance,
        bearing=thing.bearing,
        width=thing.width,
        height=thing.height,
        base_height=thing.base_height,
        sigma={
            "distance": thing.sigma_distance,
            "bearing": thing.sigma_bearing,
            "width": thing.sigma_width,
            "height": thing.sigma_height,
        },
    )


def _hole(hole: Hole) -> Found:
    return Found(
        distance=hole.distance,
        bearing=hole.bearing,
        width=hole.width,
        length=hole.length,
        depth=hole.depth,
        sigma={
            "distance": hole.sigma_distance,
            "width": hole.sigma_width,
            "length": hole.sigma_length,
            # The depth of ground that no pixel shows is a bound, not a measurement.
            "depth": _NAN if hole.depth_is_lower_bound else hole.sigma_depth,
        },
    )
