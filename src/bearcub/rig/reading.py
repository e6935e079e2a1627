"""Which calibration a file holds, told by its content, and the file that belongs to it."""

import math
import re
import reprlib
from dataclasses import dataclass, replace
from pathlib import Path

from bearcub.errors import CalibrationError, ConfigError, FormatError
from bearcub.rig.checks import LARGEST_SIDE
from bearcub.rig.kalibr import read_kalibr
from bearcub.rig.kitti import read_kitti
from bearcub.rig.middlebury import read_middlebury
from bearcub.rig.opencv import OPENCV_KEYS, read_opencv
from bearcub.rig.rig_toml import read_toml
from bearcub.rig.ros import ROS_KEYS, pair_cameras, read_camera_info
from bearcub.rig.values import Calibration, Document, naming, parse_yaml

LARGEST_FILE = 256 * 1024
"""[byte]; the largest real ones have a tenth of it."""

KNOWN = (
    "a rig TOML, KITTI or Middlebury calib.txt, a ROS camera_info pair, OpenCV stereoRectify YAML "
    "or Kalibr camchain.yaml"
)

_USUAL_NAMES = (
    "rig.toml",
    "calib.txt",
    "*camchain*.yaml",
    "left.yaml",
    "left.yml",
    "intrinsics.yml",
    "stereo.yml",
    "calib_cam_to_cam.txt",
)
_PARTNERS = (("left", "right"), ("intrinsics", "extrinsics"), ("extrinsics", "intrinsics"))
_TOML = re.compile(r"^[ \t]*\[[ \t]*(camera|mount|lens)[ \t]*[\].]", re.MULTILINE)
_MIDDLEBURY = re.compile(r"^[ \t]*cam[01][ \t]*=", re.MULTILINE)
_KITTI = re.compile(
    r"^[ \t]*P(_rect_0)?[0-3][ \t]*:[ \t]*[-+.\d]|\A\s*([-+.\deE]+[ \t]+){11}", re.MULTILINE
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hints:
    """What the user says beside the file; see `bearcub.rig.Rig.load`."""

    right: Path | None = None
    size: tuple[int, int] | None = None
    unit: float | None = None
    cameras: tuple[int, int] | None = None

    def refuse(self, what: str, *names: str) -> None:
        """Raise `ConfigError` when one of the named hints was given but has no meaning here."""
        for name in names:
            if getattr(self, name) is not None:
                raise ConfigError(f"{what} takes no --{name}: leave it out")

    def check(self) -> None:
        """Raise `ConfigError` for a hint that cannot be meant."""
        if self.unit is not None and not (math.isfinite(self.unit) and 0.0 < self.unit <= 1000.0):
            raise ConfigError(
                f"unit = {self.unit:g}: expected metres per unit of length, 0.001 for mm"
            )
        if self.size is not None and not all(16 <= side <= LARGEST_SIDE for side in self.size):
            raise ConfigError(
                f"size = {self.size[0]} x {self.size[1]}: expected width and height in px"
            )
        if self.cameras is not None and (
            min(self.cameras) < 0 or max(self.cameras) > 99 or self.cameras[0] == self.cameras[1]
        ):
            raise ConfigError(
                f"cameras = {self.cameras[0]}, {self.cameras[1]}: expected two different numbers, "
                f"left and right"
            )


def read_calibration(path: Path, hints: Hints) -> Calibration:
    """Read any calibration.

    Raises
    ------
    BearcubError
        One sentence that names the file.
    """
    hints.check()
    path = _inside(path)
    text = read_text(path)
    with naming(str(path)):
        if _TOML.search(text) or path.suffix.lower() == ".toml":
            hints.refuse("a rig TOML, which is in metres,", "right", "unit", "cameras")
            return replace(read_toml(text), source=str(path))
        if _MIDDLEBURY.search(text):
            hints.refuse("a Middlebury calibration", "right", "cameras")
            return replace(read_middlebury(text, unit=hints.unit), source=str(path))
        if _KITTI.search(text):
            hints.refuse("a KITTI calibration", "right")
            found = read_kitti(text, unit=hints.unit, cameras=hints.cameras)
            return replace(found, source=str(path))
        document = _parse(text)
        if any(re.fullmatch(r"cam\d+", key) for key in document):
            hints.refuse("a Kalibr camera chain", "right")
            found = read_kalibr(document, unit=hints.unit, cameras=hints.cameras)
            return replace(found, source=str(path))
        hints.refuse("this calibration of one pair", "cameras")
    return _read_pair(path, document, hints)


def read_text(path: Path) -> str:
    """Return the text of a small file.

    Raises
    ------
    ConfigError
        If it cannot be read.
    FormatError
        If it is empty, too large for a calibration, or not text.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{path}: cannot be read: {reason}") from None
    if len(data) > LARGEST_FILE:
        raise FormatError(f"{path}: more than {LARGEST_FILE} bytes: expected {KNOWN}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: byte {error.start} is not text (UTF-8): expected {KNOWN}"
        ) from None
    if not text.strip():
        raise FormatError(f"{path}: is empty: expected {KNOWN}")
    return text.replace("\r\n", "\n")


def _inside(path: Path) -> Path:
    """Return the calibration in a folder, or the path itself."""
    try:
        if not path.is_dir():
            return path
        found = [file for name in _USUAL_NAMES for file in sorted(path.glob(name))]
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    if not found:
        raise ConfigError(
            f"{path}: is a folder without a calibration: expected one of "
            f"{', '.join(_USUAL_NAMES)} in it, or the file's own name"
        )
    return found[0]


def _parse(text: str) -> Document:
    try:
        return parse_yaml(text)
    except FormatError as error:
        raise FormatError(f"expected {KNOWN}; as the YAML of the last three it {error}") from None


def _partner(path: Path, hints: Hints) -> Path | None:
    """Return the second file of a pair: the one given, or of the matching name beside `path`."""
    if hints.right is not None:
        return hints.right
    names = (path.name.replace(word, other) for word, other in _PARTNERS if word in path.name)
    return next((path.with_name(name) for name in names if path.with_name(name).exists()), None)


def _read_pair(path: Path, document: Document, hints: Hints) -> Calibration:
    partner = _partner(path, hints)
    other: Document = {}
    both = str(path)
    if partner is not None:
        with naming(str(partner)):
            other = _parse(read_text(partner))
        both = f"{path} and {partner}"
    if ROS_KEYS & document.keys():
        return _read_ros(path, document, partner, other, hints)
    with naming(both):
        if not (OPENCV_KEYS & document.keys() or {"R", "T"} <= document.keys()):
            raise FormatError(f"expected {KNOWN}, found the keys {reprlib.repr(sorted(document))}")
        found = read_opencv({**document, **other}, size=hints.size, unit=hints.unit)
    return replace(found, source=both)


def _read_ros(
    path: Path, document: Document, partner: Path | None, other: Document, hints: Hints
) -> Calibration:
    with naming(str(path)):
        if partner is None:
            raise CalibrationError(
                "the camera_info of one camera: give the right one's with --right, or a folder "
                "that holds left.yaml and right.yaml"
            )
        left = read_camera_info(document)
    with naming(str(partner)):
        right = read_camera_info(other)
    both = f"{path} and {partner}"
    with naming(both):
        return replace(pair_cameras(left, right, unit=hints.unit), source=both)
