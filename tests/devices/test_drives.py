"""Drives without a controller of ours: the dry run, and an autopilot that speaks MAVLink."""

import math
import random
from collections.abc import Callable
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.dry_run import DryRunDrive
from bearcub.devices.mavlink import MavlinkDrive, MavlinkParser
from bearcub.devices.target import Target
from bearcub.emulators import DirectLink
from bearcub.emulators.emulator import Serial
from bearcub.errors import ConfigError, InputError


def test_a_command_counts_until_its_limit() -> None:
    clock = ManualClock()
    target = Target(clock, limit=0.3)
    assert target.current() is None
    target.set(0.5, -0.1)
    clock.advance(0.3)
    assert target.current() == (0.5, -0.1)
    clock.advance(0.001)
    assert target.current() is None
    target.set(0.5, 0.0)
    target.clear()
    assert target.current() is None


def test_impossible_limits_and_commands_are_refused() -> None:
    with pytest.raises(ConfigError, match="command_limit"):
        Target(ManualClock(), limit=60.0)
    with pytest.raises(InputError, match="finite"):
        Target(ManualClock(), limit=0.3).set(math.nan, 0.0)
    with pytest.raises(ConfigError, match="track"):
        DryRunDrive(clock=ManualClock(), track=0.0)


def test_a_dry_run_goes_the_way_an_ideal_robot_would() -> None:
    clock = ManualClock()
    drive = DryRunDrive(clock=clock, track=0.5, acceleration=1.0)
    drive.start()
    for _ in range(20):  # 2 s: 0.5 s to reach 0.5 m/s, then 1.5 s at it
        drive.command(0.5, 0.0)
        clock.advance(0.1)
    reading = drive.feedback()
    assert reading is not None
    assert reading.value.speed == pytest.approx(0.5)
    assert reading.value.left == pytest.approx(0.125 + 0.75)
    clock.advance(5.0)  # nobody commands: 0.2 s more, then 0.125 m to a stand
    stopped = drive.feedback()
    assert stopped is not None
    assert stopped.value.speed == 0.0
    assert stopped.value.left == pytest.approx(0.875 + 0.2 * 0.5 + 0.125)


def test_a_dry_run_turns_left_with_its_right_wheel_ahead() -> None:
    clock = ManualClock()
    drive = DryRunDrive(clock=clock, track=0.5, acceleration=10.0)
    drive.start()
    for _ in range(10):
        drive.command(0.0, 1.0)
        clock.advance(0.1)
    reading = drive.feedback()
    assert reading is not None
    assert reading.value.turn_rate == pytest.approx(1.0)
    assert reading.value.right > 0 > reading.value.left
    drive.close()
    assert drive.health().problem == "drive (dry run): closed"


class Autopilot(Serial):
    """Sends HEARTBEAT, ATTITUDE and LOCAL_POSITION_NED; does at once what it is commanded."""

    baud = 57600

    def __init__(self, dialect: Any, *, armed: bool = True, mode: int = 15) -> None:
        self._mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self._ears = dialect.MAVLink(None)
        self._state = (128 if armed else 0, mode)
        self._last = [-(10**9)] * 2
        self.heard: list[Any] = []
        self.forward = self.clockwise = 0.0
        self.yaw = math.pi / 2  # heading east

    def receive(self, data: bytes) -> None:
        for message in self._ears.parse_buffer(data) or ():
            self.heard.append(message)
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                self.forward, self.clockwise = message.vx, message.yaw_rate

    def poll(self, now_ns: int) -> bytes:
        messages = []
        if now_ns - self._last[0] >= 10**9:
            self._last[0] = now_ns
            messages.append(self._mav.heartbeat_encode(10, 3, self._state[0], self._state[1], 4))
        if now_ns - self._last[1] >= 10**8:
            self._last[1] = now_ns
            messages.append(self._mav.attitude_encode(0, 0, 0, self.yaw, 0, 0, self.clockwise))
            north, east = (self.forward * f(self.yaw) for f in (math.cos, math.sin))
            messages.append(self._mav.local_position_ned_encode(0, 0, 0, 0, north, east, 0))
        return b"".join(bytes(message.pack(self._mav)) for message in messages)


@pytest.fixture
def dialect() -> Any:
    return pytest.importorskip(
        "pymavlink.dialects.v20.ardupilotmega", reason="pymavlink is not installed"
    )


def driven(autopilot: Autopilot, command: Callable[[MavlinkDrive], object]) -> MavlinkDrive:
    clock = ManualClock()
    drive = MavlinkDrive(
        DirectLink(autopilot, clock=clock, wait=clock.advance), clock=clock, speed=0.8
    )
    while clock.now_ns() < 2 * 10**9:
        command(drive)
        clock.advance(max(drive._stream.step(), 1e-3))
    return drive


def test_an_autopilot_gets_velocities_in_its_own_axes(dialect: Any) -> None:
    autopilot = Autopilot(dialect)
    drive = driven(autopilot, lambda drive: drive.command(0.5, 0.2))
    assert autopilot.forward == pytest.approx(0.5)
    assert autopilot.clockwise == pytest.approx(-0.2)
    reading = drive.feedback()
    assert reading is not None
    assert reading.value.speed == pytest.approx(0.5)
    assert reading.value.turn_rate == pytest.approx(0.2)
    assert math.isnan(reading.value.left)
    assert reading.value.enabled
    assert reading.value.faults == ()
    assert drive.health().good
    kinds = {message.get_type() for message in autopilot.heard}
    assert kinds == {"SET_POSITION_TARGET_LOCAL_NED", "HEARTBEAT", "COMMAND_LONG"}
    commands = {m.command for m in autopilot.heard if m.get_type() == "COMMAND_LONG"}
    assert commands == {511}  # asks for messages; never arms (400)
    masks = {m.type_mask for m in autopilot.heard if hasattr(m, "type_mask")}
    assert masks == {0x5C7}


def test_too_fast_a_command_is_slowed_on_the_same_bend(dialect: Any) -> None:
    autopilot = Autopilot(dialect)
    driven(autopilot, lambda drive: drive.command(-1.6, 1.0))
    assert (autopilot.forward, autopilot.clockwise) == pytest.approx((-0.8, -0.5))


def test_without_commands_it_is_told_to_stand(dialect: Any) -> None:
    autopilot = Autopilot(dialect)
    drive = driven(autopilot, lambda drive: drive.stop())
    assert autopilot.forward == 0.0
    autopilot.forward = 1.0
    drive.close()
    assert autopilot.forward == 0.0


@pytest.mark.parametrize(
    ("armed", "mode", "fault"),
    [(False, 15, "autopilot: not armed"), (True, 0, "takes commands in GUIDED only")],
)
def test_what_keeps_an_autopilot_from_driving_is_said(
    dialect: Any, *, armed: bool, mode: int, fault: str
) -> None:
    drive = driven(Autopilot(dialect, armed=armed, mode=mode), lambda drive: drive.command(0.5, 0))
    reading = drive.feedback()
    assert reading is not None
    assert any(fault in text for text in reading.value.faults)


def noise(dialect: Any, inputs: int) -> None:
    rng = random.Random(5)  # noqa: S311 (the same noise every time)
    parser, autopilot = MavlinkParser(), Autopilot(dialect)
    parser.use(dialect)
    for turn in range(inputs):
        data = bytearray(autopilot.poll(turn * 10**9))
        data[rng.randrange(len(data))] = rng.randrange(256)
        parser.feed(bytes(data[: rng.randrange(len(data) + 1)]) + rng.randbytes(rng.randrange(9)))
    parser.silence()
    kinds = [message.get_type() for message in parser.feed(autopilot.poll((inputs + 1) * 10**9))]
    assert kinds == ["HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED"]
    assert parser.tally.errors > 0


def test_noise_raises_nothing_and_the_next_message_is_found(dialect: Any) -> None:
    noise(dialect, 2000)


@pytest.mark.slow
def test_a_million_noisy_messages_raise_nothing(dialect: Any) -> None:
    noise(dialect, 1_000_000)
