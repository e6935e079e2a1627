"""Other methods, each in its usual form with fair settings, on the disparity that ours gets."""

from collections.abc import Callable

from bearcub.evaluation.baselines import classic, ransac, vdisparity, zband
from bearcub.evaluation.baselines.frame import Frame
from bearcub.evaluation.report import Report

BASELINES: dict[str, Callable[[Frame], Report]] = {
    "classic": classic.answer,
    "vdisparity": vdisparity.answer,
    "ransac": ransac.answer,
    "zband": zband.answer,
}
"""The baselines by the names of the command line."""

__all__ = ["BASELINES", "Frame"]
