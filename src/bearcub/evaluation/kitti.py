"""KITTI odometry: a drive whose poses say where the car was and which way was free."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bearcub.devices.images import list_folder
from bearcub.errors import InputError
from bearcub.evaluation.poses import climb, nose_down, read_poses, way_ahead
from bearcub.evaluation.runner import Runner, pair
from bearcub.evaluation.score import (
    Box,
    best_label,
    box_region,
    cut,
    inside_corridor,
    overlap,
    rms,
)
from bearcub.evaluation.table import Row, Section
from bearcub.geometry import base_from_optical, forward_in_camera
from bearcub.messages import Answer, Float64, Limit
from bearcub.rig import Rig

HEIGHT = 1.65  # of the camera above the road [m], as the authors state
HALF_WIDTH = 1.0
REACH = 12.0
_TOUCHED = 0.1  # share of an obstacle's pixels in the corridor that puts it there

PARKED: tuple[tuple[int, Box], ...] = (
    (0, (713, 170, 843, 255)),
    (2, (730, 172, 893, 274)),
    (4, (757, 170, 980, 303)),
    (6, (799, 172, 1138, 353)),
    (8, (864, 167, 1225, 369)),
    (14, (681, 172, 756, 226)),
    (18, (702, 176, 813, 250)),
    (20, (725, 176, 857, 260)),
    (22, (747, 177, 925, 286)),
    (24, (784, 177, 1037, 321)),
)
"""Frames and boxes of the two cars parked on the right, read off the images by eye [px]."""
_FOUND = 0.5  # share of a car's measured pixels that one obstacle must cover
_ALONE = 0.5  # overlap (intersection over union) with the car's box of a thing of its own

_ABOUT = (
    "51 frames, 60 m of road; mount 1.65 m, level, no tilt reading. Pitch is that of the camera "
    "against the road just ahead; the poses' pitch is that of the optical axis against the first "
    "camera's, nose down positive, and both count from the first frame. The second line takes the "
    "road's own inclination, from the path's climb over the next 12 m, off the poses' pitch, and "
    "compares without the mean. The car drove on, so an obstacle is false when its nearest point, "
    "or a tenth of its pixels, lies within 1 m of the path that the car then took, at most 12 m "
    "along it. The way is cut short when the free range towards a place of that path ends at an "
    "obstacle, a hole or a slope before it. The parked cars' boxes were read off the images by "
    "eye; a car stands alone when an obstacle's box overlaps its own by half (intersection over "
    "union), and is found when it does or when one obstacle covers half of its measured pixels."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What every frame answered.

    Attributes
    ----------
    frames : ndarray of int64, shape (N,)
        Their numbers.
    height, pitch : ndarray of float64, shape (N,)
        Of the camera over the fitted road [m], [rad]; NaN where no road was seen.
    in_the_way : tuple of str
        The false obstacles, in words.
    cut_short : tuple of str
        The frames where the free range ends before the car did, in words.
    parked : dict
        For every (frame, box) looked at, what `found_at` returns.
    """

    frames: np.ndarray[tuple[int], np.dtype[np.int64]]
    height: Float64
    pitch: Float64
    in_the_way: tuple[str, ...]
    cut_short: tuple[str, ...]
    parked: dict[tuple[int, Box], tuple[float, float]]


def evaluate(folder: Path, runner: Runner, *, frames: Sequence[int] | None = None) -> Section:
    """Drive through the recording, or through some of its frames."""
    poses = read_poses(folder / "poses.txt")
    drive = answer_drive(folder, poses, runner, frames=frames)
    return Section(
        name="kitti_odometry",
        title="KITTI odometry: a drive",
        about=_ABOUT,
        rows=tuple(score(drive, poses)),
    )


def answer_drive(
    folder: Path, poses: Float64, runner: Runner, *, frames: Sequence[int] | None = None
) -> Drive:
    """Answer the frames and keep what is scored.

    Raises
    ------
    InputError
        If there are not as many pairs as poses.
    """
    left, right = (list_folder(folder / f"image_{side}", (".png",)) for side in "lr")
    if not len(left) == len(right) == len(poses):
        raise InputError(
            f"{folder}: {len(left)} left and {len(right)} right images and {len(poses)} poses, "
            f"expected one of each for every frame"
        )
    rig = Rig.load(folder / "calib.txt", height=HEIGHT)
    chosen = np.array(range(len(poses)) if frames is None else frames, dtype=np.int64)
    shots = {f"{k:06d}": pair(left[k], right[k]) for k in chosen}
    height, pitch = np.full((2, len(chosen)), np.nan)
    in_the_way: list[str] = []
    cut_short: list[str] = []
    parked: dict[tuple[int, Box], tuple[float, float]] = {}
    results = runner.answers(rig, shots, name="kitti_odometry")
    for index, (frame, (snapshot, answer)) in enumerate(zip(chosen, results, strict=True)):
        if snapshot.left is not None:
            rig = rig.for_image(width=snapshot.left.shape[1], height=snapshot.left.shape[0])
        if answer.ground.seen:
            height[index], pitch[index] = answer.ground.height, answer.ground.pitch
        in_the_way += [f"frame {frame}: {what}" for what in swept(answer, rig, poses, frame)]
        cut_short += [f"frame {frame}: {what}" for what in shortened(answer, rig, poses, frame)]
        parked |= {(k, box): found_at(answer, box) for k, box in PARKED if k == frame}
    return Drive(
        frames=chosen,
        height=height,
        pitch=pitch,
        in_the_way=tuple(in_the_way),
        cut_short=tuple(cut_short),
        parked=parked,
    )


def swept(
    answer: Answer,
    rig: Rig,
    poses: Float64,
    frame: int,
    *,
    half_width: float = HALF_WIDTH,
    reach: float = REACH,
) -> list[str]:
    """Return the obstacles in the way that the car took, in words."""
    path = way_ahead(poses, frame) + np.array([rig.mount.x, rig.mount.y])
    found = []
    for obstacle in answer.obstacles:
        points = np.vstack([[(obstacle.x, obstacle.y)], ground_positions(answer, rig, obstacle.id)])
        inside = inside_corridor(points, path, half_width=half_width, reach=reach)
        if inside[0] or (len(inside) > 1 and inside[1:].mean() >= _TOUCHED):
            found.append(
                f"{obstacle.distance:.1f} m, {math.degrees(obstacle.bearing):+.0f} deg, "
                f"{obstacle.width:.1f} x {obstacle.height:.1f} m"
            )
    return found


def ground_positions(answer: Answer, rig: Rig, label: int) -> Float64:
    """Return where the pixels of one thing stand, in ``base_link`` [m], shape (N, 2)."""
    camera, layers = rig.camera.projection, answer.layers
    rows, columns = np.nonzero((layers.labels == label) & (layers.disparity > 0.0))
    optical = camera.points(
        columns.astype(np.float64),
        rows.astype(np.float64),
        layers.disparity[rows, columns].astype(np.float64),
    )
    down = camera.floor(answer.ground.plane)[1]
    turn = base_from_optical(down, forward_in_camera(rig.mount.attitude))
    return np.asarray((optical @ turn.T)[:, :2] + (rig.mount.x, rig.mount.y), dtype=np.float64)


def shortened(
    answer: Answer, rig: Rig, poses: Float64, frame: int, *, reach: float = REACH
) -> list[str]:
    """Return what ends the free range on the way that the car took, in words; one or none."""
    free = answer.free_range
    places = cut(way_ahead(poses, frame), reach)[1:] + np.array([rig.mount.x, rig.mount.y])
    for place in places if len(free) else ():
        distance, bearing = float(np.hypot(*place)), float(np.arctan2(place[1], place[0]))
        nearest = int(np.abs(free.bearing - bearing).argmin())
        if free.range[nearest] < distance and free.limit[nearest] is not Limit.UNSEEN:
            return [f"{free.limit[nearest]} at {free.range[nearest]:.1f} m"]
    return []


def found_at(answer: Answer, box: Box) -> tuple[float, float]:
    """Return how much of a box one obstacle covers, and how alike it is to an obstacle's box.

    Largest share of the measured pixels, and largest intersection over union; 0 without any.
    """
    region = box_region(box, answer.layers.labels.shape) & np.isfinite(answer.layers.disparity)
    _, share = best_label(answer.layers.labels, region)
    return share, max((overlap(o.box, box) for o in answer.obstacles), default=0.0)


def score(drive: Drive, poses: Float64) -> list[Row]:
    """Compare a drive with its poses."""
    return [
        _height_row(drive),
        *_pitch_rows(drive, poses),
        Row(
            measure="false obstacles in the way",
            value=len(drive.in_the_way),
            limit=1,
            note="; ".join(drive.in_the_way),
        ),
        Row(
            measure="frames with the way cut short",
            value=len(drive.cut_short),
            note="; ".join(drive.cut_short),
        ),
        *_parked_rows(drive.parked),
    ]


def _height_row(drive: Drive) -> Row:
    off = 100.0 * (drive.height / HEIGHT - 1.0)
    note = "no road seen"
    if not np.isnan(off).all():
        k = int(np.nanargmax(np.abs(off)))
        note = f"worst {off[k]:+.1f} % in frame {drive.frames[k]}"
    return Row(
        measure="frames with height within 5 %",
        value=100.0 * float((np.abs(off) <= 5.0).mean()),  # unknown is not within
        unit="%",
        limit=95.0,
        sense="at least",
        note=note,
    )


def _parked_rows(parked: dict[tuple[int, Box], tuple[float, float]]) -> list[Row]:
    if not parked:
        return []
    missed = [
        f"{frame}"
        for (frame, _), (share, alike) in parked.items()
        if share < _FOUND and alike < _ALONE
    ]
    merged = [f"{frame}" for (frame, _), (_, alike) in parked.items() if alike < _ALONE]
    return [
        Row(
            measure="sightings of parked cars found",
            value=100.0 * (1.0 - len(missed) / len(parked)),
            unit="%",
            limit=100.0,
            sense="at least",
            note=f"missed in frame {', '.join(missed)}" if missed else f"all {len(parked)}",
        ),
        Row(
            measure="sightings of parked cars that stand alone",
            value=100.0 * (1.0 - len(merged) / len(parked)),
            unit="%",
            note=f"not in frame {', '.join(merged)}" if merged else f"all {len(parked)}",
        ),
    ]


def _pitch_rows(drive: Drive, poses: Float64) -> list[Row]:
    posed = nose_down(poses)
    # Against the road: the axis looks down by its own inclination and the road comes up to meet it.
    against_road = posed + climb(poses, ahead=REACH)
    literal = np.degrees((drive.pitch - drive.pitch[0]) - (posed[drive.frames] - posed[0]))
    followed = np.degrees(drive.pitch - against_road[drive.frames])
    return [
        Row(
            measure="pitch against the poses, RMS",
            value=rms(literal),
            unit="deg",
            limit=0.4,
            note=f"{literal.min():+.2f} to {literal.max():+.2f} deg",
        ),
        Row(
            measure="the same, the road's inclination taken off, RMS about the mean",
            value=rms(followed - followed.mean()),
            unit="deg",
            note=f"mean {followed.mean():+.2f} deg",
        ),
    ]
