"""KITTI's ``calib.txt``: one ``name: numbers`` a line."""

import re

from bearcub.errors import FormatError
from bearcub.rig.projections import camera_from_projections
from bearcub.rig.values import Calibration, lookup, named_lines, numbers, whole


def read_kitti(text: str, *, unit: float | None, cameras: tuple[int, int] | None) -> Calibration:
    """Read the projection matrices of a KITTI ``calib.txt`` or ``calib_cam_to_cam.txt``.

    Lines without a name are P0, P1, ... in their order, as some copies have them. Other keys
    (``R0_rect``, ``Tr_velo_to_cam``, ...) are left alone: the images are rectified. Only
    ``calib_cam_to_cam.txt`` has the image size.

    Parameters
    ----------
    text : str
    unit : float or None
        Metres per unit of length; None means 1.
    cameras : tuple of int or None
        Numbers of the left and right camera. None means 2 and 3 (colour) where present, else 0
        and 1 (grey).

    Raises
    ------
    BearcubError
        If a matrix is missing, is none, or the two are no rectified pair.
    """
    lines = named_lines(text, ":")
    bare = [values for name, values in lines if not name]
    if len(bare) > 4:
        raise FormatError(
            f"{len(bare)} lines of numbers without a name: expected at most four, P0 to P3; "
            f"is this a file of poses?"
        )
    found = {f"P{k}": values for k, values in enumerate(bare)}
    found |= {re.sub(r"^P_rect_0", "P", name): values for name, values in lines if name}
    left, right = cameras or ((2, 3) if {"P2", "P3"} <= found.keys() else (0, 1))
    matrices = tuple(
        numbers(str(lookup(found, f"P{k}")).split(), f"P{k}", 12) for k in (left, right)
    )
    size = (0, 0)
    if f"S_rect_0{left}" in found:
        width, height = numbers(found[f"S_rect_0{left}"].split(), f"S_rect_0{left}", 2)
        size = whole(width, "width"), whole(height, "height")
    return Calibration(
        camera=camera_from_projections((matrices[0], matrices[1]), size=size, unit=unit)
    )
