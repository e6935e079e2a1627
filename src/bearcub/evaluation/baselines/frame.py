"""What every baseline is given: one disparity map, the rig and the tilt sensor's reading."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bearcub.evaluation.inclination import inclination
from bearcub.evaluation.report import Found, Report
from bearcub.geometry import Attitude, base_from_optical, camera_attitude, forward_in_camera
from bearcub.messages import Float32, Float64, Int32, Tilt
from bearcub.rig import Rig

LEAST_HEIGHT = 0.1
"""What rises higher than this above the floor is an obstacle to every baseline [m]."""

FARTHEST = 9.0
"""How far every baseline looks [m]: as far as a promise reaches, with the gate of the matching."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One frame, as a baseline sees it.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], adjusted (depth = fx B / d); NaN where unmatched.
    rig : Rig
        For images of this size.
    tilt : Tilt or None
    """

    disparity: Float32
    rig: Rig
    tilt: Tilt | None

    @property
    def expected(self) -> Attitude:
        """The camera's attitude that mount and tilt sensor tell."""
        body = Attitude(roll=0.0, pitch=0.0)
        if self.tilt is not None:
            body = Attitude(roll=self.tilt.roll, pitch=self.tilt.pitch)
        return camera_attitude(body=body, mount=self.rig.mount.attitude)

    def level_from_optical(self, down: Float64) -> Float64:
        """Return the rotation from optical axes to those of ``base_link`` over a floor."""
        return base_from_optical(down, forward_in_camera(self.rig.mount.attitude))

    def points(self, *, down: Float64, height: float) -> Float64:
        """Return every pixel's place over a floor, in ``base_link`` [m], shape (H, W, 3).

        Parameters
        ----------
        down : ndarray of float64, shape (3,)
            To the floor, in optical axes.
        height : float
            Of the camera above it [m].

        Returns
        -------
        ndarray of float64
            NaN where there is no disparity, and beyond `FARTHEST`.
        """
        rows, columns = self.disparity.shape
        v, u = np.mgrid[:rows, :columns].astype(np.float64)
        camera, mount = self.rig.camera, self.rig.mount
        least = camera.fx * camera.baseline / (1.2 * FARTHEST)
        seen = np.where(self.disparity > least, self.disparity, np.nan).astype(np.float64)
        places = camera.projection.points(u, v, seen) @ self.level_from_optical(down).T + (
            mount.x,
            mount.y,
            height,
        )
        places[np.hypot(places[..., 0], places[..., 1]) > FARTHEST] = np.nan
        return np.asarray(places, dtype=np.float64)

    def report(
        self,
        obstacles: tuple[Found, ...],
        *,
        height: float,
        down: Float64,
        **more: tuple[Found, ...],
    ) -> Report:
        """Return a report with the floor that was fitted; its slope only where there is gravity."""
        attitude = Attitude.from_down(down)
        slope = cross_slope = math.nan
        if self.tilt is not None:
            slope, cross_slope = inclination(
                down, gravity=self.expected.down(), mount=self.rig.mount.attitude
            )
        return Report(
            obstacles=obstacles,
            holes=more.get("holes", ()),
            slope=slope,
            cross_slope=cross_slope,
            reference="gravity",
            height=height,
            pitch=attitude.pitch,
            roll=attitude.roll,
        )


def measured(points: Float64, labels: Int32) -> tuple[Found, ...]:
    """Return the extent of every labelled set of points, robust against one in fifty.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 3)
        ``base_link`` [m].
    labels : ndarray of int32, shape (N,)
        1, 2, ...; 0 for none.
    """
    order = np.argsort(labels, kind="stable")
    edges = np.searchsorted(labels[order], np.arange(1, labels.max(initial=0) + 2))
    return tuple(_extent(points[order[a:b]]) for a, b in pairwise(edges) if b > a)


def _extent(points: Float64) -> Found:
    x, y, z = points.T
    bearing = 0.5 * float(np.quantile(np.arctan2(y, x), (0.02, 0.98)).sum())
    first, last = np.quantile(y * math.cos(bearing) - x * math.sin(bearing), (0.02, 0.98))
    low, high = np.quantile(z, (0.02, 0.98))
    return Found(
        distance=float(np.quantile(np.hypot(x, y), 0.1)),
        bearing=bearing,
        width=float(last - first),
        height=float(high),
        base_height=0.0 if low < 2.0 * LEAST_HEIGHT else float(low),
    )
