"""The plan view: what is where around the robot, in metres, x ahead up and y left to the left."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from bearcub.geometry import Projection, base_from_optical, forward_in_camera
from bearcub.messages import Answer, Float64, FreeRange, Hole, Limit, Obstacle, UInt8
from bearcub.rig import Rig
from bearcub.viewer.palette import (
    FLOOR,
    HOLE,
    LIMITS,
    MUTED,
    NIGHT,
    WHITE,
    Colour,
    blank,
    distance_colour,
)
from bearcub.viewer.placing import Area, Placing
from bearcub.viewer.text import draw_label, draw_text, label_size, line_height, text_width
from bearcub.viewer.wording import metres

_REACHES = (6.0, 10.0, 15.0, 25.0, 40.0)  # how far ahead a view may show [m]
_SHIFT = 4  # bits of a pixel's fraction in OpenCV's drawing
_SEEN: Colour = (52, 45, 41)
_RING: Colour = (92, 84, 78)


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Where ``base_link`` lies in the plan view.

    Attributes
    ----------
    width, height : int
        Of the picture [px].
    reach : float
        From the origin to the upper border [m].
    foot : int
        Rows below the origin [px].
    """

    width: int
    height: int
    reach: float
    foot: int

    @property
    def scale(self) -> float:
        """Pixels per metre."""
        return (self.height - self.foot) / self.reach

    def pixels(self, points: Float64) -> Float64:
        """Return the (column, row) [px] of points (x, y) [m] in ``base_link``, shape (..., 2)."""
        origin = np.array([(self.width - 1) / 2.0, self.height - 1.0 - self.foot])
        return origin - self.scale * np.asarray(points, dtype=np.float64)[..., ::-1]

    def outline(self, points: Float64) -> np.ndarray[tuple[int, ...], np.dtype[np.int32]]:
        """Return points [m] as OpenCV's polygons want them, with a fraction of a pixel."""
        bounded = np.clip(self.pixels(points), -30000, 30000)
        return (bounded * (1 << _SHIFT)).round().astype(np.int32)


def birdseye(
    answer: Answer, rig: Rig, *, size: tuple[int, int] = (480, 480), reach: float | None = None
) -> UInt8:
    """Draw an answer from above.

    Free ground is green; its border has the colour of what ends it. Obstacles are bars as wide as
    they are seen, in the colours of distance, with a whisker of two sigma; holes are hatched.
    The lighter area is the floor in the field of view.

    Parameters
    ----------
    answer : Answer
        Of one frame.
    rig : Rig
        Camera of the size of the answer's layers, and its mount.
    size : tuple of int
        (width, height) of the picture [px].
    reach : float, optional
        How far ahead the picture shows [m]; without it the least of 6, 10, 15, 25 and 40 m that
        holds everything found. Fix it for a video.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        BGR.
    """
    text = min(max(size[1] / 36.0, 10.0), 30.0)
    view = View(
        width=size[0],
        height=size[1],
        reach=reach or automatic_reach(answer),
        foot=round(3.4 * text),
    )
    canvas = blank(*size, NIGHT)
    placing = Placing(Area(0, 0, size[0], size[1] - line_height(text) - 4))
    _draw_field_of_view(canvas, answer, rig, view)
    _draw_free_ground(canvas, answer.free_range, view)
    _draw_rings(canvas, view, placing, text=text)
    _draw_limits(canvas, answer.free_range, view)
    _draw_things(canvas, answer, view, placing, text=text)
    _draw_robot(canvas, view, placing)
    _draw_legend(canvas, answer, text=text)
    return canvas


def automatic_reach(answer: Answer) -> float:
    """Return the least reach [m] of a plan view that shows everything found, or the largest."""
    free = answer.free_range
    ends = free.range[[limit is not Limit.UNSEEN for limit in free.limit]]
    found = [o.distance for o in answer.obstacles] + [h.distance for h in answer.holes]
    farthest = max([0.0, *found, *ends[np.isfinite(ends)].tolist()])
    return next((r for r in _REACHES if farthest <= 0.92 * r), _REACHES[-1])


def visible_floor(answer: Answer, rig: Rig, *, farthest: float) -> Float64:
    """Return the corners of the floor in the image, in ``base_link`` [m].

    Parameters
    ----------
    answer : Answer
        Its ground says where the floor is.
    rig : Rig
        The camera and its mount.
    farthest : float
        Depth [m] at which the view is cut off.

    Returns
    -------
    ndarray of float64, shape (4, 2)
        (x, y) of near left, far left, far right and near right; NaN where there is no such point.
    """
    camera, plane = rig.camera.projection, answer.ground.plane
    bottom = rig.camera.height - 1.0
    corners = []
    for u, far in ((0, False), (0, True), (rig.camera.width - 1, True), (-1, False)):
        column = float(u if u >= 0 else rig.camera.width - 1)
        row = bottom
        if far:
            level = camera.fx * camera.baseline / farthest
            row = min(bottom, (level - plane[2] - plane[0] * column) / plane[1])
        corners.append((column, row))
    return floor_points(np.array(corners), camera=camera, plane=plane, rig=rig)


def floor_points(pixels: Float64, *, camera: Projection, plane: Float64, rig: Rig) -> Float64:
    """Return (x, y) [m] in ``base_link`` of pixels (u, v) on the floor, shape (N, 2)."""
    u, v = pixels.T
    disparity = plane[0] * u + plane[1] * v + plane[2]
    points = camera.points(u, v, np.where(disparity > 0, disparity, np.nan))
    down = camera.floor(plane)[1]
    level: Float64 = points @ base_from_optical(down, forward_in_camera(rig.mount.attitude)).T
    return level[:, :2] + [rig.mount.x, rig.mount.y]


def free_outline(free: FreeRange, *, farthest: float) -> Float64:
    """Return the border of the free ground: an arc of constant range for every bearing.

    Parameters
    ----------
    free : FreeRange
        N bearings.
    farthest : float
        Ranges are cut off here [m]; one that is not known counts as 0.

    Returns
    -------
    ndarray of float64, shape (N, 2, 2)
        (x, y) [m] of the right and left end of every arc.
    """
    middle = (free.bearing[1:] + free.bearing[:-1]) / 2.0
    edges = np.concatenate([free.bearing[:1], middle, free.bearing[-1:]])
    reach = np.clip(np.nan_to_num(free.range, nan=0.0, posinf=farthest), 0.0, farthest)
    sides = np.stack([edges[:-1], edges[1:]], axis=-1)
    outline: Float64 = reach[:, None, None] * np.stack([np.cos(sides), np.sin(sides)], axis=-1)
    return outline


def bar(thing: Obstacle | Hole, *, thickness: float) -> Float64:
    """Return the corners (x, y) [m] of a thing `thickness` deep, shape (4, 2).

    Its near side lies across the line of sight to the centre, at its distance.
    """
    ahead = np.array([math.cos(thing.bearing), math.sin(thing.bearing)])
    left = np.array([-ahead[1], ahead[0]])
    half = 0.0 if math.isnan(thing.width) else thing.width / 2.0
    near, far = thing.distance * ahead, (thing.distance + thickness) * ahead
    return np.stack([near - half * left, near + half * left, far + half * left, far - half * left])


def _mix(
    canvas: UInt8,
    outline: np.ndarray[tuple[int, ...], np.dtype[np.int32]],
    *,
    colour: Colour,
    opacity: float,
) -> None:
    layer = canvas.copy()
    cv2.fillPoly(layer, [outline], colour, cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(layer, opacity, canvas, 1.0 - opacity, 0.0, dst=canvas)


def _draw_field_of_view(canvas: UInt8, answer: Answer, rig: Rig, view: View) -> None:
    if answer.ground.plane[1] <= 0:
        return
    corners = visible_floor(answer, rig, farthest=3.0 * view.reach)
    if not np.isfinite(corners).all():
        return
    cv2.fillPoly(canvas, [view.outline(corners)], _SEEN, cv2.LINE_AA, _SHIFT)
    camera = np.array([rig.mount.x, rig.mount.y])
    for near, far in ((corners[0], corners[1]), (corners[3], corners[2])):
        sight = view.outline(np.stack([camera, near, far]))
        cv2.polylines(canvas, [sight], False, _RING, 1, cv2.LINE_AA, _SHIFT)


def _draw_free_ground(canvas: UInt8, free: FreeRange, view: View) -> None:
    if len(free):
        border = free_outline(free, farthest=2.0 * view.reach).reshape(-1, 2)
        area = np.concatenate([np.zeros((1, 2)), border])
        _mix(canvas, view.outline(area), colour=FLOOR, opacity=0.34)


def _draw_limits(canvas: UInt8, free: FreeRange, view: View) -> None:
    arcs = free_outline(free, farthest=2.0 * view.reach) if len(free) else np.zeros((0, 2, 2))
    kinds = np.array(free.limit, dtype=object)
    for limit, colour in LIMITS.items():
        chosen = arcs[kinds == limit] if len(free) else arcs
        lines = list(view.outline(chosen))
        thickness = 1 if limit is Limit.UNSEEN else 2
        cv2.polylines(canvas, lines, False, colour, thickness, cv2.LINE_AA, _SHIFT)


def _draw_rings(canvas: UInt8, view: View, placing: Placing, *, text: float) -> None:
    """Draw circles of range, and their metres on the axis ahead."""
    step = next(s for s in (1.0, 2.0, 5.0, 10.0) if view.reach / s <= 6.0)
    centre = view.outline(np.zeros(2))
    corner = view.reach + view.width / 2.0 / view.scale
    for k in range(1, int(corner / step) + 1):
        radius = round(k * step * view.scale * (1 << _SHIFT))
        cv2.circle(canvas, tuple(centre.tolist()), radius, _RING, 1, cv2.LINE_AA, _SHIFT)
    ahead = view.outline(np.array([[0.0, 0.0], [view.reach, 0.0]]))
    cv2.polylines(canvas, [ahead], False, _RING, 1, cv2.LINE_AA, _SHIFT)
    for k in range(1, int(view.reach / step) + 1):
        label = f"{k * step:.0f} m"
        x, y = (float(p) for p in view.pixels(np.array([k * step, 0.0])))
        if y > 1.2 * text:
            draw_text(canvas, label, (x + 3, y - 1), size=text, colour=MUTED, anchor=(0, 1))
            size = (text_width(label, text), line_height(text))
            placing.taken.append(Area(round(x + 3), round(y - 1) - size[1], *size))


def _draw_things(
    canvas: UInt8, answer: Answer, view: View, placing: Placing, *, text: float
) -> None:
    for hole in answer.holes:
        _draw_hole(canvas, hole, view)
    named: list[tuple[Obstacle | Hole, str, Colour]] = [
        (h, f"{h.kind} {metres(h.distance, math.nan)}", HOLE) for h in answer.holes
    ]
    for thing in sorted(answer.obstacles, key=lambda o: -o.distance):
        _draw_obstacle(canvas, thing, view)
        title = f"{thing.id}  {metres(thing.distance, math.nan)}"
        named.append((thing, title, distance_colour(thing.distance)))
    named.sort(key=lambda item: item[0].distance)
    areas = [_area(view, bar(thing, thickness=_depth(thing, view))) for thing, _, _ in named]
    placing.things.extend(areas)
    for (_, title, colour), area in zip(named, areas, strict=True):
        if not area.overlap(placing.bounds):
            continue
        place = placing.place(label_size((title,), text), beside=area)
        if place:
            draw_label(canvas, (title,), x=place.x, y=place.y, size=text, colour=colour)


def _depth(thing: Obstacle | Hole, view: View) -> float:
    """Return how deep a thing is drawn [m]: a hole as known, an obstacle as a bar."""
    if isinstance(thing, Hole):
        return thing.length if math.isfinite(thing.length) else 0.08 * view.reach
    return 6.0 / view.scale


def _area(view: View, corners: Float64) -> Area:
    pixels = view.pixels(corners)
    low, high = np.floor(pixels.min(axis=0)).astype(int), np.ceil(pixels.max(axis=0)).astype(int)
    return Area(int(low[0]), int(low[1]), *(int(n) + 1 for n in high - low))


def _draw_obstacle(canvas: UInt8, thing: Obstacle, view: View) -> None:
    colour = distance_colour(thing.distance)
    outline = view.outline(bar(thing, thickness=_depth(thing, view)))
    cv2.fillPoly(canvas, [outline], colour, cv2.LINE_AA, _SHIFT)
    cv2.polylines(canvas, [outline], True, NIGHT, 1, cv2.LINE_AA, _SHIFT)
    _draw_whisker(canvas, thing, view, colour=colour)


def _draw_whisker(canvas: UInt8, thing: Obstacle, view: View, *, colour: Colour) -> None:
    """Draw two sigma of the distance along the line of sight, of the bearing across its ends."""
    along = 2.0 * thing.sigma_distance
    across = 2.0 * thing.sigma_bearing * thing.distance
    if not along * view.scale >= 2.0:  # too small to be seen, or not known
        return
    ahead = np.array([math.cos(thing.bearing), math.sin(thing.bearing)])
    cap = np.array([-ahead[1], ahead[0]]) * max(3.0 / view.scale, np.nan_to_num(across))
    near, far = (thing.distance - along) * ahead, (thing.distance + along) * ahead
    for start, end in ((near, far), (near - cap, near + cap), (far - cap, far + cap)):
        line = view.outline(np.stack([start, end]))
        cv2.polylines(canvas, [line], False, colour, 1, cv2.LINE_AA, _SHIFT)


def _draw_hole(canvas: UInt8, hole: Hole, view: View) -> None:
    corners = bar(hole, thickness=_depth(hole, view))
    area = _area(view, corners)
    if not area.overlap(Area(0, 0, view.width, view.height)):
        return
    outline = view.outline(corners)
    left, top = max(0, area.x), max(0, area.y)
    part = canvas[top : area.y + area.height, left : area.x + area.width]
    inside = np.zeros(part.shape[:2], dtype=np.uint8)
    moved = outline - (np.array([left, top]) << _SHIFT).astype(np.int32)
    cv2.fillPoly(inside, [moved], 255, cv2.LINE_8, _SHIFT)
    v, u = np.ogrid[top : top + part.shape[0], left : left + part.shape[1]]
    part[inside > 0] = NIGHT
    part[(inside > 0) & ((u + v) % 8 < 3)] = HOLE
    closed = math.isfinite(hole.length)
    sides = outline if closed else np.roll(outline, 1, axis=0)
    cv2.polylines(canvas, [sides], closed, HOLE, 2, cv2.LINE_AA, _SHIFT)


def _draw_robot(canvas: UInt8, view: View, placing: Placing) -> None:
    """Draw an arrow head whose tip is the origin: the robot's own size is not known here."""
    x, y = (float(p) for p in view.pixels(np.zeros(2)))
    size = view.foot / 2.2
    shape = np.array(
        [[x, y], [x + 0.62 * size, y + size], [x, y + 0.72 * size], [x - 0.62 * size, y + size]]
    )
    outline = (shape * (1 << _SHIFT)).round().astype(np.int32)
    cv2.fillPoly(canvas, [outline], WHITE, cv2.LINE_AA, _SHIFT)
    placing.taken.append(Area(round(x - size), round(y), round(2 * size), round(size)))


def _draw_legend(canvas: UInt8, answer: Answer, *, text: float) -> None:
    """Write what the colours of the free ground's border mean, for those that occur."""
    height = canvas.shape[0]
    x = 0.8 * text
    y = height - 0.8 * text
    small = 0.9 * text
    entries = [("free", FLOOR)] if len(answer.free_range) else []
    entries += [(str(k), c) for k, c in LIMITS.items() if k in answer.free_range.limit]
    for name, colour in entries:
        left, top = round(x), round(y - 0.3 * text)
        far = (left + round(0.7 * text), top + round(0.6 * text))
        cv2.rectangle(canvas, (left, top), far, colour, cv2.FILLED)
        draw_text(canvas, name, (x + text, y), size=small, colour=MUTED, anchor=(0, 0.5))
        x += 1.6 * text + text_width(name, small)
