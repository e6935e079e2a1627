"""Bytes of real tilt sensors and IMUs, and what they say in REP-103."""

import math
import struct
from typing import Any

import pytest

from bearcub.devices.driver import Driver, Measured
from bearcub.devices.nmea import encode as sentence
from bearcub.devices.tilt import mip, xsens
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.devices.tilt.cxtilt import Cxtilt
from bearcub.devices.tilt.hmr3000 import Hmr3000
from bearcub.devices.tilt.tcm2 import Tcm2
from bearcub.devices.tilt.vectornav import VectorNav, VectorNavInertial
from bearcub.devices.tilt.xdr import Xdr
from bearcub.errors import DeviceError, FormatError
from bearcub.messages import Orientation, Tilt

VNYMR_1 = (
    b"$VNYMR,+100.949,-007.330,+000.715,-00.0049,-00.2449,+00.5397,"
    b"-01.258,-00.100,-09.701,-00.000018,+00.001122,-00.000551*69\r\n"
)
VNYMR_2 = (
    b"$VNYMR,-004.328,+001.357,+178.257,+00.2219,-00.0720,+00.4652,"
    b"+00.226,-00.321,+10.043,-00.001188,+00.001866,-00.007661*6C\r\n"
)


def measured(driver: Driver[Any, Any], data: bytes) -> Measured[Any]:
    """The one value in these bytes."""
    values = [driver.value(telegram) for telegram in driver.parser.feed(data)]
    (value,) = [value for value in values if value is not None]
    assert driver.parser.tally.errors == 0
    return value


def degrees(driver: Driver[Any, Tilt], data: bytes) -> tuple[float, float, float]:
    """Pitch nose down, roll right side down, yaw from east, of these bytes."""
    tilt = measured(driver, data).value
    yaw = tilt.yaw if isinstance(tilt, Orientation) else math.nan
    return math.degrees(tilt.pitch), math.degrees(tilt.roll), math.degrees(yaw)


# What each device says of pitch and heading is turned round: nose down, and from east.
@pytest.mark.parametrize(
    ("driver", "data", "expected"),
    [
        (Cxtilt(), bytes.fromhex("FF01BBFF2EE9"), (1.2167, 0.5768, math.nan)),
        (
            Tcm2(),
            b"$C328.3P28.4R-12.4X55.11Y12.33Z-18.43T22.3E001*29\r\n",
            (-28.4, -12.4, math.nan),  # E001: the field is distorted, so no heading
        ),
        (Tcm2(), sentence("C328.3P28.4R-12.4"), (-28.4, -12.4, 90 - 328.3 + 360)),
        (Hmr3000(), b"$PTNTHPR,354.9,N,5.2,N,0.2,N*3A\r\n", (-5.2, 0.2, 95.1)),
        (Hmr3000(), b"$PTNTHPR,85.9,N,-0.9,N,0.8,N*2C\r\n", (0.9, 0.8, 4.1)),
        (Hmr3000(), b"$PTNTHPR,240.1,N,0.8,N,2.2,N*3B\r\n", (-0.8, 2.2, -150.1)),
        (Hmr3000(), b"$PTNTHPR,130.7,N,-9.1,N,1.2,N*17\r\n", (9.1, 1.2, -40.7)),
        (Hmr3000(mils=True), sentence("PTNTHPR,1600,N,160,O,-80,M"), (-9.0, -4.5, 0.0)),
        (Xdr(), b"$YXXDR,A,-1.22,D,PITCH,A,0.58,D,ROLL*35\r\n", (1.22, 0.58, math.nan)),
        (
            Xdr(),
            b"$HCHDT,128.0,T*22\r\n$YXXDR,A,-1.22,D,PITCH,A,0.58,D,ROLL*35\r\n",
            (1.22, 0.58, -38.0),
        ),
        (VectorNav(), VNYMR_1, (7.33, 0.715, -10.949)),
        (VectorNav(), VNYMR_2, (-1.357, 178.257, 94.328)),
    ],
)
def test_golden_bytes_say_what_they_should(
    driver: Driver[Any, Tilt], data: bytes, expected: tuple[float, float, float]
) -> None:
    # Half of the last digit that the device sends; the counts of a CXTILT02 are 0.003 degrees.
    assert degrees(driver, data) == pytest.approx(expected, abs=5e-5, nan_ok=True)


def test_a_wrong_checksum_is_refused_with_that_reason() -> None:
    driver = Hmr3000()
    assert driver.parser.feed(b"$PTNTHPR,-5.9,N,-0.9,N,0.8,N*2C\r\n") == []
    assert driver.parser.tally.reasons == {"wrong checksum": 1}
    assert len(driver.parser.feed(b"$PTNTHPR,-5.9,N,-0.9,N,0.8,N*39\r\n")) == 1


def test_a_reply_found_in_noise_is_not_believed_the_next_one_is() -> None:
    driver = Cxtilt()
    reply = bytes.fromhex("FF01BBFF2EE9")
    (telegram,) = driver.parser.feed(b"noise" + reply)
    with pytest.raises(FormatError, match="a reply among 5 bytes of noise"):
        driver.value(telegram)
    assert measured(driver, reply).value.pitch == pytest.approx(math.radians(1.2167), abs=1e-6)


def test_the_latency_is_what_the_bytes_take_on_the_line() -> None:
    assert measured(Cxtilt(), bytes.fromhex("FF01BBFF2EE9")).latency == pytest.approx(6 / 960)
    line = sentence("PTNTHPR,354.9,N,5.2,N,0.2,N")
    assert measured(Hmr3000(), line).latency == pytest.approx(len(line) / 1920)
    assert measured(VectorNav(), VNYMR_1).latency == pytest.approx(len(VNYMR_1) / 11520)


def test_an_angle_to_the_level_plane_becomes_the_angle_turned() -> None:
    # Turned by a roll of 30 degrees after a pitch of 60, the y axis is 14.48 degrees off level.
    told = math.asin(math.cos(math.radians(60)) * math.sin(math.radians(30)))
    tilt = tilt_from(Convention(to_level=True), pitch=math.radians(60), roll=told)
    assert math.degrees(told) == pytest.approx(14.48, abs=0.01)
    assert math.degrees(tilt.roll) == pytest.approx(30.0)
    with pytest.raises(FormatError, match="pitch 80 and roll nan degrees"):
        tilt_from(Convention(to_level=True), pitch=math.radians(80), roll=math.radians(30))


def test_a_convention_turns_each_sign_by_itself() -> None:
    other = Convention(nose_up=False, right_down=False, compass=False)
    turned = tilt_from(other, pitch=0.1, roll=0.2, heading=0.3)
    assert turned == Orientation(pitch=0.1, roll=-0.2, yaw=0.3)
    assert tilt_from(AIRCRAFT, pitch=0.1, roll=0.2, heading=0.0).pitch == -0.1
    driver = Cxtilt(convention=Convention(nose_up=False))
    assert degrees(driver, bytes.fromhex("FF01BBFF2EE9"))[0] == pytest.approx(-1.2167, abs=5e-5)


@pytest.mark.parametrize(
    ("driver", "data", "reason"),
    [
        (Hmr3000(), sentence("PTNTHPR,,P,5.2,N,,P"), "roll has status P, high alarm"),
        (Hmr3000(), sentence("PTNTHPR,1.0,N,5.2,C,0.2,N"), "pitch has status C, tuning"),
        (Hmr3000(), sentence("PTNTHPR,1.0,N,x,N,0.2,N"), "'x', expected a number"),
        (Hmr3000(), sentence("PTNTHPR,1.0,N,95.0,N,0.2,N"), "pitch 95 and roll 0.2 degrees"),
        (Hmr3000(), sentence("PTNTHPR,1.0,N,5.2"), "3 fields, expected 6"),
        (Tcm2(), sentence("C1.0P5.0R5.0E002"), "error E002, tilt out of its range"),
        (Tcm2(), sentence("C1.0P5.0R5.0E800"), "error E800, memory corrupted"),
        (Tcm2(), sentence("C1.0P5.0P6.0R5.0"), "one number each, at P6.0R5.0"),
        (Tcm2(), sentence("C1.0P--5R5.0"), "one number each, at P--5R5.0"),
        (Xdr(), sentence("YXXDR,A,1.0,R,PITCH"), "PITCH in unit 'R', expected D for degrees"),
        (Xdr(), sentence("YXXDR,A,1.0,D"), "3 fields, expected groups of 4"),
        (Xdr(), sentence("HCHDT"), "'', expected a number"),
        (VectorNav(), sentence("VNYMR,1,2,3"), "3 fields, expected 12"),
        (mip.Mip(), mip.encode(0x80, (0x0C, b"\0\0")), "2 bytes, expected 12 for three floats"),
        (
            mip.Mip(),
            mip.encode(0x80, (0x0C, struct.pack(">fff", 0, math.nan, 0))),
            "expected three finite numbers",
        ),
        (
            mip.Mip(),
            mip.encode(0x82, (0x05, struct.pack(">fffH", 0, 0, 0, 0))),
            "its valid flag is 0; expected 1",
        ),
        (xsens.Xsens(), xsens.encode(0x36, b"\x20\x30\x0c\0\0"), "an item ends behind it, at 15"),
        (xsens.Xsens(), xsens.encode(0x36, b"\x20\x30\x02\0\0"), "2 bytes, expected 12"),
        (
            xsens.Xsens(),
            xsens.encode(0x36, b"\x20\x30\x0c" + struct.pack(">fff", 0, math.inf, 0)),
            "expected finite numbers",
        ),
    ],
)
def test_a_telegram_that_cannot_be_right_is_refused_with_the_reason(
    driver: Driver[Any, Any], data: bytes, reason: str
) -> None:
    (telegram,) = driver.parser.feed(data)
    with pytest.raises(FormatError, match=reason):
        driver.value(telegram)


@pytest.mark.parametrize(
    ("driver", "data"),
    [
        (Tcm2(), sentence("C255.5")),
        (Tcm2(), sentence("HCHDM,182.3,M")),
        (Xdr(), sentence("GPGGA,1,2,3")),
        (Xdr(), sentence("YXXDR,C,19.5,C,AIR")),
        (Hmr3000(), sentence("HCHDT,128.0,T")),
        (VectorNav(), b"$VNRRG,01,VN-200T-CR*31\r\n"),
        (mip.Mip(), mip.encode(0x0C, (0xF1, b"\x08\0"))),
        (xsens.Xsens(), xsens.encode(0x31)),
    ],
)
def test_a_telegram_about_something_else_is_no_value_and_no_error(
    driver: Driver[Any, Any], data: bytes
) -> None:
    (telegram,) = driver.parser.feed(data)
    assert driver.value(telegram) is None
    assert driver.parser.tally.errors == 0


def test_pitch_and_roll_of_two_sentences_are_one_value() -> None:
    driver = Xdr()
    pitch = sentence("YXXDR,A,-3.0,D,PTCH")
    roll = sentence("YXXDR,A,2.0,D,ROLL")
    assert degrees(driver, pitch + roll)[:2] == pytest.approx((3.0, 2.0))
    assert [driver.value(telegram) for telegram in driver.parser.feed(roll)] == [None]


def test_half_a_value_from_before_the_line_was_lost_is_forgotten() -> None:
    driver = Xdr()
    for telegram in driver.parser.feed(sentence("YXXDR,A,-3.0,D,PITCH")):
        assert driver.value(telegram) is None
    assert list(driver.conversation()) == []
    for telegram in driver.parser.feed(sentence("YXXDR,A,2.0,D,ROLL")):
        assert driver.value(telegram) is None


@pytest.mark.parametrize(
    ("made", "golden"),
    [
        (mip.encode(0x01, (0x01, b"")), "75 65 01 02 02 01 E0 C6"),
        (mip.encode(mip.BASE, (mip.IDLE, b"")), "75 65 01 02 02 02 E1 C7"),
        (mip.encode(mip.BASE, (mip.RESUME, b"")), "75 65 01 02 02 06 E5 CB"),
        (xsens.encode(xsens.GO_TO_CONFIG), "FA FF 30 00 D1"),
        (xsens.encode(xsens.GO_TO_CONFIG + 1), "FA FF 31 00 D0"),
        (xsens.encode(xsens.GO_TO_MEASUREMENT), "FA FF 10 00 F1"),
        (xsens.encode(0x00), "FA FF 00 00 01"),
        (xsens.encode(0x3F), "FA FF 3F 00 C2"),
        (sentence("HCHDM,182.3,M"), b"$HCHDM,182.3,M*21\r\n".hex()),
        (sentence("VNWRG,07,40"), "24 56 4E 57 52 47 2C 30 37 2C 34 30 2A 35 39 0D 0A"),
    ],
)
def test_commands_have_their_golden_bytes(made: bytes, golden: str) -> None:
    assert made == bytes.fromhex(golden)


def test_mip_attitudes_of_the_imu_and_of_the_filter_are_turned_round() -> None:
    angles = struct.pack(">fff", 0.2, 0.1, math.pi / 2)  # roll, nose up, facing east
    for data in (
        mip.encode(0x80, (0x0C, angles)),
        mip.encode(0x82, (0x10, b"\0\0"), (0x05, angles + b"\0\x01")),
    ):
        tilt = measured(mip.Mip(), data).value
        assert (tilt.pitch, tilt.roll, tilt.yaw) == pytest.approx((-0.1, 0.2, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("identifier", "packed"),
    [
        (0x2030, struct.pack(">fff", 2.5, -4.0, 90.0)),
        (0x2033, struct.pack(">ddd", 2.5, -4.0, 90.0)),
        (0x2031, struct.pack(">iii", 5 << 19, -4 << 20, 90 << 20)),
        (0x2032, struct.pack(">IhIhIh", 1 << 31, 2, 0, -4, 0, 90)),
        (0x2034, struct.pack(">fff", 2.5, 4.0, 0.0)),  # NED: nose up, clockwise from north
    ],
)
def test_xsens_angles_come_in_every_format_and_both_frames(identifier: int, packed: bytes) -> None:
    data = struct.pack(">HBHHB", 0x1020, 2, 7, identifier, len(packed)) + packed
    assert degrees(xsens.Xsens(), xsens.encode(0x36, data)) == pytest.approx((-4.0, 2.5, 90.0))


def test_a_long_xsens_message_has_two_bytes_of_length() -> None:
    long = bytes(300)
    made = xsens.encode(0x36, long)
    assert made[:6] == bytes.fromhex("FAFF36FF012C")
    assert xsens.parser().feed(made) == [xsens.Message(0x36, long)]


def test_an_xsens_that_woke_up_is_set_up_again() -> None:
    driver = xsens.Xsens()
    (telegram,) = driver.parser.feed(xsens.encode(xsens.WAKE_UP))
    with pytest.raises(DeviceError, match="has started anew"):
        driver.value(telegram)


def test_raw_values_of_each_imu_are_in_the_axes_of_the_body() -> None:
    level_nose_down = (-1.0, 0.5, 9.7)  # x ahead points down a little, so gravity pushes back
    forward_right_down = struct.pack(">fff", -1.0 / mip.G, -0.5 / mip.G, -9.7 / mip.G)
    rates = struct.pack(">fff", 0.1, -0.2, -0.3)
    found = measured(
        mip.MipInertial(), mip.encode(0x80, (0x04, forward_right_down), (0x05, rates))
    ).value
    assert found.acceleration == pytest.approx(level_nose_down, abs=1e-5)
    assert found.rate == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
    own = struct.pack(">HBfff", 0x4020, 12, *level_nose_down)
    own += struct.pack(">HBfff", 0x8020, 12, 0.1, 0.2, 0.3)
    found = measured(xsens.XsensInertial(), xsens.encode(0x36, own)).value
    assert found.acceleration == pytest.approx(level_nose_down)
    assert found.rate == pytest.approx((0.1, 0.2, 0.3))
    found = measured(VectorNavInertial(), VNYMR_1).value
    assert found.acceleration == (-1.258, 0.100, 9.701)
    assert found.rate == (-0.000018, -0.001122, 0.000551)


def test_a_rate_that_a_vectornav_does_not_have_is_refused() -> None:
    with pytest.raises(DeviceError, match="rate_hz = 30: a VectorNav takes one of 1, 2, 4"):
        VectorNav(rate_hz=30)
