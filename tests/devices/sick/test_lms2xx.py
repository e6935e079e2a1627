"""Telegrams of the LMS2xx: the bytes of the maker's telegram listing and of real scanners."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.devices.sick.lms2xx import (
    LONGEST,
    Acknowledgement,
    Message,
    Reply,
    Telegram,
    crc,
    decode,
    encode,
    parser,
)
from bearcub.devices.sick.lms2xx_setup import (
    ENTER_INSTALLATION,
    READ_CONFIG,
    READ_TYPE,
    START_CONTINUOUS,
    STOP,
    set_baud,
    set_variant,
)
from bearcub.errors import FormatError

COMMANDS = {
    "status": (Telegram(0x31), "02 00 01 00 31 15 12"),
    "errors": (Telegram(0x32), "02 00 01 00 32 16 12"),
    "type": (READ_TYPE, "02 00 01 00 3A 1E 12"),
    "read configuration": (READ_CONFIG, "02 00 01 00 74 50 12"),
    "reset": (Telegram(0x10), "02 00 01 00 10 34 12"),
    "installation": (ENTER_INSTALLATION, "02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5"),
    "9600": (set_baud(9600), "02 00 02 00 20 42 52 08"),
    "19200": (set_baud(19200), "02 00 02 00 20 41 51 08"),
    "38400": (set_baud(38400), "02 00 02 00 20 40 50 08"),
    "500000": (set_baud(500000), "02 00 02 00 20 48 58 08"),
    "180/1": (set_variant(180, 1.0), "02 00 05 00 3B B4 00 64 00 97 49"),
    "180/0.5": (set_variant(180, 0.5), "02 00 05 00 3B B4 00 32 00 3B 1F"),
    "100/1": (set_variant(100, 1.0), "02 00 05 00 3B 64 00 64 00 1D 0F"),
    "100/0.5": (set_variant(100, 0.5), "02 00 05 00 3B 64 00 32 00 B1 59"),
    "100/0.25": (set_variant(100, 0.25), "02 00 05 00 3B 64 00 19 00 E7 72"),
    "start": (START_CONTINUOUS, "02 00 02 00 20 24 34 08"),
    "stop": (STOP, "02 00 02 00 20 25 35 08"),
    "one scan": (Telegram(0x30, b"\x01"), "02 00 02 00 30 01 31 18"),
    "write configuration": (
        Telegram(0x77, bytes.fromhex("00 00 00 00 00 00 01 00 00 02 02") + bytes(21)),
        "02 00 21 00 77 00 00 00 00 00 00 01 00 00 02 02" + " 00" * 21 + " FC 7E",
    ),
}
REPLIES = {
    "reset": (Telegram(Reply.RESET, b"", 0x10, 0x80), "02 80 02 00 91 10 79 30"),
    "mode, 80": (Telegram(Reply.MODE, b"\x00", 0x10, 0x80), "02 80 03 00 A0 00 10 16 0A"),
    "mode, 81": (Telegram(Reply.MODE, b"\x00", 0x10, 0x81), "02 81 03 00 A0 00 10 36 1A"),
    "power-on": (
        Telegram(Reply.POWER_ON, b"LMS200;301063;V02.06 ", 0x13, 0x81),
        "02 81 17 00 90 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 30 36 20 13 64 5A",
    ),
}
GOLDEN = [pytest.param(*pair, id=name) for name, pair in (COMMANDS | REPLIES).items()]
MODE = bytes.fromhex(REPLIES["mode, 80"][1])
SCAN = encode(Telegram(Reply.SCAN, b"\xb5\x40" + bytes(range(181)) * 2, 0x10, 0x80))


@pytest.mark.parametrize(("telegram", "text"), GOLDEN)
def test_golden_telegrams_are_written_and_read_byte_by_byte(telegram: Telegram, text: str) -> None:
    data = bytes.fromhex(text)
    assert encode(telegram) == data
    assert decode(data) == telegram
    assert parser(from_scanner=telegram.status is not None).feed(data) == [telegram]


def naive_crc(data: bytes) -> int:
    """The definition: one shift a byte, each byte taken in twice."""
    value = before = 0
    for byte in data:
        value = (value << 1 ^ (0x8005 if value & 0x8000 else 0)) & 0xFFFF
        value ^= before << 8 | byte
        before = byte
    return value


@given(st.binary(min_size=1, max_size=LONGEST))
def test_the_crc_by_table_is_the_crc_by_definition(data: bytes) -> None:
    assert crc(data) == naive_crc(data)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("02 80 03 00 A0 00 10 16 0B", "CRC 0x0B16, expected 0x0A16"),
        ("02 80 03 00 A0 01 10 16 0A", "CRC 0x0A16"),
        ("02 80 04 00 A0 00 10 16 0A", "9 bytes, expected 10 as it announces"),
        ("03 80 03 00 A0 00 10 16 0A", "begins with 03 80 03 00, expected STX"),
        ("02 80 03", "begins with 02 80 03, expected STX (02) and 7 bytes or more"),
        ("", "begins with nothing"),
    ],
)
def test_a_damaged_telegram_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(FormatError) as error:
        decode(bytes.fromhex(text))
    assert reason in str(error.value)


def test_a_telegram_longer_than_the_line_allows_is_not_sent() -> None:
    with pytest.raises(FormatError, match="815 bytes, expected at most 814"):
        encode(Telegram(0x77, bytes(808)))


@given(cuts=st.lists(st.integers(0, len(SCAN) + len(MODE) + 1), max_size=12))
def test_telegrams_and_acknowledgements_come_out_whatever_the_pieces(cuts: list[int]) -> None:
    data = b"\x06" + MODE + SCAN
    ends = [0, *sorted(cuts), len(data)]
    found: list[Message] = []
    reader = parser()
    for start, end in itertools.pairwise(ends):
        found += reader.feed(data[start:end])
    assert [m for m in found if isinstance(m, Telegram)] == [decode(MODE), decode(SCAN)]
    assert reader.tally.errors == 0


def test_an_acknowledgement_is_a_telegram_of_one_byte() -> None:
    reader = parser()
    assert reader.feed(b"\x06" + MODE) == [Acknowledgement.ACK, decode(MODE)]
    assert reader.feed(b"\x15") == [Acknowledgement.NAK]
    assert reader.tally.rejected_bytes == 0


@given(garbage=st.binary(max_size=300))
def test_after_garbage_the_next_whole_telegram_is_found_at_once(garbage: bytes) -> None:
    reader = parser()
    found = reader.feed(garbage)
    found += reader.feed(MODE + SCAN)
    assert found[-1] == decode(SCAN)  # the garbage may have taken a part of the first


@pytest.mark.parametrize("cut", range(1, len(SCAN) - 1, 7))
def test_a_telegram_that_was_cut_off_does_not_hide_the_next(cut: int) -> None:
    reader = parser()
    reader.feed(SCAN[:cut])
    assert reader.feed(MODE)[-1] == decode(MODE)
    assert reader.tally.rejected_bytes == cut


def test_a_wrong_crc_is_counted_and_costs_one_telegram() -> None:
    reader = parser()
    bad = SCAN[:100] + bytes([SCAN[100] ^ 4]) + SCAN[101:]
    found = [m for m in reader.feed(SCAN + bad + SCAN) if isinstance(m, Telegram)]
    assert found == [decode(SCAN), decode(SCAN)]
    assert dict(reader.tally.reasons) == {"wrong CRC": 1}
    assert reader.tally.rejected_bytes == len(bad)


def test_stx_inside_a_telegram_is_no_beginning() -> None:
    inside = encode(Telegram(Reply.SCAN, b"\x06\x40" + b"\x02\x80\x03\x00\xa0\x00" * 2, 0x10, 0x80))
    reader = parser()
    for at in range(len(inside) - 1):
        assert reader.feed(inside[at : at + 1]) == []
    assert reader.feed(inside[-1:]) == [decode(inside)]


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (0x10, ""),
        (0x12, "warning"),
        (0x13, "error"),
        (0x14, "fatal error"),
        (0x91, "information, the front window is dirty"),
        (0x50, "measured values are implausible"),
    ],
)
def test_the_status_byte_says_what_is_wrong_in_words(status: int, words: str) -> None:
    assert Telegram(Reply.SCAN, b"", status).fault == words
