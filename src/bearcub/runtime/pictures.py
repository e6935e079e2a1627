"""Annotated pictures of the frames, on their way to a file."""

from collections.abc import Iterable
from pathlib import Path

from bearcub.devices import FrameSink
from bearcub.errors import InputError
from bearcub.messages import Answer, UInt8
from bearcub.rig import Rig
from bearcub.runtime.feed import Shot
from bearcub.stereo.rectification import Rectifier
from bearcub.viewer import annotate


class RectifiedLeft:
    """Gives the left picture of a shot the way the pipeline sees it."""

    def __init__(self) -> None:
        self._rectifier: Rectifier | None = None

    def __call__(self, shot: Shot) -> UInt8 | None:
        """Return the picture, rectified when the shot is a raw pair; None without one."""
        left, right = shot.snapshot.left, shot.snapshot.right
        rectification = shot.rig.rectification
        if left is None or right is None or rectification is None:
            return left
        self._rectifier = self._rectifier or Rectifier(rectification)
        return self._rectifier.left(left)


class Pictures:
    """Draws every answer over its picture and hands it to a sink.

    Parameters
    ----------
    sink : FrameSink
        Open.
    fixed_reach : bool
        One scale of the plan view for all frames, instead of one that fits each.
    """

    def __init__(self, sink: FrameSink, *, fixed_reach: bool) -> None:
        self._sink = sink
        self._fixed_reach = fixed_reach
        self._left = RectifiedLeft()

    def write(self, shot: Shot, answer: Answer) -> None:
        """Draw one frame and store it."""
        reach = steady_reach(shot.rig) if self._fixed_reach else None
        picture = annotate(answer, self._left(shot), shot.rig, reach=reach)
        self._sink.write(picture, name=shot.name)


def steady_reach(rig: Rig) -> float:
    """Return how far ahead the plan view of a sequence shows [m], from 6 to 25.

    Half a pixel of disparity is 12.5 % of the distance there.
    """
    return min(max(rig.camera.fx * rig.camera.baseline / 4.0, 6.0), 25.0)


def require_separate(output: Path, inputs: Iterable[Path]) -> None:
    """Raise `InputError` when writing to `output` would change one of the inputs."""
    for given in inputs:
        same = output.exists() and given.exists() and output.samefile(given)
        inside = given.is_dir() and output.parent.exists() and output.parent.samefile(given)
        if same or inside:
            raise InputError(
                f"{output}: would {'replace' if same else 'become part of'} the input {given}; "
                "expected another place"
            )
