"""Any bytes into every parser: nothing but the project's errors, bounded, resynchronised at once.

The default run takes a few inputs, ``pytest -m slow tests/devices/test_fuzz.py`` a million each.
"""

import contextlib
import random
from collections.abc import Iterator
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.driver import Driver
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.faults import Faulty
from bearcub.emulators.kind import Kind
from bearcub.emulators.kinds import KINDS
from bearcub.errors import BearcubError

FEW, MANY = 400, 1_000_000
CHECKED_EVERY = 20  # inputs between two checks of the resynchronisation
HELD = 70_000  # more than the longest telegram of any protocol [bytes]


class Tap(Faulty):
    """Keeps the pieces that the device sends."""

    def __init__(self, emulator: Emulator) -> None:
        super().__init__(emulator, lambda _: True)
        self.pieces: list[bytes] = []

    def spoil(self, data: bytes) -> bytes:
        if data:
            self.pieces.append(data)
        return data


def sent(kind: Kind) -> list[bytes]:
    """What a device sends from the first connection on, piece by piece."""
    clock = ManualClock()
    tap = Tap(kind.emulator())
    link = DirectLink(tap, clock=clock, wait=clock.advance)
    source: Streaming[Any] = Streaming(
        link, kind.driver(), clock=clock, rate_hz=kind.rate_hz, role="sensor"
    )
    while source.health().values < 5 and clock.now_ns() < 20e9:
        clock.advance(source.step() or 1e-6)
    assert source.health().values >= 5
    return tap.pieces


def inputs(pieces: list[bytes], dice: random.Random) -> Iterator[bytes]:
    """Random bytes, and telegrams cut, joined, doubled, with bytes changed, put in and left out."""
    stream = b"".join(pieces)
    while True:
        start = dice.randrange(len(stream))
        data = bytearray(stream[start : start + dice.randint(1, 120)])
        for _ in range(dice.randint(0, 4)):
            place = dice.randrange(len(data) + 1)
            what = dice.randrange(4)
            if what == 0:
                data[place : place + 1] = dice.randbytes(1)
            elif what == 1:
                data[place:place] = dice.randbytes(dice.randint(1, 8))
            elif what == 2:
                del data[place : place + dice.randint(1, 8)]
            else:
                data[place:place] = dice.choice(pieces)[:60]
        yield dice.randbytes(dice.randint(1, 40)) if dice.random() < 0.2 else bytes(data)


def held(parser: object) -> int:
    """How many bytes and telegrams a parser keeps."""
    kept = (bytes, bytearray, str, list, tuple, dict)
    return sum(len(value) for value in vars(parser).values() if isinstance(value, kept))


def take(driver: Driver[Any, Any], telegrams: list[Any]) -> None:
    for telegram in telegrams:
        with contextlib.suppress(BearcubError):
            driver.value(telegram)


def telegram_of(kind: Kind, pieces: list[bytes]) -> tuple[bytes, list[str]]:
    """The last piece that is a telegram by itself, and what it says."""
    for piece in reversed(pieces):
        telegrams = kind.driver().parser.feed(piece)
        if telegrams:
            return piece, [repr(telegram) for telegram in telegrams]
    raise AssertionError("no piece is a telegram")


def fuzz(kind: Kind, n_inputs: int, seed: int) -> None:
    dice = random.Random(seed)  # noqa: S311 (the same inputs every time)
    pieces = sent(kind)
    valid, meaning = telegram_of(kind, pieces)
    driver = kind.driver()
    parser = driver.parser
    made = inputs(pieces, dice)
    for count in range(n_inputs):
        take(driver, parser.feed(next(made)))
        if count % CHECKED_EVERY:
            continue
        assert held(parser) <= HELD
        assert len(parser.tally.reasons) <= 20
        # The line falls silent, one valid telegram may be lost, the next one is not.
        take(driver, parser.silence() + parser.feed(valid) + parser.silence())
        after = parser.feed(valid)
        assert [repr(telegram) for telegram in after] == meaning
        take(driver, after)


@pytest.mark.parametrize("kind", list(KINDS.values()), ids=list(KINDS))
def test_no_bytes_break_a_parser_and_the_second_valid_telegram_comes_through(kind: Kind) -> None:
    fuzz(kind, FEW, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(KINDS.values()), ids=list(KINDS))
def test_a_million_inputs_break_no_parser(kind: Kind) -> None:
    fuzz(kind, MANY, seed=2)
