"""How a source talks, watches and recovers, step by step on a manual clock."""

import itertools
import logging
import threading
from collections.abc import Callable

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.driver import Ask, Baud, Conversation, Every, Listening, Measured, Pause, Talk
from bearcub.devices.framing import Cut, Framer
from bearcub.devices.health import Arrivals, Health, silence_limit
from bearcub.devices.stream import Streaming
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout, FormatError


def one_byte(data: bytes, start: int) -> Cut[bytes]:
    return Cut(1, data[start : start + 1]) if data[start] < 0x80 else Cut(1, None, "high bit")


class Line:
    """A line that gives what it is told to, and keeps what was sent."""

    name = "line"

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.coming = b""
        self.sent: list[bytes | int] = []
        self.broken = False
        self.opened = 0
        self.refuses = False

    def open(self) -> None:
        if self.refuses:
            raise DeviceError("cannot be opened: no such device")
        self.opened += 1

    def read(self, timeout: float) -> bytes:
        if self.broken:
            self.broken = False
            raise DeviceDisconnected("went away")
        data, self.coming = self.coming, b""
        if not data:
            self.clock.advance(timeout)
        return data

    def write(self, data: bytes) -> None:
        self.sent.append(data)

    def set_baud(self, baud: int) -> None:
        self.sent.append(baud)

    def close(self) -> None:
        self.sent.append(b"closed")


class Letters(Listening):
    """Every byte is a value; ``!`` ends everything, ``?`` is impossible."""

    def __init__(self) -> None:
        self.parser: Framer[bytes] = Framer(one_byte, longest=4)

    def value(self, telegram: bytes) -> Measured[str] | None:
        if telegram == b"!":
            raise DeviceError("has started anew")
        if telegram == b"?":
            raise FormatError("letter ?: impossible")
        return None if telegram == b" " else Measured(telegram.decode(), latency=0.25)

    def farewell(self) -> bytes:
        return b"bye"


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(10**9)


@pytest.fixture
def line(clock: ManualClock) -> Line:
    return Line(clock)


@pytest.fixture
def source(clock: ManualClock, line: Line) -> Streaming[str]:
    return Streaming(line, Letters(), clock=clock, rate_hz=10.0, role="sensor")


def run(source: Streaming[str], clock: ManualClock, seconds: float) -> None:
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while clock.now_ns() < end_ns:
        clock.advance(source.step())


def test_a_value_has_the_stamp_of_its_arrival_less_the_latency(
    source: Streaming[str], line: Line, clock: ManualClock
) -> None:
    source.step()
    line.coming = b"ab "
    arrived_ns = clock.now_ns()
    source.step()
    clock.advance(0.1)
    reading = source.latest()
    assert reading is not None
    assert (reading.value, reading.count, reading.fresh) == ("b", 2, True)
    assert reading.stamp_ns == arrived_ns - 250_000_000
    assert reading.age == pytest.approx(0.35)


def test_an_impossible_value_is_an_error_and_the_stream_goes_on(
    source: Streaming[str], line: Line
) -> None:
    line.coming = b"a?b"
    source.step()
    health = source.health()
    assert (health.values, health.errors, health.good) == (2, 1, True)
    assert health.last_error == "sensor (line): letter ?: impossible"


def test_a_device_that_gives_up_is_opened_anew(source: Streaming[str], line: Line) -> None:
    line.coming = b"a!"
    source.step()
    assert source.health().problem == "sensor (line): has started anew"
    assert not source.health().connected
    assert source.step() == pytest.approx(0.05)


def test_retries_are_further_and_further_apart_and_half_a_second_at_most(
    source: Streaming[str], line: Line, clock: ManualClock
) -> None:
    line.refuses = True
    attempts = []
    for _ in range(200):
        errors = source.health().errors
        pause = source.step()
        if source.health().errors > errors:
            attempts.append(clock.now_ns() * 1e-9)
        clock.advance(pause)
    gaps = [later - before for before, later in itertools.pairwise(attempts)]
    assert gaps[:6] == pytest.approx([0.05, 0.1, 0.2, 0.4, 0.5, 0.5])
    assert source.health().problem == "sensor (line): cannot be opened: no such device"


def test_what_comes_instead_of_values_is_told(
    source: Streaming[str], line: Line, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    line.coming = b"a"
    source.step()
    run(source, clock, 0.4)
    assert "nothing comes; check its power and its cable" in source.health().problem
    line.coming = b"a"
    source.step()
    line.coming = b"   "
    run(source, clock, 0.4)
    assert "3 bytes came and no value in them" in source.health().problem
    line.coming = b"a"
    source.step()
    line.coming = b"\xff\xff"
    run(source, clock, 0.4)
    assert "2 telegrams refused, the last one for: high bit" in source.health().problem
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * 3


def test_a_silent_device_is_started_anew_after_a_second(
    source: Streaming[str], line: Line, clock: ManualClock
) -> None:
    line.coming = b"a"
    run(source, clock, 0.9)
    assert line.opened == 1
    run(source, clock, 0.3)
    assert line.opened == 2


def test_after_a_reconnect_a_value_from_before_does_not_make_it_good(
    source: Streaming[str], line: Line, clock: ManualClock
) -> None:
    line.coming = b"a"
    source.step()
    line.broken = True
    source.step()
    assert source.health().problem == "sensor (line): went away"
    clock.advance(0.05)
    source.step()
    health = source.health()
    assert (line.opened, health.connected, health.good) == (2, True, False)
    assert health.age < 0.2
    assert health.problem == "sensor (line): went away"
    line.coming = b"b"
    source.step()
    assert source.health().good


def test_silence_counts_from_the_end_of_a_long_conversation(line: Line, clock: ManualClock) -> None:
    class Slow(Letters):
        def conversation(self) -> Conversation[bytes]:
            yield Pause(7.0)

    source = Streaming(line, Slow(), clock=clock, rate_hz=10.0, role="sensor")
    run(source, clock, 7.9)
    assert line.opened == 1
    assert "no value yet" in source.health().problem
    run(source, clock, 0.4)
    assert line.opened == 2


def test_values_that_were_refused_are_named_as_what_is_missing(
    source: Streaming[str], line: Line, clock: ManualClock
) -> None:
    line.coming = b"a??"
    source.step()
    run(source, clock, 0.4)
    assert source.health().problem.endswith(
        "2 values refused, the last one for: letter ?: impossible"
    )


def test_a_loose_cable_does_not_fill_the_log(
    source: Streaming[str], line: Line, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    for _ in range(20):
        line.coming = b"a"
        source.step()
        line.broken = True
        source.step()
        clock.advance(0.5)
    said = [message.removeprefix("sensor (line): ") for message in caplog.messages]
    assert said == [
        "connecting",
        "streaming",
        "went away",
        "streaming",
        "went away",
        "streaming",
        "went away (comes and goes; logged again after 10 s without a change)",
    ]
    for _ in range(41):
        line.coming = b"a"
        source.step()
        clock.advance(0.25)
    assert caplog.messages[-1] == "sensor (line): streaming, after 17 more faults"
    assert len(caplog.messages) == 8


def test_a_loose_cable_that_breaks_at_last_is_in_the_log(
    source: Streaming[str], line: Line, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(5):
        line.coming = b"a"
        source.step()
        line.broken = True
        source.step()
        clock.advance(0.5)
    line.refuses = True
    before = len(caplog.messages)
    run(source, clock, 30.0)
    assert caplog.messages[before:] == ["sensor (line): cannot be opened: no such device"]


def test_closing_says_farewell_and_closes_the_line(source: Streaming[str], line: Line) -> None:
    source.step()
    source.close()
    source.close()
    assert line.sent == [b"bye", b"closed", b"closed"]
    source.start()
    assert source.health().problem == "sensor (line): closed"


def test_an_error_of_the_program_is_told_by_the_health(
    line: Line, clock: ManualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken(Letters):
        def value(self, telegram: bytes) -> Measured[str] | None:
            raise ZeroDivisionError(telegram)

    raised: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", raised.append)
    line.coming = b"a"
    with Streaming(line, Broken(), clock=clock, rate_hz=10.0, role="sensor") as source:
        thread = source._thread
        assert thread is not None
        thread.join(5.0)
        problem = "sensor (line): its reader failed by an error of this program; see stderr"
        assert source.health().problem == problem
    assert [args.exc_type for args in raised] == [ZeroDivisionError]


def test_a_conversation_takes_its_steps_when_their_time_has_come(
    line: Line, clock: ManualClock
) -> None:
    heard = []

    def steps() -> Conversation[bytes]:
        yield Baud(19200)
        heard.append((yield Ask(b"who", lambda telegram: telegram == b"me", 0.2)))
        yield Pause(1.0)
        heard.append((yield Ask(b"again", lambda _: True, 0.2)))
        yield Ask(b"", lambda _: True, 0.1)

    talk = Talk(steps(), line, clock)
    assert line.sent == [19200, b"who"]
    assert talk.patience == pytest.approx(0.2)
    talk.hear(b"you")
    talk.hear(b"me")
    assert heard == [b"me"]
    talk.tick()
    clock.advance(1.0)
    talk.tick()
    assert line.sent == [19200, b"who", b"again"]
    clock.advance(0.2)
    talk.tick()
    assert heard == [b"me", None]
    clock.advance(0.1)
    talk.tick()
    assert talk.over
    assert talk.patience == float("inf")


def test_an_even_beat_is_kept_whatever_happens_in_between(line: Line, clock: ManualClock) -> None:
    beats = []

    def steps() -> Conversation[bytes]:
        while True:
            yield Every(0.1)
            beats.append(round(clock.now_ns() * 1e-9, 3))
            yield Pause(0.35 if len(beats) == 3 else 0.03)

    talk = Talk(steps(), line, clock)
    for _ in range(100):
        clock.advance(0.01)
        talk.tick()
    assert beats[:3] == pytest.approx([1.01, 1.11, 1.21], abs=0.011)
    assert beats[3:6] == pytest.approx([1.56, 1.66, 1.76], abs=0.021)


@pytest.mark.parametrize(
    ("rate_hz", "limit"), [(75.0, 0.2), (20.0, 0.2), (10.0, 0.3), (5.0, 0.4), (1.0, 1.5)]
)
def test_the_silence_that_counts_fits_the_rate(rate_hz: float, limit: float) -> None:
    assert silence_limit(rate_hz) == pytest.approx(limit)


def test_the_rate_is_that_of_the_last_seconds_and_falls_when_nothing_comes() -> None:
    arrivals = Arrivals(10.0)
    assert arrivals.age(0) == float("inf")
    for n in range(100):
        arrivals.add(n * 50_000_000)
    now_ns = 99 * 50_000_000
    assert arrivals.rate_hz(now_ns) == pytest.approx(20.0)
    assert arrivals.rate_hz(now_ns + 1_000_000_000) == pytest.approx(10.0, rel=0.1)
    assert arrivals.rate_hz(now_ns + 3_000_000_000) == 0.0
    assert arrivals.age(now_ns + 3_000_000_000) == pytest.approx(3.0)


def test_health_is_good_without_a_problem() -> None:
    assert Health(name="a", problem="").good
    assert not Health(name="a", problem="a: closed").good


def test_a_time_out_is_a_device_error() -> None:
    make: Callable[[str], Exception] = DeviceTimeout
    assert isinstance(make("x"), DeviceError)
