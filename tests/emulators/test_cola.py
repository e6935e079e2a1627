"""The emulated CoLa scanner answers in its own dialect, to who has logged in."""

import numpy as np
import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.link import TcpLink
from bearcub.devices.sick import Cola, Dialect
from bearcub.devices.sick.cola import Message, encode, fields_of, parser
from bearcub.devices.sick.cola_fields import Field
from bearcub.devices.sick.cola_scan import decode_scan_data, to_scan
from bearcub.devices.stream import Streaming
from bearcub.emulators import TcpHost
from bearcub.emulators.cola import LMS1XX, ColaEmulator
from bearcub.messages import Scan

SECOND = 10**9
A, B = Dialect.A, Dialect.B


def answer(
    scanner: ColaEmulator, command: str, *fields: Field, dialect: Dialect = B
) -> list[Message]:
    kind, name = command.split()
    scanner.receive(encode(kind, name, *fields, dialect=dialect))
    return parser().feed(scanner.poll(SECOND))


def log_in(scanner: ColaEmulator, password: int = 0xF4724744, dialect: Dialect = B) -> int:
    (message,) = answer(scanner, "sMN SetAccessMode", ("u8", 3), ("u32", password), dialect=dialect)
    return fields_of(message).number("u8", "result")


def test_golden_commands_get_golden_answers() -> None:
    scanner = ColaEmulator()
    scanner.receive(encode("sRN", "SCdevicestate", dialect=B))
    assert scanner.poll(0).hex() == "0202020200000013735241205343646576696365737461746520011e"
    scanner = ColaEmulator(dialect=A)
    scanner.receive(b"\x02sMN SetAccessMode 3 F4724744\x03")
    assert scanner.poll(0) == b"\x02sAN SetAccessMode 1\x03"
    scanner.receive(b"\x02sMN LMCstartmeas\x03\x02sMN Run\x03\x02sEN LMDscandata 1\x03")
    assert (
        scanner.poll(1) == b"\x02sAN LMCstartmeas 0\x03\x02sAN Run 1\x03\x02sEA LMDscandata 1\x03"
    )


@pytest.mark.parametrize("dialect", [A, B])
def test_a_scan_is_what_the_beams_measure(dialect: Dialect) -> None:
    def beams(_: int, angles: np.ndarray[tuple[int], np.dtype[np.float64]]) -> object:
        ranges = np.where(angles > 0, 3.0, np.inf)
        ranges[0] = -np.inf
        return ranges

    scanner = ColaEmulator(beams, sweep=LMS1XX, dialect=dialect)  # type: ignore[arg-type]
    (message,) = answer(scanner, "sRN LMDscandata", dialect=dialect)
    data = decode_scan_data(message)
    assert data.scan_hz == 25.0
    scan = to_scan(data)
    assert np.rad2deg(scan.angles[[0, 540, 1080]]) == pytest.approx([-135.0, 0.0, 135.0])
    assert scan.ranges[[0, 1, 540]].tolist() == [-np.inf, np.inf, np.inf]
    assert scan.ranges[541:] == pytest.approx(3.0)


def test_it_hears_only_the_dialect_that_it_is_set_to() -> None:
    scanner = ColaEmulator(dialect=A)
    assert answer(scanner, "sRN DeviceIdent", dialect=B) == []
    assert log_in(scanner, dialect=A) == 1
    answer(scanner, "sWN EIHstCola", ("u8", 1), dialect=A)
    assert answer(scanner, "sRN DeviceIdent", dialect=B) == []  # on this connection
    scanner.connect()
    assert answer(scanner, "sRN DeviceIdent", dialect=B) != []


@pytest.mark.parametrize(
    ("command", "fields"),
    [
        ("sMN LMCstopmeas", ()),
        ("sWN EIHstCola", (("u8", 1),)),
        ("sWN LMPoutputRange", (("u16", 1), ("u32", 3333), ("i32", 0), ("i32", 900_000))),
        ("sWN FREchoFilter", (("u8", 0),)),
    ],
)
def test_settings_need_a_login_that_run_and_a_new_connection_end(
    command: str, fields: tuple[Field, ...]
) -> None:
    scanner = ColaEmulator()

    def error() -> str:
        (message,) = answer(scanner, command, *fields)
        return message.error[:7]

    assert error() == "error A"
    assert log_in(scanner, password=1) == 0
    assert error() == "error A"
    assert log_in(scanner) == 1
    assert error() == ""
    answer(scanner, "sMN Run")
    assert error() == "error A"
    log_in(scanner)
    scanner.connect()
    assert error() == "error A"


@pytest.mark.parametrize(
    ("command", "fields", "error"),
    [
        ("sRN Nothing", (), "error 3"),
        ("sWN LMPoutputRange", (("u16", 1),), "error 5"),
        (
            "sWN LMPoutputRange",
            (("u16", 1), ("u32", 3333), ("i32", 900_000), ("i32", 0)),
            "error 5",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_the_error_of_the_list(
    command: str, fields: tuple[Field, ...], error: str
) -> None:
    scanner = ColaEmulator()
    log_in(scanner)
    (message,) = answer(scanner, command, *fields)
    assert message.error.startswith(error)


def test_it_streams_at_its_rate_to_who_asked_and_counts() -> None:
    scanner = ColaEmulator()
    assert scanner.poll(SECOND) == b""
    answer(scanner, "sEN LMDscandata", ("u8", 1))
    sent = b"".join(scanner.poll(SECOND + ms * 10**6) for ms in range(2002))
    scans = [decode_scan_data(message) for message in parser().feed(sent)]
    assert len(scans) == 30
    counters = [scan.telegram_counter for scan in scans]
    assert counters == list(range(counters[0], counters[0] + 30))
    assert len(sent) // 30 in range(3350, 3380)  # 3374 with the time, as a real TiM781S


def test_the_driver_reads_it_over_real_tcp() -> None:
    clock = MonotonicClock()
    with TcpHost(ColaEmulator(), clock=clock) as host:
        source: Streaming[Scan] = Streaming(
            TcpLink("127.0.0.1", host.port), Cola(), clock=clock, rate_hz=15.0, role="ladar"
        )
        end_ns = clock.now_ns() + 5 * SECOND
        while source.health().values < 3 and clock.now_ns() < end_ns:
            source.step()
        reading = source.latest()
        assert reading is not None
        assert reading.value.ranges[405] == pytest.approx(4.0)
        source.close()
