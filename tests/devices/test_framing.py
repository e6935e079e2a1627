"""From bytes to telegrams, by a protocol of letters between angle brackets."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bearcub.devices.framing import INCOMPLETE, TOO_LONG, Cut, Framer
from bearcub.devices.nmea import LONGEST, lines, sentences


def cut(data: bytes, start: int) -> Cut[bytes]:
    """One telegram: ``<`` letters ``>``; a digit inside is an error."""
    if data[start : start + 1] != b"<":
        found = data.find(b"<", start)
        return Cut((found if found >= 0 else len(data)) - start)
    end = data.find(b">", start)
    body = data[start + 1 : end] if end >= 0 else data[start + 1 :]
    if any(byte in b"0123456789<" for byte in body):
        return Cut(1, None, "digit")
    return Cut(end + 1 - start, body) if end >= 0 else Cut(0)


@pytest.fixture
def framer() -> Framer[bytes]:
    return Framer(cut, longest=8)


def test_telegrams_come_whole_whatever_the_pieces(framer: Framer[bytes]) -> None:
    assert framer.feed(b"<a") == []
    assert framer.feed(b"b><") == [b"ab"]
    assert framer.feed(b"c><d><e") == [b"c", b"d"]
    assert framer.tally.rejected_bytes == 0


def test_noise_is_skipped_and_counted_and_is_no_error(framer: Framer[bytes]) -> None:
    assert framer.feed(b"??<a>??<b>") == [b"a", b"b"]
    assert (framer.tally.rejected_bytes, framer.tally.resyncs, framer.tally.errors) == (4, 2, 0)


def test_a_wrong_telegram_gives_its_reason_and_hides_none_behind_it(framer: Framer[bytes]) -> None:
    assert framer.feed(b"<1<a>") == [b"a"]
    assert framer.tally.reasons == {"digit": 1}
    assert framer.tally.last == "digit"
    assert framer.tally.resyncs == 1


def test_a_beginning_without_end_is_given_up_at_the_longest_telegram(framer: Framer[bytes]) -> None:
    assert framer.feed(b"<aaaaaaaaaaaaaaaaaaaa") == []
    assert framer.tally.reasons == {TOO_LONG: 1}
    assert framer.feed(b"<b>") == [b"b"]


def test_silence_gives_up_a_beginning_and_returns_what_it_hid() -> None:
    def count(data: bytes, start: int) -> Cut[bytes]:  # a length, then as many bytes
        end = start + 1 + data[start] % 16
        return Cut(end - start, data[start + 1 : end]) if end <= len(data) else Cut(0)

    framer = Framer(count, longest=17)
    assert framer.feed(b"\x0f\x01a") == []
    assert framer.silence() == [b"a"]
    assert framer.tally.reasons == {INCOMPLETE: 1}
    assert framer.silence() == []


def test_a_reset_forgets_the_bytes_and_keeps_the_tally(framer: Framer[bytes]) -> None:
    framer.feed(b"?<a")
    framer.reset()
    assert framer.feed(b"b>") == []
    assert framer.tally.rejected_bytes == 3


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.text("<>ab1?", max_size=12), max_size=6))
def test_the_pieces_make_no_difference(texts: list[str]) -> None:
    pieces = [text.encode() for text in texts]
    whole, parts = Framer(cut, longest=1000), Framer(cut, longest=1000)
    found = [telegram for piece in pieces for telegram in parts.feed(piece)]
    assert whole.feed(b"".join(pieces)) == found
    assert whole.tally.rejected_bytes == parts.tally.rejected_bytes


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"$GPGGA,1*00\r\n", "wrong checksum"),
        (b"$GPGGA,1\r\n", "no checksum"),
        (b"$GP\xffGGA,1*00\n", "bytes that are no text"),
        (b"$GP$HCHDT,128.0,T*22\r\n", INCOMPLETE),
        (b"$" + b"A" * LONGEST, TOO_LONG),
    ],
)
def test_a_line_that_is_no_sentence_is_refused_with_the_reason(line: bytes, reason: str) -> None:
    parser = sentences()
    parser.feed(line)
    assert parser.tally.reasons == {reason: 1}
    (good,) = parser.feed(b"\n$HCHDT,128.0,T*22\r\n")[-1:]
    assert (good.name, good.fields, str(good)) == ("HCHDT", ("128.0", "T"), "$HCHDT,128.0,T")


def test_a_checksum_may_be_in_small_letters_and_a_line_end_without_return() -> None:
    assert lines().feed(b"$PTNTHPR,85.9,N,-0.9,N,0.8,N*2c\n") == ["PTNTHPR,85.9,N,-0.9,N,0.8,N"]
