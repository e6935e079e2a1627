"""Stages in threads: every frame once and in order, at the same time, and an end without a hang."""

import itertools
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.runtime.relay import relay

LIMIT = 20.0  # seconds until a test that hangs is given up


def counting(count: int) -> Callable[[None], int | None]:
    numbers = iter(range(count))
    return lambda _: next(numbers, None)


def double(value: int) -> int:
    return 2 * value


@pytest.fixture(autouse=True)
def no_thread_is_left() -> Iterator[None]:
    yield
    assert not [thread.name for thread in threading.enumerate() if "bearcub" in thread.name]


def test_every_frame_comes_out_once_and_in_order() -> None:
    stages: dict[str, Callable[[Any], Any]] = {"count": counting(200), "a": double, "b": str}
    values = [passed.value for passed in relay(stages, clock=ManualClock())]
    assert values == [str(2 * number) for number in range(200)]


def test_stages_work_at_the_same_time_on_frames_that_follow_each_other() -> None:
    together = threading.Barrier(3, timeout=LIMIT)
    met: list[tuple[str, int]] = []

    def meeting(name: str) -> Callable[[int], int]:
        def stage(value: int) -> int:
            # From the third frame on all three stages have one.
            if value + {"first": 0, "second": 1, "third": 2}[name] in range(2, 6):
                together.wait()
                met.append((name, value))
            return value

        return stage

    numbers = counting(6)

    def first(_: None) -> int | None:
        number = numbers(None)
        return None if number is None else meeting("first")(number)

    stages: dict[str, Callable[[Any], Any]]
    stages = {"first": first, "second": meeting("second"), "third": meeting("third")}
    assert [passed.value for passed in relay(stages, clock=ManualClock())] == list(range(6))
    for name, late in (("first", 0), ("second", 1), ("third", 2)):
        assert [v for n, v in met if n == name] == [n - late for n in range(2, 6)]


def test_no_stage_runs_further_ahead_than_one_frame() -> None:
    slow = threading.Event()
    begun: list[int] = []
    held: list[list[int]] = []

    def first(_: None) -> int:
        begun.append(len(begun))
        return begun[-1]

    def second(value: int) -> int:
        assert slow.wait(LIMIT)
        return value

    def release() -> None:
        held.append(begun.copy())
        slow.set()

    threading.Timer(0.2, release).start()
    frames = relay({"first": first, "second": second}, clock=ManualClock())
    assert next(frames).value == 0
    frames.close()
    assert held == [[0, 1]]  # frame 1 waited, and frame 2 was not begun


def test_a_frame_tells_when_each_stage_had_it() -> None:
    clock = ManualClock()

    def taking(seconds: float) -> Callable[[Any], Any]:
        def stage(value: Any) -> Any:
            clock.advance(seconds)
            return value

        return stage

    once = counting(1)

    def first(_: None) -> str | None:
        return None if once(None) is None else str(taking(1.0)("frame"))

    stages: dict[str, Callable[[Any], Any]]
    stages = {"first": first, "second": taking(2.0), "third": taking(4.0)}
    (passed,) = relay(stages, clock=clock)
    assert passed.began_ns == {"first": 0, "second": 1_000_000_000, "third": 3_000_000_000}
    assert passed.ended_ns == {
        "first": 1_000_000_000,
        "second": 3_000_000_000,
        "third": 7_000_000_000,
    }


@pytest.mark.parametrize("failing", [0, 1, 2])
def test_what_a_stage_raises_ends_all_after_the_frames_before(failing: int) -> None:
    def unless_seven(value: int) -> int:
        if value == 7:
            raise ValueError("seven")
        return value

    numbers = itertools.count()
    stages: list[Callable[[Any], Any]] = [lambda _: next(numbers), lambda v: v, lambda v: v]
    broken = stages[failing]
    stages[failing] = lambda value: unless_seven(broken(value))
    frames = relay(dict(zip("abc", stages, strict=True)), clock=ManualClock())
    assert [next(frames).value for _ in range(7)] == list(range(7))
    with pytest.raises(ValueError, match="seven"):
        next(frames)


def test_it_can_be_left_at_any_time() -> None:
    numbers = itertools.count()
    stages: dict[str, Callable[[Any], Any]] = {"a": lambda _: next(numbers), "b": double}
    frames = relay(stages, clock=ManualClock())
    assert [next(frames).value for _ in range(3)] == [0, 2, 4]
    frames.close()
    with pytest.raises(StopIteration):
        next(frames)


def test_nothing_at_all_is_no_error() -> None:
    assert list(relay({"count": counting(0), "a": double}, clock=ManualClock())) == []
