"""What a driver makes of an emulator's bytes is the attitude that was put in."""

import math

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.nmea import encode
from bearcub.devices.stream import Streaming
from bearcub.devices.tilt import mip, xsens
from bearcub.emulators import DirectLink
from bearcub.emulators.kind import Kind
from bearcub.emulators.tilt.attitude import heading_deg, inertial, rocking
from bearcub.emulators.tilt.kinds import TILT_KINDS
from bearcub.emulators.tilt.mip import MipEmulator
from bearcub.emulators.tilt.talkers import Tcm2Emulator
from bearcub.emulators.tilt.vectornav import VectorNavEmulator
from bearcub.emulators.tilt.xsens import XsensEmulator
from bearcub.messages import Orientation, Tilt

ROUNDING = math.radians(0.051)  # devices send tenths of a degree at worst
MOVED = math.radians(0.45)  # the robot pitches by at most 3.9 deg/s, a line takes 0.1 s
CASES = [
    pytest.param(kind, fault, id=f"{name}-{fault}")
    for name, kind in TILT_KINDS.items()
    for fault in ("none", *kind.all_faults)
]


@pytest.mark.parametrize(("kind", "fault"), CASES)
def test_no_wrong_attitude_is_delivered_whatever_happens(kind: Kind, fault: str) -> None:
    clock = ManualClock()
    emulator = kind.emulator()
    if fault != "none":
        emulator = kind.all_faults[fault](emulator, lambda now_ns: now_ns // 10**9 % 2 == 1)
    link = DirectLink(emulator, clock=clock, wait=clock.advance)
    source: Streaming[Tilt] = Streaming(
        link, kind.driver(), clock=clock, rate_hz=kind.rate_hz, role="tilt"
    )
    late = 0.15 if fault == "merged" else 0.02 * 30 if fault == "split" else 0.0
    seen = 0
    while clock.now_ns() < 6e9:
        clock.advance(source.step() or 1e-6)
        reading = source.latest()
        if reading is None or reading.count == seen:
            continue
        seen = reading.count
        truth = rocking(reading.stamp_ns)
        allowed = ROUNDING + MOVED + math.radians(3.9) * late
        assert abs(reading.value.pitch - truth.pitch) < allowed
        assert abs(reading.value.roll - truth.roll) < allowed
        if isinstance(reading.value, Orientation):
            assert abs(reading.value.yaw) < ROUNDING
    assert seen >= 6


def test_at_rest_the_raw_values_are_gravity_alone() -> None:
    raw = inertial(lambda _: Tilt(pitch=math.radians(30), roll=0.0), 0)
    assert raw.acceleration == pytest.approx((-9.80665 / 2, 0.0, 9.80665 * math.sqrt(3) / 2))
    assert raw.rate == (0.0, 0.0, 0.0)


def test_a_turn_of_the_pitch_is_felt_about_y_and_of_the_roll_about_x() -> None:
    raw = inertial(lambda now_ns: Tilt(pitch=now_ns * 1e-9, roll=now_ns * 2e-9), 0)
    assert raw.rate == pytest.approx((2.0, 1.0, 0.0))


@pytest.mark.parametrize(("yaw", "heading"), [(0.0, 90.0), (90.0, 0.0), (180.0, 270.0)])
def test_the_compass_counts_clockwise_from_north(yaw: float, heading: float) -> None:
    turned = Orientation(pitch=0.0, roll=0.0, yaw=math.radians(yaw))
    assert heading_deg(turned) == pytest.approx(heading)


def test_a_tcm2_obeys_halt_and_go_and_prompts() -> None:
    device = Tcm2Emulator(rate_hz=10.0, halted=False)
    assert device.poll(0).startswith(b"$C")
    device.receive(b"h\rg")
    assert device.poll(10**9) == b":\r\n"
    device.receive(b"o\r")
    assert device.poll(2 * 10**9).startswith(b":\r\n$C")


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        (encode("VNWRG,07,40"), encode("VNWRG,07,40")),
        (encode("VNWRG,07,41"), encode("VNERR,07")),
        (encode("VNWRG,99,1"), encode("VNERR,08")),
        (encode("VNXYZ,1"), encode("VNERR,04")),
        (b"$VNWRG,07,40*00\r\n", b"$VNERR,03*72\r\n"),
    ],
)
def test_a_vectornav_answers_as_the_manual_says(command: bytes, reply: bytes) -> None:
    device = VectorNavEmulator()
    device.receive(command)
    assert device.poll(0) == reply


def test_a_mip_device_refuses_what_it_does_not_have() -> None:
    device = MipEmulator()
    device.receive(mip.encode(mip.BASE, (0x77, b"")))
    assert device.poll(0) == mip.encode(mip.BASE, (mip.ACK, b"\x77\x01"))
    device.receive(mip.encode(mip.DATA, (mip.MESSAGE_FORMAT, b"\x01\x01\x99\x00\x05")))
    assert device.poll(0) == mip.encode(mip.DATA, (mip.ACK, b"\x08\x03"))


def test_an_xsens_takes_settings_in_its_configuration_state_only() -> None:
    device = XsensEmulator()
    settings = xsens.encode(xsens.SET_OUTPUT, bytes.fromhex("20300032"))
    device.receive(xsens.encode(xsens.GO_TO_MEASUREMENT) + settings)
    messages = xsens.parser().feed(device.poll(0))
    assert [message.kind for message in messages] == [0x11, xsens.ERROR, xsens.MT_DATA_2]
    device.receive(xsens.encode(xsens.GO_TO_CONFIG) + settings)
    messages = xsens.parser().feed(device.poll(10**9))
    assert [message.kind for message in messages] == [0x31, 0xC1]
