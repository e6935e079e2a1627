"""The loop: one shot after another through one stage, until the end or Ctrl-C."""

import contextlib
import itertools
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from types import FrameType
from typing import Protocol

from bearcub.messages import Answer, Snapshot
from bearcub.rig import Rig
from bearcub.rig.values import naming
from bearcub.runtime.feed import Shot


class Stage(Protocol):
    """Anything that answers a snapshot; `bearcub.pipeline.Pipeline` does."""

    def process(self, snapshot: Snapshot) -> Answer:
        """Return everything that one frame answers."""
        ...


class Interruption:
    """Whether the user asked to stop."""

    def __init__(self) -> None:
        self.requested = False


@contextlib.contextmanager
def deferred_interrupt() -> Iterator[Interruption]:
    """Let Ctrl-C finish the frame at work, so that no line and no picture is half written.

    A second Ctrl-C interrupts at once. Outside the main thread nothing is changed.
    """
    interruption = Interruption()
    if threading.current_thread() is not threading.main_thread():
        yield interruption
        return

    def request(_number: int, _frame: FrameType | None) -> None:
        if interruption.requested:
            raise KeyboardInterrupt
        interruption.requested = True

    before = signal.signal(signal.SIGINT, request)
    try:
        yield interruption
    finally:
        signal.signal(signal.SIGINT, before)


def answers(
    shots: Iterable[Shot],
    build: Callable[[Rig], Stage],
    *,
    interruption: Interruption,
    limit: int | None = None,
) -> Iterator[tuple[Shot, Answer]]:
    """Answer one shot after another.

    Parameters
    ----------
    shots : iterable of Shot
        Of one size.
    build : callable
        Makes the stage for the rig of the first shot.
    interruption : Interruption
        Looked at before every frame.
    limit : int, optional
        How many frames at most.

    Yields
    ------
    shot : Shot
    answer : Answer

    Raises
    ------
    BearcubError
        If a frame cannot be read or be what it is used as; the message names it.
    """
    stage: Stage | None = None
    for shot in itertools.islice(shots, limit):
        if interruption.requested:
            return
        with naming(shot.source):
            stage = stage or build(shot.rig)
            answer = stage.process(shot.snapshot)
        yield shot, answer
