"""The doctor on emulated devices, in real time over ptys and TCP, and on made-up readings."""

import itertools
import math
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock, MonotonicClock
from bearcub.config import Config
from bearcub.devices.health import Health
from bearcub.devices.protocols import Closing, Frame, Reading
from bearcub.emulators import PtyHost, TcpHost
from bearcub.emulators.faults import Rewritten
from bearcub.emulators.galil import GalilEmulator
from bearcub.emulators.gps import NmeaEmulator, Position
from bearcub.emulators.lms2xx import Lms2xxEmulator
from bearcub.emulators.tilt.cxtilt import CxtiltEmulator
from bearcub.messages import Fix, FixQuality, Scan, Tilt, WheelState
from bearcub.runtime.describe import describe
from bearcub.runtime.devices import Device, build_devices
from bearcub.runtime.doctor import Checkup, Doctor, Patience, processor_remark
from bearcub.runtime.stereo_check import check_pair
from bearcub.runtime.verdict import Grade
from bearcub.sample import load

QUICK = Patience(first=0.6, look=0.4, signs=0.5)


def examined(table: dict[str, object], *, patience: Patience = QUICK) -> Checkup:
    clock = MonotonicClock()
    (device,) = build_devices({"thing": table}, clock=clock, folder=Path())
    return Doctor(clock=clock, patience=patience).examine(device)


def test_a_sensor_that_works_is_described() -> None:
    with PtyHost(CxtiltEmulator(), clock=MonotonicClock()) as host:
        checkup = examined({"kind": "cxtilt", "port": host.path})
    assert checkup.grade is Grade.GOOD
    assert checkup.name == f"thing ({host.path})"
    assert checkup.health.rate_hz == pytest.approx(20, abs=3)
    assert checkup.age < 0.1
    assert "pitch" in checkup.remarks[0].text


def test_a_port_that_is_not_there_is_a_fault_with_advice() -> None:
    checkup = examined({"kind": "cxtilt", "port": "/dev/no-such-port"})
    assert checkup.grade is Grade.FAULT
    assert "bearcub devices" in checkup.remarks[0].advice
    assert math.isnan(checkup.age)


def test_software_that_is_missing_is_a_fault_of_its_device_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "depthai", None)  # cannot be imported
    checkup = examined({"kind": "depthai"}, patience=Patience(first=0.2, look=0.1))
    assert checkup.grade is Grade.FAULT
    assert "needs the package depthai" in checkup.remarks[0].text
    assert checkup.remarks[0].advice == "run: pip install depthai"


def test_a_host_that_does_not_listen_is_a_fault_with_advice() -> None:
    host = TcpHost(GalilEmulator(), clock=MonotonicClock())
    host.close()
    wheels = {"wheel_radius": 0.16, "track": 0.5, "counts": 10000}
    checkup = examined({"kind": "galil", "address": f"127.0.0.1:{host.port}", **wheels})
    assert checkup.grade is Grade.FAULT
    assert "address" in checkup.remarks[0].advice


def test_a_wrong_speed_is_a_fault_with_advice() -> None:
    with PtyHost(NmeaEmulator(baud=4800, rate_hz=20), clock=MonotonicClock()) as host:
        checkup = examined({"kind": "gps", "port": host.path, "baud": 9600, "rate_hz": 20})
    assert checkup.grade is Grade.FAULT
    assert "check baud" in checkup.remarks[0].advice


def test_a_damaged_line_is_a_warning() -> None:
    epochs = itertools.count()

    def spoil_every_third(data: bytes) -> bytes:
        return data if next(epochs) % 3 else data.replace(b",A,", b",V,")

    emulator = NmeaEmulator(rate_hz=20)
    noisy = Rewritten(emulator, lambda _: True, rewrite=spoil_every_third)
    with PtyHost(noisy, clock=MonotonicClock()) as host:
        checkup = examined({"kind": "gps", "port": host.path, "rate_hz": 5})
    assert checkup.grade is Grade.WARNING
    assert "refused" in checkup.remarks[0].text
    assert checkup.remarks[0].advice == "check cable, shield and baud rate"


def test_a_controller_with_a_fault_is_told_in_words_and_left_standing() -> None:
    controller = GalilEmulator()
    controller.axes["B"].forward_limit = True
    with TcpHost(controller, clock=MonotonicClock()) as host:
        checkup = examined(
            {
                "kind": "galil",
                "address": f"127.0.0.1:{host.port}",
                "wheel_radius": 0.16,
                "track": 0.5,
                "counts": 10000,
            }
        )
    texts = [remark.text for remark in checkup.remarks]
    assert "right wheel: forward limit switch active" in texts
    assert checkup.grade is Grade.FAULT
    assert controller.axes["A"].position == 0


def test_a_scanner_tells_its_settings_and_its_errors() -> None:
    scanner = Lms2xxEmulator(errors=[(3, 12)])
    with PtyHost(scanner, clock=MonotonicClock()) as host:
        checkup = examined(
            {"kind": "lms2xx", "port": host.path, "baud": 500000},
            patience=Patience(first=5.0, look=0.2),
        )
    assert [str(remark) for remark in checkup.remarks[:3]] == [
        "LMS200;30106x;V02.10, 180° in steps of 0.5°, mm, measuring mode 0x00, 500000 baud",
        "reports a fault of its own; see its manual for the meaning",
        "error 12 of type 3; see its manual for the meaning",
    ]
    assert checkup.grade is Grade.WARNING


@pytest.mark.parametrize(
    ("problem", "advice"),
    [
        ("nothing comes; check its power", "check its power"),
        (
            "no connection: connection refused",
            "check its power, its network cable and the address in its table",
        ),
        (
            "cannot be opened: permission denied",
            "run: sudo usermod -aG dialout,video $USER, then log in again",
        ),
        ("3 bytes came and no value in them", "check baud, and that it is a thing"),
        (
            "9 telegrams refused, the last one for: wrong CRC",
            "check baud, cable and shield, and that it is a thing",
        ),
        ("refuses the start; code 4", "switch it off and on; is it a thing?"),
        ("gone", "check its power and its cable"),
    ],
)
def test_every_problem_has_one_line_of_advice(problem: str, advice: str) -> None:
    clock = ManualClock()
    dead = Held(clock, LEVEL, problem=problem)
    doctor = Doctor(clock=clock, patience=QUICK, wait=clock.advance)
    checkup = doctor.examine(Device(name="a", kind="thing", part=dead))
    assert checkup.remarks[0].grade is Grade.FAULT
    assert checkup.remarks[0].advice == advice
    assert str(checkup.remarks[0]).startswith(problem.partition(";")[0])


def test_a_receiver_without_a_fix_is_a_warning() -> None:
    indoors = NmeaEmulator(lambda _: Position(quality=0, satellites=2), rate_hz=10)
    with PtyHost(indoors, clock=MonotonicClock()) as host:
        checkup = examined({"kind": "gps", "port": host.path, "rate_hz": 10})
    assert checkup.grade is Grade.WARNING
    assert checkup.remarks[-1].text == "no fix, 2 satellites"


class Held(Closing):
    """A sensor on a robot in somebody's hands, in manual time."""

    def __init__(self, clock: ManualClock, value: Tilt | WheelState, *, problem: str = "") -> None:
        self.problem = problem
        self.name = "thing (hands)"
        self.clock = clock
        self.value = value
        self.count = 0

    def start(self) -> None:
        pass

    def close(self) -> None:
        pass

    def latest(self) -> Reading[Tilt | WheelState]:
        self.count += 1
        now_ns = self.clock.now_ns()
        return Reading(value=self.value, stamp_ns=now_ns, age=0.0, fresh=True, count=self.count)

    def health(self) -> Health:
        return Health(
            name=self.name, problem=self.problem, values=self.count, age=0.0, rate_hz=50.0
        )


LEVEL = Tilt(pitch=0.0, roll=0.0)
STANDING = WheelState(left=7.0, right=7.0, speed=0.0, turn_rate=0.0, enabled=False)


def by_hand(value: Tilt | WheelState, **changes: float) -> list[str]:
    """Let a person do what is asked for; `changes` is what the sensor makes of it."""
    clock = ManualClock()
    held = Held(clock, value)
    doctor = Doctor(clock=clock, patience=QUICK, wait=clock.advance)
    device = Device(name="thing", kind="held", part=held)
    left = dict(changes)

    def move(_: str) -> None:
        if left:
            name = next(iter(left))
            held.value = replace(held.value, **{name: getattr(held.value, name) + left.pop(name)})

    checkup = doctor.examine(device, ask=move)
    return [str(remark) for remark in checkup.remarks[1:]]


def test_signs_that_are_right_are_called_good() -> None:
    assert by_hand(LEVEL, pitch=0.1, roll=0.1) == [
        "tilt the nose down: pitch went up, good",
        "tilt the right side down: roll went up, good",
    ]
    assert by_hand(STANDING, left=0.3, right=0.3) == [
        "push the robot ahead by hand: the left wheel's way went up, good",
        "push the robot ahead by hand: the right wheel's way went up, good",
    ]


def test_a_wrong_sign_says_which_key_to_change() -> None:
    assert by_hand(LEVEL, pitch=-0.1, roll=0.1)[0] == (
        "tilt the nose down: pitch went down; change invert_pitch in its table"
    )
    assert by_hand(STANDING, left=0.3, right=-0.3)[1] == (
        "push the robot ahead by hand: the right wheel's way went down; "
        "change invert_right in its table"
    )


def test_a_sensor_that_does_not_follow_is_noticed() -> None:
    assert [text.partition(" did ")[2][:21] for text in by_hand(LEVEL, pitch=0.01)] == [
        "not change by 3° with"
    ] * 2
    assert all("did not change by 5 cm" in text for text in by_hand(STANDING))


def test_wheels_that_are_held_or_unknown_are_not_tried() -> None:
    assert by_hand(replace(STANDING, enabled=True)) == []
    assert by_hand(replace(STANDING, left=math.nan)) == []


@pytest.mark.parametrize(
    ("value", "text", "grade"),
    [
        (Tilt(pitch=0.1, roll=-0.05), "pitch +5.7° (nose down), roll -2.9° (left side down)", 0),
        (Tilt(pitch=1.4, roll=0.0), "pitch +80.2° (nose down), roll +0.0° (left side down)", 1),
        (
            Fix(latitude_deg=48.0, longitude_deg=11.0, quality=FixQuality.RTK_FIXED,
                satellites=15, hdop=0.6),
            "48.000000°, 11.000000°, RTK FIXED, 15 satellites, HDOP 0.6", 0,
        ),
        (
            Fix(latitude_deg=48.0, longitude_deg=11.0, quality=FixQuality.GPS,
                satellites=4, hdop=0.9),
            "48.000000°, 11.000000°, GPS, 4 satellites, HDOP 0.9", 1,
        ),
        (
            WheelState(left=0, right=0, speed=0.5, turn_rate=-0.1, enabled=False),
            "motors off, +0.50 m/s, -5.7°/s", 0,
        ),
        (
            Frame(name="0", index=0, stamp_ns=0, left=np.full((16, 20), 3, dtype=np.uint8)),
            "20 x 16 pixels, mean grey level 3", 1,
        ),
        (
            Frame(name="0", index=0, stamp_ns=0, left=np.full((16, 20), 250, dtype=np.uint8)),
            "20 x 16 pixels, mean grey level 250", 1,
        ),
    ],
)  # fmt: skip
def test_values_are_put_in_words(value: object, text: str, grade: int) -> None:
    remark = describe(value)[0]
    assert (remark.text, remark.grade) == (text, grade)


def test_a_scan_is_put_in_words_and_a_covered_one_noticed() -> None:
    angles = np.radians(np.arange(-90.0, 91.0))
    ranges = np.full(181, 3.0, dtype=np.float32)
    ranges[90], ranges[91] = 1.25, -np.inf
    (remark,) = describe(Scan(ranges=ranges, angles=angles))
    assert remark.text == "181 beams over 180°, nearest 1.25 m, 1 too close to measure"
    covered = Scan(ranges=np.full(181, np.nan, dtype=np.float32), angles=angles, warnings=("hot",))
    assert [remark.grade for remark in describe(covered)] == [Grade.WARNING, Grade.WARNING]


def pair(*, lower: int = 0, swapped: bool = False) -> Frame:
    sample = load()
    left, right = (np.asarray(cv2.imread(str(path), 0)) for path in (sample.left, sample.right))
    right = np.roll(right, lower, axis=0)
    left, right = (right, left) if swapped else (left, right)
    return Frame(name="0", index=0, stamp_ns=0, left=left, right=right)


def test_the_rows_of_a_good_pair_fit() -> None:
    rig = load().rig
    rows, matched = check_pair(pair(), rig, config=Config())
    assert (rows.grade, matched.grade) == (Grade.GOOD, Grade.GOOD)
    shifted, _ = check_pair(pair(lower=2), rig, config=Config())
    assert shifted.grade is Grade.FAULT
    assert "rows lower" in shifted.text
    (swapped,) = check_pair(pair(swapped=True), rig, config=Config())
    assert swapped.grade is Grade.FAULT


def test_the_processor_is_measured() -> None:
    assert "one 640 x 480 pair takes" in processor_remark(frames=1).text
