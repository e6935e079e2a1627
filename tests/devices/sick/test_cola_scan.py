"""``LMDscandata`` whole: a recorded stream, the maker's examples, and every optional block."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.clock import ManualClock
from bearcub.devices.driver import Overheard
from bearcub.devices.link import FileLink
from bearcub.devices.sick import Cola
from bearcub.devices.sick.cola import Dialect, Message, decode, encode, parser
from bearcub.devices.sick.cola_fields import Field
from bearcub.devices.sick.cola_scan import (
    Event,
    Position,
    ScanData,
    decode_scan_data,
    to_scan,
)
from bearcub.devices.stream import Streaming
from bearcub.errors import FormatError
from bearcub.messages import BeamFlag, Scan

A, B = Dialect.A, Dialect.B
STREAM = Path(__file__).parents[3] / ".." / "shared" / "data" / "sick" / "tim781s_colab_16scans.bin"
HEAD: list[Field] = [
    *(("u16", 1), ("u16", 2), ("u32", 17250140), ("u8", 0), ("u8", 0), ("u16", 835), ("u16", 839)),
    *(("u32", 658996137), ("u32", 658997563), ("u8", 1), ("u8", 2), ("u8", 7), ("u8", 0)),
    *(("u16", 0), ("u32", 5000), ("u32", 360)),
]
NOTHING: list[Field] = [("u16", 0)]


def channel(
    content: str,
    values: Sequence[int],
    *,
    kind: str = "u16",
    scale: float = 1.0,
    offset: float = 0.0,
) -> list[Field]:
    return [
        *(("chars", content), ("f32", scale), ("f32", offset)),
        *(("i32", 800_000), ("u16", 5000), ("u16", len(values)), (f"{kind}[]", values)),
    ]


def telegram(
    *,
    encoders: Sequence[tuple[int, int]] = (),
    wide: Sequence[list[Field]] = (),
    narrow: Sequence[list[Field]] = (),
    tail: Sequence[Field] = NOTHING * 5,
    dialect: Dialect = B,
) -> Message:
    fields: list[Field] = [*HEAD, ("u16", len(encoders))]
    for place, speed in encoders:
        fields += [("u32", place), ("u16", speed)]
    for channels in (wide, narrow):
        fields.append(("u16", len(channels)))
        fields += [field for one in channels for field in one]
    return decode(encode("sSN", "LMDscandata", *fields, *tail, dialect=dialect))


@pytest.fixture(scope="module")
def stream() -> bytes:
    if not STREAM.exists():
        pytest.skip(f"needs the recorded stream {STREAM.name}")
    return STREAM.read_bytes()


def test_the_recorded_stream_has_the_values_that_its_maker_gives(stream: bytes) -> None:
    scans = [decode_scan_data(message) for message in parser().feed(stream)]
    assert len(scans) == 16
    first = scans[0]
    assert (first.version, first.device, first.serial_number) == (1, 1, 18480390)
    assert (first.telegram_counter, first.scan_counter) == (44977, 44981)
    assert (first.start_us, first.transmitted_us) == (3014133219, 3014139433)
    assert (first.status, first.inputs, first.outputs) == ((0, 0), (0, 0), (8, 0))
    assert (first.scan_hz, first.measurement_hz) == (15.0, 16200.0)
    assert first.time == "1970-01-01T00:50:14.136000"
    assert (first.encoders, first.position, first.event) == ((), None, None)
    assert (first.device_name, first.comment, first.warnings) == ("", "", ())
    assert [c.content for c in first.channels] == ["DIST1", "RSSI1"]
    distances, remission = first.channels
    assert (distances.start_deg, distances.step_deg, len(distances.raw)) == (-45.0, 0.3333, 811)
    assert distances.raw[:6].tolist() == [626, 657, 616, 2, 2, 2]
    assert remission.raw[:3].tolist() == [8177, 7678, 7840]
    assert [s.telegram_counter for s in scans] == list(range(44977, 44993))
    assert {len(s.channels[0].raw) for s in scans} == {811}


def test_the_recorded_stream_becomes_scans_after_rep_117(stream: bytes) -> None:
    scan = to_scan(decode_scan_data(parser().feed(stream)[0]))
    assert scan.ranges[:3] == pytest.approx([0.626, 0.657, 0.616])
    assert np.isposinf(scan.ranges[3:6]).all()
    assert not np.isnan(scan.ranges).any()
    # 811 beams a third of a degree apart, from -135 to +135; 0.3333 is rounded.
    assert np.rad2deg(scan.angles[[0, 405, 810]]) == pytest.approx([-135.0, 0.0, 135.0])
    assert scan.intensities is not None
    assert scan.intensities[0] == 8177
    assert scan.duration == pytest.approx(0.05, rel=1e-3)  # 270 deg at 15 turns a second


@settings(max_examples=25)
@given(cuts=st.lists(st.integers(0, 53984), max_size=60))
def test_the_recorded_stream_is_the_same_whatever_the_segments(cuts: list[int]) -> None:
    if not STREAM.exists():
        pytest.skip(f"needs the recorded stream {STREAM.name}")
    data = STREAM.read_bytes()
    ends = [0, *sorted(cuts), len(data)]
    reader = parser()
    found = [m for start, end in itertools.pairwise(ends) for m in reader.feed(data[start:end])]
    assert found == parser().feed(data)
    assert len(found) == 16
    assert reader.tally.rejected_bytes == 0


@pytest.mark.parametrize("size", [1, 7, 1448, 4096])
def test_the_recorded_stream_is_the_same_in_segments_of_one_size(stream: bytes, size: int) -> None:
    reader = parser()
    data = stream[: 3 * 3374] if size == 1 else stream
    found = [m for at in range(0, len(data), size) for m in reader.feed(data[at : at + size])]
    assert found == parser().feed(data)


def test_the_recorded_stream_is_played_back_by_the_driver(stream: bytes) -> None:
    clock = ManualClock()
    link = FileLink(STREAM, clock=clock, bytes_per_second=15 * 3374, wait=clock.advance)
    source: Streaming[Scan] = Streaming(
        link, Overheard(Cola()), clock=clock, rate_hz=15.0, role="ladar"
    )
    while "at its end" not in source.health().problem:
        clock.advance(source.step() or 1e-6)
        assert clock.now_ns() < 2e9
    health = source.health()
    assert (health.values, health.drops, health.resyncs) == (16, 0, 0)


LISTING = (
    "sRA LMDscandata 1 1 89A27F 0 0 343 347 27477BA9 2747813B 0 0 7 0 0 1388 168 0 "
    "1 DIST1 3F800000 00000000 186A0 1388 15 8A1 8A5 8AB " + 17 * "8C0 " + "906 0 0 0 0 0 0"
)
"""The telegram listing's example; the values between the third and the last are made up."""


def test_the_example_of_the_telegram_listing_is_decoded() -> None:
    data = decode_scan_data(decode(b"\x02" + LISTING.encode() + b"\x03"))
    assert (data.serial_number, data.telegram_counter, data.scan_counter) == (9020031, 835, 839)
    assert (data.scan_hz, data.measurement_hz, data.outputs) == (50.0, 36000.0, (7, 0))
    (distances,) = data.channels
    assert (distances.start_deg, distances.step_deg, len(distances.raw)) == (10.0, 0.5, 21)
    assert distances.raw[[0, 1, 2, -1]].tolist() == [2209, 2213, 2219, 2310]
    scan = to_scan(data)
    assert scan.ranges[0] == pytest.approx(2.209)
    assert np.rad2deg(scan.angles[[0, -1]]) == pytest.approx([-80.0, -70.0])
    assert scan.intensities is None
    assert data.delay == pytest.approx(0.001426)


@pytest.mark.parametrize("dialect", [A, B])
def test_remission_of_8_bits_comes_in_the_second_block(dialect: Dialect) -> None:
    """As a TiM5xx in CoLa-A: the device's name holds a blank."""
    message = telegram(
        wide=[channel("DIST1", [278, 288, 1112])],
        narrow=[channel("RSSI1", [93, 94, 255], kind="u8")],
        tail=[("u16", 0), ("u16", 1), ("text", "not defined"), *NOTHING * 3],
        dialect=dialect,
    )
    data = decode_scan_data(message)
    assert data.device_name == "not defined"
    assert data.channels[1].raw.dtype == np.uint8
    scan = to_scan(data)
    assert scan.intensities is not None
    assert scan.intensities.tolist() == [93, 94, 255]
    if dialect is A:
        assert message.arguments.endswith(b" 0 1 B not defined 0 0 0")


@pytest.mark.parametrize("dialect", [A, B])
def test_every_block_is_decoded(dialect: Dialect) -> None:
    message = telegram(
        encoders=[(100_000, 65535), (3, 4)],
        wide=[
            channel("DIST1", [1000, 2000]),
            channel("DIST2", [1500, 2500]),
            channel("RSSI1", [10, 20], scale=2.0, offset=-1.0),
            channel("ANGL1", [5, 5]),
        ],
        narrow=[channel("RSSI2", [1, 2], kind="u8")],
        tail=[
            *(("u16", 1), *[("f32", value) for value in (1.5, -2.0, 0.25, 10.0, 20.0, 30.0)]),
            *(("u8", 3), ("u16", 1), ("text", "left scanner"), ("u16", 1), ("text", "42")),
            *(("u16", 1), ("u16", 2026), ("u8", 11), ("u8", 22), ("u8", 4), ("u8", 5), ("u8", 6)),
            *(("u32", 789), ("u16", 1), ("chars", "FEVT"), ("u32", 7), ("u32", 8), ("i32", -450)),
        ],
        dialect=dialect,
    )
    data = decode_scan_data(message)
    assert data.encoders == ((100_000, 65535), (3, 4))
    assert [c.content for c in data.channels] == ["DIST1", "DIST2", "RSSI1", "ANGL1", "RSSI2"]
    assert data.channels[2].values.tolist() == [19.0, 39.0]
    assert data.position == Position(place=(1.5, -2.0, 0.25), rotation=(10.0, 20.0, 30.0), kind=3)
    assert (data.device_name, data.comment) == ("left scanner", "42")
    assert data.time == "2026-11-22T04:05:06.000789"
    assert data.event == Event(kind="FEVT", encoder=7, time_us=8, angle_deg=-0.045)
    second = data.channel("DIST2")
    assert second is not None
    assert second.raw.tolist() == [1500, 2500]
    assert data.channel("DIST5") is None


def simple(values: Sequence[int]) -> ScanData:
    return decode_scan_data(telegram(wide=[channel("DIST1", values)]))


@pytest.mark.parametrize(
    ("raw", "metres"),
    [
        (0, math.inf),  # no echo
        (1, math.nan),  # dazzled
        (2, math.inf),
        (15, math.nan),  # reserved
        (16, -math.inf),  # nearer than 0.05 m
        (49, -math.inf),
        (51, 0.051),
        (20000, 20.0),
    ],
)
def test_codes_become_what_rep_117_says(raw: int, metres: float) -> None:
    scan = to_scan(simple([500, raw]))
    assert scan.ranges.tolist() == pytest.approx([0.5, metres], nan_ok=True)
    assert scan.flags is not None
    assert scan.flags.tolist() == [0, BeamFlag.DAZZLED if raw == 1 else 0]


def test_distances_are_scaled_as_the_lms5xx_does_at_long_range() -> None:
    message = telegram(wide=[channel("DIST1", [40000, 1000], scale=2.0)], dialect=A)
    assert b" 40000000 " in message.arguments
    scan = to_scan(decode_scan_data(message))
    assert scan.ranges.tolist() == pytest.approx([80.0, 2.0])
    assert scan.farthest == pytest.approx(131.07)


def test_what_counts_as_too_close_can_be_chosen() -> None:
    assert to_scan(simple([300, 400]), nearest=0.35).ranges[0] == -math.inf
    assert to_scan(simple([300, 400]), nearest=0.0).ranges[0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("low", "warnings"),
    [
        (0, ()),
        (1, ("reports an error",)),
        (2, ("the front window is getting dirty",)),
        (5, ("the front window is dirty",)),
        (9, ("status 0 9",)),
    ],
)
def test_the_status_is_a_warning_in_words(low: int, warnings: tuple[str, ...]) -> None:
    data = telegram(wide=[channel("DIST1", [500])])
    arguments = bytearray(data.arguments)
    arguments[9] = low
    assert decode_scan_data(data._replace(arguments=bytes(arguments))).warnings == warnings


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (Message("sRA", "STlms", b"7"), "sRA STlms, expected sSN LMDscandata"),
        (telegram(wide=[channel("DIST1", [1], scale=math.nan)]), "DIST1 with scale nan"),
        (telegram()._replace(arguments=b"\x00\x01"), "expected the device number up to byte 4"),
        (telegram(tail=[("u16", 0)]), "expected whether there is the device name"),
        (telegram(encoders=[(1, 1)] * 9), "9 encoders, expected up to 8"),
    ],
)
def test_what_is_no_scan_is_refused_with_the_reason(message: Message, reason: str) -> None:
    with pytest.raises(FormatError) as error:
        decode_scan_data(message)
    assert reason in str(error.value)


def test_a_telegram_without_distances_is_refused_with_what_it_holds() -> None:
    with pytest.raises(FormatError, match="holds RSSI1, expected DIST1"):
        to_scan(decode_scan_data(telegram(wide=[channel("RSSI1", [1])])))
