"""What stands beside a figure: what physics allows, and what is behind the number."""

import math
from collections.abc import Callable

import numpy as np

from bearcub.evaluation.metrics import Metrics, relative
from bearcub.evaluation.selection import large, reading, smooth, usual
from bearcub.evaluation.target import Target
from bearcub.evaluation.verdict import Verdict

DISPARITY = 0.1
"""What a matcher can be off for all pixels of a thing [px]."""


def typical(
    metrics: Metrics, things: Callable[[Target], bool], limit: Callable[[Verdict, Target], float]
) -> float:
    """Return the median of a physical limit over all things that count."""
    limits = [
        limit(verdict, sighting.target)
        for verdict in metrics.verdicts
        if usual(verdict)
        for sighting in verdict.things
        if things(sighting.target)
    ]
    return float(np.median(limits)) if limits else math.nan


def depth_percent(verdict: Verdict, target: Target) -> float:
    """Return the error of a distance that `DISPARITY` makes [%]."""
    camera = verdict.rig.camera
    return 100.0 * DISPARITY * target.distance / (camera.fx * camera.baseline)


def pixel(verdict: Verdict, target: Target) -> float:
    """Return how wide a pixel is at a thing [m]."""
    return target.distance / verdict.rig.camera.fx


def pixel_deg(verdict: Verdict, _: Target) -> float:
    """Return how wide a pixel is in the middle of the image [deg]."""
    return math.degrees(1.0 / verdict.rig.camera.fx)


def absolute(metrics: Metrics, name: str) -> str:
    """Say the median error of one number of the large obstacles in cm and %."""
    error = metrics.error(name, large, frames=usual).estimate.value
    share = metrics.error(name, large, scale=relative, frames=usual).estimate.value
    return f"median {100.0 * error:.1f} cm, {100.0 * share:.1f} %"


def columns(metrics: Metrics, things: Callable[[Target], bool]) -> str:
    """Say how many pixels wide things are: below two, no matcher can be sure."""
    wide = [
        sighting.target.width / pixel(verdict, sighting.target)
        for verdict in metrics.verdicts
        if usual(verdict)
        for sighting in verdict.things
        if things(sighting.target)
    ]
    return f"{min(wide):.1f} to {max(wide):.1f} columns wide" if wide else ""


def pieces(metrics: Metrics) -> str:
    """Say how many answers were false, and how many of them second ones."""
    false = sum(len(v.false) for v in metrics.verdicts if smooth(v))
    pieces = sum(v.pieces for v in metrics.verdicts if smooth(v))
    return f"{false} false, {pieces} of them second answers for one thing"


def gravity(metrics: Metrics) -> str:
    """Say how far the reading itself was off: no slope against gravity can be better."""
    off = [
        v.tilt_error
        for v in metrics.verdicts
        if reading("good", "exact")(v) and not math.isnan(v.tilt_error)
    ]
    if not off:
        return ""
    return f"the tilt reading itself: {math.sqrt(float(np.mean(np.square(off)))):.2f} deg"
