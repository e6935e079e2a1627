"""The project's own folder of frames: pairs with their rig, readings and truth, as plain files.

``docs/folder.md`` describes the layout for those who fill one with a robot of their own.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.devices.images import IMAGE_SUFFIXES, list_folder
from bearcub.devices.tilt_csv import HEADER, format_tilt, read_tilts
from bearcub.errors import BearcubError, FormatError, InputError
from bearcub.messages import Int32, Scan, Tilt
from bearcub.rig import Rig
from bearcub.sim.case import FRAME_TIME
from bearcub.sim.render import SKY, Rendered

_PARTS = ("left", "right", "disparity", "labels", "truth")
_MARK = "Written by `bearcub simulate`"
_ABOUT = """# {title}

{mark}; frame k is `NNNNNN` = k, counted from 0.

| file | what it is |
|---|---|
| `left/NNNNNN.png`, `right/NNNNNN.png` | the rectified pair, 8 bit, colour |
| `rig.toml` | the camera and where it sits |
| `tilt.csv` | what the tilt sensor reads: pitch and roll [deg], a line a frame, `,` is no reading |
| `disparity/NNNNNN.pfm` | exact disparity [px] of the left pixels' centres, 0 in the sky |
| `labels/NNNNNN.png` | what these pixels show, 16 bit: see below |
| `scan.clf` | LADAR: a CARMEN log, stamps of 15 frames a second |
| `truth/NNNNNN.json` | a perfect answer, `bearcub.truth/1`; its `tags` say what was drawn |

Labels: 0 ground, 1, 2, ... the obstacle of that `id`, 65535, 65534, ... (-1, -2, ... as int16) the
hole of that `id`, 32768 the sky.

    bearcub detect {name}/left {name}/right --rig {name}/rig.toml --tilt-file {name}/tilt.csv
"""

_SKY_CODE = -32768  # what `SKY` is in 16 bit


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """One frame to be written.

    Attributes
    ----------
    rendered : Rendered
    tilt : Tilt or None
        What the sensor read.
    scan : Scan or None
    tags : mapping
        Kept in the truth under "tags".
    """

    rendered: Rendered
    tilt: Tilt | None = None
    scan: Scan | None = None
    tags: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """One frame of a folder; pictures and maps are named, not read.

    Attributes
    ----------
    name : str
        Of its files, without their ending.
    left, right : Path
    rig : Rig
    tilt : Tilt or None
        None without a reading, or without a ``tilt.csv``.
    truth : dict
        A ``bearcub.truth/1`` object.
    disparity, labels : Path or None
        Where there are such files.
    """

    name: str
    left: Path
    right: Path
    rig: Rig
    tilt: Tilt | None
    truth: dict[str, Any]
    disparity: Path | None
    labels: Path | None


def write(folder: Path, frames: Iterable[Taken], *, rig: Rig, title: str = "Frames") -> int:
    """Write frames as they come and return how many there were.

    Parameters
    ----------
    folder : Path
        Made where missing. Frames that this function wrote before are removed.
    frames : iterable of Taken
        All taken by `rig`.
    rig : Rig
    title : str
        First line of its ``README.md``.

    Raises
    ------
    InputError
        If a file cannot be written, or the folder holds frames of another origin.
    """
    try:
        _make_room(folder)
        (folder / "rig.toml").write_text(rig.to_toml(), encoding="utf-8")
        about = _ABOUT.format(mark=_MARK, title=title, name=folder.name)
        (folder / "README.md").write_text(about, encoding="utf-8")
        return _write_frames(folder, frames, rig)
    except BearcubError:  # one of ours may be an OSError, too, and says what it is
        raise
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from error


def _make_room(folder: Path) -> None:
    """Make the folders; remove older frames, but nothing that somebody else put there."""
    old = [path for part in _PARTS for path in (folder / part).glob("*")]
    about = folder / "README.md"
    if old and not (about.exists() and _MARK in about.read_text(encoding="utf-8")):
        raise InputError(
            f"{folder}: holds frames that `bearcub simulate` did not write, such as {old[0]}: "
            "expected another folder, or an empty one"
        )
    for path in old:
        path.unlink()
    for part in _PARTS:
        (folder / part).mkdir(parents=True, exist_ok=True)


def _write_frames(folder: Path, frames: Iterable[Taken], rig: Rig) -> int:
    count = 0
    with (
        (folder / "tilt.csv").open("w", encoding="utf-8") as tilts,
        (folder / "scan.clf").open("w", encoding="utf-8") as scans,
    ):
        tilts.write(f"{HEADER}\n")
        for count, taken in enumerate(frames, 1):
            _write_frame(folder, f"{count - 1:06d}", taken, rig)
            tilts.write(f"{format_tilt(taken.tilt)}\n")
            if taken.scan is not None:
                scans.write(_carmen(taken.scan, (count - 1) * FRAME_TIME))
            for file in (tilts, scans):  # what is interrupted is complete as far as it goes
                file.flush()
    return count


def _carmen(scan: Scan, seconds: float) -> str:
    """Return a scan as a message of a CARMEN log; what is too close is 0, what is lost -1.

    ``RAWLASER1 type start field_of_view step farthest accuracy remission_mode count ranges...
    n_remissions stamp host logger_stamp``, angles in radians.
    """
    nothing = scan.farthest + 0.01  # readers take the farthest range itself for nothing, too
    ranges = np.nan_to_num(scan.ranges, nan=-1.0, posinf=nothing, neginf=0.0)
    start, end = scan.angles[[0, -1]]
    step = (end - start) / (len(scan) - 1)
    head = f"RAWLASER1 0 {start:.9f} {end - start:.9f} {step:.9f} {nothing:g} 0.01 0"
    values = " ".join(f"{reach:.3f}" for reach in ranges)
    return f"{head} {len(scan)} {values} 0 {seconds:.6f} simulator {seconds:.6f}\n"


def _write_frame(folder: Path, name: str, taken: Taken, rig: Rig) -> None:
    rendered = taken.rendered
    _write_image(folder / "left" / f"{name}.png", rendered.left)
    _write_image(folder / "right" / f"{name}.png", rendered.right)
    measured = rendered.disparity - np.float32(rig.camera.doffs)
    _write_image(folder / "disparity" / f"{name}.pfm", measured)
    _write_image(folder / "labels" / f"{name}.png", _coded(rendered.labels))
    truth = {**rendered.truth, "tags": dict(taken.tags)}
    text = json.dumps(truth, indent=1, allow_nan=False) + "\n"
    (folder / "truth" / f"{name}.json").write_text(text, encoding="utf-8")


def _write_image(path: Path, image: NDArray[Any]) -> None:
    if not cv2.imwrite(str(path), image):
        raise InputError(f"{path}: cannot be written")


def _coded(labels: Int32) -> NDArray[np.uint16]:
    return np.where(labels == SKY, _SKY_CODE, labels).astype(np.int16).view(np.uint16)


def read(folder: Path) -> Iterator[Stored]:
    """Walk through the frames of a folder, or of every folder in it that holds a rig.

    Only ``left``, ``right``, a rig file and ``truth`` must be there.

    Raises
    ------
    BearcubError
        If one of them is missing or damaged, or the numbers of files or readings differ; the
        message names the file.
    """
    if (folder / "left").is_dir():
        yield from _read_one(folder)
        return
    try:
        inner = sorted(path for path in folder.iterdir() if (path / "left").is_dir())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror}") from error
    if not inner:
        raise InputError(f"{folder}: expected a folder with left, right, rig.toml and truth")
    for path in inner:
        yield from _read_one(path)


def _read_one(folder: Path) -> Iterator[Stored]:
    rig = Rig.load(folder / "rig.toml" if (folder / "rig.toml").exists() else folder)
    lefts, rights = (list_folder(folder / side, IMAGE_SUFFIXES) for side in ("left", "right"))
    if [path.stem for path in lefts] != [path.stem for path in rights]:
        raise InputError(
            f"{folder}: left holds {len(lefts)} pictures, right {len(rights)}; expected pairs of "
            "the same names"
        )
    tilts: list[Tilt | None] = [None] * len(lefts)
    if (folder / "tilt.csv").exists():
        tilts = read_tilts(folder / "tilt.csv")
        if len(tilts) != len(lefts):
            raise InputError(
                f"{folder / 'tilt.csv'}: holds {len(tilts)} readings, expected one for each of "
                f"{len(lefts)} frames"
            )
    for left, right, tilt in zip(lefts, rights, tilts, strict=True):
        maps = {
            part: next(iter(sorted((folder / part).glob(f"{left.stem}.*"))), None)
            for part in ("disparity", "labels")
        }
        yield Stored(
            name=left.stem,
            left=left,
            right=right,
            rig=rig,
            tilt=tilt,
            truth=_read_truth(folder / "truth" / f"{left.stem}.json"),
            **maps,
        )


def _read_truth(path: Path) -> dict[str, Any]:
    try:
        truth = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise FormatError(f"{path}: is not JSON: {error}") from error
    if not isinstance(truth, dict) or truth.get("schema") != "bearcub.truth/1":
        raise FormatError(f"{path}: expected an object with the schema bearcub.truth/1")
    return truth


def read_labels(path: Path) -> Int32:
    """Return the labels of one frame as `Rendered.labels` has them, shape (H, W).

    Raises
    ------
    FormatError
        If the file is no 16-bit picture.
    """
    codes = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if codes is None or codes.dtype != np.uint16 or codes.ndim != 2:
        raise FormatError(f"{path}: expected a grey picture of 16 bit with labels")
    labels = np.ascontiguousarray(codes).view(np.int16).astype(np.int32)
    return np.where(labels == _SKY_CODE, np.int32(SKY), labels).astype(np.int32)
