"""The emulated controller against what the command reference says; literal bytes both ways."""

import random

import pytest

from bearcub.emulators.galil import GalilEmulator

MS = 1_000_000


def said(controller: GalilEmulator, line: bytes, *, at_ms: int = 0) -> bytes:
    controller.poll(at_ms * MS)
    controller.receive(line)
    return controller.poll(at_ms * MS)


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (b"\x12\x16\r", b"DMC4040 Rev 1.2d\r\n:"),
        (b"\r", b":"),
        (b"\r\n", b":"),
        (b"MG _BGA\r", b" 0.0000\r\n:"),
        (b"TPA\r", b" 0\r\n:"),
        (b"TP\r\n", b" 0, 0, 0, 0\r\n:"),
        (b"MG _MOA\r", b" 1.0000\r\n:"),
        (b"SH AB;MG _MOA\r", b": 0.0000\r\n:"),
        (b"JG 1000,-1000;JG ?,?\r", b": 1000, -1000\r\n:"),
        (b"jg 1000\r", b"?"),
        (b"XX\r", b"?"),
        (b"JGA=99000000\r", b"?"),
        (b"hb=5;MG hb+1*2\r", b": 12.0000\r\n:"),  # from left to right, as the controller does
        (b"MG nobody\r", b"?"),
        (b"MG 1/0\r", b"?"),
        (b"QZ\r", b" 4, 52, 26, 36\r\n:"),
        (b'MG "a b"\r', b"a b\r\n:"),
        (b"XQ #NONE\r", b"?"),
    ],
)
def test_a_command_is_answered_by_its_bytes(line: bytes, answer: bytes) -> None:
    assert said(GalilEmulator(), line) == answer


def test_the_last_error_is_told_once() -> None:
    controller = GalilEmulator()
    assert said(controller, b"BG A\r") == b"?"
    assert said(controller, b"TC 1\r") == b"20 Begin not valid with motor off\r\n:"
    assert said(controller, b"TC 0\r") == b" 0\r\n:"


def test_beginning_twice_or_against_a_limit_switch_is_refused() -> None:
    controller = GalilEmulator()
    assert said(controller, b"SH A\rJGA=1000\rBG A\rBG A\rTC1\r") == (
        b"::" + b":?21 Begin not valid while running\r\n:"
    )
    blocked = GalilEmulator()
    blocked.axes["A"].forward_limit = True
    assert said(blocked, b"SH A\rJGA=1000\rBG A\rTC1\r") == (
        b"::?22 Begin not possible due to Limit Switch\r\n:"
    )


def test_a_jog_ramps_up_holds_and_ramps_down() -> None:
    controller = GalilEmulator()
    said(controller, b"SH A\rACA=10240\rDCA=20480\rJGA=5120\rBG A\r")
    controller.poll(250 * MS)  # half of the ramp of 0.5 s
    assert controller.axes["A"].speed == pytest.approx(2560)
    assert controller.axes["A"].position == 320  # a t²/2
    controller.poll(1500 * MS)  # ramp 1280 counts, then 1 s of 5120
    assert controller.axes["A"].position == 1280 + 5120
    assert said(controller, b"MG _BGA\r", at_ms=1500) == b" 1.0000\r\n:"
    said(controller, b"ST A\r", at_ms=1500)
    controller.poll(2000 * MS)
    assert controller.axes["A"].position == 6400 + 640  # v²/2a
    assert said(controller, b"MG _BGA,_SCA\r", at_ms=2000) == b" 0.0000 4.0000\r\n:"


def test_the_speed_may_be_changed_while_jogging_also_through_zero() -> None:
    controller = GalilEmulator()
    said(controller, b"SH A\rACA=10240\rDCA=10240\rJGA=1024\rBG A\r")
    assert said(controller, b"JGA=-1024\r", at_ms=1000) == b":"
    controller.poll(1200 * MS)  # 0.2 s for the change of 2048
    assert controller.axes["A"].speed == pytest.approx(-1024)


def test_the_encoder_wraps_at_31_bits() -> None:
    controller = GalilEmulator()
    assert said(controller, b"DPA=2147483647\rTPA\r") == b": 2147483647\r\n:"
    controller.axes["A"].actual += 1
    assert said(controller, b"TPA\r") == b" -2147483648\r\n:"


def test_a_program_is_silent_until_its_end_and_then_says_two_colons() -> None:
    controller = GalilEmulator()
    assert said(controller, b"DL\r#AUTO\rMG 1\r") == b""
    assert said(controller, b"EN\r\\\r") == b"::"
    assert said(controller, b"LS\r") == b"0 #AUTO\r\n1 MG 1\r\n2 EN\r\n:"


def test_a_program_runs_in_its_own_time_and_marks_what_it_prints() -> None:
    controller = GalilEmulator()
    said(controller, b"CW 1\rDL\r#GO\rn=n+1\rWT 100\rIF (n>=3)\rMG n\rEN\rENDIF\rJP #GO\r\\\r")
    assert said(controller, b"n=0\rXQ #GO\r") == b"::"
    assert said(controller, b"MG n,_XQ0\r", at_ms=150) == b" 2.0000 0.0000\r\n:"
    printed = controller.poll(400 * MS)
    assert bytes(byte & 0x7F for byte in printed) == b" 3.0000\r\n"
    assert all(byte & 0x80 for byte in printed)
    assert said(controller, b"MG _XQ0\r", at_ms=400) == b" -1.0000\r\n:"


def test_a_program_without_a_wait_does_not_hang_the_emulator() -> None:
    controller = GalilEmulator()
    said(controller, b"DL\r#GO\rJP #GO\r\\\rXQ #GO\r")
    controller.poll(100 * MS)
    assert said(controller, b"HX\rMG _XQ0\r", at_ms=100) == b": -1.0000\r\n:"


def test_a_long_absence_is_lived_through_quickly() -> None:
    controller = GalilEmulator()
    said(controller, b"DL\r#GO\rn=n+1\rWT 20\rJP #GO\r\\\rn=0\rXQ #GO\r")
    controller.poll(1_000_000_000 * MS)
    assert controller.variables["n"] <= 502  # of 10 s, not of days


def test_half_a_command_is_forgotten_with_its_connection() -> None:
    controller = GalilEmulator()
    controller.receive(b"JGA=1")
    controller.connect()
    assert said(controller, b"TPA\r") == b" 0\r\n:"


def test_nonsense_is_refused_and_breaks_nothing() -> None:
    rng = random.Random(3)  # noqa: S311 (the same nonsense every time)
    words = ["MG", "JG", "IF (", "DL", "\\", "XQ", "#A", "WT", "BG A", "hb=", "9" * 12, "*", "/0"]
    words += ["A", "=", ",", ";", " ", "?", "_TPA", "JP #A", "-", "HX", "ST", ")", "<", "QR", "n"]
    controller = GalilEmulator()
    for turn in range(4000):
        line = "".join(rng.choices(words, k=rng.randrange(1, 6))).encode() + b"\r"
        controller.receive(line if turn % 5 else bytes(rng.randbytes(9)) + b"\r")
        controller.poll(turn * MS)
    controller.receive(b"\\\rHX\r\r")
    assert controller.poll(4000 * MS).endswith(b":")
