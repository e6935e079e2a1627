"""Telegrams with a right checksum and a wrong content: refused with the project's errors only.

Damaged streams are the business of ``tests/devices/test_fuzz.py``; here the damage is inside, where
a checksum does not help. ``pytest -m slow tests/devices/sick/test_fuzz.py`` takes a million each.
"""

import contextlib
import random

import numpy as np
import pytest

from bearcub.devices.sick import Cola, Dialect, Lms2xx, Sweep, lms2xx
from bearcub.devices.sick.cola import Message, decode, wrap
from bearcub.devices.sick.lms2xx import Reply, Telegram
from bearcub.emulators.cola import ColaEmulator
from bearcub.emulators.lms2xx import Lms2xxEmulator
from bearcub.errors import BearcubError

FEW, MANY = 3_000, 1_000_000


def changed(data: bytes, dice: random.Random) -> bytes:
    """The bytes with up to four changes, most of them near the beginning, where the counts are."""
    changed = bytearray(data)
    for _ in range(dice.randint(0, 4)):
        reach = len(changed) if dice.random() < 0.3 else min(len(changed), 120)
        place = dice.randrange(reach + 1)
        what = dice.randrange(5)
        if what == 0:
            changed[place : place + 1] = dice.choice((b"\x00", b"\xff", b"\x7f", b"\x80", b" "))
        elif what == 1:
            changed[place : place + 1] = dice.randbytes(1)
        elif what == 2:
            del changed[place : place + dice.randint(1, 30)]
        elif what == 3:
            changed[place:place] = dice.randbytes(dice.randint(1, 8))
        else:
            del changed[dice.randrange(len(changed) + 1) :]
    return bytes(changed)


def lms2xx_telegram(dice: random.Random) -> Telegram:
    words = np.array([dice.randrange(65536) for _ in range(8)] * 46, "<u2")[:361]
    header = 361 | dice.choice((0, 0x4000, 0x8000, 0xC000, 0x2000, 0x2800))
    data = header.to_bytes(2, "little") + words.tobytes()
    kind = dice.choice((Reply.SCAN, Reply.SCAN, Reply.MEAN_SCAN, Reply.SUBRANGE_SCAN, *Reply))
    telegram = Telegram(kind, changed(data, dice)[:800], dice.randrange(256), 0x80)
    assert lms2xx.parser().feed(lms2xx.encode(telegram)) == [telegram]
    return telegram


def scanned(dialect: Dialect) -> bytes:
    """The payload of a small scan with two channels."""
    scanner = ColaEmulator(sweep=Sweep(start_deg=-5, stop_deg=5, step_deg=0.5), dialect=dialect)
    scanner.receive(
        wrap(b"sEN LMDscandata \x01") if dialect is Dialect.B else b"\x02sEN LMDscandata 1\x03"
    )
    scanner.poll(0)
    (message,) = Cola().parser.feed(scanner.poll(10**9))
    assert message.kind == "sSN"
    return message.arguments


SCANNED = {dialect: scanned(dialect) for dialect in Dialect}


def cola_message(dice: random.Random) -> Message:
    dialect = dice.choice(list(Dialect))
    arguments = changed(SCANNED[dialect], dice)
    if dialect is Dialect.B:
        return decode(wrap(b"sSN LMDscandata " + arguments))
    return Message("sSN", "LMDscandata", arguments, dialect)


def decode_lms2xx(dice: random.Random) -> object:
    return Lms2xx(measuring_mode=0).value(lms2xx_telegram(dice))


def decode_cola(dice: random.Random) -> object:
    return Cola().value(cola_message(dice))


CONTENTS = {"lms2xx": decode_lms2xx, "cola": decode_cola}


def fuzz(name: str, count: int) -> None:
    dice = random.Random(1)  # noqa: S311 (the same contents every time)
    decoded = 0
    for _ in range(count):
        with contextlib.suppress(BearcubError):
            decoded += CONTENTS[name](dice) is not None
    assert 0.02 * count < decoded < 0.98 * count


@pytest.mark.parametrize("name", CONTENTS)
def test_a_wrong_content_is_refused_and_breaks_nothing(name: str) -> None:
    fuzz(name, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTENTS)
def test_a_million_wrong_contents_are_refused_and_break_nothing(name: str) -> None:
    fuzz(name, MANY)


@pytest.mark.parametrize("seed", range(20))
def test_no_command_breaks_an_emulator(seed: int) -> None:
    dice = random.Random(seed)  # noqa: S311 (the same commands every time)
    serial, network = Lms2xxEmulator(), ColaEmulator()
    for count in range(100):
        command = Telegram(dice.choice((0x10, 0x20, 0x30, 0x31, 0x3B, 0x74, 0x77, 0x99)))
        data = changed(b"\x00SICK_LMS", dice) if dice.random() < 0.5 else dice.randbytes(34)
        serial.receive(lms2xx.encode(command._replace(data=data)))
        network.receive(wrap(b"sMN SetAccessMode \x03\xf4\x72\x47\x44"))
        kind, name = dice.choice(list(network._answers))
        network.receive(wrap(f"{kind} {name} ".encode() + dice.randbytes(dice.randrange(20))))
        for emulator in (serial, network):
            emulator.receive(dice.randbytes(5))
            emulator.poll(count * 10**9)
