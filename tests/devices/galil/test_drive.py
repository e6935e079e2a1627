"""The drive on an emulated controller, in manual time: motion, both guards, refusals."""

import math
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.galil import GalilDrive, GalilSetup
from bearcub.devices.link import SerialLink
from bearcub.emulators.drive_kinds import EMULATED_WHEELS as METRE
from bearcub.emulators.galil import GalilEmulator
from bearcub.errors import ConfigError, InputError


@pytest.mark.parametrize("records", [True, False])
def test_the_wheels_do_what_is_commanded(on_bench: Any, *, records: bool) -> None:
    bench = on_bench(controller=GalilEmulator(records=records))
    bench.run(0.3)
    bench.run(3.0, (0.5, 0.4))
    reading = bench.drive.feedback()
    assert reading is not None
    assert reading.fresh
    # 0.5 m/s minus and plus 0.4 rad/s times 0.25 m; ramps of 1 m/s² cost v²/2 each.
    assert bench.controller.axes["A"].speed == pytest.approx(4000, abs=2)
    assert bench.controller.axes["B"].speed == pytest.approx(6000, abs=2)
    assert (reading.value.speed, reading.value.turn_rate) == pytest.approx((0.5, 0.4), abs=0.01)
    # The first command and the last reading are each up to a period of 0.05 s late.
    assert reading.value.left == pytest.approx(0.4 * 2.95 - 0.4**2 / 2, abs=0.4 * 0.06)
    assert reading.value.right == pytest.approx(0.6 * 2.95 - 0.6**2 / 2, abs=0.6 * 0.06)
    assert reading.value.enabled
    assert reading.value.faults == ()
    assert bench.drive.identity == "DMC4040 Rev 1.2d"


def test_the_controller_stops_the_wheels_when_the_host_falls_silent(
    on_bench: Any,
) -> None:
    bench = on_bench()
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
def test_a_watchdog_that_someone_halts_is_started_anew(on_bench: Any, *, records: bool) -> None:
    bench = on_bench(controller=GalilEmulator(records=records))
    bench.run(2.0, (0.2, 0.0))
    bench.controller._program.running = False
    bench.run(1.2, (0.2, 0.0))
    assert "watchdog does not run" in bench.drive.health().last_error
    bench.run(1.0, (0.2, 0.0))
    assert bench.controller._program.running
    assert bench.drive.health().good


def test_without_the_watchdog_the_wheels_would_turn_on(on_bench: Any) -> None:
    bench = on_bench(setup=GalilSetup(wheels=METRE, silence=0.0))
    bench.run(2.0, (0.5, 0.0))
    bench.leave_alone(5.0)
    assert bench.moving()  # what the watchdog is for


def test_nobody_else_can_move_the_wheels_without_a_heartbeat(
    on_bench: Any,
) -> None:
    bench = on_bench()
    bench.run(0.5)
    bench.controller.receive(b"JGA=5000\rBG A\r")
    bench.leave_alone(0.1)
    assert not bench.moving()


def test_the_wheels_start_again_when_the_host_is_back(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(1.0, (0.5, 0.0))
    bench.leave_alone(2.0)
    bench.run(1.5, (0.3, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert reading.value.speed == pytest.approx(0.3, abs=0.01)


def test_a_loop_that_hangs_stops_the_robot_though_the_thread_lives(
    on_bench: Any,
) -> None:
    bench = on_bench()
    bench.run(1.0, (0.5, 0.0))
    bench.run(0.3 + 0.1 + 0.25)  # command's limit, two periods, v / deceleration
    assert not bench.moving()
    assert bench.drive.health().good


def test_connecting_alone_switches_no_motor_on(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(1.0)
    reading = bench.drive.feedback()
    assert reading is not None
    assert not reading.value.enabled
    assert reading.value.faults == ()
    assert all(axis.motor_off for axis in bench.controller.axes.values())
    bench.run(0.2, (0.0, 0.0))
    assert [axis.motor_off for axis in bench.controller.axes.values()] == [False, False, True, True]


def test_motors_that_someone_switches_off_stay_off(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(1.0, (0.2, 0.0))
    bench.controller.receive(b"MO\r")
    bench.run(1.0, (0.2, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert "left wheel: motor off" in reading.value.faults
    assert any("cannot begin with the motor off" in fault for fault in reading.value.faults)


def test_stop_is_sent_within_one_period(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(1.0, (0.5, 0.0))
    bench.drive.stop()
    bench.run(0.06)
    assert all(bench.controller.axes[axis].stopping for axis in "AB")


def test_closing_stops_the_wheels(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(1.0, (0.5, 0.0))
    bench.close()
    bench.controller.poll(bench.clock.now_ns())
    assert all(bench.controller.axes[axis].stopping for axis in "AB")


def test_a_wheel_is_never_commanded_beyond_its_speed_and_the_bend_is_kept(
    on_bench: Any,
) -> None:
    bench = on_bench(setup=GalilSetup(wheels=METRE, speed=0.6))
    bench.run(2.0, (2.0, 4.0))  # wheels at 1 and 3 m/s
    assert bench.controller.axes["A"].speed == pytest.approx(2000, abs=2)
    assert bench.controller.axes["B"].speed == pytest.approx(6000, abs=2)


def test_an_encoder_that_wraps_does_not_disturb_the_way(on_bench: Any) -> None:
    bench = on_bench()
    bench.run(0.22)  # between two readings
    bench.controller.axes["A"].actual = bench.controller.axes["A"].commanded = 2.0**31 - 1000
    bench.drive._driver._rolled.restart()
    bench.run(2.0, (0.5, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert bench.controller.axes["A"].position < 0
    assert reading.value.left == pytest.approx(reading.value.right, abs=0.01)


@pytest.mark.parametrize("records", [True, False])
def test_a_limit_switch_is_named(on_bench: Any, *, records: bool) -> None:
    bench = on_bench(controller=GalilEmulator(records=records))
    bench.run(1.0, (0.5, 0.0))
    bench.controller.axes["B"].forward_limit = True
    bench.run(1.0, (0.5, 0.0))
    reading = bench.drive.feedback()
    assert reading is not None
    assert "right wheel: stopped by the forward limit switch" in reading.value.faults
    assert "right wheel: forward limit switch active" in reading.value.faults
    assert "BG B refused: error 22: cannot begin: a limit switch is active" in reading.value.faults
    assert bench.drive.health().errors == 0


def test_a_jammed_wheel_switches_off_and_waits_for_someone_to_enable_it(
    on_bench: Any,
) -> None:
    bench = on_bench()
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


def test_a_reconnect_does_not_enable_motors_that_a_fault_switched_off(
    on_bench: Any,
) -> None:
    controller = GalilEmulator()
    controller.axes["A"].stop_code = 8
    bench = on_bench(controller=controller)
    bench.run(0.5, (0.5, 0.0))
    assert controller.axes["A"].motor_off
    assert not bench.moving()


def test_a_program_of_the_users_is_not_overwritten_unless_allowed(
    on_bench: Any, caplog: pytest.LogCaptureFixture
) -> None:
    controller = GalilEmulator()
    controller.poll(0)
    controller.receive(b'DL\r#MINE\rMG "a: b?"\rEN\r\\\r')
    assert controller.poll(0) == b"::"
    bench = on_bench(controller=controller)
    bench.run(1.0)
    assert bench.drive.feedback() is None
    assert "holds a program of its own" in bench.drive.health().problem
    assert "replace_program" in caplog.text
    bench.close()
    allowed = on_bench(controller=controller, setup=GalilSetup(wheels=METRE, replace_program=True))
    allowed.run(1.0)
    assert allowed.drive.health().good


@pytest.mark.parametrize("revision", ["DMC4040 Rev 1.2d", "DMC2280 Rev 1.0o-CM"])
def test_controllers_are_known_by_their_revision(on_bench: Any, revision: str) -> None:
    bench = on_bench(controller=GalilEmulator(revision=revision))
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
def test_a_wrong_controller_is_named(on_bench: Any, controller: GalilEmulator, reason: str) -> None:
    bench = on_bench(controller=controller)
    bench.run(0.5)
    assert reason in bench.drive.health().problem


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.0, math.inf)])
def test_a_command_that_is_no_number_is_refused(
    on_bench: Any, command: tuple[float, float]
) -> None:
    with pytest.raises(InputError, match="finite"):
        on_bench().drive.command(*command)


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


def test_a_line_that_is_not_tcp_is_refused() -> None:
    with pytest.raises(ConfigError, match="/dev/ttyUSB0: a Galil controller is reached by TCP"):
        GalilDrive(SerialLink("/dev/ttyUSB0"), GalilSetup(wheels=METRE), clock=ManualClock())
