"""The loop: limits, interruption, errors that name the frame."""

import os
import signal
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import Answer, Snapshot
from bearcub.rig import Camera, Mount, Rig
from bearcub.runtime.classic import ClassicPipeline
from bearcub.runtime.feed import Shot
from bearcub.runtime.loop import Interruption, answers, deferred_interrupt

RIG = Rig(
    camera=Camera(width=64, height=48, fx=40.0, fy=40.0, cx=31.5, cy=23.5, baseline=0.1),
    mount=Mount(height=1.0, pitch=0.3),
)


def _shots(count: int) -> Iterator[Shot]:
    snapshot = Snapshot(disparity=np.ones((48, 64), dtype=np.float32))
    for index in range(count):
        yield Shot(name=str(index), source=f"frame {index}", snapshot=snapshot, rig=RIG)


class Stage:
    """Answers with the classic method; calls `before` first."""

    def __init__(self, before: Callable[[], None]) -> None:
        self._before = before
        self._answer = ClassicPipeline(RIG).process(next(_shots(1)).snapshot)

    def process(self, snapshot: Snapshot) -> Answer:
        """Return the answer."""
        self._before()
        return self._answer


def test_one_stage_is_built_and_the_limit_kept() -> None:
    built: list[Rig] = []

    def build(rig: Rig) -> Stage:
        built.append(rig)
        return Stage(lambda: None)

    found = list(answers(_shots(9), build, interruption=Interruption(), limit=3))
    assert [shot.name for shot, _ in found] == ["0", "1", "2"]
    assert built == [RIG]


def test_ctrl_c_lets_the_frame_at_work_finish() -> None:
    before = signal.getsignal(signal.SIGINT)
    with deferred_interrupt() as interruption:
        stage = Stage(lambda: os.kill(os.getpid(), signal.SIGINT))
        found = list(answers(_shots(9), lambda _: stage, interruption=interruption))
    assert [shot.name for shot, _ in found] == ["0"]
    assert interruption.requested
    assert signal.getsignal(signal.SIGINT) is before


def test_a_second_ctrl_c_interrupts_at_once() -> None:
    with deferred_interrupt() as interruption:
        os.kill(os.getpid(), signal.SIGINT)
        assert interruption.requested
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)


def test_an_error_names_its_frame() -> None:
    def fail() -> None:
        raise InputError("nothing is matched")

    with pytest.raises(InputError, match=r"nothing is matched \(in frame 0\)"):
        list(answers(_shots(2), lambda _: Stage(fail), interruption=Interruption()))
