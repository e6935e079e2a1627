"""What a value of each sort looks like in words, and whether it can be right."""

import math
from collections.abc import Callable, Sequence

from bearcub.devices.cameras import CameraSource
from bearcub.devices.protocols import Frame
from bearcub.messages import Fix, FixQuality, Scan, Tilt, WheelState
from bearcub.runtime.verdict import Grade, Remark

_DARK, _BRIGHT = 15, 240  # mean grey levels
_FEW_SATELLITES, _POOR_HDOP = 5, 3.0
_LEAST_BEAMS = 0.05  # share of beams with an echo
_LARGEST_SKEW = 0.01  # s
_STEEP = 30.0  # deg; no robot stands so


def describe(value: object) -> list[Remark]:
    """Return what a sensor's or drive's value says."""
    for of, remarks in _DESCRIBERS:
        if isinstance(value, of):
            return remarks(value)
    return [Remark(str(value))]


def _tilt_remarks(tilt: Tilt) -> list[Remark]:
    pitch, roll = math.degrees(tilt.pitch), math.degrees(tilt.roll)
    nose, side = ("down" if pitch > 0 else "up"), ("right" if roll > 0 else "left")
    text = f"pitch {pitch:+.1f}° (nose {nose}), roll {roll:+.1f}° ({side} side down)"
    if max(abs(pitch), abs(roll)) > _STEEP:
        return [Remark(text, grade=Grade.WARNING, advice="look how it is mounted")]
    return [Remark(text)]


def _scan_remarks(scan: Scan) -> list[Remark]:
    finite = [float(r) for r in scan.ranges if math.isfinite(r)]
    close = sum(1 for r in scan.ranges if r == -math.inf)
    fov = math.degrees(float(scan.angles[-1] - scan.angles[0])) if len(scan) else 0.0
    nearest = f"nearest {min(finite):.2f} m" if finite else "no echo"
    text = f"{len(scan)} beams over {fov:.0f}°, {nearest}, {close} too close to measure"
    remarks = [Remark(text)]
    if len(finite) < _LEAST_BEAMS * len(scan):
        remarks = [Remark(text, grade=Grade.WARNING, advice="clean its window; is it covered?")]
    remarks += [
        Remark(warning, grade=Grade.WARNING, advice="see the scanner's manual")
        for warning in scan.warnings
    ]
    return remarks


def _fix_remarks(fix: Fix) -> list[Remark]:
    if fix.quality is FixQuality.NONE:
        return [
            Remark(
                f"no fix, {fix.satellites or 0} satellites",
                grade=Grade.WARNING,
                advice="take the antenna where it sees the sky and wait a minute",
            )
        ]
    quality = fix.quality.name.replace("_", " ")
    text = (
        f"{fix.latitude_deg:.6f}°, {fix.longitude_deg:.6f}°, {quality}, "
        f"{fix.satellites} satellites, HDOP {fix.hdop:.1f}"
    )
    if fix.hdop > _POOR_HDOP or (fix.satellites or _FEW_SATELLITES) < _FEW_SATELLITES:
        return [Remark(text, grade=Grade.WARNING, advice="take the antenna to open sky")]
    return [Remark(text)]


def _wheel_remarks(wheels: WheelState) -> list[Remark]:
    power = "motors on" if wheels.enabled else "motors off"
    text = f"{power}, {wheels.speed:+.2f} m/s, {math.degrees(wheels.turn_rate):+.1f}°/s"
    remarks = [Remark(text)]
    remarks += [
        Remark(fault, grade=Grade.FAULT, advice="clear it, then enable the motors again")
        for fault in wheels.faults
    ]
    return remarks


def _picture(frame: Frame) -> list[Remark]:
    if frame.left is None:
        return []
    height, width = frame.left.shape[:2]
    level = float(frame.left.mean())
    pair = "pair of " if frame.right is not None else ""
    text = f"{pair}{width} x {height} pixels, mean grey level {level:.0f}"
    if level < _DARK:
        return [Remark(text, grade=Grade.WARNING, advice="take the cap off or raise exposure_ms")]
    if level > _BRIGHT:
        return [Remark(text, grade=Grade.WARNING, advice="lower exposure_ms or set 0")]
    return [Remark(text)]


def describe_skew(camera: CameraSource) -> list[Remark]:
    """Return how far apart in time the two pictures of a pair are."""
    skew = camera.skew
    if math.isnan(skew.median):
        return [Remark("the camera does not tell when each picture was taken")]
    text = (
        f"right picture {skew.median * 1e3:.1f} ms from the left, {skew.largest * 1e3:.1f} at most"
    )
    if skew.largest > _LARGEST_SKEW:
        return [Remark(text, grade=Grade.WARNING, advice="connect the cameras' triggers")]
    return [Remark(text)]


_DESCRIBERS: Sequence[tuple[type, Callable[..., list[Remark]]]] = (
    (Tilt, _tilt_remarks),
    (Scan, _scan_remarks),
    (Fix, _fix_remarks),
    (WheelState, _wheel_remarks),
    (Frame, _picture),
)
