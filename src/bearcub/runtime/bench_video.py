"""How long a video's frames take, from the file to the picture with the answer drawn over it."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bearcub.clock import Clock
from bearcub.config import Config
from bearcub.messages import Answer, DisparityMap, Float64, UInt8, as_image
from bearcub.pipeline import Pipeline
from bearcub.rig.values import naming
from bearcub.runtime.bench import WARM_UP, on_threads
from bearcub.runtime.feed import Shot
from bearcub.runtime.loop import Interruption
from bearcub.runtime.pictures import steady_reach
from bearcub.runtime.relay import Passed, relay
from bearcub.stereo.images import grey
from bearcub.stereo.rectification import Rectifier
from bearcub.viewer import annotate

AGE = "age of the answer"
"""What is measured beside the stages: from the beginning of a frame's decoding to its answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """What playing a video took, without the frames that warm up.

    Attributes
    ----------
    size : tuple of int
        Width and height of an image [px].
    seconds : float
        From the last frame of the warm-up to the last frame.
    times : dict of str to ndarray of float64, shape (frames,)
        Milliseconds of every stage, and the `AGE` of the answers.
    """

    size: tuple[int, int]
    seconds: float
    times: dict[str, Float64]

    @property
    def frames(self) -> int:
        """How many frames were counted."""
        return len(self.times[AGE])

    @property
    def rate_hz(self) -> float:
        """Frames per second, sustained."""
        return self.frames / self.seconds


def play(
    shots: Iterator[Shot],
    config: Config,
    *,
    clock: Clock,
    interruption: Interruption,
    advance: Callable[[], object] = lambda: None,
) -> Played:
    """Decode, rectify, match, answer and draw, each in a thread of its own; see `relay`.

    Parameters
    ----------
    shots : iterator of Shot
        Pairs; advancing it decodes one.
    config : Config
        OpenCV takes as many threads as its matching.
    clock : Clock
    interruption : Interruption
        Looked at after every frame.
    advance : callable
        Called after every frame.

    Raises
    ------
    BearcubError
        If a frame cannot be read or answered; no thread is left then, either.
    """
    stages = _Stages(shots, config)
    passed: list[Passed] = []
    with (
        on_threads(config.matching.threads),
        contextlib.closing(relay(stages.in_order(), clock=clock)) as frames,
    ):
        for frame in frames:
            passed.append(replace(frame, value=None))  # not the pictures
            advance()
            if interruption.requested:
                break
    return _summary(passed, size=stages.size)


def _summary(passed: list[Passed], *, size: tuple[int, int]) -> Played:
    counted = passed[WARM_UP:]
    names = list(counted[0].began_ns) if counted else []
    times = {
        name: np.array([frame.ended_ns[name] - frame.began_ns[name] for frame in counted]) * 1e-6
        for name in names
    }
    ages = [frame.ended_ns["answer"] - frame.began_ns["decode"] for frame in counted]
    through = [frame.ended_ns["overlay"] for frame in passed[WARM_UP - 1 :]]
    seconds = (through[-1] - through[0]) * 1e-9 if counted else 0.0
    return Played(size=size, seconds=seconds, times={**times, AGE: np.array(ages) * 1e-6})


class _Stages:
    """What happens to a shot; each method is called by one thread alone."""

    def __init__(self, shots: Iterator[Shot], config: Config) -> None:
        self.size = (0, 0)
        self._shots = shots
        self._config = config
        self._rectifier: Rectifier | None = None
        self._matching: Pipeline | None = None
        self._answering: Pipeline | None = None

    def in_order(self) -> dict[str, Callable[[Any], Any]]:
        return {
            "decode": self._decode,
            "rectify": self._rectify,
            "match": self._match,
            "answer": self._answer,
            "overlay": self._overlay,
        }

    def _decode(self, _: None) -> Shot | None:
        return next(self._shots, None)

    def _rectify(self, shot: Shot) -> tuple[Shot, UInt8]:
        """Return the shot with its pair in grey, rectified, and its left picture."""
        snapshot, rectification = shot.snapshot, shot.rig.rectification
        with naming(shot.source):
            picture, right = (
                as_image(snapshot.left, name="left"),
                as_image(snapshot.right, name="right"),
            )
            pair = grey(picture), grey(right)
            if rectification is not None:
                self._rectifier = self._rectifier or Rectifier(
                    rectification, threads=self._config.matching.threads
                )
                pair, picture = self._rectifier(*pair), self._rectifier.left(picture)
        rectified = replace(snapshot, left=pair[0], right=pair[1])
        return replace(shot, snapshot=rectified, rig=replace(shot.rig, lenses=None)), picture

    def _match(self, rectified: tuple[Shot, UInt8]) -> tuple[Shot, UInt8, DisparityMap]:
        shot, picture = rectified
        rig, snapshot = shot.rig, shot.snapshot
        self.size = (rig.camera.width, rig.camera.height)
        with naming(shot.source):
            self._matching = self._matching or Pipeline(rig, self._config)
            return shot, picture, self._matching.match(snapshot)

    def _answer(self, matched: tuple[Shot, UInt8, DisparityMap]) -> tuple[Shot, UInt8, Answer]:
        shot, picture, disparity = matched
        self._answering = self._answering or Pipeline(shot.rig, self._config)
        with naming(shot.source):
            return shot, picture, self._answering.answer(shot.snapshot, disparity)

    def _overlay(self, answered: tuple[Shot, UInt8, Answer]) -> UInt8:
        shot, picture, answer = answered
        return annotate(answer, picture, shot.rig, reach=steady_reach(shot.rig))
