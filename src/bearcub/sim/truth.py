"""The truth of a rendered frame, in the form of the answer's contract (``bearcub.answer/1``)."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from bearcub.geometry import Attitude, base_from_optical, forward_in_camera
from bearcub.messages import Bool, Float64, Int32
from bearcub.rig import Camera, Rig
from bearcub.sim.world import Face, Ground, Scene, Thing

SCHEMA = "bearcub.truth/1"

_NEAR, _FAR = 1.5, 5.0  # the slope is that of the ground so far ahead [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hits:
    """What the rays through the left pixels' centres meet.

    Attributes
    ----------
    pixel : float
        Width of a pixel a metre ahead [m].
    depth : ndarray of float64, shape (H, W)
        Along the optical axis [m]; inf in the sky.
    labels : ndarray of int32, shape (H, W)
    points : ndarray of float64, shape (3, H, W)
        Level coordinates [m].
    alone : dict
        For every label the pixels it would cover if nothing stood before it, shape (H, W).
    """

    pixel: float
    depth: Float64
    labels: Int32
    points: Float64
    alone: dict[int, Bool]

    def visible(self, label: int) -> Bool:
        """Return the pixels of one label."""
        mask: Bool = self.labels == label
        return mask

    def share(self, label: int) -> float:
        """Return which share of a thing's pixels nothing hides."""
        return float(self.visible(label).sum() / max(1, self.alone[label].sum()))

    def truncated(self, label: int) -> list[str]:
        """Return the image borders that a thing reaches."""
        seen = self.visible(label)
        borders = {
            "left": seen[:, 0],
            "right": seen[:, -1],
            "top": seen[0],
            "bottom": seen[-1],
        }
        return [name for name, edge in borders.items() if edge.any()]

    def extent(self, label: int) -> Float64:
        """Return the level coordinates of its visible pixels, shape (3, N)."""
        found: Float64 = self.points[:, self.visible(label)]
        return found


def describe(scene: Scene, rig: Rig, body: Attitude, down: Float64, hits: Hits) -> dict[str, Any]:
    """Return obstacles, holes, terrain, ground and tilt as the JSON object of a perfect answer.

    Positions are in ``base_link`` made level: the level frame moved so that the left camera is at
    (`mount.x`, `mount.y`). `distance` is horizontal from its origin to the nearest point;
    `bearing_deg` the middle of the interval of bearings that the thing covers; `width` its extent
    across that direction (between the lines of sight that touch it, so a little less than the
    diameter of a cylinder); `height` its top above the ground at its foot; `base_height` its
    lowest point above it. Where the pixels that show a thing fall short of that by more than two
    pixels, because it is partly hidden or cut by the image, the number is measured from these
    pixels; `visible_share` and `truncated` give the reason. What no pixel shows is left out.

    What is an obstacle, and what terrain: things are obstacles. So are faces of the ground steeper
    than 30 deg (steps up, kerbs, banks) from 0.1 m on, each as one wide obstacle from border to
    border of what is seen of it, its distance to its foot; lower ones and all that is less steep
    are terrain, ramps of 15 deg among it. What hangs at or above the scene's `clearance` (the
    robot's height) is listed with ``"passable": true``: it is there, and does not block the way.

    The mouth of a pit is given whole; a drop as wide as its lip is seen, without a length.
    `depth` is the true one, `depth_seen` that of the deepest point that a pixel shows. `rows` is
    the geometric limit of [1]_: how many image rows the far wall of a pit of length w at range R
    covers, ``f h w / (R (R + w))``, for the camera at height h above the lip; fewer than about 6
    cannot be told from noise. A drop has none.
    `slope_deg` is the mean over the ground's pieces; steps are no slope.

    `ground` is the camera against the ground just ahead of the robot, `height` along its normal.
    `fov` is the field of view: its angles, and the bearings of the left and the right border of a
    camera that looks straight ahead.

    Parameters
    ----------
    scene, rig, body, hits
        What was rendered, from where, and what the rays met.
    down : ndarray of float64, shape (3,)
        Gravity in the left camera's optical axes.

    References
    ----------
    .. [1] L. Matthies, A. Rankin: "Negative obstacle detection by thermal signature", IROS 2003.
    """
    eye = -np.array([rig.mount.x, rig.mount.y])
    things = [
        _obstacle(label, thing, scene.ground, eye, hits)
        for label, thing in enumerate(scene.things, 1)
        if hits.visible(label).any()
    ]
    faces = [
        _face(label, face, scene.ground, eye, hits)
        for label, face in enumerate(scene.ground.faces(), 1 + len(scene.things))
        if hits.visible(label).any()
    ]
    obstacles = [
        {**found, "passable": found["base_height"] >= scene.clearance} for found in things + faces
    ]
    return {
        "schema": SCHEMA,
        "tilt": {"pitch_deg": _deg(body.pitch), "roll_deg": _deg(body.roll)},
        "fov": _field_of_view(rig.camera),
        "obstacles": sorted(obstacles, key=lambda found: float(found["distance"])),
        "holes": _holes(scene.ground, eye, hits, rig),
        "terrain": _terrain(scene.ground),
        "ground": _ground(scene.ground, rig, down),
    }


def _field_of_view(camera: Camera) -> dict[str, Any]:
    left = math.atan((camera.cx + 0.5) / camera.fx)
    right = -math.atan((camera.width - 0.5 - camera.cx) / camera.fx)
    up = math.atan((camera.cy + 0.5) / camera.fy)
    down = math.atan((camera.height - 0.5 - camera.cy) / camera.fy)
    return {
        "horizontal_deg": _deg(left - right),
        "vertical_deg": _deg(up + down),
        "left_deg": _deg(left),
        "right_deg": _deg(right),
    }


def _obstacle(label: int, thing: Thing, ground: Ground, eye: Float64, hits: Hits) -> dict[str, Any]:
    points = hits.extent(label)
    shown = points[:2].T - eye
    whole = np.concatenate([part.outline(eye) for part in thing.parts]) - eye
    near = _nearest(np.array([part.nearest(eye) for part in thing.parts]) - eye)
    near_shown = _nearest(shown)
    slack = _slack(hits, near_shown)
    bearing, width, _ = _across(whole)
    bearing_shown, width_shown, _ = _across(shown)
    if width_shown < width - slack:
        bearing, width = bearing_shown, width_shown
    if np.linalg.norm(near_shown) > np.linalg.norm(near) + slack:
        near = near_shown
    top = max(part.top for part in thing.parts)
    if points[2].max() < top - slack:
        top = float(points[2].max())
    floor = ground.at(*thing.foot)
    lowest = min(part.bottom for part in thing.parts)
    return _entry(label, thing.name, near, bearing, width, top - floor, lowest - floor, hits)


def _face(label: int, face: Face, ground: Ground, eye: Float64, hits: Hits) -> dict[str, Any]:
    """Return a step or a bank as one thing, between the outermost lines of sight to it."""
    points = hits.extent(label)
    sight = points[1] / points[0]
    foot = np.stack([np.full(2, face.start), face.start * np.array([sight.min(), sight.max()])])
    low, high = foot.min(axis=1), foot.max(axis=1)
    near = np.clip(eye, low, high) - eye
    near_shown = _nearest(points[:2].T - eye)
    if np.linalg.norm(near_shown) > np.linalg.norm(near) + _slack(hits, near_shown):
        near = near_shown
    bearing, width, _ = _across(foot.T - eye)
    above = points[2] - ground.cross * points[1] - face.foot
    rise = min(face.rise, float(above.max()))
    if face.rise - rise <= _slack(hits, near_shown):
        rise = face.rise
    return _entry(label, face.name, near, bearing, width, rise, 0.0, hits)


def _slack(hits: Hits, near: Float64) -> float:
    """Return by how much what pixels show may fall short of the whole: two pixels there [m]."""
    return 2.0 * hits.pixel * float(np.linalg.norm(near))


def _entry(
    label: int,
    name: str,
    near: Float64,
    bearing: float,
    width: float,
    height: float,
    base_height: float,
    hits: Hits,
) -> dict[str, Any]:
    return {
        "id": label,
        "name": name,
        **_place(near, bearing),
        "width": _num(width),
        "height": _num(height),
        "base_height": _num(base_height),
        **_seen(label, hits),
    }


def _holes(ground: Ground, eye: Float64, hits: Hits, rig: Rig) -> list[dict[str, Any]]:
    shapes = [("pit", pit.outline(), pit.depth) for pit in ground.pits]
    for label, (x, depth) in enumerate(ground.drops(), 1 + len(ground.pits)):
        seen = hits.extent(-label)
        # where the lines of sight to the lower ground cross the lip
        ys = seen[1] * x / seen[0] if seen.size else np.zeros(1)
        shapes.append(("drop", np.array([[x, ys.min()], [x, ys.max()]]), depth))
    return [
        _hole(-label, kind, outline, eye, depth, ground, hits, rig)
        for label, (kind, outline, depth) in enumerate(shapes, 1)
        if hits.visible(-label).any()
    ]


def _hole(
    label: int,
    kind: str,
    outline: Float64,
    eye: Float64,
    depth: float,
    ground: Ground,
    hits: Hits,
    rig: Rig,
) -> dict[str, Any]:
    near = np.clip(eye, outline.min(axis=0), outline.max(axis=0)) - eye
    bearing, width, length = _across(outline - eye)
    lip = float(outline[:, 0].min())
    plane = [p for p in ground.planes if p.start < lip][-1]
    rows = _rows(outline, ground, rig) if kind == "pit" else None
    return {
        "id": label,
        **_place(near, bearing),
        "width": _num(width),
        "length": _num(length) if kind == "pit" else None,
        "depth": _num(depth),
        "depth_seen": _num(float(plane.below(hits.extent(label)).max())),
        "kind": kind,
        "rows": rows,
        **_seen(label, hits),
    }


def _rows(outline: Float64, ground: Ground, rig: Rig) -> float | None:
    """Return how many rows the far wall of a pit covers at most, as the camera sees it."""
    near = np.clip(np.zeros(2), outline.min(axis=0), outline.max(axis=0))
    distance = float(np.linalg.norm(near))
    length = float(np.ptp(outline[:, 0]))
    height = rig.mount.height - ground.at(float(near[0]), float(near[1]))
    return _num(rig.camera.fy * height * length / (distance * (distance + length)))


def _seen(label: int, hits: Hits) -> dict[str, Any]:
    return {
        "visible_share": _num(hits.share(label)),
        "truncated": hits.truncated(label),
        "pixels": int(hits.visible(label).sum()),
    }


def _place(point: Float64, bearing: float) -> dict[str, Any]:
    return {
        "x": _num(point[0]),
        "y": _num(point[1]),
        "distance": _num(float(np.linalg.norm(point))),
        "bearing_deg": _deg(bearing),
    }


def _across(points: Float64) -> tuple[float, float, float]:
    """Return (bearing of the middle, extent across it, extent along it) of points (N, 2)."""
    bearings = np.arctan2(points[:, 1], points[:, 0])
    bearing = 0.5 * float(bearings.min() + bearings.max())
    ahead = np.array([math.cos(bearing), math.sin(bearing)])
    along = points @ ahead
    across = points @ np.array([-ahead[1], ahead[0]])
    return bearing, float(np.ptp(across)), float(np.ptp(along))


def _nearest(points: Float64) -> Float64:
    """Return the point of (N, 2) that is nearest to the origin."""
    nearest: Float64 = points[np.argmin(np.linalg.norm(points, axis=1))]
    return nearest


def _terrain(ground: Ground) -> dict[str, Any]:
    edges = [_NEAR + 0.5 * band for band in range(8)]
    return {
        "slope_deg": _deg(_slope(ground, _NEAR, _FAR)),
        "cross_slope_deg": _deg(math.atan(ground.cross)),
        "reference": "gravity",
        "profile": [
            {"from": _num(a), "to": _num(b), "slope_deg": _deg(_slope(ground, a, b))}
            for a, b in pairwise(edges)
        ],
    }


def _slope(ground: Ground, start: float, end: float) -> float:
    """Return the mean inclination of the ground's pieces in a range of x [rad], without steps."""
    rise = sum(
        plane.slope * max(0.0, min(end, plane.end) - max(start, plane.start))
        for plane in ground.planes
    )
    return math.atan(rise / (end - start))


def _ground(ground: Ground, rig: Rig, down: Float64) -> dict[str, Any]:
    normal = next(p for p in reversed(ground.planes) if p.start <= 0.0).normal()
    level_from_optical = base_from_optical(down, forward_in_camera(rig.mount.attitude))
    camera = Attitude.from_down(level_from_optical.T @ -normal)
    return {
        "height": _num(rig.mount.height * float(normal[2])),
        "pitch_deg": _deg(camera.pitch),
        "roll_deg": _deg(camera.roll),
    }


def _num(value: float) -> float | None:
    return round(float(value), 6) if math.isfinite(value) else None


def _deg(value: float) -> float | None:
    return _num(math.degrees(value))
