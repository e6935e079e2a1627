"""What is truly there in a frame, and what of it a stereo camera can be asked for."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bearcub.geometry import Attitude, base_from_optical, camera_attitude, forward_in_camera
from bearcub.messages import Float64
from bearcub.rig import Rig

RANGE = (1.0, 12.0)
"""Things nearer or farther than this are asked of nobody [m]."""

LEAST_VISIBLE = 0.7
"""Share of a thing that must be seen, by the left camera and by both, for it to be asked for."""

LEAST_ROWS = 6.0
"""Rows that a hole covers at its limit; `docs/accuracy.md` gives the formula [px]."""

LEAST_JUMP = 0.5
"""Step of the disparity from a hole's near lip to what is seen behind it at its limit [px]."""

_SAMPLES = 21  # directions across a thing that are tried


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """One obstacle or hole of the truth.

    Attributes
    ----------
    kind : str
        What it is: "can", "post", "pit", ...
    distance, bearing, width : float
        As in `bearcub.messages.Obstacle` and `Hole` [m], [rad].
    height, base_height : float
        Of an obstacle [m], else NaN.
    length, depth : float
        Of a hole [m], else NaN; `depth` is that of the deepest point that a pixel shows.
    rows : float
        That a hole covers in the image [px], else NaN.
    jump : float
        Step of disparity at a hole's near lip [px], else NaN.
    pixels : int
        That show it.
    truncated : tuple of str
        Borders of the image that cut it.
    passable : bool
        The robot fits under it.
    ignored : str
        Why it is neither missed nor wrongly found; empty when it counts.
    """

    kind: str
    distance: float
    bearing: float
    width: float
    height: float = math.nan
    base_height: float = math.nan
    length: float = math.nan
    depth: float = math.nan
    rows: float = math.nan
    jump: float = math.nan
    pixels: int = 0
    truncated: tuple[str, ...] = ()
    passable: bool = False
    ignored: str = ""

    @property
    def counts(self) -> bool:
        """Whether it is asked for."""
        return not self.ignored

    @property
    def whole(self) -> bool:
        """Whether no side of the image cuts it, so that its width and middle are known."""
        return not {"left", "right"} & set(self.truncated)


def obstacles(truth: Mapping[str, Any], rig: Rig) -> tuple[Target, ...]:
    """Return the obstacles of a ``bearcub.truth/1`` object, those with a passage below, too."""
    view = _View.of(truth, rig)
    return tuple(_obstacle(thing, view) for thing in truth.get("obstacles", ()))


def holes(truth: Mapping[str, Any], rig: Rig) -> tuple[Target, ...]:
    """Return the holes of a ``bearcub.truth/1`` object."""
    view = _View.of(truth, rig)
    return tuple(_hole(thing, view) for thing in truth.get("holes", ()))


def _obstacle(thing: Mapping[str, Any], view: "_View") -> Target:
    target = Target(
        **_common(thing),
        kind=str(thing.get("name", "thing")),
        height=_number(thing, "height"),
        base_height=_number(thing, "base_height"),
        passable=bool(thing.get("passable", False)),
    )
    return replace(target, ignored=_hidden(target, thing.get("visible_share"), view))


def _hole(thing: Mapping[str, Any], view: "_View") -> Target:
    distance, length = _number(thing, "distance"), _number(thing, "length")
    rows, jump = hole_limits(
        view.rig, distance=distance, length=length, depth=_number(thing, "depth")
    )
    target = Target(
        **_common(thing),
        kind=str(thing.get("kind", "pit")),
        length=length,
        depth=_number(thing, "depth_seen" if "depth_seen" in thing else "depth"),
        rows=rows if thing.get("rows") is None else float(thing["rows"]),
        jump=jump,
    )
    ignored = _hidden(target, thing.get("visible_share"), view)
    if not ignored and (target.rows < LEAST_ROWS or jump < LEAST_JUMP):
        ignored = f"{target.rows:.1f} rows and a step of {jump:.2f} px are beyond the limit"
    return replace(target, ignored=ignored)


def hole_limits(rig: Rig, *, distance: float, length: float, depth: float) -> tuple[float, float]:
    """Return the rows that a hole covers and the step of disparity at its near lip [px].

    ``f h w / (R (R + w))`` and ``f B w / (R (R + w))``; beyond a drop as much ground is hidden as
    its depth casts a shadow: ``w = R depth / h`` [1]_.

    References
    ----------
    .. [1] Matthies and Rankin, "Negative obstacle detection by thermal signature", IROS 2003.

    Examples
    --------
    The paper's rig and a hole of 0.6 m: 6 rows at 6.5 m.

    >>> from bearcub.rig import Camera, Mount
    >>> camera = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    >>> rig = Rig(camera=camera, mount=Mount(height=1.2))
    >>> [round(x, 2) for x in hole_limits(rig, distance=6.51, length=0.6, depth=1.0)]
    [6.0, 0.6]
    """
    height = rig.mount.height
    hidden = distance * depth / height
    w = hidden if math.isnan(length) else length
    share = w / (distance * (distance + w))
    return rig.camera.fy * height * share, rig.camera.fx * rig.camera.baseline * share


def _common(thing: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "distance": _number(thing, "distance"),
        "bearing": math.radians(_number(thing, "bearing_deg")),
        "width": _number(thing, "width"),
        "pixels": int(thing.get("pixels", 0)),
        "truncated": tuple(thing.get("truncated", ())),
    }


def _hidden(target: Target, share: float | None, view: "_View") -> str:
    """Return why a thing cannot be asked for; empty when it can."""
    if not RANGE[0] <= target.distance <= RANGE[1]:
        return f"{target.distance:.1f} m is out of range"
    if share is not None and share < LEAST_VISIBLE:
        return f"only {100 * share:.0f} % of it are visible"
    both = view.in_both(target)
    return "" if both >= LEAST_VISIBLE else f"only {100 * both:.0f} % of it are in both images"


def _number(thing: Mapping[str, Any], key: str) -> float:
    value = thing.get(key)
    return math.nan if value is None else float(value)


def face(target: Target, *, shares: Float64) -> Float64:
    """Return places across the line of sight of a thing, at its distance [m], shape (2, N).

    Parameters
    ----------
    target : Target
    shares : ndarray of float64, shape (N,)
        -0.5 for its right end, 0.5 for its left one.
    """
    ahead = np.array([[math.cos(target.bearing)], [math.sin(target.bearing)]])
    aside = np.array([[-ahead[1, 0]], [ahead[0, 0]]])
    return np.asarray(target.distance * ahead + aside * (target.width * shares), dtype=np.float64)


def corners(target: Target, truth: Mapping[str, Any], rig: Rig) -> Float64:
    """Return the outline of a thing's face, or of a hole, in the left image [px], shape (N, 2).

    An upright rectangle across the line of sight, or one on the ground; empty where it is not
    ahead of the camera.
    """
    right, left = face(target, shares=np.array([-0.5, 0.5])).T
    if math.isnan(target.height):
        length = target.length if np.isfinite(target.length) else 0.5
        away = 1.0 + length / target.distance
        ground = [right, left, left * away, right * away]
        places = np.array([(*place, 0.0) for place in ground])
    else:
        low, high = target.base_height, target.height
        places = np.array([(*right, low), (*left, low), (*left, high), (*right, high)])
    u, v, z = _View.of(truth, rig).pixels(places.T)
    return np.stack([u, v], axis=1) if (z > 0.0).all() else np.zeros((0, 2))


@dataclass(frozen=True, slots=True, kw_only=True)
class _View:
    """Both cameras over the level ground of the truth."""

    rig: Rig
    optical_from_level: Float64

    @classmethod
    def of(cls, truth: Mapping[str, Any], rig: Rig) -> "_View":
        tilt = truth.get("tilt") or {"pitch_deg": 0.0, "roll_deg": 0.0}
        body = Attitude(roll=math.radians(tilt["roll_deg"]), pitch=math.radians(tilt["pitch_deg"]))
        attitude = camera_attitude(body=body, mount=rig.mount.attitude)
        turn = base_from_optical(attitude.down(), forward_in_camera(rig.mount.attitude))
        return cls(rig=rig, optical_from_level=turn.T)

    def in_both(self, target: Target) -> float:
        """Return the share of the places across a thing that both images show, at half height."""
        camera = self.rig.camera
        height = 0.0 if math.isnan(target.height) else 0.5 * target.height
        rise = np.full((1, _SAMPLES), height)
        across = face(target, shares=np.linspace(-0.5, 0.5, _SAMPLES))
        u, _, z = self.pixels(np.concatenate([across, rise]))
        with np.errstate(divide="ignore"):
            u_right = u - camera.fx * camera.baseline / z + camera.doffs
        seen = (z > 0.0) & (u <= camera.width - 0.5) & (u_right >= -0.5)
        return float(seen.mean())

    def pixels(self, places: Float64) -> Float64:
        """Return column, row [px] and depth [m] of places in ``base_link`` made level, (3, N)."""
        mount, camera = self.rig.mount, self.rig.camera
        eye = np.array([[mount.x], [mount.y], [mount.height]])
        x, y, z = self.optical_from_level @ (places - eye)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.stack([camera.cx + camera.fx * x / z, camera.cy + camera.fy * y / z, z])
