"""What cannot be right in a camera or a mount: units, signs, sizes."""

import math
from dataclasses import asdict

from bearcub.errors import ConfigError
from bearcub.rig.camera import Camera
from bearcub.rig.mount import MOUNT_KEYS, Mount

LARGEST_SIDE = 32767
"""Largest image side [px]: OpenCV's remapping counts pixels in 16 bits."""


def check_camera(camera: Camera) -> None:
    """Raise `ConfigError` naming the value when a number of the camera cannot be right."""
    for name, value in asdict(camera).items():
        _check_finite(f"camera.{name}", value)
    _check_size(camera)
    _check_baseline(camera.baseline)
    for name, focal, side in (("fx", camera.fx, camera.width), ("fy", camera.fy, camera.height)):
        _check_focal(name, focal, side)
    if not 0.5 < camera.fx / camera.fy < 2.0:
        raise ConfigError(
            f"camera.fx = {camera.fx:g}, camera.fy = {camera.fy:g}: expected two focal lengths "
            f"in px that differ by less than a factor of 2"
        )
    if camera.size_known:
        _check_centre("cx", camera.cx, camera.width)
        _check_centre("cy", camera.cy, camera.height)
        if abs(camera.doffs) >= camera.width:
            raise ConfigError(
                f"camera.doffs = {camera.doffs:g}: expected less than the image's width, "
                f"{camera.width} px"
            )


def check_mount(mount: Mount) -> None:
    """Raise `ConfigError` naming the value when a number of the mount cannot be right."""
    for key, name in MOUNT_KEYS.items():
        value = getattr(mount, name)
        if "sigma" not in key:
            _check_finite(f"mount.{key}", value)
        elif not (math.isnan(value) or 0.0 < value < math.inf):
            raise ConfigError(f"mount.{key}: expected a positive 1-sigma, found {value:g} (SI)")
    if not 0.0 < mount.height <= 20.0:
        hint = "; it looks like millimetres: divide by 1000" if mount.height >= 100.0 else ""
        raise ConfigError(
            f"mount.height = {mount.height:g} m: expected the camera's height above the ground, "
            f"more than 0 and at most 20 m{hint}"
        )
    for name, radians in (("pitch_deg", mount.pitch), ("roll_deg", mount.roll)):
        angle = math.degrees(radians)
        if abs(angle) >= 90.0:
            raise ConfigError(f"mount.{name} = {angle:g}: expected degrees between -90 and 90")
    for name, position in (("x", mount.x), ("y", mount.y)):
        if abs(position) > 50.0:
            raise ConfigError(
                f"mount.{name} = {position:g} m: expected at most 50 m from base_link; "
                f"it looks like millimetres: divide by 1000"
            )


def _check_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ConfigError(f"{name} = {value}: expected a finite number")


def _check_size(camera: Camera) -> None:
    sides = camera.width, camera.height
    if sides != (0, 0) and not all(16 <= side <= LARGEST_SIDE for side in sides):
        raise ConfigError(
            f"camera.width = {sides[0]}, camera.height = {sides[1]}: expected 16 to "
            f"{LARGEST_SIDE} px each, or 0 for both while it is not known"
        )


def _check_baseline(baseline: float) -> None:
    if baseline == 0.0:
        raise ConfigError("camera.baseline = 0 m: expected a stereo pair, this is one camera twice")
    if baseline < 0.0:
        raise ConfigError(
            f"camera.baseline = {baseline:g} m is negative, so the cameras are swapped: "
            f"exchange left and right"
        )
    if baseline > 5.0:
        raise ConfigError(
            f"camera.baseline = {baseline:g} m: expected at most 5 m; it looks like millimetres: "
            f"divide by 1000, or read the calibration with --unit 0.001"
        )
    if baseline < 0.001:
        raise ConfigError(
            f"camera.baseline = {baseline:g} m: expected at least 1 mm; "
            f"is it in metres, and is the focal length in px?"
        )


def _check_focal(name: str, focal: float, side: int) -> None:
    if focal <= 0.0:
        raise ConfigError(f"camera.{name} = {focal:g}: expected a positive focal length in px")
    # 0.1 is a view of 157 deg, 50 of 1.1 deg; without a size only a wrong unit can be told.
    low, high = (0.1 * side, 50.0 * side) if side else (10.0, 1e6)
    if not low <= focal <= high:
        raise ConfigError(
            f"camera.{name} = {focal:g}: expected a focal length of {low:g} to {high:g} px"
            + (f" for an image side of {side} px" if side else "")
        )


def _check_centre(name: str, centre: float, side: int) -> None:
    if not -0.5 <= centre <= side - 0.5:
        raise ConfigError(
            f"camera.{name} = {centre:g}: the principal point lies outside the image, "
            f"whose side is {side} px; do the size and the calibration belong together?"
        )
