"""OpenCV's stereo calibration: ``stereoRectify``'s matrices as `FileStorage` writes them."""

import numpy as np

from bearcub.errors import CalibrationError
from bearcub.messages import Float64
from bearcub.rig.camera import NO_ROTATION, Camera, Lens
from bearcub.rig.projections import camera_from_projections, needed_lenses, rectify_lenses
from bearcub.rig.values import Calibration, Document, distortion, lookup, numbers, rotation, whole

Size = tuple[int, int]

_ALIASES = {
    "M1": ("K1", "cameraMatrix1", "camera_matrix_1"),
    "M2": ("K2", "cameraMatrix2", "camera_matrix_2"),
    "D1": ("distCoeffs1", "distortion_coefficients_1"),
    "D2": ("distCoeffs2", "distortion_coefficients_2"),
}
OPENCV_KEYS = frozenset(
    {
        "P1",
        "P2",
        "Q",
        "R1",
        "R2",
        *_ALIASES,
        *(name for names in _ALIASES.values() for name in names),
    }
)
"""Keys of which a calibration by OpenCV has at least one."""


def read_opencv(document: Document, *, size: Size | None, unit: float | None) -> Calibration:
    """Read what OpenCV's stereo calibration wrote, of which any sufficient part will do.

    The rectified camera comes from P1 and P2, else from Q, else from M1 D1 M2 D2 R T. With M1 D1
    M2 D2 R1 R2 the pair is rectified first.

    Parameters
    ----------
    document : mapping
        The nodes of one file, or of intrinsics.yml and extrinsics.yml together.
    size : tuple of int or None
        Width and height [px] where the file has none; required only without P1, P2 and Q.
    unit : float or None
        Metres per unit of length, the side of a square where it counts squares; None means 1.

    Raises
    ------
    BearcubError
        If a value is missing or wrong, or the matrices are those of no rectified pair.
    """
    found = {
        **document,
        **{
            name: document[alias]
            for name, aliases in _ALIASES.items()
            for alias in aliases
            if alias in document
        },
    }
    size = _size(found) or size or (0, 0)
    lenses = (_lens(found, 1), _lens(found, 2)) if {"M1", "M2"} & found.keys() else None
    if not {"P1", "P2", "Q"} & found.keys():
        return _rectify(found, lenses, size=size, unit=unit)
    if {"P1", "P2"} & found.keys():
        projections = tuple(numbers(lookup(found, name), name, 12) for name in ("P1", "P2"))
        camera = camera_from_projections((projections[0], projections[1]), size=size, unit=unit)
    else:
        camera = _camera_from_q(numbers(found["Q"], "Q", 16), size=size, unit=unit)
    return Calibration(camera=camera, lenses=lenses and needed_lenses(camera, lenses))


def _size(found: Document) -> Size | None:
    if {"image_width", "image_height"} & found.keys():
        sides = [lookup(found, name) for name in ("image_width", "image_height")]
    elif {"image_size", "imageSize"} & found.keys():
        sides = list(numbers(lookup(found, "image_size", "imageSize"), "image_size", 2))
    else:
        return None
    return whole(sides[0], "image width"), whole(sides[1], "image height")


def _lens(found: Document, which: int) -> Lens:
    matrix = numbers(lookup(found, f"M{which}"), f"M{which}", 9)
    coefficients = lookup(found, f"D{which}")
    many = len(numbers(coefficients, f"D{which}", 0, 4, 5, 8, 12, 14)) > 5
    usual = "rational_polynomial" if many else "plumb_bob"
    fisheye = str(found.get("fisheye_model", "0")) not in {"0", ""}
    model, values = distortion(
        coefficients,
        "equidistant" if fisheye else found.get("distortion_model", usual),
        f"D{which}",
    )
    # Without P and Q the rotation is still to be found, see _rectify.
    turned = bool({"P1", "P2", "Q"} & found.keys())
    return Lens(
        fx=matrix[0],
        fy=matrix[4],
        cx=matrix[2],
        cy=matrix[5],
        model=model,
        distortion=values,
        rotation=rotation(lookup(found, f"R{which}"), f"R{which}") if turned else NO_ROTATION,
    )


def _rectify(
    found: Document, lenses: tuple[Lens, Lens] | None, *, size: Size, unit: float | None
) -> Calibration:
    if lenses is None or not {"R", "T"} <= found.keys():
        raise CalibrationError(
            "P1 and P2 are missing: expected P1 and P2, or Q, or M1 D1 M2 D2 R T, in this file "
            "or in intrinsics.yml and extrinsics.yml side by side"
        )
    if size == (0, 0):
        raise CalibrationError(
            "P1 and P2 are missing and cannot be computed without the size of the images: "
            "give it with --size"
        )
    turn: Float64 = np.reshape(rotation(found["R"], "R"), (3, 3))
    projections, turned = rectify_lenses(lenses, turn, np.array(numbers(found["T"], "T", 3)), size)
    camera = camera_from_projections(projections, size=size, unit=unit)
    return Calibration(camera=camera, lenses=needed_lenses(camera, turned))


def _camera_from_q(q: tuple[float, ...], *, size: Size, unit: float | None) -> Camera:
    """Undo ``Q = [1 0 0 -cx; 0 1 0 -cy; 0 0 0 f; 0 0 1/B (cx' - cx)/B]``."""
    if q[14] == 0.0:
        raise CalibrationError("Q[3, 2] = 0: expected 1 / baseline")
    return Camera(
        width=size[0],
        height=size[1],
        fx=q[11],
        fy=q[11],
        cx=-q[3],
        cy=-q[7],
        baseline=(unit or 1.0) / q[14],
        doffs=q[15] / q[14],
    )
