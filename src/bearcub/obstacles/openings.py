"""Holes that the images show and the disparity map does not."""

import math
from collections.abc import Callable

import cv2
import numpy as np

from bearcub.geometry import Float64
from bearcub.ground.surface import Surface
from bearcub.messages import Ground, Hole
from bearcub.obstacles.cloud import View
from bearcub.obstacles.dark import dark_patches
from bearcub.obstacles.mouths import Mouth, mouths
from bearcub.obstacles.regions import EDGE_ROWS, MIRRORED, Region
from bearcub.obstacles.rims import across_and_along, cut
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.sunken import Sunken, opening
from bearcub.obstacles.upright import Scene
from bearcub.robust import median, quantile

_TRIES = 3  # mouths that are looked at, the surest first ...
_PATCHES = 2  # ... and dark ones, the darkest first
_NEAR = 4  # pixels around a dark one in which nothing may stand [px]
_FLOOR = 0.5  # share of what is around a hole that must be matched as floor
_PART = 0.22  # width and length of what may be a part of a hole [m]
_LEAST, _LONGEST = 0.3, 2.0  # width and length of a hole, and its length [m]
NARROW = 0.4  # width [m] below which gaps between blades and stones look like holes in the map
_LEANS = 0.1  # how far what was matched inside must lie below the floor [px]
_AROUND = np.ones((9, 9), dtype=np.uint8)  # in which a matcher may mix a hole with the floor [px]
_EDGE = 1.0  # 1-sigma of where a rim is [px]
_VAGUE = (0.15, 0.08)  # ... of width (side walls) and length (close to the far lip), as a share
_SHALLOWER = 0.3  # ... and of the depth: where the wall's foot is
_BELIEVED = 10.0  # log-likelihood ratio of what is rather sure
_SAMPLES = 32  # points of a lip
_ROWS = (-0.5, -0.35, -0.2, 0.2, 0.35, 0.5)  # by which the images' rows may be off [px]
_LEFT = 0.6  # share of the misfit to the floor that they leave; of true pits 0.8 and more


def openings(
    known: list[Region],
    doubtful: list[tuple[Hole, Region]],
    images: Scene,
    sorter: Sorter,
    view: View,
    ground: Ground,
    refused: Callable[[Region], bool],
) -> list[tuple[Hole, Region]]:
    """Return holes beside the known ones.

    Parameters
    ----------
    known : list of Region
        The others' pixels.
    doubtful : list of tuple of Hole and Region
        What may be holes by their disparities, and not by the images pixel by pixel; all `large`.
    images : Scene
    sorter : Sorter
    view : View
    ground : Ground
    refused : callable
        Tells what is no hole for other reasons.
    """
    candidates: list[tuple[Mouth, tuple[Hole, Region] | None]] = [
        *((mouth, None) for mouth in _seen(images, sorter)),
        *((_mouth(region, images.surface), (hole, region)) for hole, region in doubtful),
    ]
    taken = list(known)
    found = []
    for mouth, told in candidates:
        if any(region.holds(mouth.u, _row(mouth, images.surface)) for region in taken):
            continue
        sunken = opening(images, mouth)
        if sunken is None or not sunken.left <= mouth.u <= sunken.right:
            continue  # nothing, or something else beside it
        region = _region(sunken, sorter)
        if region is None or any(region.overlaps(other) for other in taken):
            continue
        if not _sinks(region) or refused(region) or _rows_explain(region, images):
            continue
        hole = _hole(sunken, region, view, ground, images)
        if hole is None and told is not None and told[0].width > NARROW:
            hole, region = told  # no rectangle: its disparities tell its extent
        if hole is not None:
            found.append((hole, region))
            taken.append(region)
    return found


def large(region: Region, images: Scene) -> bool:
    """Tell what may be a part of a hole from what is as small as noise.

    Parameters
    ----------
    region : Region
    images : Scene
    """
    p = images.projection
    u, v = region.pixels()
    level = images.surface.level(u + region.left, v + region.top)
    depths = p.fx * p.baseline / np.maximum(level, p.baseline)
    wide = p.baseline * (int(u.max()) - int(u.min()) + 1)
    return bool(wide > _PART * level.max() and np.ptp(depths) > _PART)


def _seen(images: Scene, sorter: Sorter) -> list[Mouth]:
    """Return where the floor seems to open, and where it is dark and nothing stands."""
    witness, surface, projection = images.witness, images.surface, images.projection
    seen = mouths(witness, surface, projection, offset=images.offset)[:_TRIES]
    dark = dark_patches(witness.left, surface, projection)[:_PATCHES]
    return seen + [mouth for mouth in dark if not _stands(mouth, sorter)]


def _stands(mouth: Mouth, sorter: Sorter) -> bool:
    """Tell whether something stands where the floor is dark, just behind the near end."""
    row = _row(mouth, sorter.surface) - _NEAR
    rows, columns = (slice(max(0, at - _NEAR), max(0, at + _NEAR) + 1) for at in (row, mouth.u))
    return bool(sorter.part(rows, columns).standing.mean() > _FLOOR)


def _mouth(region: Region, surface: Surface) -> Mouth:
    u, v = region.pixels()
    u, v = u + region.left, v + region.top
    return Mouth(u=round(median(u)), level=quantile(surface.level(u, v), 0.9), sure=0.0)


def _row(mouth: Mouth, surface: Surface) -> int:
    a, b, c = (float(k) for k in surface.plane)
    return round((mouth.level - a * mouth.u - c) / b)


def _region(sunken: Sunken, sorter: Sorter) -> Region | None:
    """Return the pixels between the lips of a mouth, None where there are none."""
    a, b, c = sorter.surface.plane.tolist()
    height, width = sorter.disparity.shape
    first, last = max(0, round(sunken.left)), min(width - 1, round(sunken.right))
    rows = [(lip - a * u - c) / b for lip in (sunken.far, sunken.near) for u in (first, last)]
    top, bottom = math.floor(min(rows)) - MIRRORED, math.ceil(max(rows)) + EDGE_ROWS
    part = sorter.part(
        slice(max(0, top), min(height, bottom)),
        slice(max(0, first - len(_AROUND)), min(width, last + len(_AROUND))),
    )
    level = sorter.surface.level(part.u[None, :], part.v[:, None])
    mask = (level >= sunken.far) & (level <= sunken.near)
    mask &= (part.u >= first) & (part.u <= last)
    return Region(mask=mask, sorting=part, plain=False) if mask.any() else None


def _sinks(region: Region) -> bool:
    """Tell whether what was matched leans to a hole: lower inside, floor around."""
    part = region.sorting
    around = cv2.dilate(region.mask.astype(np.uint8), _AROUND) == 0
    inside = part.residual[region.mask]
    inside = inside[np.isfinite(inside)]
    if len(inside) and median(inside) > -_LEANS:
        return False
    return bool(part.on_floor[around].mean() > _FLOOR)


def _rows_explain(region: Region, images: Scene) -> bool:
    """Tell whether the floor fits the images much better where their rows are a little off.

    On an edge nearly along the row, as that of a shadow or of a painted line, a shift of rows
    looks like a much larger one of disparity.
    """
    v, u = np.nonzero(region.mask)
    floor = region.sorting.floor[v, u] - np.float32(images.offset)
    u, v = u + region.left, v + region.top
    here = images.witness.left[v, u].astype(np.float32)
    first = max(0, int(v.min()) - 1)
    right = images.witness.right[first : int(v.max()) + 2].astype(np.float32)

    def misfit(rows: float) -> float:
        at, row = (place.astype(np.float32) for place in (u - floor, v - first + rows))
        seen = cv2.remap(right, at, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        difference = here - np.asarray(seen, dtype=np.float32).ravel()
        difference -= np.float32(median(difference))
        return float((difference * difference).mean())

    return min(misfit(rows) for rows in _ROWS) < _LEFT * misfit(0.0)


def _hole(sunken: Sunken, region: Region, view: View, ground: Ground, images: Scene) -> Hole | None:
    """Return the hole that a mouth is; what is seen of its far wall is the least of its depth."""
    near, far = (_lip(sunken, level, view, images.surface) for level in (sunken.near, sunken.far))
    reach = np.hypot(near[0], near[1])
    first = int(np.argmin(reach))
    distance = float(reach[first])
    bearings = np.arctan2(near[1], near[0])
    bearing = 0.5 * float(bearings.max() + bearings.min())
    width, length = across_and_along(np.concatenate([near, far], axis=1), bearing)
    if min(width, length) < _LEAST or length > _LONGEST:
        return None
    depth = ground.height * length / distance
    pixel = distance / view.projection.fx
    step = _EDGE * pixel * distance / ground.height  # along the floor
    spread = ground.noise * distance / (view.projection.fx * view.projection.baseline) / 4
    v, u = np.nonzero(region.mask)
    box = (int(u.min()), int(v.min()), int(u.max()), int(v.max()))
    left, top = region.left, region.top
    hole = Hole(
        x=float(near[0, first]),
        y=float(near[1, first]),
        distance=distance,
        bearing=bearing,
        width=width,
        length=length,
        depth=depth,
        depth_is_lower_bound=True,
        kind="pit",
        sigma_distance=math.hypot(step, distance * spread),
        sigma_width=math.hypot(_EDGE * pixel, _VAGUE[0] * width),
        sigma_length=math.hypot(step, _VAGUE[1] * length),
        sigma_depth=_SHALLOWER * depth,
        confidence=1 - math.exp(-sunken.likely / _BELIEVED),
        box=(box[0] + left, box[1] + top, box[2] + left, box[3] + top),
        pixels=len(u),
    )
    return cut(hole, (images.witness.left.shape[0], images.witness.left.shape[1]))


def _lip(sunken: Sunken, level: float, view: View, surface: Surface) -> Float64:
    """Return points of a lip, shape (3, N) [m]."""
    a, b, c = surface.plane.tolist()
    u = np.linspace(sunken.left, sunken.right, _SAMPLES)
    entry = surface.entry(np.array([level], dtype=np.float32))
    floor = level + float(surface.look_up(surface.bend, entry)[0])
    return view.points(u, (level - c - a * u) / b, np.full(_SAMPLES, floor))
