"""The controller's bytes: replies, records, what a program prints; random pieces and noise."""

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.devices.galil.codes import axis_faults, error_text
from bearcub.devices.galil.record import Layout, decode_record, decode_text
from bearcub.devices.galil.replies import Reply, ReplyParser
from bearcub.devices.galil.watchdog import is_watchdog, watchdog_program
from bearcub.errors import FormatError

LAYOUT = Layout.parse(" 4, 52, 26, 36")  # DMC-4040


def record(**axis_a: int) -> bytes:
    """A DMC-4040's record: 4-byte header, axis A from byte 82 on, 36 bytes an axis."""
    data = bytearray(struct.pack("<BBH", 0x87, 0x0F, 226) + bytes(222))
    values = {"status": 0, "switches": 0x0C, "stop": 1, "position": 0, "velocity": 0} | axis_a
    struct.pack_into("<HBB", data, 82, values["status"], values["switches"], values["stop"])
    struct.pack_into("<i", data, 82 + 8, values["position"])
    struct.pack_into("<i", data, 82 + 20, values["velocity"] * 64)
    struct.pack_into("<HBB", data, 82 + 36, 0x0001, 0x0C, 0)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "reply"),
    [
        (b" 1234\r\n:", Reply(text="1234")),
        (b"0000001234\r\n:", Reply(text="0000001234")),
        (b" 0, 0, 0, 0\r\n:", Reply(text="0, 0, 0, 0")),
        (b":", Reply()),
        (b"?", Reply(accepted=False)),
        (b"DMC4040 Rev 1.2d\r\n:", Reply(text="DMC4040 Rev 1.2d")),
        (
            b"20 Begin not valid with motor off\r\n:",
            Reply(text="20 Begin not valid with motor off"),
        ),
    ],
)
def test_a_reply_ends_with_a_colon_or_a_question_mark(data: bytes, reply: Reply) -> None:
    assert ReplyParser().feed(data) == [reply]


def test_what_a_program_prints_is_kept_apart_by_its_eighth_bit() -> None:
    parser = ReplyParser()
    printed = bytes(byte | 0x80 for byte in b"lost: why?\r\n")
    assert parser.feed(b" 12" + printed + b"34\r\n:") == [Reply(text="1234")]
    assert list(parser.messages) == ["lost: why?"]


def test_a_record_may_hold_colons_and_question_marks() -> None:
    parser = ReplyParser()
    sent = record(position=0x3A3F3A3F)
    assert parser.feed(b":" + sent + b"::") == [Reply(), Reply(record=sent), Reply()]


def test_a_record_that_tells_an_impossible_size_is_given_up() -> None:
    parser = ReplyParser()
    assert parser.feed(b"\x87\x0f\xff\xff:") == [Reply()]
    assert parser.tally.reasons == {"telegram too long": 1}


@pytest.mark.parametrize(
    ("axes", "size"),
    [(4, 226), (8, 4 + 52 + 26 + 8 * 36), (2, 4 + 24 + 16 + 2 * 28), (1, 4 + 18 + 16 + 36)],
)
def test_a_record_that_nobody_asked_for_is_laid_out_by_its_size(axes: int, size: int) -> None:
    sent = struct.pack("<BBH", 0x87, (1 << axes) - 1, size) + bytes(size - 4)
    assert (Layout.of(sent).axes, Layout.of(sent).size) == (axes, size)
    with pytest.raises(FormatError, match="no known model"):
        Layout.of(sent[:-1])


@given(st.data())
def test_pieces_of_any_size_give_the_same_replies(data: st.DataObject) -> None:
    stream = b":" + record(position=-5) + b": 1.0000\r\n:?"
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    parser = ReplyParser()
    replies = [
        reply
        for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)
        for reply in parser.feed(stream[start:end])
    ]
    assert replies == [
        Reply(),
        Reply(record=record(position=-5)),
        Reply(text="1.0000"),
        Reply(accepted=False),
    ]


def test_an_endless_reply_is_given_up_and_counted() -> None:
    parser = ReplyParser()
    assert parser.feed(b"x" * 40000) == []
    assert parser.tally.reasons == {"telegram too long": 2}
    assert parser.feed(b"\r\n: 1\r\n:")[-1] == Reply(text="1")


def test_half_a_reply_before_a_silence_is_forgotten_and_counted() -> None:
    parser = ReplyParser()
    parser.feed(b" 12")
    assert parser.silence() == []
    assert parser.feed(b" 7\r\n:") == [Reply(text="7")]
    assert parser.tally.errors == 1


def test_a_record_decodes_to_the_states_of_both_wheels() -> None:
    sent = record(status=0x8000, switches=0x08, stop=3, position=-1234, velocity=500)
    left, right = decode_record(sent, LAYOUT, axes="AB")
    assert (left.position, left.velocity, left.stop_code) == (-1234, 500.0, 3)
    assert (left.moving, left.motor_off) == (True, False)
    assert (left.forward_limit, left.reverse_limit) == (False, True)
    assert (right.moving, right.motor_off, right.forward_limit) == (False, True, False)


@pytest.mark.parametrize("damaged", [b"", record()[:-1], record()[:2] + b"\0\0" + record()[4:]])
def test_a_record_of_another_size_is_refused(damaged: bytes) -> None:
    with pytest.raises(FormatError, match="expected 226"):
        decode_record(damaged, LAYOUT, axes="AB")


def test_an_axis_that_is_not_in_the_record_is_refused() -> None:
    with pytest.raises(FormatError, match="no axis E"):
        decode_record(record(), LAYOUT, axes="AE")


@pytest.mark.parametrize("text", ["", "4, 52", "4, 52, 26, 3", "99, 52, 26, 36", "a, b, c, d"])
def test_an_impossible_layout_is_refused(text: str) -> None:
    with pytest.raises(FormatError, match="QZ"):
        Layout.parse(text)


def test_text_decodes_to_the_same_state() -> None:
    state = decode_text(" -1234.0000 500.0000 3.0000 1.0000 0.0000 1.0000 0.0000")
    assert (
        state
        == decode_record(
            record(status=0x8000, switches=0x08, stop=3, position=-1234, velocity=500),
            LAYOUT,
            axes="A",
        )[0]
    )


@pytest.mark.parametrize("text", ["", "1 2 3", "a b c d e f g", "inf 0 0 0 0 0 0"])
def test_text_that_is_no_state_is_refused(text: str) -> None:
    with pytest.raises(FormatError, match="seven numbers"):
        decode_text(text)


def test_codes_are_said_in_words() -> None:
    assert error_text(22) == "error 22: cannot begin: a limit switch is active"
    assert axis_faults(stop_code=8, motor_off=True, forward_limit=True, reverse_limit=False) == (
        "stopped because the position error exceeded its limit (off-on-error)",
        "motor off",
        "forward limit switch active",
    )
    assert axis_faults(stop_code=1, motor_off=False, forward_limit=False, reverse_limit=False) == ()


def test_the_watchdog_is_known_again_in_a_listing_and_nothing_else_is() -> None:
    lines = watchdog_program("CD", deceleration=2048).split("\r")
    assert max(len(line) for line in lines) <= 40  # what older controllers take
    assert is_watchdog("\r\n".join(f"{number} {line}" for number, line in enumerate(lines)))
    assert not is_watchdog("0 #AUTO\r\n1 JG 1000\r\n2 BG A")
    assert not is_watchdog("")


@pytest.mark.slow
def test_a_million_random_inputs_raise_nothing_and_do_not_stick() -> None:
    rng, parser = random.Random(1), ReplyParser()  # noqa: S311 (the same inputs every time)
    pieces = [b":", b"?", b" 12\r\n:", record(), b"\x80\xff", b"DMC4040 Rev 1.2d\r\n:"]
    for _ in range(1_000_000):
        data = bytearray(rng.choice(pieces))
        if rng.random() < 0.5:
            data[rng.randrange(len(data))] = rng.randrange(256)
        parser.feed(bytes(data))
        assert len(parser._text) + len(parser._record) + len(parser._message) < 20000
    parser.reset()
    assert parser.feed(b" 7\r\n:") == [Reply(text="7")]
