"""Time is passed in."""

import re
from pathlib import Path

import pytest

import bearcub
from bearcub.clock import Clock, ManualClock, MonotonicClock, elapsed_ms


def test_manual_clock_moves_only_when_told() -> None:
    clock = ManualClock(start_ns=7)
    assert [clock.now_ns(), clock.now_ns()] == [7, 7]
    clock.advance(1.5)
    assert clock.now_ns() == 1_500_000_007


def test_elapsed_time_is_told_in_milliseconds() -> None:
    clock = ManualClock()
    start = clock.now_ns()
    clock.advance(0.0625)
    assert elapsed_ms(clock, start) == pytest.approx(62.5)


def test_machines_clock_never_goes_back() -> None:
    clock: Clock = MonotonicClock()
    readings = [clock.now_ns() for _ in range(100)]
    assert readings == sorted(readings)
    assert elapsed_ms(clock, readings[0]) >= 0


def test_no_other_module_asks_the_machine_for_the_time() -> None:
    package = Path(bearcub.__file__).parent
    asking = re.compile(r"^\s*(import|from) (time|datetime)\b", re.MULTILINE)
    found = {
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        if asking.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"clock.py"}
