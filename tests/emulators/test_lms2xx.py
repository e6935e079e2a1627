"""The emulated LMS2xx answers with the real one's bytes, in the time that its line takes."""

import os
import select

import numpy as np
import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.link import SerialLink
from bearcub.devices.sick import Lms2xx
from bearcub.devices.sick.lms2xx import Reply, Telegram, decode, encode, parser
from bearcub.devices.sick.lms2xx_scan import Lms2xxSetting, decode_scan
from bearcub.devices.sick.lms2xx_setup import (
    ENTER_INSTALLATION,
    READ_CONFIG,
    READ_TYPE,
    START_CONTINUOUS,
    STOP,
    set_baud,
    set_variant,
)
from bearcub.devices.stream import Streaming
from bearcub.emulators import PtyHost
from bearcub.emulators.lms2xx import Lms2xxEmulator
from bearcub.messages import Scan

SECOND = 10**9
MODE_REPLY = "06 02 80 03 00 a0 00 10 16 0a"


def answer(scanner: Lms2xxEmulator, sent: Telegram | str, *, now: float = 1.0) -> bytes:
    """What a second on the line brings."""
    scanner.poll(round(now * SECOND))
    scanner.receive(bytes.fromhex(sent) if isinstance(sent, str) else encode(sent))
    scanner.poll(round(now * SECOND))
    return scanner.poll(round((now + 1.0) * SECOND))


@pytest.mark.parametrize(
    ("sent", "reply"),
    [
        ("02 00 02 00 20 25 35 08", MODE_REPLY),
        ("02 00 02 00 20 24 34 08", MODE_REPLY),
        ("02 00 02 00 20 48 58 08", MODE_REPLY),
        ("02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5", MODE_REPLY),
        ("02 00 02 00 20 25 35 09", "15"),  # wrong CRC
        ("02 00 01 00 10 34 12", "06 02 80 02 00 91 10 79 30"),
    ],
)
def test_golden_commands_get_golden_replies(sent: str, reply: str) -> None:
    scanner = Lms2xxEmulator()
    found = answer(scanner, sent)
    assert found[: len(bytes.fromhex(reply))].hex(" ") == reply


def test_the_other_reply_address_is_golden_too() -> None:
    assert answer(Lms2xxEmulator(address=0x81), STOP).hex(" ") == "06 02 81 03 00 a0 00 10 36 1a"


def reply_to(scanner: Lms2xxEmulator, sent: Telegram) -> Telegram:
    found = answer(scanner, sent)
    assert found[:1] == b"\x06"
    return decode(found[1:])


def test_it_says_what_it_is() -> None:
    scanner = Lms2xxEmulator(model="LMS291;30107x;V02.10", measuring_mode=4, unit=0)
    assert reply_to(scanner, READ_TYPE).data == b"LMS291;30107x;V02.10"
    config = reply_to(scanner, READ_CONFIG)
    assert (len(config.data), config.data[5], config.data[6]) == (34, 4, 0)
    assert len(answer(scanner, Telegram(0x31))) == 161  # as a real unit's, with the ACK
    assert reply_to(scanner, Telegram(0x55)).command == Reply.REJECTED


@pytest.mark.parametrize(
    ("fov_deg", "resolution_deg", "length"),
    [(100, 1.0, 212), (180, 1.0, 372), (100, 0.5, 412), (180, 0.5, 732), (100, 0.25, 812)],
)
def test_scans_are_as_long_as_the_telegram_listing_says(
    fov_deg: int, resolution_deg: float, length: int
) -> None:
    scanner = Lms2xxEmulator()
    assert reply_to(scanner, set_variant(fov_deg, resolution_deg)).data[0] == 1
    scan = answer(scanner, Telegram(0x30, b"\x01"))[1:]
    assert len(scan) == length
    setting = Lms2xxSetting(fov_deg=fov_deg, resolution_deg=resolution_deg)
    assert np.isfinite(decode_scan(decode(scan), setting).ranges).all()


def test_a_variant_that_does_not_exist_is_refused() -> None:
    scanner = Lms2xxEmulator()
    assert reply_to(scanner, set_variant(180, 0.25)).data == b"\x00\xb4\x00\x32\x00"


def test_the_configuration_is_written_in_installation_mode_only() -> None:
    scanner = Lms2xxEmulator()
    write = Telegram(0x77, bytes([0, 0, 0, 0, 0, 4, 0]) + bytes(27))
    assert reply_to(scanner, write).command == Reply.REJECTED
    assert reply_to(scanner, Telegram(0x20, b"\x00SICK_LMX")).data == b"\x01"
    assert reply_to(scanner, write).command == Reply.REJECTED
    assert reply_to(scanner, ENTER_INSTALLATION).data == b"\x00"
    assert reply_to(scanner, write).command == Reply.CONFIG_WRITTEN
    assert reply_to(scanner, READ_CONFIG).data[5] == 4


def test_the_speed_changes_after_the_reply_at_the_old_one() -> None:
    scanner = Lms2xxEmulator()
    found = answer(scanner, set_baud(38400))
    assert found.hex(" ") == MODE_REPLY
    assert scanner.baud == 9600
    scanner.poll(3 * SECOND)
    assert scanner.baud == 38400


@pytest.mark.parametrize(("baud", "scans"), [(9600, 12), (38400, 47), (500000, 375)])
def test_the_line_limits_the_rate(baud: int, scans: int) -> None:
    """In ten seconds; a real scanner at 38400 baud was seen to send 4.7 scans a second."""
    scanner = Lms2xxEmulator(power_on_baud=baud)
    answer(scanner, START_CONTINUOUS)
    sent = b"".join(scanner.poll(2 * SECOND + ms * 10**6) for ms in range(0, 10_000, 2))
    found = [m for m in parser().feed(sent) if isinstance(m, Telegram)]
    assert len(found) == pytest.approx(scans, abs=1)


def test_a_telegram_takes_ten_bits_a_byte() -> None:
    scanner = Lms2xxEmulator()
    scanner.poll(0)
    scanner.receive(encode(STOP))
    times = [us for us in range(0, 20_000, 10) if scanner.poll(us * 1000)]
    # One byte of acknowledgement, then nine of the reply, at 9600 baud.
    assert times == pytest.approx([1042, 10417], abs=10)


def test_it_hears_nothing_while_it_boots_and_then_says_what_it_is() -> None:
    scanner = Lms2xxEmulator(power_on_baud=38400)
    answer(scanner, START_CONTINUOUS)
    scanner.restart()
    scanner.receive(encode(STOP))
    assert scanner.poll(2 * SECOND) == b""
    scanner.poll(3 * SECOND)
    said = decode(scanner.poll(4 * SECOND))
    assert (said.command, said.data) == (Reply.POWER_ON, b"LMS200;30106x;V02.10 ")
    assert scanner.poll(5 * SECOND) == b""  # it does not stream any more


@pytest.mark.parametrize("value", [-np.inf, np.nan, np.inf, 0.02, 8.1, 20.0])
def test_what_it_measures_is_what_the_driver_reads(value: float) -> None:
    scanner = Lms2xxEmulator(lambda _, angles: np.full(len(angles), value))
    scan = answer(scanner, Telegram(0x30, b"\x01"))[1:]
    expected = np.inf if value == 20.0 else value  # beyond 8.182 m
    ranges = decode_scan(decode(scan), Lms2xxSetting()).ranges
    assert ranges == pytest.approx(np.full(361, expected), nan_ok=True)


def test_the_driver_finds_it_on_a_real_pty_and_reads_it() -> None:
    clock = MonotonicClock()
    driver = Lms2xx(baud=500000)
    with PtyHost(Lms2xxEmulator(), clock=clock) as host:
        link = SerialLink(host.path, baud=9600)
        source: Streaming[Scan] = Streaming(
            link, driver, clock=clock, rate_hz=driver.rate_hz, role="ladar"
        )
        end_ns = clock.now_ns() + 8 * SECOND
        while source.health().values < 5 and clock.now_ns() < end_ns:
            source.step()
        reading = source.latest()
        assert reading is not None
        assert reading.value.ranges[180] == pytest.approx(4.0)
        source.close()


def test_at_another_speed_a_pty_carries_garbage_only() -> None:
    with PtyHost(Lms2xxEmulator(power_on_baud=500000), clock=MonotonicClock()) as host:
        port = os.open(host.path, os.O_RDWR | os.O_NOCTTY)  # at 38400 baud
        try:
            os.write(port, encode(STOP))
            assert not select.select([port], [], [], 0.1)[0]
        finally:
            os.close(port)
