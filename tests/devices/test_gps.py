"""GPS: golden sentences, quality that travels with the position, gpsd, the local frame, faults."""

import logging
import math
import random
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bearcub.clock import ManualClock
from bearcub.devices.gps import Gpsd, NmeaGps, from_compass
from bearcub.devices.local_frame import LocalFrame
from bearcub.devices.nmea import encode
from bearcub.devices.stream import Streaming
from bearcub.emulators import FAULTS, DirectLink
from bearcub.emulators.emulator import Emulator
from bearcub.emulators.faults import between
from bearcub.emulators.gps import GpsdEmulator, NmeaEmulator, Position, sentences
from bearcub.errors import FormatError, InputError
from bearcub.messages import Fix, FixQuality

GGA = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
RMC = b"$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n"


def fixes(driver: NmeaGps | Gpsd, data: bytes) -> list[Fix]:
    measured = [driver.value(telegram) for telegram in driver.parser.feed(data)]  # type: ignore[arg-type]
    return [m.value for m in measured if m is not None]


def test_the_golden_gga_gives_position_and_quality() -> None:
    (fix,) = fixes(NmeaGps(), GGA)
    assert fix.latitude_deg == pytest.approx(48.1173)
    assert fix.longitude_deg == pytest.approx(11.516667, abs=1e-6)
    assert (fix.quality, fix.satellites, fix.hdop) == (FixQuality.GPS, 8, 0.9)
    assert fix.altitude == 545.4
    assert math.isnan(fix.speed)


def test_the_golden_rmc_adds_speed_course_and_date() -> None:
    (fix,) = fixes(NmeaGps(), RMC + GGA)
    assert fix.speed == pytest.approx(11.52, abs=0.005)
    assert math.degrees(fix.course) == pytest.approx(90 - 84.4)
    assert fix.utc_ns == 764426119 * 10**9  # 1994-03-23 12:35:19 UTC
    assert fix.hdop == 0.9


@pytest.mark.parametrize(
    ("sentence", "reason"),
    [
        (GGA.replace(b"*47", b"*48"), "wrong checksum"),
        (GGA.replace(b"4807", b"4907"), "wrong checksum"),
        (GGA.replace(b"*47", b""), "no checksum"),
        (GGA[:30] + RMC, "telegram cut off"),
    ],
)
def test_a_damaged_sentence_is_refused_with_the_reason(sentence: bytes, reason: str) -> None:
    driver = NmeaGps()
    assert [fix for fix in fixes(driver, sentence) if fix.altitude == 545.4] == []
    assert driver.parser.tally.reasons[reason] == 1


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("GPGGA,123519,,,,,1,08,0.9,545.4,M,46.9,M,,", "latitude nan"),
        ("GPGGA,123519,9907.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,", "latitude 99"),
        ("GPGGA,123519,4807.038,N,01131.000,E,x,08,0.9,545.4,M,46.9,M,,", "quality"),
        ("GPGGA,123519,4807.038,N,01131.000,E,9,08,0.9,545.4,M,46.9,M,,", "quality 9"),
        ("GPGGA,123519,4807.038", "too few fields"),
        ("GPGGA,123519,4807.038,N,01131.000,E,1,08,inf,545.4,M,46.9,M,,", "HDOP inf"),
    ],
)
def test_a_sentence_that_cannot_be_is_refused_with_the_reason(body: str, reason: str) -> None:
    driver = NmeaGps()
    (telegram,) = driver.parser.feed(encode(body))
    with pytest.raises(FormatError, match=reason):
        driver.value(telegram)


@pytest.mark.parametrize(
    ("quality", "expected"),
    [(0, 0), (1, 1), (2, 2), (4, 4), (5, 5), (6, 6), (8, 0)],
)
def test_quality_travels_with_the_position(quality: int, expected: int) -> None:
    body = f"GNGGA,123519,4807.038,N,01131.000,E,{quality},08,0.9,545.4,M,46.9,M,,"
    (fix,) = fixes(NmeaGps(), encode(body))
    assert fix.quality == expected
    assert math.isnan(fix.latitude_deg) == (expected == 0)


def test_a_lost_fix_is_delivered_without_the_last_position() -> None:
    driver = NmeaGps()
    lost = "GPRMC,123520,V,4807.038,N,01131.000,E,,,230394,,", "GPGGA,123520,,,,,0,00,99.9,,M,,M,,"
    found = fixes(driver, RMC + GGA + b"".join(map(encode, lost)))
    assert [fix.quality for fix in found] == [FixQuality.GPS, FixQuality.NONE]
    assert math.isnan(found[1].latitude_deg)
    assert math.isnan(found[1].speed)
    assert found[1].hdop == 99.9


def test_speed_is_never_that_of_another_epoch() -> None:
    driver = NmeaGps()
    later = encode("GPGGA,123520,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,")
    found = fixes(driver, RMC + GGA + later)
    assert [math.isnan(fix.speed) for fix in found] == [False, True]


def test_a_receiver_that_sends_rmc_last_gives_one_fix_an_epoch_all_the_same() -> None:
    driver, found = NmeaGps(), []
    for second in range(10, 20):
        gga = f"GPGGA,1235{second},4807.038,N,01131.000,E,4,08,0.9,545.4,M,46.9,M,,"
        rmc = f"GPRMC,1235{second},A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W"
        found += fixes(driver, encode(gga) + encode(rmc))
    assert len(found) == 10
    assert not any(math.isnan(fix.speed) for fix in found[1:])
    assert {fix.quality for fix in found} == {FixQuality.RTK_FIXED}


def test_a_receiver_without_gga_gives_fixes_too() -> None:
    driver, found = NmeaGps(), []
    for second in range(10, 20):
        rmc = f"GPRMC,1235{second},A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W,D"
        found += fixes(driver, encode(rmc))
    assert len(found) >= 8
    assert found[-1].quality == FixQuality.DGPS


def test_sentences_of_other_kinds_are_no_errors() -> None:
    driver = NmeaGps()
    assert fixes(driver, encode("GPGSV,1,1,00") + encode("PUBX,00,1")) == []
    assert driver.parser.tally.errors == 0


@pytest.mark.parametrize(
    ("course", "angle"), [(0, 90), (90, 0), (180, -90), (270, -180), (84.4, 5.6), (359, 91)]
)
def test_courses_become_counter_clockwise_from_east(course: float, angle: float) -> None:
    assert math.degrees(from_compass(course)) == pytest.approx(angle)


@given(st.data())
def test_pieces_of_any_size_give_the_same_fixes(data: st.DataObject) -> None:
    stream = b"\xff$GP" + RMC + GGA + sentences(Position(), 10**9)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    driver = NmeaGps()
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    found = [fix for piece in pieces for fix in fixes(driver, piece)]
    assert [round(fix.latitude_deg, 4) for fix in found] == [48.1173, 39.1317]


def test_the_emulated_receiver_says_what_it_was_told() -> None:
    there = Position(
        latitude_deg=-33.5, longitude_deg=-70.25, altitude=12.0, speed=2.0, course_deg=200.0,
        quality=5, satellites=14, hdop=0.6,
    )  # fmt: skip
    (fix,) = fixes(NmeaGps(), sentences(there, 3_600_250_000_000))
    assert (fix.latitude_deg, fix.longitude_deg) == pytest.approx((-33.5, -70.25), abs=1e-8)
    assert (fix.altitude, fix.satellites, fix.hdop) == (12.0, 14, 0.6)
    assert fix.quality == FixQuality.RTK_FLOAT
    assert fix.speed == pytest.approx(2.0, abs=1e-3)
    assert math.degrees(fix.course) == pytest.approx(-110)
    assert fix.sigma == pytest.approx(1.2)
    assert fix.utc_ns is not None
    assert fix.utc_ns % (86_400 * 10**9) == 3_600_250_000_000


REPORT = (
    b'{"class":"TPV","mode":3,"status":3,"time":"2026-05-01T12:00:00.250Z","lat":48.1173,'
    b'"lon":11.516667,"altMSL":545.4,"track":84.4,"speed":11.52,"eph":1.5}\r\n'
)


def test_gpsd_reports_give_the_same_kind_of_fix() -> None:
    sky = b'{"class":"SKY","hdop":0.9,"uSat":8}\r\n'
    (fix,) = fixes(Gpsd(), sky + REPORT)
    assert (fix.latitude_deg, fix.longitude_deg) == (48.1173, 11.516667)
    assert (fix.quality, fix.hdop, fix.satellites) == (FixQuality.RTK_FIXED, 0.9, 8)
    assert math.degrees(fix.course) == pytest.approx(5.6)
    assert fix.utc_ns == 1777636800250000000


def test_gpsd_without_a_fix_says_so() -> None:
    (fix,) = fixes(Gpsd(), b'{"class":"TPV","mode":1,"lat":48.0,"lon":11.0}\r\n')
    assert fix.quality == FixQuality.NONE
    assert math.isnan(fix.latitude_deg)


@pytest.mark.parametrize(
    "line",
    [
        b'{"class":"TPV","mode":"3"}\n',
        b'{"class":"TPV","mode":3,"lat":"48"}\n',
        b'{"class":"TPV","mode":3,"lat":1e999,"lon":1}\n',
        b'{"class":"TPV","mode":1,"time":"yesterday"}\n',
        b'{"class":"TPV","mode":1,"time":"2026-13-01T12:00:00Z"}\n',
    ],
)
def test_a_report_that_cannot_be_is_refused(line: bytes) -> None:
    with pytest.raises(FormatError, match=r"gpsd|GPS"):
        fixes(Gpsd(), line)


def test_what_is_no_json_is_refused_and_the_next_line_is_read() -> None:
    driver = Gpsd()
    assert len(fixes(driver, b'{"class"}\n' + b"{" * 5000 + b"\n" + REPORT)) == 1
    assert driver.parser.tally.reasons == {"no JSON object": 2}


def test_a_thousand_metres_to_the_north_east_are_a_thousand_metres() -> None:
    frame = LocalFrame(latitude_deg=48.0, longitude_deg=11.0, altitude=500.0)
    # Radii of curvature of WGS 84 at 48° and 500 m: meridian 6 371 281.5 m + 500, prime vertical
    # 6 389 983.5 m + 500.
    north = math.degrees(1000 / 6_371_781.0)
    east = math.degrees(1000 / (6_390_452.0 * math.cos(math.radians(48.0))))
    fix = Fix(latitude_deg=48.0 + north, longitude_deg=11.0 + east, quality=FixQuality.GPS)
    assert frame.position(fix)[:2] == pytest.approx((1000.0, 1000.0), abs=0.2)
    assert abs(frame.position(fix)[2]) < 0.2  # the earth falls away by d²/2R


def test_no_fix_has_no_place_in_the_local_frame() -> None:
    frame = LocalFrame(latitude_deg=48.0, longitude_deg=11.0)
    nowhere = Fix(latitude_deg=math.nan, longitude_deg=math.nan, quality=FixQuality.NONE)
    assert all(math.isnan(value) for value in frame.position(nowhere))
    with pytest.raises(InputError, match="latitude"):
        LocalFrame(latitude_deg=91.0, longitude_deg=0.0)


MAKERS: dict[str, Callable[[], tuple[Emulator, NmeaGps | Gpsd]]] = {
    "nmea": lambda: (NmeaEmulator(rate_hz=5.0), NmeaGps()),
    "gpsd": lambda: (GpsdEmulator(rate_hz=5.0), Gpsd()),
}


CASES = [("nmea", fault) for fault in sorted(FAULTS)] + [
    ("gpsd", fault) for fault in sorted(FAULTS) if fault != "wrong-baud"
]


@pytest.mark.parametrize(("kind", "fault"), CASES)
def test_after_every_fault_the_receiver_is_back_within_two_seconds(
    kind: str, fault: str, caplog: pytest.LogCaptureFixture
) -> None:
    emulator, driver = MAKERS[kind]()
    clock = ManualClock()
    faulty = FAULTS[fault](emulator, between(2_100_000_000, 4_000_000_000))
    link = DirectLink(faulty, clock=clock, wait=clock.advance)
    source = Streaming(link, driver, clock=clock, rate_hz=5.0, role="gps")

    def run(until_ns: int) -> None:
        while clock.now_ns() < until_ns:
            clock.advance(max(source.step(), 1e-4))
            reading = source.latest()
            assert reading is None or reading.fresh == (reading.age <= 0.4)

    run(2_000_000_000)
    first = source.latest()
    assert first is not None
    assert source.health().good
    caplog.clear()
    run(4_000_000_000)
    warnings = [r for r in caplog.records if r.levelno >= logging.WARNING]
    assert len(warnings) <= 3
    assert all("\n" not in record.getMessage() for record in warnings)
    run(6_000_000_000)
    last = source.latest()
    assert last is not None
    assert last.fresh
    assert last.value.quality == FixQuality.GPS
    assert last.stamp_ns > 5_500_000_000
    assert source.health().good


def mutated(rng: random.Random, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.randrange(4)):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def refitted(rng: random.Random, sentence: bytes) -> bytes:
    """Change fields and put the right checksum on, to reach what a checksum would keep out."""
    fields = sentence[1:-5].decode().split(",")
    words = ["", "A", "-1", "1e400", "nan", "99999999", "0x1", "48.07.0", ",", "٣", "1_0", " "]
    fields[rng.randrange(1, len(fields))] = rng.choice(words)
    del fields[rng.randrange(1, len(fields) + 1) :]
    body = ",".join(fields).encode("ascii", "replace").decode()
    return encode(body)


def fuzz(rounds: int) -> None:
    rng, driver = random.Random(1), NmeaGps()  # noqa: S311 (the same inputs every time)
    pieces = [GGA, RMC, *sentences(Position(), 10**9).splitlines(keepends=True)]
    for _ in range(rounds):
        piece = rng.choice(pieces)
        data = refitted(rng, piece) if rng.random() < 0.5 else mutated(rng, piece)
        for telegram in driver.parser.feed(data):
            try:
                driver.value(telegram)
            except FormatError:
                continue
        assert len(driver.parser._rest) <= 256
    driver.parser.feed(b"\r\n")
    assert driver.parser.feed(GGA) == [GGA[1:-5].decode()]  # the next whole sentence is found


def test_fuzzing_raises_nothing_but_our_own() -> None:
    fuzz(3000)


@pytest.mark.slow
def test_a_million_random_sentences_raise_nothing_but_our_own() -> None:
    fuzz(1_000_000)


def fuzz_gpsd(rounds: int) -> None:
    rng, driver = random.Random(2), Gpsd()  # noqa: S311 (the same inputs every time)
    values = ["null", "true", "[]", "{}", '"x"', "-1", "1e400", "NaN", "9" * 5000, "3"]
    names = ["class", "mode", "status", "time", "lat", "lon", "speed", "track", "eph", "altMSL"]
    for _ in range(rounds):
        data = mutated(rng, REPORT)
        if rng.random() < 0.5:
            name, value = rng.choice(names), rng.choice(values)
            data = b'{"class":"TPV","mode":3,"' + f'{name}":{value}'.encode() + b"}\r\n"
        for telegram in driver.parser.feed(data):
            try:
                driver.value(telegram)
            except FormatError:
                continue
        assert len(driver.parser._rest) <= 16384
    assert len(fixes(driver, b"\n" + REPORT)) == 1


def test_fuzzing_gpsd_raises_nothing_but_our_own() -> None:
    fuzz_gpsd(3000)


@pytest.mark.slow
def test_a_million_random_reports_raise_nothing_but_our_own() -> None:
    fuzz_gpsd(1_000_000)
