"""Free space without labels: where the car drove on, nothing stood in the way.

For any sequence of pairs with the poses of its left camera. An obstacle is false when its nearest
point, or a tenth of its pixels, lies in the corridor that the vehicle then swept.
"""

from collections.abc import Sequence
from pathlib import Path

from bearcub.devices.images import IMAGE_SUFFIXES, list_folder
from bearcub.errors import InputError
from bearcub.evaluation.bootstrap import Bootstrap, Estimate
from bearcub.evaluation.kitti import HALF_WIDTH, REACH, shortened, swept
from bearcub.evaluation.poses import read_poses
from bearcub.evaluation.runner import Runner, pair
from bearcub.evaluation.table import Row, Section
from bearcub.rig import Rig

SIDES = (("left", "right"), ("image_l", "image_r"), ("image_2", "image_3"), ("image_0", "image_1"))
"""What the folders of the two cameras may be called."""

_ABOUT = (
    "{frames} frames with the poses of the left camera. The vehicle drove on, so an obstacle is "
    "false when its nearest point, or a tenth of its pixels, lies within {half:g} m of the path "
    "that it then took, at most {reach:g} m along it. The way is cut short when the free range "
    "towards a place of that path ends at an obstacle, a hole or a slope before it."
)


def evaluate_drive(
    folder: Path,
    rig: Rig,
    poses_file: Path,
    runner: Runner,
    *,
    half_width: float = HALF_WIDTH,
    reach: float = REACH,
) -> Section:
    """Compare answers with the way that the vehicle took.

    Parameters
    ----------
    folder : Path
        Holds the two cameras' folders, named as in `SIDES`.
    rig : Rig
    poses_file : Path
        KITTI's ``poses.txt``: ``first_from_camera`` of every frame, twelve numbers a line.
    runner : Runner
    half_width : float
        Of the vehicle, with what it keeps from things [m].
    reach : float
        How far along the path things are looked for [m].

    Raises
    ------
    InputError
        If there are not as many pairs as poses, or something cannot be read.
    """
    left, right = _pictures(folder)
    poses = read_poses(poses_file)
    if not len(left) == len(right) == len(poses):
        raise InputError(
            f"{folder}: {len(left)} left and {len(right)} right pictures, and {len(poses)} poses "
            f"in {poses_file}: expected one of each for every frame"
        )
    shots = {a.stem: pair(a, b) for a, b in zip(left, right, strict=True)}
    blocked: list[list[str]] = []
    ended: list[list[str]] = []
    for frame, (_, answer) in enumerate(runner.answers(rig, shots, name="drive")):
        seen = rig.for_image(
            width=answer.layers.labels.shape[1], height=answer.layers.labels.shape[0]
        )
        blocked.append(swept(answer, seen, poses, frame, half_width=half_width, reach=reach))
        ended.append(shortened(answer, seen, poses, frame, reach=reach))
    names = list(shots)
    return Section(
        name="drive",
        title=f"{folder.name}: the car drove on",
        about=_ABOUT.format(frames=len(names), half=half_width, reach=reach),
        rows=(
            _row("false obstacles in the way, in 1,000 frames", names, blocked),
            _row("frames with the way cut short, of 1,000", names, ended),
        ),
    )


def _pictures(folder: Path) -> tuple[list[Path], list[Path]]:
    for sides in SIDES:
        if all((folder / side).is_dir() for side in sides):
            left, right = (list_folder(folder / side, IMAGE_SUFFIXES) for side in sides)
            return left, right
    known = ", ".join(f"{left} and {right}" for left, right in SIDES)
    raise InputError(f"{folder}: expected two folders of pictures in it: {known}")


def _row(measure: str, names: Sequence[str], found: Sequence[Sequence[str]]) -> Row:
    counts = [len(each) for each in found]
    estimate: Estimate = Bootstrap(len(names)).per_frame(counts, [1] * len(names)).times(1000.0)
    return Row(
        measure=measure,
        value=estimate.value,
        low=estimate.low,
        high=estimate.high,
        count=estimate.count,
        note="; ".join(
            f"{name}: {what}" for name, each in zip(names, found, strict=True) for what in each
        ),
    )
