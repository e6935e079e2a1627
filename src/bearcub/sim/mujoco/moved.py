"""The truth of a frame that a robot took somewhere in a scene, heading anywhere."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from bearcub.geometry import Attitude
from bearcub.rig import Rig
from bearcub.sim import truth
from bearcub.sim.render import SKY, View
from bearcub.sim.world import Ground, Scene

_EDGES = tuple(1.5 + 0.5 * band for band in range(8))  # bands of the slope's profile [m]


def describe_from(
    scene: Scene,
    rig: Rig,
    view: View,
    hits: truth.Hits,
    *,
    place: tuple[float, float, float],
    body: Attitude,
) -> dict[str, Any]:
    """Return the truth as `bearcub.sim.truth.describe` has it, seen from where the robot is.

    Things, pits, terrain and ground, and the place itself. Steps and banks of the ground and
    drops, which have no end to the sides, are only described for a robot at the origin. The robot
    may head up to 135 deg away from the scene's x axis.

    Parameters
    ----------
    scene, rig, view, hits
        What was rendered, from where, and what the rays met, in the scene's coordinates.
    place : tuple of float
        x, y [m] and yaw [rad] of ``base_link`` in the scene.
    body : Attitude
        Of the robot against gravity.
    """
    x, y, yaw = place
    there = replace(rig, mount=replace(rig.mount, x=-x, y=-y))
    found = truth.describe(scene, there, body, view.down, _bounded(scene, hits))
    holes = [{**hole, "rows": _rows(hole, scene.ground, view)} for hole in found["holes"]]
    return {
        **found,
        "obstacles": [_turned(thing, yaw) for thing in found["obstacles"]],
        "holes": [_turned(hole, yaw) for hole in holes],
        "terrain": _terrain(scene.ground, place),
        "ground": _ground(scene.ground, view, place),
        "place": {"x": round(x, 6), "y": round(y, 6), "yaw_deg": _deg(yaw)},
    }


def _bounded(scene: Scene, hits: truth.Hits) -> truth.Hits:
    """Return the hits without faces of the ground and drops."""
    endless = (hits.labels > len(scene.things)) | (hits.labels < -len(scene.ground.pits))
    labels = np.where(endless & (hits.labels != SKY), np.int32(0), hits.labels)
    return replace(hits, labels=labels)


def _turned(entry: dict[str, Any], yaw: float) -> dict[str, Any]:
    """Turn a place relative to the robot from the scene's axes into the robot's."""
    c, s, x, y = math.cos(yaw), math.sin(yaw), entry["x"], entry["y"]
    bearing = math.remainder(entry["bearing_deg"] - math.degrees(yaw), 360.0)
    return {
        **entry,
        "x": round(c * x + s * y, 6),
        "y": round(c * y - s * x, 6),
        "bearing_deg": round(bearing, 6),
    }


def _rows(hole: dict[str, Any], ground: Ground, view: View) -> float:
    """Return how many rows the far wall of a pit covers at most: ``f h w / (R (R + w))``."""
    pit = ground.pits[-1 - hole["id"]]
    length, distance = hole["length"], hole["distance"]
    above = float(view.position[2]) - ground.at(pit.x0, 0.5 * (pit.y0 + pit.y1))
    rows = view.camera.fy * above * length / (distance * (distance + length))
    return round(float(rows), 6)


def _terrain(ground: Ground, place: tuple[float, float, float]) -> dict[str, Any]:
    along, across = _inclination(ground, place, _EDGES[0], _EDGES[-1])
    return {
        "slope_deg": along,
        "cross_slope_deg": across,
        "reference": "gravity",
        "profile": [
            {"from": a, "to": b, "slope_deg": _inclination(ground, place, a, b)[0]}
            for a, b in pairwise(_EDGES)
        ],
    }


def _inclination(
    ground: Ground, place: tuple[float, float, float], start: float, end: float
) -> tuple[float, float]:
    """Return mean slope and cross slope of the way ahead [deg], without steps."""
    x, _, yaw = place
    c, s = math.cos(yaw), math.sin(yaw)
    along = across = 0.0
    middles = start + (np.arange(100) + 0.5) * ((end - start) / 100)
    for middle in middles:
        at = x + c * float(middle)
        plane = next(p for p in reversed(ground.planes) if at >= p.start)
        along += 0.01 * (c * plane.slope + s * plane.cross)
        across += 0.01 * (c * plane.cross - s * plane.slope)
    return _deg(math.atan(along)), _deg(math.atan(across))


def _ground(ground: Ground, view: View, place: tuple[float, float, float]) -> dict[str, Any]:
    """Return the camera against the ground piece under the robot."""
    plane = next(p for p in reversed(ground.planes) if place[0] >= p.start)
    normal = plane.normal()
    x, y, z = (float(value) for value in view.position)
    camera = Attitude.from_down(view.level_from_optical.T @ -normal)
    return {
        "height": round((z - plane.at(x, y)) * float(normal[2]), 6),
        "pitch_deg": _deg(camera.pitch),
        "roll_deg": _deg(camera.roll),
    }


def _deg(angle: float) -> float:
    return round(math.degrees(angle), 6)
