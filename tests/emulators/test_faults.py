"""What each fault does to the bytes of a device."""

import pytest

from bearcub.emulators.emulator import Serial, Ticker
from bearcub.emulators.faults import (
    Corrupt,
    Faulty,
    Half,
    Interrupted,
    Merged,
    Noise,
    Reset,
    Restarted,
    Rewritten,
    Split,
    Stuck,
    Unheard,
    WrongBaud,
    between,
    garbled,
)

MS = 1_000_000


class Device(Serial):
    """Says ``telegram`` every 10 ms and back what it hears."""

    def __init__(self) -> None:
        self.ticker = Ticker(100.0)
        self.heard = b""
        self.restarts = 0

    def receive(self, data: bytes) -> None:
        self.heard += data

    def poll(self, now_ns: int) -> bytes:
        heard, self.heard = self.heard, b""
        return heard + (b"telegram" if self.ticker.due(now_ns) else b"")

    def restart(self) -> None:
        self.restarts += 1


@pytest.fixture
def device() -> Device:
    return Device()


def between_20_and_50(now_ns: int) -> bool:
    return 20 * MS <= now_ns < 50 * MS


def said(faulty: Faulty, first_ms: int, end_ms: int) -> list[bytes]:
    """What comes in each millisecond that something comes."""
    pieces = [faulty.poll(ms * MS) for ms in range(first_ms, end_ms)]
    return [piece for piece in pieces if piece]


@pytest.mark.parametrize(
    "kind", [Split, Merged, Corrupt, Noise, Stuck, Half, Reset, WrongBaud, Restarted]
)
def test_a_fault_that_is_off_changes_nothing(kind: type[Faulty], device: Device) -> None:
    faulty = kind(device, lambda _: False)
    assert faulty.baud == 9600
    faulty.receive(b"G")
    assert said(faulty, 0, 30) == [b"Gtelegram", b"telegram", b"telegram"]


def test_split_telegrams_come_in_pieces_of_one_to_three_bytes(device: Device) -> None:
    pieces = said(Split(device, lambda _: True), 0, 10)
    assert b"".join(pieces) == b"telegram"
    assert {len(piece) for piece in pieces} <= {1, 2, 3}
    assert len(pieces) > 2


def test_merged_telegrams_come_together(device: Device) -> None:
    pieces = said(Merged(device, lambda _: True), 0, 200)
    assert [len(piece) // 8 for piece in pieces] == [16]
    assert pieces[0] == b"telegram" * 16


def test_a_corrupt_telegram_has_one_bit_wrong(device: Device) -> None:
    for piece in said(Corrupt(device, lambda _: True), 0, 100):
        wrong = [a ^ b for a, b in zip(piece, b"telegram", strict=True)]
        assert sum(bits.bit_count() for bits in wrong) == 1


def test_noise_is_put_in_and_takes_nothing_away(device: Device) -> None:
    for piece in said(Noise(device, lambda _: True), 0, 100):
        assert 9 <= len(piece) <= 28
        left = iter(piece)
        assert all(byte in left for byte in b"telegram")  # in this order


def test_a_stuck_device_neither_speaks_nor_hears(device: Device) -> None:
    faulty = Stuck(device, between_20_and_50)
    assert len(said(faulty, 0, 25)) == 2
    faulty.receive(b"lost")
    assert said(faulty, 25, 61) == [b"telegram", b"telegram"]


def test_half_a_telegram_is_followed_by_silence_each_time(device: Device) -> None:
    faulty = Half(device, lambda now_ns: now_ns // (50 * MS) % 2 == 1)
    assert said(faulty, 0, 100) == [b"telegram"] * 5 + [b"tele"]
    assert said(faulty, 100, 200) == [b"telegram"] * 5 + [b"tele"]


def test_a_reset_breaks_the_connection_off(device: Device) -> None:
    faulty = Reset(device, between_20_and_50)
    assert faulty.poll(0) == b"telegram"
    with pytest.raises(ConnectionResetError):
        faulty.poll(20 * MS)


def test_at_the_wrong_speed_both_ends_hear_garbage(device: Device) -> None:
    faulty = WrongBaud(device, between_20_and_50)
    faulty.poll(20 * MS)
    faulty.receive(b"G")
    assert device.heard == garbled(b"G") != b"G"
    device.heard = b""
    assert faulty.poll(30 * MS) == garbled(b"telegram")


def test_what_is_not_heard_is_answered_all_the_same(device: Device) -> None:
    faulty = Unheard(device, between_20_and_50, answer=b"\x15")
    faulty.poll(20 * MS)
    faulty.receive(b"a")
    faulty.receive(b"b")
    assert device.heard == b""
    assert faulty.poll(21 * MS) == b"\x15\x15"


def test_what_is_sent_can_be_rewritten(device: Device) -> None:
    faulty = Rewritten(device, between_20_and_50, rewrite=lambda data: data[:1])
    assert said(faulty, 0, 40) == [b"telegram", b"telegram", b"t", b"t"]


def test_an_intruder_cuts_one_telegram_off(device: Device) -> None:
    faulty = Interrupted(device, between_20_and_50, intruder=b"!")
    assert said(faulty, 0, 40) == [b"telegram", b"telegram", b"tele!", b"telegram"]


def test_a_device_restarts_once_for_each_time_the_fault_begins(device: Device) -> None:
    faulty = Restarted(device, lambda now_ns: now_ns // (50 * MS) % 2 == 1)
    said(faulty, 0, 100)
    assert device.restarts == 1
    said(faulty, 100, 200)
    assert device.restarts == 2


def test_faults_add_up(device: Device) -> None:
    faulty = Rewritten(
        Stuck(device, lambda now_ns: now_ns >= 20 * MS), lambda _: True, rewrite=lambda d: d[:2]
    )
    assert said(faulty, 0, 40) == [b"te", b"te"]


def test_a_time_between_two_others_includes_the_first() -> None:
    on = between(10, 20)
    assert [on(time) for time in (9, 10, 19, 20)] == [False, True, True, False]


def test_garbled_bytes_are_never_text() -> None:
    assert min(garbled(bytes(range(256)))) >= 0x80
