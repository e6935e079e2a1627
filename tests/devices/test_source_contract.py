"""What holds for every source; a device in the table of emulators is tested here without more."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.driver import Overheard
from bearcub.devices.link import FileLink
from bearcub.devices.replay import Replay
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.faults import Faulty
from bearcub.emulators.kind import Kind
from bearcub.emulators.kinds import KINDS

FAULT_ENDS = 6.0  # seconds; long enough for a device to be given up several times
BACK_WITHIN = 2.0
NAMED_WITHIN = 0.5
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


class Recorder(Faulty):
    """Keeps what the device sends."""

    def __init__(self, emulator: Emulator) -> None:
        super().__init__(emulator, lambda _: True)
        self.sent = b""

    def spoil(self, data: bytes) -> bytes:
        self.sent += data
        return data


def bench(kind: Kind, fault: str = "", on: Callable[[int], bool] = lambda _: True) -> Bench:
    emulator = kind.emulator()
    return Bench(kind, kind.all_faults[fault](emulator, on) if fault else emulator)


@pytest.fixture(params=list(KINDS.values()), ids=list(KINDS))
def running(request: pytest.FixtureRequest) -> Bench:
    """A source that delivers."""
    found = bench(request.param)
    assert found.run(20.0, until=lambda: found.source.health().good) < 20.0
    return found


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_before_it_is_started_a_source_has_no_value_and_says_that_it_is_closed(kind: Kind) -> None:
    source = bench(kind).source
    assert source.latest() is None
    assert source.health().problem == "sensor (emulator): closed"
    source.close()


def test_values_come_at_the_rate_the_device_has(running: Bench) -> None:
    running.run(3.0)
    health = running.source.health()
    assert health.rate_hz == pytest.approx(running.kind.rate_hz, rel=0.15)
    assert (health.errors, health.drops, health.last_error) == (0, 0, "")
    assert health.connected


def test_asking_takes_no_time_and_the_age_grows_by_what_the_clock_says(running: Bench) -> None:
    before = running.clock.now_ns()
    first, second = running.source.latest(), running.source.latest()
    assert running.clock.now_ns() == before
    assert first is not None
    assert first == second
    running.clock.advance(5.0)
    later = running.source.latest()
    assert later is not None
    assert later.age == pytest.approx(first.age + 5.0)
    assert (first.fresh, later.fresh) == (True, False)
    assert (later.stamp_ns, later.count) == (first.stamp_ns, first.count)


def test_stamps_ascend_and_are_never_later_than_now(running: Bench) -> None:
    stamps = []
    for _ in range(20):
        count = running.source.health().values
        running.run(3.0, until=lambda: running.source.health().values > count)  # noqa: B023
        reading = running.source.latest()
        assert reading is not None
        assert reading.age >= 0
        stamps.append(reading.stamp_ns)
    assert stamps == sorted(set(stamps))


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


def test_closing_twice_is_well_and_says_so(running: Bench) -> None:
    running.source.close()
    running.source.close()
    assert running.source.health().problem == "sensor (emulator): closed"


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
    start_ns = found.clock.now_ns()
    ages = [0.0]
    silent = False
    while found.clock.now_ns() - start_ns < FAULT_ENDS * 1e9:
        found.run(0.05)
        reading, health = found.source.latest(), found.source.health()
        assert reading is not None
        silent |= not health.good
        assert health.good or not health.connected or not reading.fresh
        assert reading.fresh or not health.good
        if reading.fresh:
            ages.append(health.age)
    assert max(ages) <= max(0.4, 1.5 / kind.rate_hz)
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


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_what_a_device_sent_is_read_from_a_file_as_well(kind: Kind, tmp_path: Path) -> None:
    live = bench(kind)
    recorder = Recorder(live.emulator)
    live.link = DirectLink(recorder, clock=live.clock, wait=live.clock.advance)
    live.source = live.connected()
    live.run(20.0, until=lambda: live.source.health().values == 10)
    path = tmp_path / "sent.bin"
    path.write_bytes(recorder.sent)
    clock = ManualClock()
    link = FileLink(path, clock=clock, bytes_per_second=len(recorder.sent), wait=clock.advance)
    played: Streaming[Any] = Streaming(
        link, Overheard(kind.driver()), clock=clock, rate_hz=kind.rate_hz, role="recorded"
    )
    while clock.now_ns() < 2e9:
        clock.advance(played.step())
    assert played.health().values == 10
    assert played.health().problem == f"recorded ({path}): the recording is at its end"


def test_a_replay_gives_each_value_its_time_and_says_when_it_is_over() -> None:
    clock = ManualClock(5_000)
    values = [(0.1, "a"), (0.2, "b"), (0.3, "c")]
    with Replay(values, clock=clock, rate_hz=10.0, name="log") as source:
        assert source.latest() is None
        assert source.health().problem == "log: no value yet"
        clock.advance(0.25)
        reading = source.latest()
        assert reading is not None
        assert (reading.value, reading.count, reading.stamp_ns) == ("b", 2, 200_005_000)
        assert reading.age == pytest.approx(0.05)
        assert source.health().good
        assert source.health().rate_hz == pytest.approx(10.0)
        clock.advance(1.0)
        late = source.latest()
        assert late is not None
        assert (late.value, late.fresh) == ("c", False)
        assert source.health().problem == "log: the recording is at its end"
    source.close()
    assert source.health().problem == "log: closed"
