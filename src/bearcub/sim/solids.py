"""Cylinders, cones and boxes, hit by rays analytically.

Coordinates are level: x ahead (the heading of the body), y left, z up [m], with the origin on the
ground under the left camera. Rays are ``origin + t * ray``; `origin` and `ray` have the shapes
(3, 1) and (3, N), or (3, N) and (3, 1).
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bearcub.messages import Float64
from bearcub.sim.texture import Reals, Texture


class Part(Protocol):
    """A surface of one texture."""

    @property
    def texture(self) -> Texture:
        """What it looks like."""
        ...

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return t of the first hit of every ray, shape (N,); inf where there is none."""
        ...

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the outward normal, shape (3, N), and surface coordinates s, t [m] of points."""
        ...


class Solid(Part, Protocol):
    """A part of a thing, whose extent is known."""

    @property
    def bottom(self) -> float:
        """Lowest z [m]."""
        ...

    @property
    def top(self) -> float:
        """Highest z [m]."""
        ...

    def nearest(self, eye: Float64) -> Float64:
        """Return its horizontally nearest point (x, y) to `eye`, shape (2,)."""
        ...

    def outline(self, eye: Float64) -> Float64:
        """Return the points (x, y) that bound it to the sides as seen from `eye`, shape (K, 2)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """A solid cylinder from point `start` to point `end` of the axis, with flat ends."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float
    texture: Texture

    def _axis(self) -> tuple[Float64, float]:
        along = np.array(self.end) - np.array(self.start)
        length = float(np.linalg.norm(along))
        return along / length, length

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return the smaller t of side and ends."""
        axis, length = self._axis()
        a = axis.astype(ray.dtype)[:, None]
        w = origin - np.array(self.start, dtype=ray.dtype)[:, None]
        w_along, r_along = (w * a).sum(axis=0), (ray * a).sum(axis=0)
        w_off, r_off = w - a * w_along, ray - a * r_along
        aa, bb = (r_off**2).sum(axis=0), (w_off * r_off).sum(axis=0)
        cc = (w_off**2).sum(axis=0) - self.radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            side = (-bb - np.sqrt(bb**2 - aa * cc)) / aa
            reach = w_along + side * r_along
            side = np.where((side > 0) & (reach >= 0) & (reach <= length), side, np.inf)
            for level in (0.0, length):
                cap = (level - w_along) / r_along
                off = aa * cap**2 + 2 * bb * cap + cc
                side = np.where((cap > 0) & (off <= 0) & (cap < side), cap, side)
        return side.astype(ray.dtype)

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and (arc, height along the axis); on the ends flat coordinates."""
        axis, length = self._axis()
        across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        third = np.cross(axis, across)
        q = point - np.array(self.start, dtype=point.dtype)[:, None]
        along, e, f = (np.tensordot(v.astype(point.dtype), q, 1) for v in (axis, across, third))
        off = np.hypot(e, f)
        to_end = np.minimum(np.abs(along), np.abs(along - length))
        on_end = to_end < np.abs(off - self.radius)
        side = (across[:, None] * e + third[:, None] * f) / np.maximum(off, 1e-9)
        end = axis[:, None] * np.where(along > 0.5 * length, 1.0, -1.0)
        normal = np.where(on_end, end, side).astype(point.dtype)
        s = np.where(on_end, e, self.radius * np.arctan2(f, e))
        return normal, s, np.where(on_end, length + 1.0 + f, along)

    @property
    def _rise(self) -> float:
        """How far the ends' rims reach above and below the axis [m]."""
        upright = self._axis()[0][2]
        return self.radius * math.sqrt(max(0.0, 1.0 - upright**2))

    @property
    def bottom(self) -> float:
        """Lowest z [m]."""
        return min(self.start[2], self.end[2]) - self._rise

    @property
    def top(self) -> float:
        """Highest z [m]."""
        return max(self.start[2], self.end[2]) + self._rise

    def nearest(self, eye: Float64) -> Float64:
        """Return the nearest point of its footprint."""
        if self._rise == 0.0:
            return _nearest_of_disc(self.start[:2], self.radius, eye)
        return _nearest_of_polygon(self._footprint(), eye)

    def outline(self, eye: Float64) -> Float64:
        """Return where lines of sight touch it (upright), or the corners of its footprint."""
        if self._rise > 0.0:
            return self._footprint()
        return _tangents_of_disc(self.start[:2], self.radius, eye)

    def _footprint(self) -> Float64:
        a, b = np.array(self.start[:2]), np.array(self.end[:2])
        along = (b - a) / float(np.linalg.norm(b - a))
        side = self.radius * np.array([-along[1], along[0]])
        return np.array([a - side, b - side, b + side, a + side])


@dataclass(frozen=True, slots=True, kw_only=True)
class Cone:
    """A standing truncated cone about (x, y), from radius `radii[0]` up to `radii[1]`."""

    x: float
    y: float
    bottom: float
    height: float
    radii: tuple[float, float]
    texture: Texture

    @property
    def top(self) -> float:
        """Highest z [m]."""
        return self.bottom + self.height

    @property
    def _taper(self) -> float:
        """Change of the radius per metre up."""
        return (self.radii[1] - self.radii[0]) / self.height

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return the smaller t of side and ends.

        The side is where ``x^2 + y^2 = (r0 + k z)^2`` between the ends, with taper k.
        """
        dtype, k = ray.dtype, self._taper
        w = origin - np.array([self.x, self.y, self.bottom], dtype=dtype)[:, None]
        wide = self.radii[0] + k * w[2]
        aa = ray[0] ** 2 + ray[1] ** 2 - (k * ray[2]) ** 2
        bb = w[0] * ray[0] + w[1] * ray[1] - k * wide * ray[2]
        cc = w[0] ** 2 + w[1] ** 2 - wide**2
        nearest = np.full(np.broadcast(w[0], ray[0]).shape, np.inf, dtype=dtype)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(bb**2 - aa * cc)
            for t in ((-bb - root) / aa, (-bb + root) / aa):
                up = w[2] + t * ray[2]
                met = (t > 0) & (up >= 0) & (up <= self.height) & (t < nearest)
                nearest = np.where(met, t, nearest)
            for level, radius in zip((0.0, self.height), self.radii, strict=True):
                t = (level - w[2]) / ray[2]
                off = np.hypot(w[0] + t * ray[0], w[1] + t * ray[1])
                nearest = np.where((t > 0) & (off <= radius) & (t < nearest), t, nearest)
        return nearest.astype(dtype)

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and (arc, height up); on the ends flat coordinates."""
        e, f, up = point - np.array([self.x, self.y, self.bottom], dtype=point.dtype)[:, None]
        k, off = self._taper, np.maximum(np.hypot(e, f), 1e-9)
        wide = self.radii[0] + k * up
        on_end = np.minimum(np.abs(up), np.abs(up - self.height)) < np.abs(off - wide)
        side = np.stack([e / off, f / off, np.full_like(e, -k)]) / math.hypot(1.0, k)
        level = np.where(up > 0.5 * self.height, 1.0, -1.0)
        end = np.stack([np.zeros_like(e), np.zeros_like(e), level])
        normal = np.where(on_end, end, side).astype(point.dtype)
        s = np.where(on_end, e, self.radii[0] * np.arctan2(f, e))
        return normal, s, np.where(on_end, self.height + 1.0 + f, up)

    def nearest(self, eye: Float64) -> Float64:
        """Return the nearest point of its wider end."""
        return _nearest_of_disc((self.x, self.y), max(self.radii), eye)

    def outline(self, eye: Float64) -> Float64:
        """Return where lines of sight touch its wider end."""
        return _tangents_of_disc((self.x, self.y), max(self.radii), eye)


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box on a level base, turned by `yaw` [rad] about its centre (x, y)."""

    x: float
    y: float
    bottom: float
    size: tuple[float, float, float]  # along, across, up
    texture: Texture
    yaw: float = 0.0

    @property
    def top(self) -> float:
        """Highest z [m]."""
        return self.bottom + self.size[2]

    def _turn(self) -> Float64:
        """Return box_from_level, shape (3, 3)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def _centre(self) -> Float64:
        return np.array([self.x, self.y, self.bottom + 0.5 * self.size[2]])

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return t where rays enter all three pairs of faces."""
        turn, dtype = self._turn().astype(ray.dtype), ray.dtype
        o = turn @ (origin - self._centre().astype(dtype)[:, None])
        d = turn @ ray
        half = 0.5 * np.array(self.size, dtype=dtype)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (-half - o) / d, (half - o) / d
        enter = np.nanmax(np.fmin(one, two), axis=0)
        leave = np.nanmin(np.fmax(one, two), axis=0)
        return np.where((enter <= leave) & (enter > 0), enter, np.inf).astype(dtype)

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and the two coordinates on the face."""
        turn = self._turn().astype(point.dtype)
        q = turn @ (point - self._centre().astype(point.dtype)[:, None])
        half = 0.5 * np.array(self.size, dtype=point.dtype)[:, None]
        face = np.argmin(half - np.abs(q), axis=0)
        index = np.arange(q.shape[1])
        normal = np.zeros_like(q)
        normal[face, index] = np.sign(q[face, index])
        s = np.where(face == 0, q[1], q[0])
        return turn.T @ normal, s, np.where(face == 2, q[1], q[2] + half[2])

    def nearest(self, eye: Float64) -> Float64:
        """Return the nearest point of its footprint."""
        return _nearest_of_polygon(self.outline(eye), eye)

    def outline(self, eye: Float64) -> Float64:  # noqa: ARG002 (a box has the same corners for all)
        """Return its corners."""
        a, b = 0.5 * self.size[0], 0.5 * self.size[1]
        corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
        turned: Float64 = corners @ self._turn()[:2, :2] + np.array([self.x, self.y])
        return turned


def _nearest_of_disc(centre: tuple[float, float], radius: float, eye: Float64) -> Float64:
    """Return the point of a disc's rim that is nearest to `eye`."""
    away = np.array(centre) - eye
    nearest: Float64 = np.array(centre) - away * (radius / float(np.linalg.norm(away)))
    return nearest


def _tangents_of_disc(centre: tuple[float, float], radius: float, eye: Float64) -> Float64:
    """Return the two points where lines of sight from `eye` touch a disc, shape (2, 2)."""
    away = np.array(centre) - eye
    far = float(np.linalg.norm(away))
    half = math.asin(min(1.0, radius / far))
    reach = math.sqrt(max(0.0, far**2 - radius**2))
    angles = math.atan2(away[1], away[0]) + np.array([half, -half])
    touching: Float64 = eye + reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return touching


def _nearest_of_polygon(corners: Float64, eye: Float64) -> Float64:
    """Return the point of the polygon's edges that is nearest to `eye`."""
    start, along = corners, np.roll(corners, -1, axis=0) - corners
    share = ((eye - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    points = start + np.clip(share, 0.0, 1.0)[:, None] * along
    nearest: Float64 = points[np.argmin(np.linalg.norm(points - eye, axis=1))]
    return nearest
