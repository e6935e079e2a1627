"""What every device may suffer: unplugged, silent, broken, and back within two seconds.

A device in the table of emulators is tested here without more. What holds for sources of every sort
is in ``test_source_contract.py``.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.health import silence_limit
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.faults import Faulty
from bearcub.emulators.kind import Kind
from bearcub.emulators.kinds import KINDS

FAULT_ENDS = 6.0  # seconds; long enough for a device to be given up several times
BACK_WITHIN = 2.0
NAMED_WITHIN = 0.5
LOOK = 0.05  # how often is looked at the source
DELIVERING = ("split", "merged")  # faults under which values keep coming, in other pieces

FAULTS = [
    pytest.param(KINDS[kind], fault, id=f"{kind}-{fault}")
    for kind in KINDS
    for fault in KINDS[kind].all_faults
]


@dataclass
class Bench:
    """A driver with its device on the table: time passes when it is told to."""

    kind: Kind
    emulator: Emulator
    clock: ManualClock = field(default_factory=ManualClock)

    def __post_init__(self) -> None:
        self.link = DirectLink(self.emulator, clock=self.clock, wait=self.clock.advance)
        self.source = self.connected()

    def connected(self) -> Streaming[Any]:
        """A new source on the link."""
        return Streaming(
            self.link,
            self.kind.driver(),
            clock=self.clock,
            rate_hz=self.kind.rate_hz,
            role="sensor",
        )

    def run(self, seconds: float, *, until: Callable[[], bool] = lambda: False) -> float:
        """Let time pass; return how much of it did."""
        start_ns = self.clock.now_ns()
        while (passed := (self.clock.now_ns() - start_ns) * 1e-9) < seconds and not until():
            pause = self.source.step()
            # A step that did nothing and wants no pause must not stop the test's time.
            self.clock.advance(pause or 1e-6)
        return passed


def bench(kind: Kind, fault: str = "", on: Callable[[int], bool] = lambda _: True) -> Bench:
    emulator = kind.emulator()
    return Bench(kind, kind.all_faults[fault](emulator, on) if fault else emulator)


@pytest.fixture(params=list(KINDS.values()), ids=list(KINDS))
def running(request: pytest.FixtureRequest) -> Bench:
    """A source that delivers."""
    found = bench(request.param)
    assert found.run(20.0, until=lambda: found.source.health().good) < 20.0
    return found


def test_an_unplugged_device_is_named_within_half_a_second_and_comes_back_within_two(
    running: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    running.link.plugged = False
    named = running.run(5.0, until=lambda: not running.source.health().good)
    assert named <= NAMED_WITHIN
    assert running.source.health().problem.startswith("sensor (emulator): ")
    running.run(10.0)
    assert not running.source.health().connected
    running.link.plugged = True
    back = running.run(5.0, until=lambda: running.source.health().good)
    assert back <= BACK_WITHIN
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]


@pytest.mark.parametrize(("kind", "fault"), FAULTS)
def test_after_a_fault_the_source_is_back_within_two_seconds_and_nothing_stale_was_fresh(
    kind: Kind, fault: str, caplog: pytest.LogCaptureFixture
) -> None:
    """The fault lasts from when the source delivers for six seconds."""
    caplog.set_level(logging.WARNING)
    fault_on = False
    found = bench(kind, fault, lambda _: fault_on)
    assert isinstance(found.emulator, Faulty)
    assert found.run(20.0, until=lambda: found.source.health().good) < 20.0
    fault_on = True
    start_ns = changed_ns = found.clock.now_ns()
    count, silent = found.source.health().values, False
    while found.clock.now_ns() - start_ns < FAULT_ENDS * 1e9:
        found.run(LOOK)
        reading, health = found.source.latest(), found.source.health()
        assert reading is not None
        if reading.count > count:
            count, changed_ns = reading.count, found.clock.now_ns()
        quiet = (found.clock.now_ns() - changed_ns) * 1e-9
        assert not reading.fresh or quiet <= silence_limit(kind.rate_hz) + LOOK
        assert reading.fresh or not health.good
        silent |= not health.good
    fault_on = False
    end_ns = found.clock.now_ns()

    def is_back() -> bool:
        reading = found.source.latest()
        return found.source.health().good and reading is not None and reading.stamp_ns > end_ns

    assert found.run(10.0, until=is_back) <= BACK_WITHIN
    assert bool(caplog.records) == silent
    assert all(text.startswith("sensor (emulator): ") for text in caplog.messages)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_dead_device_is_named_and_the_log_has_one_line_for_it(
    kind: Kind, caplog: pytest.LogCaptureFixture
) -> None:
    stuck = False
    found = bench(kind, "stuck", lambda _: stuck)
    found.run(20.0, until=lambda: found.source.health().good)
    caplog.set_level(logging.INFO)
    stuck = True
    assert found.run(5.0, until=lambda: not found.source.health().good) <= max(
        NAMED_WITHIN, 2.0 / kind.rate_hz
    )
    found.run(0.5)
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert record.getMessage().startswith("sensor (emulator): no value for 0.")
    stuck = False
    found.run(5.0, until=lambda: found.source.health().good)
    assert caplog.messages[-1] == "sensor (emulator): streaming"
    assert len(caplog.records) == 2
