"""Score a folder of the project's own layout: pairs with truth, of a simulator or a robot."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from bearcub.devices.images import read_image
from bearcub.evaluation.contenders import Contenders, Given
from bearcub.evaluation.runner import Track
from bearcub.evaluation.sim import Result, score
from bearcub.evaluation.verdict import Record
from bearcub.sim.folder import Stored, read


def evaluate_folder(folder: Path, track: Track, *, baselines: tuple[str, ...] = ()) -> Result:
    """Answer and score every frame of a folder, or of the folders in it.

    Parameters
    ----------
    folder : Path
        See `bearcub.sim.folder`; what the truth of a frame does not name is not scored.
    track : Track
    baselines : tuple of str
        Compare with these, too.

    Raises
    ------
    InputError
        If something is missing or cannot be read.
    """
    stored = list(read(folder))
    contenders = Contenders(baselines=baselines)
    frames = track(stored, total=len(stored), name=folder.name)
    return score(tuple(_records(frames, contenders)), baselines=baselines, where=folder.name)


def _records(frames: Iterable[Stored], contenders: Contenders) -> Iterator[Record]:
    for frame in frames:
        yield contenders.record(_given(frame))


def _given(frame: Stored) -> Given:
    scenario = frame.left.parent.parent.name
    return Given(
        name=f"{scenario}/{frame.name}",
        scenario=scenario,
        rig=frame.rig,
        tilt=frame.tilt,
        left=read_image(frame.left),
        right=read_image(frame.right),
        truth=frame.truth,
        tags=frame.truth.get("tags", {}),
    )
