"""The LMS2xx driver talks to an emulated scanner, step by step and without waiting."""

import logging
import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.devices.driver import Overheard
from bearcub.devices.sick import Lms2xx
from bearcub.devices.sick.lms2xx import Reply, Telegram, encode
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.faults import Faulty
from bearcub.emulators.lms2xx import LMS2XX_FAULTS, Lms2xxEmulator
from bearcub.errors import ConfigError, FormatError
from bearcub.messages import Float64, Scan


@dataclass
class Bench:
    """A driver and its scanner; time passes when it is told to."""

    driver: Lms2xx
    scanner: Emulator
    clock: ManualClock = field(default_factory=ManualClock)
    baud: int | None = None

    def __post_init__(self) -> None:
        link = DirectLink(self.scanner, clock=self.clock, wait=self.clock.advance, baud=self.baud)
        self.source: Streaming[Scan] = Streaming(
            link, self.driver, clock=self.clock, rate_hz=self.driver.rate_hz, role="ladar"
        )

    def run(self, seconds: float) -> None:
        end_ns = self.clock.now_ns() + seconds * 1e9
        while self.clock.now_ns() < end_ns:
            self.clock.advance(self.source.step() or 1e-6)

    def first_scan(self, patience: float = 20.0) -> Scan:
        """Run until a scan newer than now has come; return it."""
        start_ns = self.clock.now_ns()
        while self.clock.now_ns() - start_ns < patience * 1e9:
            self.clock.advance(self.source.step() or 1e-6)
            reading = self.source.latest()
            if reading and reading.stamp_ns > start_ns:
                return reading.value
        raise AssertionError(self.source.health())

    @property
    def now(self) -> float:
        return self.clock.now_ns() * 1e-9


def straight(now_ns: int, angles: Float64) -> Float64:
    """A wall 3 m ahead, nothing to the sides, something at the window on the far right."""
    ranges = np.where(np.abs(angles) < 0.5, 3.0 / np.cos(angles), np.inf)
    ranges[0] = -np.inf
    return ranges


@pytest.mark.parametrize("power_on_baud", [9600, 19200, 38400, 500000])
@pytest.mark.parametrize("baud", [9600, 38400, 500000])
def test_the_scanner_is_found_at_any_speed_and_streams_at_the_one_asked_for(
    power_on_baud: int, baud: int
) -> None:
    scanner = Lms2xxEmulator(power_on_baud=power_on_baud)
    bench = Bench(Lms2xx(baud=baud), scanner, baud=9600)
    scan = bench.first_scan()
    assert scanner.baud == baud
    assert scan.ranges[180] == pytest.approx(4.0)
    assert bench.driver.identity == (
        f"LMS200;30106x;V02.10, 180° in steps of 0.5°, mm, measuring mode 0x00, {baud} baud"
    )
    assert bench.driver.complaints == ()
    assert bench.now < 3.0
    bench.run(3.0)
    assert bench.source.health().rate_hz == pytest.approx(bench.driver.rate_hz, rel=0.05)


@pytest.mark.parametrize(
    ("fov_deg", "resolution_deg", "count"),
    [(180, 1.0, 181), (180, 0.5, 361), (100, 1.0, 101), (100, 0.5, 201), (100, 0.25, 401)],
)
@pytest.mark.parametrize("unit", ["mm", "cm"])
def test_field_of_view_resolution_and_unit_are_set(
    fov_deg: int, resolution_deg: float, count: int, unit: str
) -> None:
    driver = Lms2xx(fov_deg=fov_deg, resolution_deg=resolution_deg, baud=500000, unit=unit)
    scan = Bench(driver, Lms2xxEmulator(straight)).first_scan()
    assert len(scan) == count
    assert scan.ranges[count // 2] == pytest.approx(3.0)
    assert math.isinf(scan.ranges[0])
    assert scan.ranges[0] < 0
    assert scan.nearest == pytest.approx({"mm": 0.001, "cm": 0.01}[unit])


@pytest.mark.parametrize(
    ("mode", "farthest"),
    [(0, 8.182), (1, 8.182), (2, 8.182), (3, 16.374), (4, 16.374), (5, 32.758)],
)
def test_the_measuring_mode_that_the_scanner_has_is_used(mode: int, farthest: float) -> None:
    def wall(_: int, angles: Float64) -> Float64:
        return np.full(len(angles), 7.9)

    scan = Bench(Lms2xx(baud=500000), Lms2xxEmulator(wall, measuring_mode=mode)).first_scan()
    assert scan.farthest == pytest.approx(farthest)
    assert scan.ranges == pytest.approx(7.9)


def test_a_measuring_mode_that_is_asked_for_is_written_once() -> None:
    written = []

    class Watched(Lms2xxEmulator):
        def _write_config(self, data: bytes) -> Telegram | None:
            written.append(data)
            return super()._write_config(data)

    scanner = Watched(lambda _, angles: np.full(len(angles), 12.0))
    scan = Bench(Lms2xx(baud=500000, measuring_mode=4), scanner).first_scan()
    assert scan.ranges == pytest.approx(12.0)
    assert len(written) == 1
    again = Bench(Lms2xx(baud=500000, measuring_mode=4), scanner, baud=500000)
    assert again.first_scan().ranges == pytest.approx(12.0)
    assert len(written) == 1


def test_a_scanner_that_still_streams_from_before_is_found_and_stopped() -> None:
    scanner = Lms2xxEmulator()
    first = Bench(Lms2xx(baud=19200), scanner)
    first.first_scan()
    # The program ended without a farewell; the next one expects another speed.
    second = Bench(Lms2xx(baud=38400), scanner, clock=first.clock)
    start = second.now
    second.first_scan()
    assert scanner.baud == 38400
    assert second.now - start < 5.0


def test_at_500000_baud_commands_are_sent_byte_by_byte_with_gaps() -> None:
    """The telegram listing asks for 55 us to 6 ms between bytes."""
    clock = ManualClock()
    received: list[tuple[int, int]] = []

    class Listening(Lms2xxEmulator):
        def receive(self, data: bytes) -> None:
            if self.baud == 500000:
                received.append((clock.now_ns(), len(data)))
            super().receive(data)

    bench = Bench(Lms2xx(baud=500000), Listening(power_on_baud=500000), clock, baud=500000)
    bench.first_scan()
    assert {size for _, size in received} == {1}
    gaps = np.diff([at for at, _ in received]) * 1e-9
    assert gaps.min() >= 55e-6
    assert len(received) > 40
    assert np.median(gaps) < 6e-3


def test_the_farewell_ends_the_stream() -> None:
    scanner = Lms2xxEmulator()
    bench = Bench(Lms2xx(), scanner)
    bench.first_scan()
    assert scanner.mode == 0x24
    bench.source.close()
    assert scanner.mode == 0x25


def test_a_stamp_is_earlier_than_the_arrival_by_the_time_on_the_line() -> None:
    bench = Bench(Lms2xx(baud=38400), Lms2xxEmulator())
    bench.first_scan()
    reading = bench.source.latest()
    assert reading is not None
    assert reading.age == pytest.approx(732 * 10 / 38400, abs=0.003)  # 191 ms
    assert reading.fresh


class Switched:
    """A fault that a test switches on and off."""

    def __init__(self, name: str, scanner: Lms2xxEmulator, *, on: bool = False) -> None:
        self.on = on
        self.scanner: Faulty = LMS2XX_FAULTS[name](scanner, lambda _: self.on)


@pytest.mark.parametrize("fault", ["nak", "ack-only"])
def test_commands_are_repeated_until_they_are_answered(fault: str) -> None:
    switched = Switched(fault, Lms2xxEmulator(power_on_baud=38400), on=True)
    bench = Bench(Lms2xx(), switched.scanner)
    bench.run(1.7)
    assert bench.source.latest() is None
    switched.on = False
    start = bench.now
    bench.first_scan()
    assert bench.now - start < 2.0


@pytest.mark.parametrize("power_on_baud", [9600, 38400])
def test_a_scanner_that_lost_its_power_is_back_two_seconds_after_it_says_so(
    power_on_baud: int, caplog: pytest.LogCaptureFixture
) -> None:
    switched = Switched("restart", Lms2xxEmulator(power_on_baud=power_on_baud))
    bench = Bench(Lms2xx(), switched.scanner)
    bench.first_scan()
    bench.run(1.0)
    caplog.clear()
    switched.on = True
    start = bench.now
    bench.run(0.5)  # it boots for 0.4 s
    bench.first_scan()
    assert bench.now - start < 2.0 + 0.4
    (lost,) = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert lost.startswith("ladar (emulator): no value for 0.4")
    # Its power-on telegram is only understood where it comes at the speed of the stream.
    understood = "LMS200;30106x;V02.10: was switched on anew" in bench.source.health().last_error
    assert understood == (power_on_baud == 38400)


def test_a_power_on_telegram_in_the_middle_of_a_scan_begins_everything_anew() -> None:
    switched = Switched("power-on", Lms2xxEmulator())
    bench = Bench(Lms2xx(), switched.scanner)
    bench.first_scan()
    switched.on = True
    bench.run(0.3)
    assert "was switched on anew" in bench.source.health().last_error
    bench.first_scan()
    assert bench.source.health().good


def test_a_scanner_that_does_not_answer_is_named_with_what_to_check() -> None:
    class Dead(Lms2xxEmulator):
        def receive(self, data: bytes) -> None:
            """Hear nothing."""

    bench = Bench(Lms2xx(), Dead())
    bench.run(6.0)
    assert "no answer at 9600, 19200, 38400 or 500000 baud" in bench.source.health().last_error
    assert not bench.source.health().good


def rejecting(command: int, reply: Telegram) -> Lms2xxEmulator:
    """A scanner that answers one command with that telegram."""

    class Rejecting(Lms2xxEmulator):
        def _answer(self, given: Telegram) -> None:
            if given.command == command:
                self._queue += [b"\x06", encode(reply._replace(status=0x10, address=0x80))]
            else:
                super()._answer(given)

    return Rejecting(power_on_baud=38400)


@pytest.mark.parametrize(
    ("command", "reply", "reason"),
    [
        (0x74, Telegram(Reply.REJECTED), "rejects its configuration (command 0x74)"),
        (0x3B, Telegram(Reply.VARIANT, bytes(5)), "cannot scan 180 deg in steps of 0.5 deg"),
        (0x77, Telegram(Reply.CONFIG_WRITTEN, b"\x00"), "keeps measuring mode 0x00 and unit 1"),
        (0x74, Telegram(Reply.CONFIG, b"\x00"), "a configuration of 1 bytes, expected 32 or 34"),
        (0x74, Telegram(Reply.CONFIG, bytes([0, 0, 0, 0, 0, 0x3F, 1])), "mode 0x3F has no"),
        (0x20, Telegram(Reply.MODE, b"\x02"), "refuses output on request, code 02"),
    ],
)
def test_a_refusal_is_said_in_words(command: int, reply: Telegram, reason: str) -> None:
    driver = Lms2xx(measuring_mode=4 if command == 0x77 else None)
    bench = Bench(driver, rejecting(command, reply))
    bench.run(0.5)
    assert reason in bench.source.health().last_error
    assert bench.source.latest() is None


def test_scans_of_a_recording_need_a_measuring_mode() -> None:
    words = np.full(361, 1000, "<u2").tobytes()
    scan = Telegram(Reply.SCAN, b"\x69\x41" + words, 0x10, 0x80)
    with pytest.raises(FormatError, match="measuring mode is not known"):
        Overheard(Lms2xx()).value(scan)
    measured = Overheard(Lms2xx(measuring_mode=0)).value(scan)
    assert measured is not None
    assert measured.value.ranges == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"baud": 57600}, "57600 baud; expected one of 9600, 19200, 38400, 500000"),
        ({"unit": "inch"}, "unit 'inch'; expected 'mm' or 'cm'"),
        ({"fov_deg": 360}, "360 deg"),
        ({"measuring_mode": 0x3F}, "measuring mode 0x3F"),
    ],
)
def test_impossible_settings_are_refused(options: dict[str, int | str], reason: str) -> None:
    with pytest.raises(ConfigError) as error:
        Lms2xx(**options)  # type: ignore[arg-type]
    assert reason in str(error.value)
