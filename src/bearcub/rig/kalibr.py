"""Kalibr's ``camchain.yaml``: raw lenses and the transforms from each camera to the next."""

import reprlib

import numpy as np

from bearcub.errors import CalibrationError
from bearcub.messages import Float64
from bearcub.rig.camera import Lens
from bearcub.rig.projections import camera_from_projections, needed_lenses, rectify_lenses
from bearcub.rig.ros import require_one_size
from bearcub.rig.values import Calibration, Document, distortion, lookup, numbers, rotation, whole


def read_kalibr(
    document: Document, *, unit: float | None, cameras: tuple[int, int] | None
) -> Calibration:
    """Read two cameras of a chain and find their common rectified view.

    Parameters
    ----------
    document : mapping
        ``cam0``, ``cam1``, ...; ``T_cn_cnm1`` of ``cam1`` maps points of cam0 to cam1.
    unit : float or None
        Metres per unit of length; None means 1.
    cameras : tuple of int or None
        Numbers of the left and the right camera; None means 0 and 1.

    Raises
    ------
    BearcubError
        If a value is missing or wrong, the camera model is not a pinhole, or the two cannot be
        rectified together.
    """
    left, right = cameras or (0, 1)
    sizes = [_size(document, k) for k in (left, right)]
    require_one_size(sizes[0], sizes[1])
    lenses = _lens(document, left), _lens(document, right)
    right_from_left = _from_first(document, right) @ np.linalg.inv(_from_first(document, left))
    projections, turned = rectify_lenses(
        lenses, right_from_left[:3, :3], right_from_left[:3, 3], sizes[0]
    )
    camera = camera_from_projections(projections, size=sizes[0], unit=unit)
    return Calibration(camera=camera, lenses=needed_lenses(camera, turned))


def _camera(document: Document, which: int) -> Document:
    camera = lookup(document, f"cam{which}")
    if not isinstance(camera, dict):
        raise CalibrationError(f"cam{which}: expected the values of a camera")
    return camera


def _size(document: Document, which: int) -> tuple[int, int]:
    name = f"cam{which}.resolution"
    width, height = numbers(lookup(_camera(document, which), "resolution"), name, 2)
    return whole(width, name), whole(height, name)


def _lens(document: Document, which: int) -> Lens:
    camera = _camera(document, which)
    kind = lookup(camera, "camera_model")
    if kind != "pinhole":
        raise CalibrationError(
            f"cam{which}.camera_model = {reprlib.repr(kind)}: expected pinhole; calibrate with "
            f"pinhole-radtan or pinhole-equi"
        )
    fx, fy, cx, cy = numbers(lookup(camera, "intrinsics"), f"cam{which}.intrinsics", 4)
    model, coefficients = distortion(
        camera.get("distortion_coeffs", []),
        lookup(camera, "distortion_model"),
        f"cam{which}.distortion_coeffs",
    )
    return Lens(fx=fx, fy=fy, cx=cx, cy=cy, model=model, distortion=coefficients)


def _from_first(document: Document, which: int) -> Float64:
    """Return the 4 x 4 transform from cam0 to this camera."""
    chain = np.eye(4)
    for k in range(1, which + 1):
        name = f"cam{k}.T_cn_cnm1"
        entries = numbers(lookup(_camera(document, k), "T_cn_cnm1"), name, 16)
        step = np.array(entries).reshape(4, 4)
        rotation(step[:3, :3].tolist(), name)
        chain = step @ chain
    return chain
