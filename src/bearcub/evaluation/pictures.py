"""Annotated pictures of the frames that show a row of the table at its worst and at its best."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.evaluation.contenders import Contenders
from bearcub.evaluation.metrics import Figure
from bearcub.evaluation.simulated import Method, drives, frames_of
from bearcub.evaluation.target import Target, corners, holes, obstacles
from bearcub.messages import UInt8
from bearcub.rig import Rig
from bearcub.sim.case import Case
from bearcub.viewer.frame import annotate

_TRUE = (255, 255, 255)
_IGNORED = (160, 160, 160)
_WORST = 2  # pictures of the worst frames of a row


def save_pictures(
    shown: Mapping[str, Figure], cases: Sequence[Case], method: Method, folder: Path
) -> None:
    """Draw the worst and the best frames of every row, the truth as white outlines.

    Parameters
    ----------
    shown : mapping of str to Figure
        By the row's measure.
    cases : sequence of Case
        All that the figures rest on.
    method : Method
        How they were rendered and answered.
    folder : Path
        For ``ROW_worst-1_CASE.png`` and ``ROW_best_CASE.png``.

    Raises
    ------
    InputError
        If a picture cannot be written.
    """
    until = {
        case.name: frames[:count]
        for frames in drives(cases)
        for count, case in enumerate(frames, start=1)
    }
    drawn: dict[str, UInt8] = {}
    for measure, figure in shown.items():
        wanted = [(f"worst-{k}", name) for k, name in enumerate(figure.worst[:_WORST], 1)]
        wanted += [("best", name) for name in figure.best[:1]]
        for word, name in wanted:
            if name not in drawn:
                drawn[name] = draw(until[name], method)
            _write(folder, f"{_slug(measure)}_{word}_{_slug(name)}.png", drawn[name])


def draw(cases: Sequence[Case], method: Method) -> UInt8:
    """Return the left image of the last case with our answer and the truth in it.

    What comes before it in the same drive is answered first, as rows are learnt on the way.
    """
    contenders = Contenders(config=method.config)
    for given in frames_of(cases, method):
        answer = contenders.answer(given)
    picture = annotate(answer, given.left, given.rig).copy()
    for target in (*obstacles(given.truth, given.rig), *holes(given.truth, given.rig)):
        _outline(picture, target, given.truth, given.rig)
    return picture


def _outline(picture: UInt8, target: Target, truth: Mapping[str, Any], rig: Rig) -> None:
    """Draw where the truth has a thing."""
    points = np.rint(corners(target, truth, rig)).astype(np.int32)
    if len(points):
        colour = _TRUE if target.counts else _IGNORED
        cv2.polylines(picture, [points.reshape(-1, 1, 2)], isClosed=True, color=colour)


def _slug(words: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-")


def _write(folder: Path, name: str, picture: UInt8) -> None:
    path = folder / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from error
    if not cv2.imwrite(str(path), picture):
        raise InputError(f"{path}: cannot be written")
