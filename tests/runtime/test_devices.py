"""``[devices.NAME]`` tables: what they build, and every mistake named with the nearest word."""

import re
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras.plugins import plugin_names
from bearcub.devices.dry_run import DryRunDrive
from bearcub.devices.galil import GalilDrive
from bearcub.devices.replay import Replay
from bearcub.devices.sick import Cola, Lms2xx, Sweep
from bearcub.devices.stream import Streaming
from bearcub.devices.tilt.complementary import Fused
from bearcub.errors import ConfigError
from bearcub.runtime.devices import Device, build_devices, kinds, load_robot

WHEELS = {"wheel_radius": 0.16, "track": 0.5, "counts": 10000}
TABLES: dict[str, dict[str, Any]] = {
    **{
        kind: {"port": "/dev/ttyUSB0"}
        for kind in ("cxtilt", "tcm2", "os5000", "hmr3000", "nmea", "vectornav", "mip", "xsens")
    },
    "lms2xx": {"port": "/dev/ttyUSB1", "baud": 500000},
    "cola": {"address": "192.168.0.1", "dialect": "A"},
    "gps": {"port": "tcp://10.0.0.3:5000", "rate_hz": 5},
    "gpsd": {},
    "galil": {"address": "192.168.2.2", **WHEELS},
    "dry-run": {},
    "mavlink": {"port": "/dev/ttyACM0"},
    "camera": {"source": "/dev/video7", "side_by_side": True, "width": 1280, "height": 480},
    "depthai": {},
    "realsense": {"device": "1234"},
    "genicam": {"library": "producer.cti"},
    "aravis": {"device": "Fake_1"},
}


def built(**table: Any) -> Device:
    (device,) = build_devices({"thing": table}, clock=ManualClock(), folder=Path())
    return device


@pytest.mark.parametrize("kind", TABLES)
def test_every_kind_is_built_and_named_by_its_table(kind: str) -> None:
    device = built(kind=kind, **TABLES[kind])
    assert device.part.name.startswith("thing (")
    assert (device.name, device.kind) == ("thing", kind)


def test_every_kind_is_tried_here() -> None:
    assert {*TABLES, "carmen"} == set(kinds())  # which needs a file: see below


@pytest.mark.parametrize("kind", sorted({*TABLES, "carmen"} - {"dry-run", "gpsd", *plugin_names()}))
def test_a_device_that_nothing_leads_to_is_refused(kind: str) -> None:
    with pytest.raises(ConfigError, match=r"^devices\.thing: \w+: is missing; give"):
        built(kind=kind, **{k: v for k, v in WHEELS.items() if kind == "galil"})


def test_an_inverted_tilt_sensor_is_told_so() -> None:
    raw = b"\xff\x01\xbb\xff\x2e\xe9"  # a nose down by 1.2 degrees, as CXTILT02 sends it
    pitches = []
    for inverted in (False, True):
        device = built(kind="cxtilt", port="/dev/ttyUSB0", invert_pitch=inverted)
        assert isinstance(device.part, Streaming)
        driver = device.part._driver
        (telegram,) = driver.parser.feed(raw)
        measured = driver.value(telegram)
        assert measured is not None
        pitches.append(measured.value.pitch)
    assert pitches[0] == pytest.approx(-pitches[1])
    assert abs(pitches[0]) == pytest.approx(0.0212, abs=1e-4)


@pytest.mark.parametrize("kind", ["vectornav", "mip", "xsens"])
def test_an_imu_can_be_asked_for_raw_values_and_takes_the_wheels_into_account(kind: str) -> None:
    tables = {
        "tilt": {"kind": kind, "port": "/dev/ttyUSB0", "fused": True},
        "drive": {"kind": "dry-run"},  # configured after who asks it
    }
    clock = ManualClock()
    tilt, drive = build_devices(tables, clock=clock, folder=Path())
    assert isinstance(tilt.part, Streaming)
    fused = tilt.part._driver
    assert isinstance(fused, Fused)
    assert isinstance(drive.part, DryRunDrive)
    drive.part.start()
    for _ in range(30):
        drive.part.command(1.0, 0.0)
        clock.advance(0.02)
        accelerated = fused._own()
    assert accelerated.ahead == pytest.approx(1.0, abs=0.01)  # the dry run's acceleration


def test_a_fused_imu_has_no_signs_to_invert() -> None:
    with pytest.raises(ConfigError, match="fused = true: takes no invert_pitch"):
        built(kind="mip", port="/dev/ttyUSB0", fused=True, invert_pitch=True)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({}, r"devices\.thing\.kind: is missing; expected one of aravis, camera"),
        ({"kind": "lms200"}, "unknown kind of device lms200: did you mean lms2xx"),
        (
            {"kind": "cxtilt", "prot": "x"},
            r"unknown key devices\.thing\.prot: did you mean port",
        ),
        ({"kind": "cxtilt", "port": 3}, r"devices\.thing: port = 3: expected str"),
        ({"kind": "cola", "address": "a", "dialect": "C"}, "must be one of A, B"),
        ({"kind": "cola", "address": "a:b"}, "expected HOST:PORT"),
        ({"kind": "gps", "port": "tcp://host"}, "expected HOST:PORT"),
        ({"kind": "galil", "address": "a", **WHEELS, "track": 0.0}, "track: is missing; measure"),
        ({"kind": "galil", "address": "a", **WHEELS, "left": "Q"}, "letters A to H"),
        ({"kind": "lms2xx", "port": "x", "baud": 1200}, "1200 baud; expected one of"),
        (
            {
                "kind": "camera",
                "source": "/dev/video0",
                "right": "/dev/video2",
                "side_by_side": True,
            },
            "holds the right picture already",
        ),
        ({"kind": "camera", "source": "/dev/video0", "width": 640}, "two numbers above 0"),
    ],
)
def test_a_mistake_is_named(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        built(**table)


def test_a_file_is_read_with_its_other_tables(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(
        '[matching]\nuniqueness = 12\n[devices.tilt]\nkind = "cxtilt"\nport = "/dev/ttyUSB0"\n'
        '[devices.eyes]\nkind = "camera"\nsource = "/dev/video0"\nrig = "rig.toml"\n'
    )
    robot = load_robot(path, clock=ManualClock())
    assert robot.config.matching.uniqueness == 12
    tilt, eyes = robot.devices
    assert (tilt.name, tilt.rig) == ("tilt", None)
    assert eyes.rig == tmp_path / "rig.toml"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("devices = 3", "expected tables"),
        ("[devices]\ntilt = 3", r"expected a table \[devices\.tilt\]"),
        ("[machting]\n", "unknown table machting: did you mean matching"),
        ("[devices.tilt", "is not TOML"),
    ],
)
def test_a_file_with_a_mistake_is_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as caught:
        load_robot(path, clock=ManualClock())
    assert "robot.toml" in str(caught.value)


def test_files_are_played_as_a_camera(tmp_path: Path) -> None:
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        cv2.imwrite(str(tmp_path / side / "1.png"), np.full((20, 30), 60, dtype=np.uint8))
    table = {"eyes": {"kind": "camera", "source": "left", "right": "right"}}
    (device,) = build_devices(table, clock=ManualClock(), folder=tmp_path)
    assert isinstance(device.part, CameraSource)
    device.part.step()
    reading = device.part.latest()
    assert reading is not None
    assert reading.value.right is not None
    assert reading.value.right[0, 0] == 60


def test_a_folder_is_played_as_one_colour_camera(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "1.png"), np.full((20, 30, 3), (10, 60, 200), dtype=np.uint8))
    table = {"eye": {"kind": "camera", "source": "."}}
    (device,) = build_devices(table, clock=ManualClock(), folder=tmp_path)
    assert isinstance(device.part, CameraSource)
    device.part.step()
    reading = device.part.latest()
    assert reading is not None
    assert reading.value.right is None
    assert reading.value.left is not None
    assert reading.value.left[0, 0].tolist() == [10, 60, 200]


def test_wheels_and_guards_reach_the_controller() -> None:
    device = built(kind="galil", address="10.0.0.2:5023", **WHEELS, invert_right=True, silence=0.5)
    assert isinstance(device.part, GalilDrive)
    setup = device.part._driver._setup
    assert (setup.wheels.right_sign, setup.silence) == (-1, 0.5)
    assert device.part.name == "thing (10.0.0.2:5023)"


def test_what_a_scanner_is_to_be_set_to_reaches_its_driver() -> None:
    serial = built(kind="lms2xx", port="/dev/x", unit="cm", measuring_mode=4)
    assert isinstance(serial.part, Streaming)
    assert isinstance(serial.part._driver, Lms2xx)
    assert serial.part._driver._fixed == {5: 4, 6: 0}  # bytes of its configuration
    network = built(kind="cola", address="x", step_deg=0.5, rate_hz=50, set_rate=True, nearest=0.2)
    assert isinstance(network.part, Streaming)
    assert isinstance(network.part._driver, Cola)
    sweep = Sweep(start_deg=-135, stop_deg=135, step_deg=0.5, scan_hz=50)
    assert (network.part._driver._sweep, network.part._driver._nearest) == (sweep, 0.2)


def test_a_log_is_played_as_a_scanner_and_a_damaged_one_is_named(tmp_path: Path) -> None:
    beams = " ".join(["2.0"] * 180)
    for name, text in (
        ("good", f"FLASER 180 {beams} 0 0 0 0 0 0 1.0 x 1.0\n"),
        ("bad", "FLASER 9\n"),
    ):
        (tmp_path / f"{name}.clf").write_text(text * 2)
    table = {"ladar": {"kind": "carmen", "source": "good.clf"}}
    (device,) = build_devices(table, clock=ManualClock(), folder=tmp_path)
    device.part.start()
    assert isinstance(device.part, Replay)
    reading = device.part.latest()
    assert reading is not None
    assert reading.value.ranges[90] == 2.0
    with pytest.raises(ConfigError, match=r"source: .*bad\.clf, line 1"):
        build_devices(
            {"ladar": {"kind": "carmen", "source": "bad.clf"}}, clock=ManualClock(), folder=tmp_path
        )


def test_what_a_network_camera_cannot_be_set_to_is_refused() -> None:
    with pytest.raises(ConfigError, match="width and exposure_ms of a network camera"):
        built(kind="camera", source="rtsp://cam/1", width=640, height=480, exposure_ms=3.0)


PAGE = Path(__file__).parents[2] / "docs" / "drive_and_cameras.md"


def test_the_tables_of_the_documentation_are_built() -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    devices = build_devices(
        tomllib.loads(text)["devices"], clock=ManualClock(), folder=Path("/robot")
    )
    assert [device.kind for device in devices] == ["cxtilt", "lms2xx", "camera", "gps", "galil"]
    assert devices[2].rig == Path("/robot/rig.toml")


@pytest.mark.parametrize("kind", kinds())
def test_every_key_is_explained_with_its_default(kind: str) -> None:
    page = PAGE.read_text(encoding="utf-8")
    section = page.partition("## All keys")[2].partition(f"`{kind}`")[2].partition("\n**")[0]
    rows = dict(re.findall(r"^\| `(\w+)` \| `(.*?)` \|", section, re.MULTILINE))
    for field in fields(kinds()[kind][0]):
        default = str(field.default).lower() if field.default in (True, False) else field.default
        shown = f'"{default}"' if isinstance(field.default, str) else str(default)
        assert rows.pop(field.name) == shown
    assert rows == {}
