"""Stages that work at the same time, each in a thread of its own, on one frame after another."""

import threading
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any

from bearcub.clock import Clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Passed:
    """A frame on its way.

    Attributes
    ----------
    value : object
        What the last stage made of it.
    began_ns, ended_ns : mapping of str to int
        When each stage so far took it up and was done with it [ns].
    """

    value: Any = None
    began_ns: Mapping[str, int] = field(default_factory=dict)
    ended_ns: Mapping[str, int] = field(default_factory=dict)


def relay(
    stages: Mapping[str, Callable[[Any], Any]], *, clock: Clock
) -> Generator[Passed, None, None]:
    """Send frames through stages, every one of which works on another frame.

    A stage takes up its next frame when the one after it has taken the last: between two of them
    never more than one frame waits, and none grows old in a queue.

    Parameters
    ----------
    stages : mapping of str to callable
        In order; each is given what the one before returned, the first None. The first makes the
        frames; None from it, or from any other, ends the relay.
    clock : Clock

    Yields
    ------
    Passed
        Every frame, in order. When the generator is closed, the frames at work are finished and
        no thread is left.

    Raises
    ------
    Exception
        What the first stage that failed raised, after the frames that were through.
    """
    slots = [_Slot() for _ in stages]
    before: list[_Slot | None] = [None, *slots[:-1]]
    stops: list[BaseException] = []
    workers = [
        threading.Thread(
            target=_work,
            args=(name, stage, source, target, clock, stops),
            name=f"bearcub {name}",
            daemon=True,
        )
        for (name, stage), source, target in zip(stages.items(), before, slots, strict=True)
    ]
    for worker in workers:
        worker.start()
    try:
        while (passed := slots[-1].take()) is not None:
            yield passed
    finally:
        for slot in slots:
            slot.close()
        for worker in workers:
            worker.join()
    if stops:
        raise stops[0]


class _Slot:
    """Where one frame waits between two stages."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._frame: Passed | None = None
        self._closed = False

    def wait_until_empty(self) -> bool:
        """Return True when a frame may be put; False when no more is wanted."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._frame is None)
            return not self._closed

    def put(self, frame: Passed) -> None:
        """Leave a frame, after `wait_until_empty`."""
        with self._changed:
            self._frame = frame
            self._changed.notify_all()

    def take(self) -> Passed | None:
        """Return the next frame; None when none will come any more."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._frame is not None)
            frame, self._frame = self._frame, None
            self._changed.notify_all()
            return frame

    def close(self) -> None:
        """Wake who waits: what is there may still be taken, nothing more will come."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


def _work(
    name: str,
    stage: Callable[[Any], Any],
    source: _Slot | None,
    target: _Slot,
    clock: Clock,
    stops: list[BaseException],
) -> None:
    """Do a stage's part for all frames; closing both its slots lets its neighbours end, too."""
    try:
        while target.wait_until_empty():
            frame = Passed() if source is None else source.take()
            if frame is None:
                return
            began_ns = clock.now_ns()
            value = stage(frame.value)
            if value is None:
                return
            target.put(
                Passed(
                    value=value,
                    began_ns={**frame.began_ns, name: began_ns},
                    ended_ns={**frame.ended_ns, name: clock.now_ns()},
                )
            )
    except BaseException as error:  # noqa: BLE001 (it is raised where the frames are wanted)
        stops.append(error)
    finally:
        target.close()
        if source is not None:
            source.close()
