"""Scans of the LMS2xx, decoded as the scanner's measuring mode says."""

import math

import numpy as np
import pytest

from bearcub.devices.sick.lms2xx import Reply, Telegram
from bearcub.devices.sick.lms2xx_scan import Lms2xxSetting, decode_scan
from bearcub.errors import ConfigError, FormatError
from bearcub.messages import BeamFlag, Scan

HALF = Lms2xxSetting(fov_deg=180, resolution_deg=0.5)
CM, MM, DM = 0, 1, 2
FREE = 3289  # mm


def telegram(words: list[int], *, unit: int = MM, header: int = 0, after: bytes = b"") -> Telegram:
    head = len(words) | unit << 14 | header
    data = head.to_bytes(2, "little") + np.array(words, "<u2").tobytes() + after
    return Telegram(Reply.SCAN, data, 0x10, 0x80)


def whole(words: dict[int, int], *, count: int = 361) -> list[int]:
    values = [FREE] * count
    for at, word in words.items():
        values[at] = word
    return values


def decoded(word: int, mode: int, *, unit: int = MM) -> Scan:
    setting = Lms2xxSetting(measuring_mode=mode)
    return decode_scan(telegram(whole({180: word}), unit=unit), setting)


def test_the_words_of_a_real_scan_mean_what_they_mean_in_its_measuring_mode() -> None:
    """An LMS200 in mode 00, mm: 0x227A is 0.634 m in field A, not 8.826 m."""
    start = [2251, 2251, 2242, 2242, 2243, 2234]
    words = whole(dict(enumerate(start)) | {263: 0x227A, 360: 1304})
    message = telegram(words)
    assert message.data[:2] == b"\x69\x41"
    scan = decode_scan(message, HALF)
    assert scan.ranges[:6] == pytest.approx([2.251, 2.251, 2.242, 2.242, 2.243, 2.234])
    assert scan.ranges[[180, 263, 360]] == pytest.approx([3.289, 0.634, 1.304])
    assert scan.flags is not None
    assert np.flatnonzero(scan.flags).tolist() == [263]
    assert scan.flags[263] == BeamFlag.FIELD_A
    in_16_m = decode_scan(message, Lms2xxSetting(measuring_mode=4))
    assert in_16_m.ranges[263] == pytest.approx(8.826)


@pytest.mark.parametrize(
    ("fov_deg", "resolution_deg", "count", "duration_ms"),
    [
        # A turn of the mirror takes 13.33 ms; finer scans take 2 or 4 turns, a degree a beam.
        (180, 1.0, 181, 6.667),
        (180, 0.5, 361, 20.0),
        (100, 1.0, 101, 3.704),
        (100, 0.5, 201, 17.037),
        (100, 0.25, 401, 43.704),
    ],
)
def test_beams_go_from_right_to_left_around_straight_ahead(
    fov_deg: int, resolution_deg: float, count: int, duration_ms: float
) -> None:
    setting = Lms2xxSetting(fov_deg=fov_deg, resolution_deg=resolution_deg)
    scan = decode_scan(telegram(whole({}, count=count)), setting)
    degrees = np.rad2deg(scan.angles)
    assert degrees[[0, count // 2, -1]] == pytest.approx([-fov_deg / 2, 0, fov_deg / 2])
    assert degrees[1] - degrees[0] == pytest.approx(resolution_deg)
    assert scan.duration * 1e3 == pytest.approx(duration_ms, abs=0.001)


@pytest.mark.parametrize(
    ("mode", "unit", "word", "metres", "farthest"),
    [
        (0x00, MM, 0x1FF0, 8.176, 8.182),
        (0x00, CM, 0x1FF0, 81.76, 81.82),
        (0x01, MM, 0xE000 | 1000, 1.0, 8.182),
        (0x02, CM, 0xE000 | 1000, 10.0, 81.82),
        (0x03, MM, 0xC000 | 16000, 16.0, 16.374),
        (0x04, MM, 0x4000 | 12000, 12.0, 16.374),
        (0x05, MM, 0x8000 | 32000, 32.0, 32.758),
        (0x06, MM, 0x8000 | 31000, 31.0, 32.758),
        (0x0F, MM, 32000, 32.0, 65.526),
        (0x00, DM, 100, 10.0, 818.2),
    ],
)
def test_the_distance_has_as_many_bits_as_the_mode_gives_it(
    mode: int, unit: int, word: int, metres: float, farthest: float
) -> None:
    scan = decoded(word, mode, unit=unit)
    assert scan.ranges[180] == pytest.approx(metres)
    assert scan.farthest == pytest.approx(farthest)


@pytest.mark.parametrize(
    ("mode", "word", "flags"),
    [
        (0x00, 0x2000 | 500, BeamFlag.FIELD_A),
        (0x00, 0x4000 | 500, BeamFlag.FIELD_B),
        (0x00, 0x6000 | 500, BeamFlag.FIELD_A | BeamFlag.FIELD_B),
        (0x02, 0x8000 | 500, BeamFlag.FIELD_C),
        (0x04, 0x8000 | 500, BeamFlag.FIELD_B),
        (0x06, 0x8000 | 500, BeamFlag.FIELD_A),
    ],
)
def test_field_flags_come_with_the_distance(mode: int, word: int, flags: BeamFlag) -> None:
    scan = decoded(word, mode)
    assert scan.flags is not None
    assert scan.flags[180] == flags
    assert np.count_nonzero(scan.flags) == 1
    assert scan.ranges[180] == pytest.approx(0.5)


def test_a_dazzled_beam_has_no_range() -> None:
    scan = decoded(0x8000 | 500, 0x00)
    assert scan.flags is not None
    assert scan.flags[180] == BeamFlag.DAZZLED
    assert math.isnan(scan.ranges[180])
    assert np.isfinite(np.delete(scan.ranges, 180)).all()


@pytest.mark.parametrize(
    ("mode", "word", "level"), [(1, 0xA3E8, 5), (3, 0xC3E8, 3), (5, 0x83E8, 1)]
)
def test_reflector_levels_are_intensities(mode: int, word: int, level: int) -> None:
    scan = decoded(word, mode)
    assert scan.flags is None
    assert scan.intensities is not None
    assert scan.intensities[180] == level
    assert scan.intensities.sum() == level


@pytest.mark.parametrize(
    ("code", "meaning"),
    [
        (0x1FFF, math.inf),  # no echo
        (0x1FFE, math.nan),  # dazzled
        (0x1FFD, math.nan),  # overflow
        (0x1FFB, math.nan),  # low signal to noise
        (0x1FFA, math.nan),  # channel 1
        (0x1FF7, math.inf),  # beyond the range
        (0x1FF6, 8.182),
        (0x0001, 0.001),
        (0x0000, -math.inf),  # too close
    ],
)
def test_codes_become_what_rep_117_says(code: int, meaning: float) -> None:
    found = decoded(code, 0x00).ranges[180]
    assert found == pytest.approx(meaning, nan_ok=True)
    wider = 0 if code < 0x1FF7 else 0x3FFF - 0x1FFF
    if code >= 0x1FF7:  # the codes move up with the number of bits
        assert decoded(code + wider, 0x04).ranges[180] == pytest.approx(meaning, nan_ok=True)


def test_a_beam_that_a_code_calls_dazzled_has_the_flag_too() -> None:
    flags = decoded(0x1FFE, 0x00).flags
    assert flags is not None
    assert flags[180] == BeamFlag.DAZZLED


@pytest.mark.parametrize("index", [0, 1, 2, 3])
def test_a_part_of_a_scan_lies_on_the_raster_of_quarter_degrees(index: int) -> None:
    setting = Lms2xxSetting(fov_deg=100, resolution_deg=0.25)
    count = 101 if index == 0 else 100
    message = telegram(whole({}, count=count), header=0x2000 | index << 11)
    scan = decode_scan(message, setting)
    assert np.rad2deg(scan.angles[[0, 1]]) == pytest.approx([-50 + index / 4, -49 + index / 4])


def test_a_subrange_begins_at_the_beam_that_it_names() -> None:
    inner = telegram([1000, 1001, 1002]).data
    message = Telegram(Reply.SUBRANGE_SCAN, b"\xb5\x00\xb7\x00" + inner, 0x10)  # beams 181 to 183
    scan = decode_scan(message, HALF)
    assert np.rad2deg(scan.angles) == pytest.approx([0.0, 0.5, 1.0])
    assert scan.ranges == pytest.approx([1.0, 1.001, 1.002])


def test_a_mean_scan_is_a_scan() -> None:
    message = Telegram(Reply.MEAN_SCAN, b"\x05" + telegram(whole({7: 700})).data, 0x10)
    assert decode_scan(message, HALF).ranges[7] == pytest.approx(0.7)


@pytest.mark.parametrize("after", [b"", b"\x07", b"\x07\x20"])
def test_index_bytes_after_the_words_are_no_words(after: bytes) -> None:
    assert len(decode_scan(telegram(whole({}), after=after), HALF)) == 361


def test_a_dirty_window_is_a_warning() -> None:
    dirty = telegram(whole({}))._replace(status=0x92)
    assert decode_scan(dirty, HALF).warnings == ("warning, the front window is dirty",)
    assert decode_scan(telegram(whole({})), HALF).warnings == ()


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (Telegram(Reply.STATUS, bytes(9)), "telegram 0xB1, expected a scan"),
        (telegram(whole({}, count=181)), "181 values from the 1. on, expected 361 for 180 deg"),
        (telegram(whole({}), unit=3), "unit 3, expected 0 (cm), 1 (mm) or 2 (10 cm)"),
        (telegram(whole({}), after=b"123"), "361 values in 727 bytes, expected 724 to 726"),
        (Telegram(Reply.SCAN, b"\x69\x41\x00"), "a scan of 361 values in 3 bytes"),
        (Telegram(Reply.SCAN, b""), "a scan of 0 values"),
        (telegram([1] * 99, header=0x2000), "part 0 of a scan with 99 values, expected 181"),
        (
            Telegram(Reply.SUBRANGE_SCAN, b"\x69\x01\x6b\x01" + telegram([1, 2, 3]).data),
            "3 values from the 361. on, expected 361",
        ),
    ],
)
def test_what_is_no_scan_is_refused_with_the_reason(message: Telegram, reason: str) -> None:
    with pytest.raises(FormatError) as error:
        decode_scan(message, HALF)
    assert reason in str(error.value)


@pytest.mark.parametrize(
    ("fov_deg", "resolution_deg", "mode", "reason"),
    [
        (180, 0.25, 0, "180 deg in steps of 0.25 deg"),
        (90, 1.0, 0, "90 deg"),
        (180, 1.0, 0x3F, "measuring mode 0x3F; expected one of 0x00"),
    ],
)
def test_what_the_scanner_cannot_do_is_refused(
    fov_deg: int, resolution_deg: float, mode: int, reason: str
) -> None:
    with pytest.raises(ConfigError) as error:
        Lms2xxSetting(fov_deg=fov_deg, resolution_deg=resolution_deg, measuring_mode=mode)
    assert reason in str(error.value)


@pytest.mark.parametrize(
    ("setting", "baud", "rate_hz"),
    [
        (HALF, 500000, 37.5),
        (HALF, 38400, 4.6875),  # 191 ms on the line: every eighth scan; 4.7 Hz were measured
        (Lms2xxSetting(resolution_deg=1.0), 38400, 9.375),
        (Lms2xxSetting(resolution_deg=1.0), 500000, 75.0),
        (Lms2xxSetting(fov_deg=100, resolution_deg=0.25), 500000, 18.75),
    ],
)
def test_mirror_and_line_limit_the_rate(setting: Lms2xxSetting, baud: int, rate_hz: float) -> None:
    assert setting.rate_hz(baud) == pytest.approx(rate_hz)
