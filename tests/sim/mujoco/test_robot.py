"""The robot drives, tips, stops at things and feels the ground, the same way every time."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.sim import render as cast_rays
from bearcub.sim import scenes
from bearcub.sim.mujoco import Sensors, Simulation
from bearcub.sim.sensors import GpsModel, LadarModel, TiltModel, WheelModel
from bearcub.sim.world import Scene

RIG = scenes.paper_rig(width=160, height=120)
IDEAL = Sensors(
    tilt=TiltModel(lag=0.0, noise=0.0, bias=0.0),
    ladar=LadarModel(sigma=0.0, quantum=1e-9, lost=0.0),
    wheels=WheelModel(scale=0.0, counts_per_metre=1e6),
    gps=GpsModel(noise=0.0, wander=0.0),
)


def _driven(scene: Scene, seconds: float, *, speed: float = 0.8) -> Simulation:
    robot = Simulation(scene, RIG, roughness=0.0, sensors=IDEAL)
    robot.step(seconds, speed, 0.0)
    return robot


def test_it_holds_the_commanded_speed_and_stays_on_its_line() -> None:
    robot = _driven(scenes.floor(), 1.0)
    before = robot.pose()
    robot.step(2.0, 0.8, 0.0)
    after = robot.pose()
    assert after.x - before.x == pytest.approx(1.6, rel=0.02)
    assert abs(after.y) < 0.01
    assert abs(math.degrees(after.pitch)) < 0.1


def test_a_positive_turn_rate_turns_left() -> None:
    robot = Simulation(scenes.floor(), RIG, roughness=0.0)
    robot.step(0.5, 0.4, 0.4)
    yaw = robot.pose().yaw
    robot.step(1.0, 0.4, 0.4)
    assert robot.pose().yaw - yaw == pytest.approx(0.4, rel=0.1)
    assert robot.pose().y > 0


def test_a_ramp_tips_its_nose_up_by_its_slope() -> None:
    place = _driven(scenes.ramp(start=1.0), 4.0).pose()
    assert math.degrees(place.pitch) == pytest.approx(-8.5, abs=0.2)
    assert place.z == pytest.approx(math.tan(math.radians(8.5)) * (place.x - 1.0), abs=0.02)


def test_ground_that_rises_to_the_left_rolls_it_right_side_down() -> None:
    robot = Simulation(scenes.cross_slope(), RIG, roughness=0.0)
    assert math.degrees(robot.pose().roll) == pytest.approx(6.0, abs=0.2)


@pytest.mark.parametrize(
    "scene",
    [scenes.pit(distance=1.2, length=0.6, width=1.2, depth=0.4), scenes.drop(distance=1.2)],
    ids=["pit", "drop"],
)
def test_it_overturns_in_a_pit_and_off_a_drop(scene: Scene) -> None:
    robot = Simulation(scene, RIG, roughness=0.0)
    for _ in range(30):
        robot.step(0.1, 0.8, 0.0)
        if robot.overturned:
            return
    pytest.fail(f"still on its wheels at {robot.pose()}")


def test_it_stops_at_a_can_and_knows_what_it_touched() -> None:
    robot = _driven(scenes.garbage_can(distance=1.0, bearing=0.0), 2.5)
    assert robot.touched == {"can"}
    assert robot.pose().x == pytest.approx(1.0 - 0.25, abs=0.03)  # its front is 0.25 m ahead
    assert _driven(scenes.floor(), 0.5).touched == frozenset()


@pytest.mark.parametrize(("height", "touched"), [(1.2, {"branch"}), (0.6, set())])
def test_the_mast_of_a_high_camera_catches_a_branch(height: float, touched: set[str]) -> None:
    rig = replace(RIG, mount=replace(RIG.mount, height=height))
    robot = Simulation(scenes.branch(distance=0.8, base=0.9), rig, roughness=0.0)
    robot.step(2.0, 0.8, 0.0)
    assert robot.touched == touched


def test_readings_come_at_their_own_rates_and_with_their_age() -> None:
    robot = Simulation(scenes.floor(), RIG)
    robot.step(1.05, 0.5, 0.0)
    tilt, scan, gps = robot.tilt(), robot.scan(), robot.gps()
    assert tilt is not None
    assert scan is not None
    assert gps is not None
    assert (tilt.count, scan.count, gps.count) == (53, 11, 6)  # 50, 10 and 5 Hz, from 0 on
    assert (scan.stamp_ns, gps.stamp_ns) == (1_000_000_000, 1_000_000_000)
    assert scan.age == pytest.approx(0.05)
    assert scan.fresh


def test_ideal_sensors_say_what_is_true() -> None:
    robot = _driven(scenes.garbage_can(distance=3.0, bearing=0.0), 1.0)
    place = robot.pose()
    tilt, scan, wheels, gps = robot.tilt(), robot.scan(), robot.wheels(), robot.gps()
    assert tilt is not None
    assert tilt.value.pitch == pytest.approx(place.pitch, abs=1e-9)
    assert scan is not None
    ahead = scan.value.ranges[np.argmin(np.abs(scan.value.angles))]
    assert ahead == pytest.approx(3.0 + 0.006 - place.x, abs=0.002)  # ribs stand 6 mm back
    assert wheels is not None
    assert wheels.value.speed == pytest.approx(0.8, rel=0.02)
    assert gps is not None
    east, north, _ = GpsModel().origin.position(gps.value)
    assert (east, north) == pytest.approx((place.x, place.y), abs=1e-3)


def test_the_same_commands_give_the_same_bits() -> None:
    def drive(seed: int) -> tuple[object, ...]:
        with Simulation(scenes.garbage_can(), RIG, seed=seed) as robot:
            robot.step(0.3, 0.6, 0.2)
            frame = robot.pair(noise="medium")
            scan, gps = robot.scan(), robot.gps()
            assert scan is not None
            assert gps is not None
            return (
                robot.pose(),
                frame.left.tobytes(),
                frame.right.tobytes(),
                scan.value.ranges.tobytes(),
                gps.value,
                robot.tilt(),
            )

    first, again, other = drive(1), drive(1), drive(2)
    assert first == again
    assert all(a != b for a, b in zip(first, other, strict=True))


def test_a_robot_at_the_start_sees_what_a_still_camera_sees() -> None:
    scene = scenes.garbage_can()
    with Simulation(scene, RIG, roughness=0.0) as robot:
        frame, place = robot.pair(), robot.pose()
    assert (place.roll, place.pitch, place.yaw) == pytest.approx((0, 0, 0), abs=1e-3)
    still = cast_rays(scene, RIG, body=Attitude(roll=place.roll, pitch=place.pitch))
    # it stands some millimetres from the origin
    np.testing.assert_allclose(frame.disparity, still.disparity, atol=0.1)
    (moving,), (standing,) = frame.truth["obstacles"], still.truth["obstacles"]
    for key in ("x", "y", "distance", "width", "height"):
        assert moving[key] == pytest.approx(standing[key], abs=0.01)
    assert moving["bearing_deg"] == pytest.approx(standing["bearing_deg"], abs=0.1)
    assert frame.truth["terrain"] == still.truth["terrain"]
    for key, value in still.truth["ground"].items():
        assert frame.truth["ground"][key] == pytest.approx(value, abs=0.02)


def test_truth_turns_and_moves_with_the_robot() -> None:
    """From (1, 1), heading right by 30 deg, the can at (3.275, 0) is 2.26 m away to the left."""
    scene = scenes.garbage_can(bearing=0.0)
    start = (1.0, 1.0, math.radians(-30))
    with Simulation(scene, RIG, roughness=0.0, start=start) as robot:
        frame = robot.pair()
    (can,) = frame.truth["obstacles"]
    to_centre = math.hypot(2.275, 1.0)
    assert can["distance"] == pytest.approx(to_centre - 0.225, abs=0.01)
    # its centre is 23.73 deg to the right of x, and the robot looks 30 deg to the right
    assert can["bearing_deg"] == pytest.approx(30.0 - 23.73, abs=0.3)
    assert can["y"] == pytest.approx(can["distance"] * math.sin(math.radians(6.27)), abs=0.05)
    assert frame.truth["place"]["yaw_deg"] == pytest.approx(-30.0, abs=0.2)


def test_a_ramp_seen_from_the_side_is_a_cross_slope() -> None:
    scene = replace(scenes.ramp(start=-5.0), things=())
    with Simulation(scene, RIG, roughness=0.0, start=(0.0, 0.0, math.radians(90))) as robot:
        truth = robot.pair().truth
    rise, yaw = math.tan(math.radians(8.5)), math.radians(truth["place"]["yaw_deg"])
    slope, cross = math.atan(rise * math.cos(yaw)), math.atan(-rise * math.sin(yaw))
    assert truth["terrain"]["slope_deg"] == pytest.approx(math.degrees(slope), abs=1e-4)
    # x, which rises, is to the right of a robot that heads along y
    assert truth["terrain"]["cross_slope_deg"] == pytest.approx(math.degrees(cross), abs=1e-4)
    assert math.degrees(cross) == pytest.approx(-8.5, abs=0.05)
    assert truth["tilt"]["roll_deg"] == pytest.approx(-8.5, abs=0.2)
