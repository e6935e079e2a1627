"""ROS ``camera_info``: one YAML a camera, as a file or as ``ros2 topic echo`` prints it."""

from dataclasses import dataclass

from bearcub.errors import CalibrationError
from bearcub.rig.camera import Lens
from bearcub.rig.projections import camera_from_projections, needed_lenses
from bearcub.rig.values import Calibration, Document, distortion, lookup, numbers, rotation, whole

ROS_KEYS = frozenset({"projection_matrix", "camera_matrix", "P", "p"})
"""Keys of which a ``camera_info`` has at least one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraInfo:
    """One camera: its image size [px], projection matrix P row by row, and lens."""

    size: tuple[int, int]
    projection: tuple[float, ...]
    lens: Lens


def read_camera_info(document: Document) -> CameraInfo:
    """Read one camera.

    Raises
    ------
    BearcubError
        If a value is missing or wrong.
    """
    matrix = numbers(lookup(document, "camera_matrix", "K", "k"), "camera_matrix", 9)
    model, coefficients = distortion(
        lookup(document, "distortion_coefficients", "D", "d"),
        document.get("distortion_model") or "plumb_bob",
        "distortion_coefficients",
    )
    turn = lookup(document, "rectification_matrix", "R", "r")
    return CameraInfo(
        size=(
            whole(lookup(document, "image_width", "width"), "image_width"),
            whole(lookup(document, "image_height", "height"), "image_height"),
        ),
        projection=numbers(
            lookup(document, "projection_matrix", "P", "p"), "projection_matrix", 12
        ),
        lens=Lens(
            fx=matrix[0],
            fy=matrix[4],
            cx=matrix[2],
            cy=matrix[5],
            model=model,
            distortion=coefficients,
            rotation=rotation(turn, "rectification_matrix"),
        ),
    )


def pair_cameras(left: CameraInfo, right: CameraInfo, *, unit: float | None) -> Calibration:
    """Return the calibration of two cameras; the right P[0, 3] is ``-fx B``.

    Parameters
    ----------
    left, right : CameraInfo
    unit : float or None
        Metres per unit of length; None means 1.

    Raises
    ------
    CalibrationError
        If the two are no rectified pair of one size.
    """
    require_one_size(left.size, right.size)
    if left.projection[3] == right.projection[3]:
        raise CalibrationError(
            f"P[0, 3] = {right.projection[3]:g} in both cameras: expected -fx B in the right "
            f"one; these are calibrations of single cameras, not of a pair"
        )
    camera = camera_from_projections((left.projection, right.projection), size=left.size, unit=unit)
    return Calibration(camera=camera, lenses=needed_lenses(camera, (left.lens, right.lens)))


def require_one_size(left: tuple[int, int], right: tuple[int, int]) -> None:
    """Raise `CalibrationError` when two cameras have images of different sizes."""
    if left != right:
        raise CalibrationError(
            f"the left image is {left[0]} x {left[1]} px, the right one {right[0]} x {right[1]} "
            f"px: expected one size"
        )
