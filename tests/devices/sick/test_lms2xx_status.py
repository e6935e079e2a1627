"""What an LMS2xx says of itself: the places of the bytes in its status, and its errors."""

import pytest

from bearcub.devices.sick.lms2xx import Reply, Telegram, encode, parser
from bearcub.devices.sick.lms2xx_status import decode_errors, decode_status
from bearcub.emulators.lms2xx import Lms2xxEmulator
from bearcub.errors import FormatError


def status(changes: dict[int, bytes], *, length: int = 152) -> Telegram:
    """A status whose bytes count from the command B1 at 0, as the manual counts them."""
    payload = bytearray(1 + length)
    for place, found in {1: b"V02.10 ", 8: b"\x25", **changes}.items():
        payload[place : place + len(found)] = found
    return Telegram(Reply.STATUS, bytes(payload[1:]), 0x10, 0x80)


def test_every_byte_of_a_status_has_its_place() -> None:
    found = decode_status(
        status(
            {
                102: b"\x04",
                107: b"\x64\x00",
                109: b"\x19\x00",
                116: b"\x01\x80",
                119: b"\x01",
                122: b"\x01",
            }
        )
    )
    assert (found.firmware, found.mode, found.defective) == ("V02.10", 0x25, False)
    assert str(found.settings) == (
        "100° in steps of 0.25°, mm, measuring mode 0x04, 500000 baud, kept without power"
    )


@pytest.mark.parametrize(
    ("word", "baud"), [(0x8067, 9600), (0x8033, 19200), (0x8019, 38400), (0x8001, 500000)]
)
def test_speeds_are_told_by_their_divisors(word: int, baud: int) -> None:
    settings = decode_status(status({116: word.to_bytes(2, "little")})).settings
    assert settings is not None
    assert settings.baud == baud


def test_what_is_not_known_is_said_to_be_so() -> None:
    settings = decode_status(status({116: b"\x77\x77", 122: b"\x09"})).settings
    assert settings is not None
    assert (settings.baud, settings.unit) == (None, "unit 9")
    assert "an unknown speed" in str(settings)


def test_a_fault_is_seen_and_the_short_layout_has_no_settings() -> None:
    found = decode_status(status({9: b"\x01"}, length=146))
    assert (found.defective, found.settings, found.firmware) == (True, None, "V02.10")


def test_errors_come_in_pairs() -> None:
    assert decode_errors(Telegram(Reply.ERRORS, bytes([1, 2, 3, 40]))) == ((1, 2), (3, 40))
    assert decode_errors(Telegram(Reply.ERRORS)) == ()


@pytest.mark.parametrize(
    "telegram", [Telegram(Reply.SCAN, bytes(152)), Telegram(Reply.STATUS, bytes(100))]
)
def test_anything_else_is_refused(telegram: Telegram) -> None:
    with pytest.raises(FormatError, match="expected a status"):
        decode_status(telegram)
    with pytest.raises(FormatError, match="expected errors"):
        decode_errors(telegram._replace(data=b"123"))


def test_on_the_wire_a_status_and_its_acknowledgement_take_161_bytes() -> None:
    """That was measured on a real LMS200."""
    scanner = Lms2xxEmulator()
    scanner.receive(encode(Telegram(0x31)))
    scanner.poll(0)
    sent = scanner.poll(10**9)
    assert (sent[:1], len(sent)) == (b"\x06", 161)
    _, telegram = parser().feed(sent)
    assert isinstance(telegram, Telegram)
    assert str(decode_status(telegram).settings) == (
        "180° in steps of 0.5°, mm, measuring mode 0x00, 9600 baud"
    )
