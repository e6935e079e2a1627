"""Everything one frame answers, and its JSON."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bearcub.messages.findings import FreeRange, Ground, Hole, Layers, Obstacle, Terrain, Timing

SCHEMA = "bearcub.answer/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Everything one frame answers. `notes` are sentences for the operator (not in the JSON)."""

    obstacles: tuple[Obstacle, ...]
    holes: tuple[Hole, ...]
    terrain: Terrain
    ground: Ground
    free_range: FreeRange
    timing: Timing
    layers: Layers
    stamp_ns: int = 0
    frame_id: str = "base_link"
    valid_share: float = math.nan
    epipolar_offset: float = math.nan
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    def to_dict(self) -> dict[str, Any]:
        """Return the answer as the JSON object of the contract (``bearcub.answer/1``)."""
        return {
            "schema": SCHEMA,
            "stamp_ns": self.stamp_ns,
            "frame_id": self.frame_id,
            "obstacles": [_obstacle(o) for o in self.obstacles],
            "holes": [_hole(h) for h in self.holes],
            "terrain": _terrain(self.terrain),
            "ground": _ground(self.ground),
            "free_range": [
                {"bearing_deg": _deg(b), "range": _num(r), "limit": str(limit)}
                for b, r, limit in zip(
                    self.free_range.bearing,
                    self.free_range.range,
                    self.free_range.limit,
                    strict=True,
                )
            ],
            "timing_ms": {
                name: _num(getattr(self.timing, name))
                for name in ("match", "ground", "obstacles", "total")
            },
        }

    def to_json(self) -> str:
        """Return `to_dict` as one line of JSON."""
        return json.dumps(self.to_dict(), allow_nan=False)


def _num(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None


def _deg(value: float) -> float | None:
    return _num(math.degrees(value))


def _obstacle(o: Obstacle) -> dict[str, Any]:
    return {
        "id": o.id,
        "x": _num(o.x),
        "y": _num(o.y),
        "distance": _num(o.distance),
        "bearing_deg": _deg(o.bearing),
        "width": _num(o.width),
        "height": _num(o.height),
        "base_height": _num(o.base_height),
        "sigma": {
            "distance": _num(o.sigma_distance),
            "bearing_deg": _deg(o.sigma_bearing),
            "width": _num(o.sigma_width),
            "height": _num(o.sigma_height),
        },
        "confidence": _num(o.confidence),
        "votes": [
            {"sensor": v.sensor, "vote": v.vote, "weight": _num(v.weight), "reason": v.reason}
            for v in o.votes
        ],
    }


def _hole(h: Hole) -> dict[str, Any]:
    return {
        "x": _num(h.x),
        "y": _num(h.y),
        "distance": _num(h.distance),
        "bearing_deg": _deg(h.bearing),
        "width": _num(h.width),
        "length": _num(h.length),
        "depth": _num(h.depth),
        "depth_is_lower_bound": h.depth_is_lower_bound,
        "kind": h.kind,
        "sigma": {
            "distance": _num(h.sigma_distance),
            "width": _num(h.sigma_width),
            "length": _num(h.sigma_length),
            "depth": _num(h.sigma_depth),
        },
        "confidence": _num(h.confidence),
    }


def _terrain(t: Terrain) -> dict[str, Any]:
    return {
        "slope_deg": _deg(t.slope),
        "cross_slope_deg": _deg(t.cross_slope),
        "sigma_deg": _deg(t.sigma),
        "roughness": _num(t.roughness),
        "reference": t.reference,
        "profile": [
            {
                "from": _num(b.start),
                "to": _num(b.end),
                "slope_deg": _deg(b.slope),
                "sigma_deg": _deg(b.sigma),
            }
            for b in t.profile
        ],
    }


def _ground(g: Ground) -> dict[str, Any]:
    return {
        "height": _num(g.height),
        "pitch_deg": _deg(g.pitch),
        "roll_deg": _deg(g.roll),
        "source": g.source,
        "residual_px": _num(g.residual),
        "tilt_disagreement_deg": _deg(g.tilt_disagreement),
    }
