"""Rendered frames kept on disk, so that a change of the algorithms need not render them again."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2

from bearcub.devices.images import read_image
from bearcub.errors import FormatError, InputError
from bearcub.messages import UInt8


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """What is needed of a rendered frame.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
    truth : dict
        A ``bearcub.truth/1`` object.
    """

    left: UInt8
    right: UInt8
    truth: Mapping[str, Any]


def load_frame(folder: Path) -> Kept | None:
    """Return a frame that was saved; None where there is none.

    Raises
    ------
    FormatError
        If what is there is no frame.
    """
    path = folder / "truth.json"
    if not path.exists():
        return None
    try:
        truth = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FormatError(f"{path}: is not a kept frame: {error}; delete the folder") from error
    return Kept(
        left=read_image(folder / "left.png"), right=read_image(folder / "right.png"), truth=truth
    )


def save_frame(folder: Path, frame: Kept) -> None:
    """Save a frame; the truth last, so that a frame that was interrupted is none.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, image in (("left", frame.left), ("right", frame.right)):
            path = folder / f"{name}.png"
            if not cv2.imwrite(str(path), image, [cv2.IMWRITE_PNG_COMPRESSION, 1]):
                raise InputError(f"{path}: cannot be written")
        (folder / "truth.json").write_text(json.dumps(frame.truth), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from error
