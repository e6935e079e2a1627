"""The real recordings: which sets there are, and what each must show."""

from collections.abc import Callable, Iterable
from pathlib import Path

from bearcub.errors import InputError
from bearcub.evaluation import inria, kitti, pothole, sslg
from bearcub.evaluation.runner import Runner
from bearcub.evaluation.table import Section

SETS: dict[str, Callable[[Path, Runner], Section]] = {
    "inria_road": inria.evaluate,
    "kitti_odometry": kitti.evaluate,
    "pothole": pothole.evaluate,
    "sslg": sslg.evaluate,
}
"""The folders of the sets and what evaluates each."""


def evaluate_real(
    folder: Path, runner: Runner | None = None, *, only: Iterable[str] = ()
) -> list[Section]:
    """Evaluate every set that is there.

    Parameters
    ----------
    folder : Path
        Holds one folder for each set, named as in `SETS`.
    runner : Runner, optional
    only : iterable of str
        Names of the sets to evaluate; all when empty.

    Returns
    -------
    list of Section
        In the order of `SETS`. A set without a folder is marked as skipped.

    Raises
    ------
    InputError
        If no set is there, or one that is there cannot be read.
    """
    names = [name for name in SETS if not only or name in set(only)]
    if not any((folder / name).is_dir() for name in names):
        raise InputError(f"{folder}: holds none of the folders {', '.join(names)}")
    return [_evaluate(name, folder / name, runner or Runner()) for name in names]


def _evaluate(name: str, folder: Path, runner: Runner) -> Section:
    if not folder.is_dir():
        return Section(name=name, title=name, about="", skipped=f"there is no folder {folder}")
    return SETS[name](folder, runner)
