"""Potholes of known size: one hole, as deep and as wide as the mould taken from it."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bearcub.config import Config, Matching
from bearcub.devices.images import read_image
from bearcub.evaluation.mould import Mould, measure, read_points
from bearcub.evaluation.runner import Runner, Shot
from bearcub.evaluation.score import Box, overlap
from bearcub.evaluation.table import Row, Section
from bearcub.messages import Answer, Hole, Snapshot
from bearcub.rig import Camera, Mount, Rig
from bearcub.stereo.images import shrunk

CAMERA = Camera(
    width=2079, height=1040, fx=1389, fy=1389, cx=1039, cy=519.5, baseline=0.1194, doffs=11.3
)
SIZE = (1040, 520)
MOUNT = Mount(
    height=0.6, pitch=math.radians(40.0), sigma_height=0.2, sigma_pitch=math.radians(10.0)
)
NEAREST = 0.4  # m, of this rig: nothing of the road is nearer


@dataclass(frozen=True, slots=True)
class Pothole:
    """One pair of the set.

    Attributes
    ----------
    folder : str
        Of the model it belongs to.
    number : int
        Of the pair.
    box : tuple of int
        The pothole's mouth, read off the left image of `SIZE` by eye [px].
    """

    folder: str
    number: int
    box: Box

    @property
    def files(self) -> tuple[str, str]:
        """Left and right image, relative to the set."""
        return (
            f"{self.folder}/left images/L{self.number}.png",
            f"{self.folder}/right images/R{self.number}.png",
        )

    @property
    def mould(self) -> str:
        """The scanned mould; the authors gave both models' files the same name."""
        return f"{self.folder}/gt/model_1.ply"


PAIRS = (
    Pothole("model1", 1, (514, 406, 631, 503)),
    Pothole("model2", 9, (537, 353, 638, 441)),
    Pothole("model2", 15, (458, 388, 598, 476)),
)
_ALIKE = 0.2  # least overlap (intersection over union) of a hole's box with the pothole's

_ABOUT = (
    "Three pairs at half size (1040 x 520) with one pothole each. Focal length and mount are not "
    "stated: 1389 px at full size; guessed for all pairs, 0.6 m (1-sigma 0.2 m) and 40 deg down "
    "(1-sigma 10 deg); nearest range 0.4 m; no tilt reading. "
    "Truth is the laser scan of a mould that stands on the face that was level with the road: its "
    "height is the depth; as the side from which the camera looked is not known, the width must "
    "lie within 15 % of the range of the mould's extents over all directions, and the number is "
    "how far outside of that range it lies. The pothole's place was read off the image by eye."
)


def evaluate(folder: Path, runner: Runner) -> Section:
    """Look for the three potholes."""
    camera = CAMERA.scaled(width=SIZE[0], height=SIZE[1])
    rig = Rig(camera=camera, mount=MOUNT)
    config = Config(matching=Matching(nearest=NEAREST))
    rows: list[Row] = []
    for pothole in PAIRS:
        mould = measure(read_points(folder / pothole.mould))
        shots = {str(pothole.number): _half_size(folder, pothole)}
        for _, answer in runner.answers(rig, shots, name="pothole", config=config):
            rows += score(pothole, mould, answer)
    return Section(
        name="pothole", title="Potholes: depth and width", about=_ABOUT, rows=tuple(rows)
    )


def _half_size(folder: Path, pothole: Pothole) -> Shot:
    def load() -> Snapshot:
        left, right = (
            shrunk(read_image(folder / name), width=SIZE[0], height=SIZE[1])
            for name in pothole.files
        )
        return Snapshot(left=left, right=right)

    return load


def score(pothole: Pothole, mould: Mould, answer: Answer) -> list[Row]:
    """Compare the holes of an answer with the mould."""
    overlaps = [overlap(hole.box, pothole.box) for hole in answer.holes]
    chosen = int(np.argmax(overlaps)) if overlaps and max(overlaps) >= _ALIKE else None
    hole = None if chosen is None else answer.holes[chosen]
    name = f"pair {pothole.number}"
    others = [h for k, h in enumerate(answer.holes) if k != chosen]
    return [
        Row(
            measure=f"{name}: pothole found",
            value=float(hole is not None),
            limit=1,
            sense="at least",
            note=f"overlap {max(overlaps, default=0.0):.2f}, "
            f"camera {answer.ground.height:.2f} m high, "
            f"{math.degrees(answer.ground.pitch):.0f} deg down",
        ),
        Row(
            measure=f"{name}: other things called a hole",
            value=len(others),
            limit=0,
            note="; ".join(f"{h.kind} at {h.distance:.2f} m, {h.width:.2f} m wide" for h in others),
        ),
        Row(
            measure=f"{name}: depth error",
            value=math.nan if hole is None else 1000.0 * abs(hole.depth - mould.depth),
            unit="mm",
            limit=6.0,
            note=_depths(hole, mould),
        ),
        Row(
            measure=f"{name}: width outside of the mould's",
            value=math.nan if hole is None else 100.0 * outside(hole.width, mould),
            unit="%",
            limit=15.0,
            note=_widths(hole, mould),
        ),
    ]


def outside(width: float, mould: Mould) -> float:
    """Return by which share a width is less than the narrowest or more than the widest extent.

    Examples
    --------
    >>> mould = Mould(depth=0.04, narrowest=0.06, widest=0.10)
    >>> [round(outside(width, mould), 3) for width in (0.054, 0.08, 0.12)]
    [0.1, 0.0, 0.2]
    """
    if math.isnan(width):
        return math.nan
    return max(1.0 - width / mould.narrowest, width / mould.widest - 1.0, 0.0)


def _depths(hole: Hole | None, mould: Mould) -> str:
    truth = f"mould {1000.0 * mould.depth:.1f} mm"
    if hole is None:
        return truth
    bound = "at least " if hole.depth_is_lower_bound else ""
    return f"{bound}{1000.0 * hole.depth:.1f} +- {1000.0 * hole.sigma_depth:.1f} mm, {truth}"


def _widths(hole: Hole | None, mould: Mould) -> str:
    truth = f"mould {1000.0 * mould.narrowest:.0f} to {1000.0 * mould.widest:.0f} mm"
    return truth if hole is None else f"{1000.0 * hole.width:.0f} mm, {truth}"
