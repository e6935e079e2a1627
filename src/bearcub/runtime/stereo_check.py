"""Whether a stereo camera still fits its calibration, seen in one pair."""

import math
from pathlib import Path

from bearcub.config import Config
from bearcub.devices.protocols import Frame
from bearcub.errors import BearcubError
from bearcub.messages import Snapshot
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig
from bearcub.runtime.verdict import Grade, Remark

_LARGEST_OFFSET = 0.5  # rows; beyond, matches are lost
_LEAST_MATCHED = 0.2  # share of pixels


def check_pair(frame: Frame, rig: Path, *, config: Config) -> list[Remark]:
    """Rectify and match a pair; tell how far its rows are apart and how much can be matched.

    Parameters
    ----------
    frame : Frame
        With both pictures.
    rig : Path
        The calibration.
    config : Config
        Of the matching.

    Returns
    -------
    list of Remark
    """
    try:
        answer = Pipeline(Rig.load(rig), config).process(
            Snapshot(left=frame.left, right=frame.right)
        )
    except BearcubError as error:
        return [Remark(str(error), grade=Grade.FAULT, advice="check rig, left and right")]
    return [_rows(answer.epipolar_offset), _matched(answer.valid_share)]


def _rows(offset: float) -> Remark:
    if math.isnan(offset):
        return Remark(
            "too few corners in view to tell whether the rows fit",
            grade=Grade.WARNING,
            advice="point the camera at something with texture",
        )
    text = f"right picture {abs(offset):.2f} rows {'lower' if offset > 0 else 'higher'}"
    if abs(offset) > _LARGEST_OFFSET:
        return Remark(text, grade=Grade.FAULT, advice="calibrate the camera again")
    return Remark(text)


def _matched(share: float) -> Remark:
    text = f"{100 * share:.0f} % of the pixels matched"
    if share < _LEAST_MATCHED:
        return Remark(
            text, grade=Grade.WARNING, advice="check focus, exposure and that the rig is this one"
        )
    return Remark(text)
