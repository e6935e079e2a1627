"""The drive on an emulated controller: motion, both guards, refusals and faults, in manual time."""

import logging
import math
from collections.abc import Callable

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.galil import GalilDrive, GalilSetup
from bearcub.devices.wheels import Wheels
from bearcub.emulators import FAULTS, DirectLink, Emulator
from bearcub.emulators.faults import Unheard, between
from bearcub.emulators.galil import GalilEmulator
from bearcub.errors import ConfigError, InputError

METRE = Wheels(radius=0.5 / math.pi, track=0.5, counts=10000)  # 10000 counts per metre


class Bench:
    """A drive and a controller that live in the same manual time."""

    def __init__(
        self,
        *,
        setup: GalilSetup | None = None,
        controller: GalilEmulator | None = None,
        line: Callable[[GalilEmulator], Emulator] = lambda emulator: emulator,
    ) -> None:
        self.clock = ManualClock()
        self.controller = controller or GalilEmulator()
        self.link = DirectLink(line(self.controller), clock=self.clock, wait=self.clock.advance)
        self.drive = GalilDrive(self.link, setup or GalilSetup(wheels=METRE), clock=self.clock)

    def run(self, seconds: float, command: tuple[float, float] | None = None) -> None:
        """Let the loop command at 20 Hz or more, and the drive do its work."""
        end = self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < end:
            if command is not None:
                self.drive.command(*command)
            self.clock.advance(max(self.drive._stream.step(), 1e-4))

    def leave_alone(self, seconds: float) -> None:
        """Let time pass for the controller while the host is dead."""
        for _ in range(round(seconds * 1000)):
            self.clock.advance(0.001)
            self.controller.poll(self.clock.now_ns())

    def moving(self) -> bool:
        return any(axis.moving for axis in self.controller.axes.values())


@pytest.mark.parametrize("records", [True, False])
def test_the_wheels_do_what_is_commanded(*, records: bool) -> None:
    bench = Bench(controller=GalilEmulator(records=records))
    bench.run(0.3)
    bench.run(3.0, (0.5, 0.4))
    reading = bench.drive.feedback()
    assert reading is not None
    assert reading.fresh
    # 0.5 m/s minus and plus 0.4 rad/s times 0.25 m; ramps of 1 m/s² cost v²/2 each.
    assert bench.controller.axes["A"].speed == pytest.approx(4000, abs=2)
    assert bench.controller.axes["B"].speed == pytest.approx(6000, abs=2)
    assert (reading.value.speed, reading.value.turn_rate) == pytest.approx((0.5, 0.4), abs=0.01)
    assert reading.value.left == pytest.approx(0.4 * 3.0 - 0.4**2 / 2, abs=0.05)
    assert reading.value.right == pytest.approx(0.6 * 3.0 - 0.6**2 / 2, abs=0.05)
    assert reading.value.enabled
    assert reading.value.faults == ()
    assert bench.drive.identity == "DMC4040 Rev 1.2d"


def test_the_controller_stops_the_wheels_when_the_host_falls_silent() -> None:
    bench = Bench()
    bench.run(2.0, (0.5, 0.0))
    assert bench.moving()
    bench.leave_alone(0.25)
    assert not any(axis.stopping for axis in bench.controller.axes.values())
    bench.leave_alone(0.10)  # 0.3 s and a step of the program's after the last heartbeat
    assert all(bench.controller.axes[axis].stopping for axis in "AB")
    bench.leave_alone(0.5 / 2.0)  # v / deceleration
    assert not bench.moving()
    assert all(bench.controller.axes[axis].stop_code == 4 for axis in "AB")


@pytest.mark.parametrize("records", [True, False])
def test_a_watchdog_that_someone_halts_is_started_anew(*, records: bool) -> None:
    bench = Bench(controller=GalilEmulator(records=records))
    bench.run(2.0, (0.2, 0.0))
    bench.controller._program.running = False
    bench.run(1.2, (0.2, 0.0))
    assert "watchdog does not run" in bench.drive.health().last_error
    bench.run(1.0, (0.2, 0.0))
    assert bench.controller._program.running
    assert bench.drive.health().good


def test_without_the_watchdog_the_wheels_would_turn_on() -> None:
    bench = Bench(setup=GalilSetup(wheels=METRE, silence=0.0))
    bench.run(2.0, (0.5, 0.0))
    bench.leave_alone(5.0)
    assert bench.moving()  # what the watchdog is for


def test_nobody_else_can_move_the_wheels_without_a_heartbeat() -> None:
    bench = Bench()
    bench.run(0.5)
    bench.controller.receive(b"JGA=5000\rBG A\r")
    bench.leave_alone(0.1)
    assert not bench.moving()


def test_the_wheels_start_again_when_the_host_is_back() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.leave_alone(2.0)
    bench.run(1.5, (0.3, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert reading.value.speed == pytest.approx(0.3, abs=0.01)


def test_a_loop_that_hangs_stops_the_robot_though_the_thread_lives() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.run(0.3 + 0.1 + 0.25)  # command's limit, two periods, v / deceleration
    assert not bench.moving()
    assert bench.drive.health().good


def test_connecting_alone_switches_no_motor_on() -> None:
    bench = Bench()
    bench.run(1.0)
    reading = bench.drive.feedback()
    assert reading is not None
    assert not reading.value.enabled
    assert reading.value.faults == ()
    assert all(axis.motor_off for axis in bench.controller.axes.values())
    bench.run(0.2, (0.0, 0.0))
    assert [axis.motor_off for axis in bench.controller.axes.values()] == [False, False, True, True]


def test_motors_that_someone_switches_off_stay_off() -> None:
    bench = Bench()
    bench.run(1.0, (0.2, 0.0))
    bench.controller.receive(b"MO\r")
    bench.run(1.0, (0.2, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert "left wheel: motor off" in reading.value.faults
    assert any("cannot begin with the motor off" in fault for fault in reading.value.faults)


def test_stop_is_sent_within_one_period() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.drive.stop()
    bench.run(0.06)
    assert all(bench.controller.axes[axis].stopping for axis in "AB")


def test_closing_stops_the_wheels() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.drive.close()
    bench.controller.poll(bench.clock.now_ns())
    assert all(bench.controller.axes[axis].stopping for axis in "AB")


def test_a_wheel_is_never_commanded_beyond_its_speed_and_the_bend_is_kept() -> None:
    bench = Bench(setup=GalilSetup(wheels=METRE, speed=0.6))
    bench.run(2.0, (2.0, 4.0))  # wheels at 1 and 3 m/s
    assert bench.controller.axes["A"].speed == pytest.approx(2000, abs=2)
    assert bench.controller.axes["B"].speed == pytest.approx(6000, abs=2)


def test_an_encoder_that_wraps_does_not_disturb_the_way() -> None:
    bench = Bench()
    bench.run(0.2)
    bench.controller.axes["A"].actual = bench.controller.axes["A"].commanded = 2.0**31 - 1000
    bench.drive._driver._rolled.restart()
    bench.run(2.0, (0.5, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert bench.controller.axes["A"].position < 0
    assert reading.value.left == pytest.approx(reading.value.right, abs=0.01)


def test_a_limit_switch_is_named() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.controller.axes["B"].forward_limit = True
    bench.run(1.0, (0.5, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert "right wheel: stopped by the forward limit switch" in reading.value.faults
    assert "right wheel: forward limit switch active" in reading.value.faults
    assert "BG B refused: error 22: cannot begin: a limit switch is active" in reading.value.faults


def test_a_jammed_wheel_switches_off_and_waits_for_someone_to_enable_it() -> None:
    bench = Bench()
    bench.run(1.0, (0.5, 0.0))
    bench.controller.axes["A"].jammed = True
    bench.run(5.0, (0.5, 0.0))  # 16384 counts of error take 3.3 s
    reading = bench.drive.feedback()
    assert reading is not None
    assert not reading.value.enabled
    assert reading.value.faults[0] == (
        "left wheel: stopped because the position error exceeded its limit (off-on-error)"
    )
    assert "left wheel: motor off" in reading.value.faults
    bench.controller.axes["A"].jammed = False
    bench.drive.enable()
    bench.run(1.5, (0.3, 0.0))
    again = bench.drive.feedback()
    assert again is not None
    assert again.value.enabled
    assert again.value.faults == ()
    assert again.value.speed == pytest.approx(0.3, abs=0.01)


def test_a_reconnect_does_not_enable_motors_that_a_fault_switched_off() -> None:
    controller = GalilEmulator()
    controller.axes["A"].stop_code = 8
    bench = Bench(controller=controller)
    bench.run(0.5, (0.5, 0.0))
    assert controller.axes["A"].motor_off
    assert not bench.moving()


def test_a_program_of_the_users_is_not_overwritten_unless_allowed(
    caplog: pytest.LogCaptureFixture,
) -> None:
    controller = GalilEmulator()
    controller.poll(0)
    controller.receive(b'DL\r#MINE\rMG "a: b?"\rEN\r\\\r')
    assert controller.poll(0) == b"::"
    bench = Bench(controller=controller)
    bench.run(1.0)
    assert bench.drive.feedback() is None
    assert "holds a program of its own" in bench.drive.health().problem
    assert "replace_program" in caplog.text
    allowed = Bench(controller=controller, setup=GalilSetup(wheels=METRE, replace_program=True))
    allowed.run(1.0)
    assert allowed.drive.health().good


@pytest.mark.parametrize("revision", ["DMC4040 Rev 1.2d", "DMC2280 Rev 1.0o-CM"])
def test_controllers_are_known_by_their_revision(revision: str) -> None:
    bench = Bench(controller=GalilEmulator(revision=revision))
    bench.run(0.5)
    assert bench.drive.health().good
    assert bench.drive.identity == revision


@pytest.mark.parametrize(
    ("controller", "reason"),
    [
        (GalilEmulator(axes=1), "has no axis B"),
        (GalilEmulator(revision="RFM220 by someone else"), "expected a Galil controller"),
    ],
)
def test_a_wrong_controller_is_named(controller: GalilEmulator, reason: str) -> None:
    bench = Bench(controller=controller)
    bench.run(0.5)
    assert reason in bench.drive.health().problem


def refusing(emulator: Emulator, on: Callable[[int], bool]) -> Emulator:
    return Unheard(emulator, on, answer=b"?")


@pytest.mark.parametrize("fault", [*sorted(set(FAULTS) - {"wrong-baud"}), "refusing"])
def test_after_every_fault_the_drive_is_back_within_two_seconds(
    fault: str, caplog: pytest.LogCaptureFixture
) -> None:
    wrap = {**FAULTS, "refusing": refusing}[fault]
    on = between(2_100_000_000, 4_000_000_000)
    bench = Bench(line=lambda emulator: wrap(emulator, on))
    bench.run(2.0, (0.4, 0.0))
    before = bench.drive.feedback()
    assert before is not None
    caplog.clear()
    while bench.clock.now_ns() < 4_000_000_000:
        bench.run(0.02, (0.4, 0.0))
        reading = bench.drive.feedback()
        assert reading is not None
        assert not reading.fresh or reading.age <= 0.2
    warnings = [r for r in caplog.records if r.levelno >= logging.WARNING]
    if fault in ("stuck", "half", "reset", "refusing"):
        assert warnings
        assert all("\n" not in r.getMessage() for r in warnings)
    bench.run(2.0, (0.4, 0.0))
    after = bench.drive.feedback()
    assert after is not None
    assert after.fresh
    assert bench.drive.health().good
    assert after.value.speed == pytest.approx(0.4, abs=0.05)  # TV averages over 0.25 s
    # What rolled while nobody could look is not made up.
    rolled = bench.controller.axes["A"].actual / 10000
    assert after.value.left <= rolled + 0.01


def test_a_dead_controller_is_named_within_half_a_second() -> None:
    bench = Bench()
    bench.run(1.0, (0.2, 0.0))
    bench.link.plugged = False
    bench.run(0.5, (0.2, 0.0))
    health = bench.drive.health()
    assert health.problem.startswith("drive (emulator):")
    reading = bench.drive.feedback()
    assert reading is not None
    assert not reading.fresh


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.0, math.inf)])
def test_a_command_that_is_no_number_is_refused(command: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="finite"):
        Bench().drive.command(*command)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"left": "A", "right": "A"}, "two different letters"),
        ({"speed": 0.0}, r"galil\.speed"),
        ({"silence": 9.0}, "silence"),
        ({"silence": 0.05, "rate_hz": 20.0}, "two periods"),
        ({"speed": 2000.0}, "which the controller does not reach"),
    ],
)
def test_an_impossible_setup_is_refused(wrong: dict[str, object], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        GalilSetup(wheels=METRE, **wrong)  # type: ignore[arg-type]
