"""SSLG: depth images of a wheelchair robot, with every pixel labelled."""

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bearcub.devices.images import list_folder, read_image, read_raw
from bearcub.errors import FormatError
from bearcub.evaluation.runner import Runner, Shot
from bearcub.evaluation.score import best_label
from bearcub.evaluation.table import Row, Section
from bearcub.messages import Answer, Bool, Snapshot, UInt8
from bearcub.rig import Camera, Mount, Rig
from bearcub.stereo.formats import read_disparity

CAMERA = Camera(width=1280, height=720, fx=924, fy=924, cx=639.5, cy=359.5, baseline=0.055)
MOUNT = Mount(height=0.6, sigma_height=0.2, sigma_pitch=math.radians(10.0))

DRIVABLE, OBSTACLE = 1, 2
_SMALLEST = 200  # px; smaller patches of a label are slips of the brush
_FOUND = 0.3  # share of a labelled obstacle's measured pixels that one obstacle must cover
_MOSTLY = 0.5  # share of an obstacle's pixels labelled drivable that makes it false

_ABOUT = (
    "Depth images, 1280 x 720. Focal length and mount are not stated: 924 px; guessed, 0.6 m "
    "(1-sigma 0.2 m) and level (1-sigma 10 deg); no tilt reading. A labelled obstacle (connected "
    "pixels of that label, 200 at least) is found when one obstacle covers 30 % of its measured "
    "pixels: depth images lose the rims of things. An obstacle is false when more than half of its "
    "pixels are labelled drivable."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """One frame against its labels.

    Attributes
    ----------
    covered : tuple of float
        For every labelled obstacle, the share that one obstacle covers.
    drivable : tuple of float
        For every obstacle of the answer, the share of its pixels labelled drivable.
    """

    covered: tuple[float, ...]
    drivable: tuple[float, ...]


def evaluate(folder: Path, runner: Runner) -> Section:
    """Compare every frame's obstacles with its labels."""
    rig = Rig(camera=CAMERA, mount=MOUNT)
    names = [path.stem for path in list_folder(folder / "depth_u16", (".png",))]
    shots = {name: _shot(folder, name) for name in names}
    scored = {
        name: score(answer, _labels(folder / "label" / f"{name}.png", answer))
        for name, (_, answer) in zip(names, runner.answers(rig, shots, name="sslg"), strict=True)
    }
    return Section(
        name="sslg",
        title="SSLG: labelled depth images",
        about=_ABOUT,
        rows=tuple(summary(scored)),
    )


def _shot(folder: Path, name: str) -> Shot:
    def load() -> Snapshot:
        depth = read_disparity(
            folder / "depth_u16" / f"{name}.png",
            encoding="depth_mm",
            focal_baseline=CAMERA.fx * CAMERA.baseline,
        )
        return Snapshot(left=read_image(folder / "rgb" / f"{name}.png"), disparity=depth.disparity)

    return load


def _labels(path: Path, answer: Answer) -> UInt8:
    labels = read_raw(path)
    if labels.dtype != np.uint8 or labels.shape != answer.layers.labels.shape:
        raise FormatError(
            f"{path}: {labels.dtype} of shape {labels.shape}, expected 8-bit labels of the shape "
            f"of the depth image, {answer.layers.labels.shape}"
        )
    return labels.astype(np.uint8, copy=False)


def score(answer: Answer, truth: UInt8) -> Scored:
    """Compare the obstacles' pixels of one answer with labels of the same shape."""
    layers = answer.layers
    measured = np.isfinite(layers.disparity)
    return Scored(
        covered=tuple(best_label(layers.labels, part & measured)[1] for part in patches(truth)),
        drivable=tuple(
            float(np.mean(truth[layers.labels == obstacle.id] == DRIVABLE))
            for obstacle in answer.obstacles
            if (layers.labels == obstacle.id).any()
        ),
    )


def patches(truth: UInt8) -> list[Bool]:
    """Return every connected patch labelled obstacle, without the smallest."""
    count, numbers, stats, _ = cv2.connectedComponentsWithStats(
        (truth == OBSTACLE).astype(np.uint8)
    )
    return [
        np.asarray(numbers == k, dtype=np.bool_)
        for k in range(1, count)
        if stats[k, cv2.CC_STAT_AREA] >= _SMALLEST
    ]


def summary(scored: dict[str, Scored]) -> list[Row]:
    """Return the rows of all frames together."""
    covered = [share for frame in scored.values() for share in frame.covered]
    false = {
        name: [share for share in frame.drivable if share > _MOSTLY]
        for name, frame in scored.items()
    }
    shares = "; ".join(
        f"{name}: {', '.join(f'{100 * s:.0f} %' for s in frame.covered)}"
        for name, frame in scored.items()
    )
    return [
        Row(
            measure="labelled obstacles found",
            value=100.0 * float(np.mean([s >= _FOUND for s in covered])) if covered else math.nan,
            unit="%",
            limit=90.0,
            sense="at least",
            note=f"covered: {shares}",
        ),
        Row(
            measure="obstacles that are mostly drivable",
            value=sum(len(shares) for shares in false.values()),
            limit=0,
            note=", ".join(f"{name}: {len(found)}" for name, found in false.items() if found),
        ),
        Row(
            measure="obstacles reported in all",
            value=sum(len(frame.drivable) for frame in scored.values()),
        ),
    ]
