"""Middlebury's ``calib.txt`` (2014 and later): one ``name=value`` a line, lengths in mm."""

import re

from bearcub.errors import CalibrationError
from bearcub.rig.camera import Camera
from bearcub.rig.values import Calibration, lookup, named_lines, number, numbers, whole


def read_middlebury(text: str, *, unit: float | None) -> Calibration:
    """Read a Middlebury ``calib.txt`` (2014 and later), whose baseline is in millimetres.

    Raises
    ------
    BearcubError
        If a value is missing, is no number, or `doffs` contradicts the principal points.
    """
    found = dict(named_lines(text, "="))
    left, right = (
        numbers(re.split(r"[\s;]+", str(lookup(found, name)).strip("[] ")), name, 9)
        for name in ("cam0", "cam1")
    )
    doffs = number(lookup(found, "doffs"), "doffs")
    if abs(right[2] - left[2] - doffs) > 0.5:
        raise CalibrationError(
            f"doffs = {doffs:g}: expected cx of cam1 minus cx of cam0, {right[2] - left[2]:g} px"
        )
    return Calibration(
        camera=Camera(
            width=whole(lookup(found, "width"), "width"),
            height=whole(lookup(found, "height"), "height"),
            fx=left[0],
            fy=left[4],
            cx=left[2],
            cy=left[5],
            baseline=number(lookup(found, "baseline"), "baseline") * (unit or 0.001),
            doffs=doffs,
        )
    )
