"""CoLa telegrams in both dialects: the maker's bytes, a recorded session, damage of all kinds."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.devices.sick.cola import (
    ERRORS,
    Dialect,
    Message,
    decode,
    encode,
    fields_of,
    parser,
    wrap,
)
from bearcub.devices.sick.cola_fields import BinaryFields, Field, TextFields
from bearcub.devices.sick.cola_setup import Access, Cola, content_fields
from bearcub.errors import FormatError

A, B = Dialect.A, Dialect.B
SESSION = (
    Path(__file__).parents[3] / ".." / "shared" / "data" / "sick" / "rms1xxx_colaa_session.json"
)

LOGIN: tuple[Field, ...] = (("u8", 3), ("u32", 0xF4724744))
GOLDEN = [
    ("sRN LMDscandata", (), "02020202 0000000F 73524E204C4D447363616E64617461 05"),
    (
        "sEN LMDscandata",
        (("u8", 1),),
        "02020202 00000011 73454E204C4D447363616E6461746120 01 33",
    ),
    (
        "sEN LMDscandata",
        (("u8", 0),),
        "02020202 00000011 73454E204C4D447363616E6461746120 00 32",
    ),
    (
        "sMN SetAccessMode",
        LOGIN,
        f"02020202 00000017 {b'sMN SetAccessMode '.hex()} 03 F4724744 B3",
    ),
    ("sMN Run", (), f"02020202 00000007 {b'sMN Run'.hex()} 19"),
    ("sMN LMCstartmeas", (), f"02020202 00000010 {b'sMN LMCstartmeas'.hex()} 68"),
    ("sMN LMCstopmeas", (), f"02020202 0000000F {b'sMN LMCstopmeas'.hex()} 10"),
    ("sWN EIHstCola", (("u8", 1),), f"02020202 0000000F {b'sWN EIHstCola '.hex()} 01 09"),
    ("sRN SCdevicestate", (), f"02020202 00000011 {b'sRN SCdevicestate'.hex()} 30"),
    ("sRA SCdevicestate", (("u8", 1),), f"02020202 00000013 {b'sRA SCdevicestate '.hex()} 01 1E"),
    ("sRN DeviceIdent", (), f"02020202 0000000F {b'sRN DeviceIdent'.hex()} 25"),
    ("sRN FirmwareVersion", (), f"02020202 00000013 {b'sRN FirmwareVersion'.hex()} 24"),
    ("sRN LMPoutputRange", (), f"02020202 00000012 {b'sRN LMPoutputRange'.hex()} 5E"),
    ("sRN LMDscandatacfg", (), f"02020202 00000012 {b'sRN LMDscandatacfg'.hex()} 67"),
    (
        "sWN LMDscandatacfg",
        content_fields(remission=True, wide=False, time=True),
        f"02020202 00000020 {b'sWN LMDscandatacfg '.hex()} 0100 01 00 00 0000 00 00 00 01 0001 42",
    ),
]


@pytest.mark.parametrize(("command", "fields", "text"), GOLDEN)
def test_golden_binary_telegrams_are_written_and_read_byte_by_byte(
    command: str, fields: tuple[Field, ...], text: str
) -> None:
    kind, name = command.split()
    data = bytes.fromhex(text)
    assert encode(kind, name, *fields, dialect=B) == data
    message = decode(data)
    assert (message.kind, message.name, message.dialect) == (kind, name, B)
    reader = fields_of(message)
    for format_, value in fields:
        plain = {"x8": "u8", "d16": "u16"}.get(format_, format_)
        assert reader.number(plain, "it") == value
    assert parser().feed(data) == [message]


@pytest.mark.parametrize(
    ("command", "fields", "text"),
    [
        ("sMN SetAccessMode", LOGIN, "sMN SetAccessMode 3 F4724744"),
        (
            "sWN LMDscandatacfg",
            content_fields(remission=True),
            "sWN LMDscandatacfg 01 00 1 1 0 00 00 0 0 0 0 +1",
        ),
        (
            "sWN LMPoutputRange",
            (("u16", 1), ("u32", 3333), ("i32", -450_000), ("i32", 2_250_000)),
            "sWN LMPoutputRange 1 D05 FFF92230 225510",
        ),
        (
            "sMN mLMPsetscancfg",
            (("u32", 5000), ("d16", 1), ("u32", 5000), ("i32", -450_000), ("i32", 2_250_000)),
            "sMN mLMPsetscancfg 1388 +1 1388 FFF92230 225510",
        ),
    ],
)
def test_golden_text_telegrams_are_written_and_read_byte_by_byte(
    command: str, fields: tuple[Field, ...], text: str
) -> None:
    kind, name = command.split()
    data = b"\x02" + text.encode() + b"\x03"
    assert encode(kind, name, *fields, dialect=A) == data
    reader = fields_of(decode(data))
    for format_, value in fields:
        plain = {"x8": "u8", "d16": "u16"}.get(format_, format_)
        assert reader.number(plain, "it") == value


def session() -> list[bytes]:
    if not SESSION.exists():
        pytest.skip(f"needs the recorded session {SESSION.name}")
    entries = json.loads(SESSION.read_text(encoding="utf-8"))
    payloads = [entry["_source"]["layers"]["tcp"]["tcp.payload"] for entry in entries]
    return [bytes.fromhex(payload.replace(":", "")) for payload in payloads]


def test_a_recorded_session_is_understood_in_both_directions() -> None:
    recorded = session()
    messages = [decode(data) for data in recorded]
    assert parser().feed(b"".join(recorded)) == messages
    assert len(messages) == len(recorded) > 30
    assert {m.dialect for m in messages} == {A}
    by_name = {(m.kind, m.name): m for m in messages}
    assert fields_of(by_name["sAN", "SetAccessMode"]).number("u8", "result") == 1
    version = fields_of(by_name["sRA", "FirmwareVersion"])
    assert version.characters(version.number("u16", "length"), "version") == "1.5.1.115R"
    assert recorded[2] == encode("sMN", "SetAccessMode", ("u8", 3), ("u32", 0xF4724744), dialect=A)
    assert [by_name["sAN", "Run"].arguments, by_name["sEA", "LMDradardata"].arguments] == [b"1"] * 2
    assert messages[-1].name == "LMDradardata"


def test_the_driver_logs_in_with_the_bytes_of_the_recorded_session() -> None:
    driver = Cola(dialect=A)
    steps = driver.conversation()
    step = next(steps)
    step = steps.send(Message("sRA", "DeviceIdent", b"", A))
    login, accepted = session()[2:4]
    assert getattr(step, "data") == login  # noqa: B009 (a pause has none)
    following = steps.send(decode(accepted))
    assert b"sRN DeviceIdent" in getattr(following, "data")  # noqa: B009


@pytest.mark.parametrize("code", ERRORS)
def test_an_error_is_said_in_words_in_both_dialects(code: int) -> None:
    text = decode(b"\x02sFA %X\x03" % code)
    binary = decode(wrap(b"sFA " + bytes([code])))
    wide = decode(wrap(b"sFA" + code.to_bytes(2, "big")))
    assert text.error == binary.error == wide.error == f"error {code:X}: {ERRORS[code]}"


def test_an_error_that_is_not_in_the_list_is_still_said() -> None:
    assert decode(b"\x02sFA 7F\x03").error == "error 7F: not in the list of errors"
    assert decode(b"\x02sFA ?\x03").error == "error b'?'"
    assert decode(b"\x02sRA STlms 7\x03").error == ""


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (bytes.fromhex("02020202 00000007") + b"sMN Run\x18", "checksum 0x18, expected 0x19"),
        (bytes.fromhex("02020202 00000008") + b"sMN Run\x19", "16 bytes that begin with 02 02 02"),
        (wrap(b"hello"), "no CoLa command"),
        (b"\x02sXX Run\x03", "no CoLa command"),
        (b"\x02sMN Run", "expected STX"),
        (b"sMN Run\x03", "expected STX"),
        (b"", "0 bytes"),
    ],
)
def test_a_damaged_telegram_is_refused_with_the_reason(data: bytes, reason: str) -> None:
    with pytest.raises(FormatError) as error:
        decode(data)
    assert reason in str(error.value)


@pytest.mark.parametrize("dialect", [A, B])
def test_what_ends_too_early_or_is_no_number_is_refused_with_its_name(dialect: Dialect) -> None:
    reader = fields_of(Message("sRA", "STlms", b"\x00" if dialect is B else b"", dialect))
    with pytest.raises(FormatError, match="the state"):
        reader.number("u16", "the state")
    with pytest.raises(FormatError, match="the values"):
        TextFields(b"1 2 G").row("u16", 3, "the values")
    with pytest.raises(FormatError, match="the values exceeds FF"):
        TextFields(b"1 100").row("u8", 2, "the values")
    with pytest.raises(FormatError, match="the name of 5 characters"):
        TextFields(b"abc").characters(5, "the name")
    with pytest.raises(FormatError, match="the scale"):
        TextFields(b"100000000").real("the scale")
    with pytest.raises(FormatError, match="the scale"):
        BinaryFields(b"\x00").real("the scale")


@given(
    numbers=st.lists(
        st.one_of(
            st.tuples(st.just("u8"), st.integers(0, 255)),
            st.tuples(st.just("u16"), st.integers(0, 65535)),
            st.tuples(st.just("u32"), st.integers(0, 2**32 - 1)),
            st.tuples(st.just("i32"), st.integers(-(2**31), 2**31 - 1)),
        ),
        max_size=8,
    ),
    row=st.lists(st.integers(0, 65535), max_size=20),
    text=st.text(alphabet=st.characters(min_codepoint=32, max_codepoint=126), min_size=1),
    real=st.floats(width=32, allow_nan=False),
)
@pytest.mark.parametrize("dialect", [A, B])
def test_what_was_written_is_read_in_either_dialect(
    dialect: Dialect, numbers: list[tuple[str, int]], row: list[int], text: str, real: float
) -> None:
    fields: list[Field] = [*numbers, ("text", text), ("f32", real), ("u16[]", row), ("u8", 7)]
    if dialect is A and not row:  # an empty row would leave two blanks
        fields.remove(("u16[]", row))
    reader = fields_of(decode(encode("sSN", "X", *fields, dialect=dialect)))
    assert [reader.number(kind, "it") for kind, _ in numbers] == [value for _, value in numbers]
    assert reader.characters(reader.number("u16", "length"), "text") == text
    assert reader.real("real") == real
    assert reader.row("u16", len(row), "row").tolist() == row
    assert reader.number("u8", "last") == 7


READY = encode("sRA", "SCdevicestate", ("u8", 1), dialect=B)
LONG = encode("sSN", "X", ("u16[]", np.full(600, 0x0202)), dialect=B)
TEXT = b"\x02sAN SetAccessMode 1\x03"


@given(cuts=st.lists(st.integers(0, len(READY + LONG + TEXT)), max_size=12))
def test_telegrams_of_both_dialects_come_out_whatever_the_pieces(cuts: list[int]) -> None:
    data = READY + LONG + TEXT
    ends = [0, *sorted(cuts), len(data)]
    reader = parser()
    found = [m for start, end in itertools.pairwise(ends) for m in reader.feed(data[start:end])]
    assert found == [decode(READY), decode(LONG), decode(TEXT)]
    assert reader.tally.rejected_bytes == 0


@given(garbage=st.binary(max_size=200), dialect=st.sampled_from([A, B]))
def test_after_garbage_the_next_whole_telegram_is_found_at_once(
    garbage: bytes, dialect: Dialect
) -> None:
    reader = parser()
    found = reader.feed(garbage)
    found += reader.feed(READY + (TEXT if dialect is A else READY))
    assert found[-1] == decode(TEXT if dialect is A else READY)


@pytest.mark.parametrize("cut", [1, 4, 7, 8, 9, 20, 500, len(LONG) - 1])
@pytest.mark.parametrize("following", [READY, TEXT], ids=["B", "A"])
def test_a_telegram_that_was_cut_off_does_not_hide_the_next(cut: int, following: bytes) -> None:
    reader = parser()
    reader.feed(LONG[:cut])
    assert reader.feed(following) == [decode(following)]
    assert reader.tally.rejected_bytes == cut


def test_a_length_that_cannot_be_waits_for_nothing() -> None:
    reader = parser()
    assert reader.feed(bytes.fromhex("02020202 7FFFFFFF") + READY) == [decode(READY)]


@pytest.mark.parametrize("access", Access)
def test_the_passwords_are_those_of_the_factory(access: Access) -> None:
    hashes = {
        Access.MAINTENANCE: "B21ACE26",
        Access.CLIENT: "F4724744",
        Access.SERVICE: "81BE23AA",
        Access.SAFETY_CLIENT: "6FD62C05",
    }
    assert f"{access.value[1]:X}" == hashes[access]
