"""The CoLa driver talks to an emulated scanner, step by step and without waiting."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.devices.sick import Cola, Dialect, Sweep
from bearcub.devices.sick.cola import Message, encode, parser
from bearcub.devices.sick.cola_fields import Field
from bearcub.devices.sick.cola_setup import Access, Echo
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.cola import COLA_FAULTS, LMS1XX, ColaEmulator
from bearcub.errors import ConfigError
from bearcub.messages import Scan

A, B = Dialect.A, Dialect.B
FRONT = Sweep(start_deg=-90, stop_deg=90, step_deg=0.5, scan_hz=50)


class Watched(ColaEmulator):
    """A scanner that notes what it is told, and can be told what to answer."""

    def __init__(
        self,
        *,
        answers: dict[str, tuple[Field, ...] | int] | None = None,
        dialect: Dialect = B,
        sweep: Sweep = LMS1XX,
        spin_up: float = 0.0,
    ) -> None:
        super().__init__(dialect=dialect, sweep=sweep, spin_up=spin_up)
        self.heard: list[str] = []
        self._given = answers or {}

    def _answer(self, message: Message) -> None:
        self.heard.append(f"{message.kind} {message.name}")
        given = self._given.get(message.name)
        if given is None:
            super()._answer(message)
        elif isinstance(given, int):
            self._pending += encode("sFA", "", ("u8", given), dialect=message.dialect)
        else:
            kind = {"sRN": "sRA", "sWN": "sWA", "sMN": "sAN", "sEN": "sEA"}[message.kind]
            self._pending += encode(kind, message.name, *given, dialect=message.dialect)


@dataclass
class Bench:
    """A driver and its scanner; time passes when it is told to."""

    driver: Cola
    scanner: Emulator
    clock: ManualClock = field(default_factory=ManualClock)

    def __post_init__(self) -> None:
        self.link = DirectLink(self.scanner, clock=self.clock, wait=self.clock.advance)
        self.source: Streaming[Scan] = Streaming(
            self.link, self.driver, clock=self.clock, rate_hz=15.0, role="ladar"
        )

    def run(self, seconds: float) -> None:
        end_ns = self.clock.now_ns() + seconds * 1e9
        while self.clock.now_ns() < end_ns:
            self.clock.advance(self.source.step() or 1e-6)

    def first_scan(self) -> Scan:
        """Run until a scan newer than now has come; return it."""
        start_ns = self.clock.now_ns()
        while self.clock.now_ns() - start_ns < 20e9:
            self.clock.advance(self.source.step() or 1e-6)
            reading = self.source.latest()
            if reading and reading.stamp_ns > start_ns:
                return reading.value
        raise AssertionError(self.source.health())

    @property
    def last_error(self) -> str:
        return self.source.health().last_error

    @property
    def now(self) -> float:
        return self.clock.now_ns() * 1e-9


def test_the_start_up_sequence_is_that_of_the_makers_driver() -> None:
    scanner = Watched()
    bench = Bench(Cola(), scanner)
    scan = bench.first_scan()
    assert scanner.heard == [
        "sRN DeviceIdent",
        "sMN SetAccessMode",
        "sRN DeviceIdent",
        "sRN SCdevicestate",
        "sWN LMDscandatacfg",
        "sMN LMCstartmeas",
        "sMN Run",
        "sRN STlms",
        "sEN LMDscandata",
    ]
    assert len(scan) == 1081
    assert scan.ranges[540] == pytest.approx(4.0)
    assert scan.intensities is None
    assert bench.driver.identity == "TiM781S V2.80"
    assert bench.source.health().errors == 0


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize(("wanted", "spoken"), [(B, A), (A, B), (A, A), (B, B)])
def test_the_dialect_is_changed_where_it_can_be_and_spoken_where_it_cannot(
    wanted: Dialect, spoken: Dialect, *, fixed: bool
) -> None:
    sent = []

    class Recorded(ColaEmulator):
        def poll(self, now_ns: int) -> bytes:
            data = super().poll(now_ns)
            sent.append(data)
            return data

    bench = Bench(Cola(dialect=wanted), Recorded(dialect=spoken, fixed_dialect=fixed))
    bench.first_scan()
    last = [message for message in parser().feed(b"".join(sent)) if message.kind == "sSN"][-1]
    assert last.dialect is (spoken if fixed else wanted)
    if wanted is not spoken:
        assert f"changes from {spoken.value} to {wanted.value}" in bench.last_error


def test_a_sweep_that_is_asked_for_is_set_once() -> None:
    scanner = Watched()
    bench = Bench(Cola(sweep=FRONT, remission=True, echo=Echo.FIRST), scanner)
    scan = bench.first_scan()
    assert np.rad2deg(scan.angles[[0, 180, 360]]) == pytest.approx([-90.0, 0.0, 90.0])
    assert scan.intensities is not None
    assert {"sMN LMCstopmeas", "sMN mLMPsetscancfg", "sWN LMPoutputRange"} <= set(scanner.heard)
    assert "sWN FREchoFilter" in scanner.heard
    bench.run(3.0)
    assert bench.source.health().rate_hz == pytest.approx(50.0, rel=0.02)
    scanner.heard.clear()
    bench.link.plugged = False
    bench.run(1.0)
    bench.link.plugged = True
    bench.first_scan()
    assert "sMN mLMPsetscancfg" not in scanner.heard
    assert "sWN LMPoutputRange" not in scanner.heard
    assert "sMN LMCstopmeas" not in scanner.heard  # the mirror went on turning


def test_a_scanner_that_spins_up_is_waited_for() -> None:
    bench = Bench(Cola(sweep=FRONT), Watched(spin_up=8.0))
    bench.run(7.5)
    assert bench.source.latest() is None
    assert bench.source.health().errors == 0
    bench.first_scan()
    assert 8.0 < bench.now < 8.5


def test_the_stamp_is_when_the_scanner_measured() -> None:
    bench = Bench(Cola(), ColaEmulator())
    bench.first_scan()
    reading = bench.source.latest()
    assert reading is not None
    assert reading.age == pytest.approx(0.006, abs=1e-4)  # the emulated scanner's delay


def test_telegrams_that_never_came_are_counted() -> None:
    class Losing(ColaEmulator):
        def poll(self, now_ns: int) -> bytes:
            data = super().poll(now_ns)
            return b"" if 1.0e9 < now_ns < 1.19e9 and len(data) > 1000 else data

    bench = Bench(Cola(), Losing())
    bench.run(3.0)
    assert bench.source.health().drops == 3


def test_the_farewell_ends_the_stream() -> None:
    scanner = Watched()
    bench = Bench(Cola(), scanner)
    bench.first_scan()
    bench.source.close()
    scanner.poll(bench.clock.now_ns())
    assert scanner.heard[-1] == "sEN LMDscandata"
    assert scanner.poll(bench.clock.now_ns() + 10**9) == b""


@pytest.mark.parametrize(
    ("answers", "reason"),
    [
        ({"SetAccessMode": (("u8", 0),)}, "refuses the login as client; its password was changed"),
        ({"LMDscandatacfg": 0x0A}, "refuses sWN LMDscandatacfg: error A: writing the variable"),
        ({"Run": 0x0D}, "refuses sMN Run: error D: it is still busy with the method"),
        ({"SCdevicestate": (("u8", 2),)}, "reports an error (SCdevicestate 2)"),
        ({"mLMPsetscancfg": (("u8", 1),)}, "cannot scan at 50 Hz in steps of 0.5 deg"),
        ({"LMPscancfg": ()}, "answers sRA LMPscancfg b'': CoLa telegram: ends after 0 bytes"),
        ({"LMDscandata": (("u8", 0),)}, "does not start to send"),
    ],
)
@pytest.mark.parametrize("dialect", [A, B])
def test_a_refusal_is_said_in_words(
    answers: dict[str, tuple[Field, ...] | int], reason: str, dialect: Dialect
) -> None:
    bench = Bench(Cola(sweep=FRONT, dialect=dialect), Watched(answers=answers, dialect=dialect))
    bench.run(0.3)
    expected = reason.replace("ends after 0 bytes", "ends before") if dialect is A else reason
    assert expected in bench.last_error
    assert bench.source.latest() is None


def test_commands_that_a_model_does_not_know_are_left_out() -> None:
    unknown: dict[str, tuple[Field, ...] | int] = dict.fromkeys(
        ("DeviceIdent", "SCdevicestate", "LMCstartmeas", "STlms"), 3
    )
    bench = Bench(Cola(), Watched(answers=unknown))
    bench.first_scan()
    assert bench.driver.identity == ""
    assert bench.source.health().errors == 0


def test_a_scanner_that_stays_busy_is_given_up_and_named() -> None:
    bench = Bench(Cola(), Watched(answers={"SCdevicestate": (("u8", 0),)}))
    bench.run(31.5)
    assert "SCdevicestate is 0 after 30 s, expected 1" in bench.last_error


def test_commands_are_repeated_until_they_are_answered() -> None:
    on = True
    bench = Bench(Cola(), COLA_FAULTS["refused"](ColaEmulator(), lambda _: on))
    bench.run(2.3)
    assert bench.source.latest() is None
    assert "error D: it is still busy" in bench.last_error
    on = False
    start = bench.now
    bench.first_scan()
    assert bench.now - start < 2.0


def test_a_port_where_nobody_speaks_cola_is_named_with_what_to_check() -> None:
    class Mute(ColaEmulator):
        def receive(self, data: bytes) -> None:
            """Hear nothing."""

    bench = Bench(Cola(), Mute())
    bench.run(3.5)
    assert "no answer in CoLa-A or CoLa-B; check that the port is 2111 or 2112" in bench.last_error


@pytest.mark.parametrize("access", [Access.SERVICE, Access.SAFETY_CLIENT])
def test_other_users_can_log_in(access: Access) -> None:
    bench = Bench(Cola(access=access), ColaEmulator())
    assert len(bench.first_scan()) == 811


@pytest.mark.parametrize(
    ("start", "stop", "step"), [(10, -10, 1.0), (0, 0, 1.0), (-90, 90, 0.0), (-200, 200, 1.0)]
)
def test_a_sweep_without_beams_is_refused(start: float, stop: float, step: float) -> None:
    with pytest.raises(ConfigError, match="expected start_deg < stop_deg and a positive step"):
        Sweep(start_deg=start, stop_deg=stop, step_deg=step)
