"""The obstacle stage: disparity and floor become things, holes, terrain and free range."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import (
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    forward_in_camera,
)
from bearcub.messages import (
    Bool,
    DisparityMap,
    Float32,
    FreeRange,
    Ground,
    Hole,
    Int32,
    Layers,
    Obstacle,
    Pixel,
    Terrain,
    UInt8,
    Vote,
)
from bearcub.obstacles.free_range import free_range
from bearcub.obstacles.holes import find_holes
from bearcub.obstacles.measure import Extent, View, measure
from bearcub.obstacles.segment import Segments, segment
from bearcub.obstacles.sorting import Sorting, sort_by_floor
from bearcub.obstacles.terrain import lie_of_the_land
from bearcub.obstacles.verify import Witness, confirmed
from bearcub.rig.model import Mount
from bearcub.robust import median

_RISEN = 0.6  # share of its height that a low thing reaches at its front
_SMALL = 400  # pixels of a thing that may be mixed ones
_BESIDE = 8  # columns or rows to a nearer thing's edge [px]
_LARGE = 8000  # pixels of a thing that needs no second look at the images

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What the stage found in one frame."""

    obstacles: tuple[Obstacle, ...]
    holes: tuple[Hole, ...]
    terrain: Terrain
    free_range: FreeRange
    layers: Layers


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleStage:
    """Find what stands on the floor, what is missing from it and how it lies.

    Attributes
    ----------
    projection : Projection
    mount : Mount
    least_height : float
        Lowest thing that is reported [m].
    least_area : float
        Smallest outline that is reported [m²].
    low_height : float
        What does not rise above it (kerbs, banks) does not join what does [m].
    least_pixels : int
        Smallest thing that is reported [px].
    least_fill : float
        Share of its outline that a thing's pixels must cover.
    farthest : float
        How far to look [m].
    clearance : float
        What hangs higher than this does not block the way [m].
    sigmas : float
        How many sigmas off the floor a pixel must be.
    unevenness : float
        Height of bumps that are still floor [m].
    bias : float
        1-sigma of the disparity error that all pixels of a thing share [px].
    steepest : float
        Steepest ground that is still a way [rad].
    bearing_step : float
        Between the directions of the free range [rad].
    """

    projection: Projection
    mount: Mount
    least_height: float
    least_area: float
    low_height: float
    least_pixels: int
    least_fill: float
    farthest: float
    clearance: float
    sigmas: float
    unevenness: float
    bias: float
    steepest: float
    bearing_step: float

    def __call__(
        self, disparity: DisparityMap, ground: Ground, *, gravity: Float64 | None
    ) -> Findings:
        """Answer the six questions of one frame.

        Parameters
        ----------
        disparity : DisparityMap
        ground : Ground
        gravity : ndarray of float64, shape (3,), or None
            Direction of gravity in optical axes when a tilt sensor told it.

        Returns
        -------
        Findings
        """
        d = disparity.disparity
        view = self.view(ground)
        farthest_level = self.projection.fx * self.projection.baseline / self.farthest
        sorting = sort_by_floor(
            d,
            ground,
            sigmas=self.sigmas,
            unevenness=self.unevenness,
            farthest_level=farthest_level,
        )
        segments = segment(
            d,
            sorting.floor,
            sorting.standing,
            self.projection,
            camera_height=ground.height,
            lean=math.tan(ground.roll),
            least_height=self.least_height,
            low_height=min(self.low_height, 0.5 * ground.height),
            nearest_level=min(disparity.largest, 0.5 * d.shape[1]),
            farthest_level=farthest_level,
        )
        witness = Witness.of(disparity)
        obstacles, labels = self._obstacles(disparity, sorting, segments, view, ground, witness)
        holes, hole_labels = find_holes(
            sorting,
            labels,
            view,
            ground,
            farthest=self.farthest,
            witness=witness,
            offset=disparity.offset,
        )
        if holes:
            labels = np.where(hole_labels < 0, hole_labels, labels)
        layers = Layers(
            disparity=d,
            floor=sorting.floor,
            kind=_kinds(d, sorting.on_floor, labels),
            labels=labels,
        )
        terrain = lie_of_the_land(d, sorting.on_floor, view, ground, gravity=gravity)
        way = free_range(
            layers,
            obstacles,
            terrain,
            view,
            step=self.bearing_step,
            farthest=self.farthest,
            clearance=self.clearance,
            steepest=self.steepest,
        )
        return Findings(
            obstacles=obstacles, holes=holes, terrain=terrain, free_range=way, layers=layers
        )

    def view(self, ground: Ground) -> View:
        """Return the camera in ``base_link`` over this ground."""
        down = Attitude(roll=ground.roll, pitch=ground.pitch).down()
        return View(
            projection=self.projection,
            base_from_optical=base_from_optical(down, forward_in_camera(self.mount.attitude)),
            origin=np.array([self.mount.x, self.mount.y, ground.height]),
        )

    def _obstacles(
        self,
        disparity: DisparityMap,
        sorting: Sorting,
        segments: Segments,
        view: View,
        ground: Ground,
        witness: Witness | None,
    ) -> tuple[tuple[Obstacle, ...], Int32]:
        """Measure every segment; number those that count from the nearest."""
        d = disparity.disparity
        found = []
        for number, (u, v) in enumerate(segments.members, start=1):
            stride = segments.stride[number - 1]
            pixels = stride**2 * len(u)
            if pixels < self.least_pixels:
                continue
            if pixels < _SMALL and _mixed(d, segments.labels, number, u, v):
                continue
            extent = measure(
                view,
                (u + 0.5 * (stride - 1)).astype(np.float64),
                (v + 0.5 * (stride - 1)).astype(np.float64),
                d[v, u],
                stride=stride,
                noise=ground.noise,
                bias=self.bias,
                fattening=disparity.fattening,
            )
            hidden = ground.height * median(sorting.allowed[v, u] / d[v, u])
            if self._hangs(extent, hidden) and _hidden_below(d, segments.labels, number, u, v):
                extent = replace(extent, bottom=0.0)  # its foot is out of sight
            if self._counts(extent, hidden, pixels) and (
                pixels > _LARGE or confirmed(witness, sorting, u, v, offset=disparity.offset)
            ):
                if not self._hangs(extent, hidden):
                    extent = replace(extent, bottom=0.0)
                found.append((extent, number, _box(u, v, stride, d.shape)))
        found.sort(key=lambda item: item[0].distance)
        labels = np.zeros(d.shape, dtype=np.int32)
        obstacles = []
        for identity, (extent, number, box) in enumerate(found, start=1):
            left, top, right, bottom = box
            window = np.s_[top : bottom + 1, left : right + 1]
            own = segments.labels[window] == number
            np.copyto(labels[window], identity, where=own)
            count = int(np.count_nonzero(own))
            obstacles.append(self._obstacle(identity, extent, box, count, d.shape))
        return tuple(obstacles), labels

    def _counts(self, extent: Extent, hidden: float, pixels: int) -> bool:
        """Tell a thing from stray matches: they fill little of their outline or hang in the sky."""
        # a matcher's window alone makes a thing as wide as itself; a blade of grass has no area
        small = extent.width <= 0.0 or extent.width * extent.top < self.least_area
        low = extent.top < self.least_height
        if small or low or extent.climbs or extent.distance > self.farthest:
            return False
        if extent.top < self.low_height and extent.front < _RISEN * extent.top:
            return False  # ground that climbs
        if self._hangs(extent, hidden):
            return pixels > 10 * self.least_pixels and extent.fill > 2 * self.least_fill
        return extent.fill > self.least_fill

    def _hangs(self, extent: Extent, hidden: float) -> bool:
        """Tell what hangs; the tolerance hides the lowest part of what stands on the floor."""
        return extent.bottom > max(
            2 * self.least_height + 3 * self.unevenness, min(1.5 * hidden, 0.4)
        )

    def _obstacle(
        self,
        identity: int,
        extent: Extent,
        box: tuple[int, int, int, int],
        pixels: int,
        shape: tuple[int, int],
    ) -> Obstacle:
        cut = _cut(box, shape)
        weight = min(6.0, math.log(pixels / self.least_pixels) + 0.5)
        remark = f"; cut by the image's {' and '.join(cut)} border" if cut else ""
        return Obstacle(
            id=identity,
            x=extent.x,
            y=extent.y,
            distance=extent.distance,
            bearing=extent.bearing,
            width=extent.width,
            height=extent.top,
            base_height=extent.bottom,
            sigma_distance=extent.sigma_distance,
            sigma_bearing=extent.sigma_bearing,
            sigma_width=math.nan if {"left", "right"} & set(cut) else extent.sigma_width,
            sigma_height=math.nan if "top" in cut else extent.sigma_top,
            confidence=1 / (1 + math.exp(-weight)),
            box=box,
            pixels=pixels,
            truncated=cut,
            votes=(
                Vote(
                    sensor="stereo",
                    vote="for",
                    weight=weight,
                    reason=f"{pixels} px above the floor{remark}",
                ),
            ),
        )


def _mixed(d: Float32, labels: Int32, number: int, u: Index, v: Index) -> bool:
    """Tell pixels that a matcher put between a nearer thing's edge and what is behind it."""
    beside = np.zeros(len(u), dtype=bool)
    for right, down in ((-_BESIDE, 0), (_BESIDE, 0), (0, _BESIDE)):
        column = np.clip(u + right, 0, d.shape[1] - 1)
        row = np.clip(v + down, 0, d.shape[0] - 1)
        other = labels[row, column]
        beside |= (other != 0) & (other != number) & (d[row, column] > d[v, u])
    return bool(beside.mean() > 0.5)


def _hidden_below(d: Float32, labels: Int32, number: int, u: Index, v: Index) -> bool:
    """Tell whether a nearer thing hides what is below these pixels."""
    there = np.clip(v + _BESIDE, 0, d.shape[0] - 1)
    other = labels[there, u]
    hidden = (other != 0) & (other != number) & (d[there, u] > d[v, u])
    return len(np.unique(u[hidden])) > 0.5 * len(np.unique(u))


def _box(u: Index, v: Index, stride: int, shape: tuple[int, int]) -> tuple[int, int, int, int]:
    right, bottom = int(u.max()) + stride - 1, int(v.max()) + stride - 1
    return int(u.min()), int(v.min()), min(right, shape[1] - 1), min(bottom, shape[0] - 1)


def _cut(box: tuple[int, int, int, int], shape: tuple[int, int]) -> tuple[str, ...]:
    """Name the image borders that a box touches, with the margin a matcher loses there."""
    left, top, right, bottom = box
    rows, columns = shape
    margin = 6
    sides = {
        "left": left < margin,
        "right": right >= columns - margin,
        "top": top < margin,
        "bottom": bottom >= rows - margin,
    }
    return tuple(name for name, touched in sides.items() if touched)


def _kinds(d: Float32, on_floor: Bool, labels: Int32) -> UInt8:
    kind = np.full(d.shape, Pixel.OTHER, dtype=np.uint8)
    np.copyto(kind, np.uint8(Pixel.UNSEEN), where=np.isnan(d))
    np.copyto(kind, np.uint8(Pixel.FLOOR), where=on_floor)
    np.copyto(kind, np.uint8(Pixel.OBSTACLE), where=labels > 0)
    np.copyto(kind, np.uint8(Pixel.HOLE), where=labels < 0)
    return np.asarray(kind, dtype=np.uint8)
