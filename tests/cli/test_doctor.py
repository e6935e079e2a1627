"""``bearcub doctor`` and ``bearcub devices`` as a script sees them: output and exit code."""

import json
from pathlib import Path

import pytest

from bearcub.cli.main import main
from bearcub.clock import MonotonicClock
from bearcub.emulators import PtyHost
from bearcub.emulators.tilt.cxtilt import CxtiltEmulator


def config(folder: Path, *tables: str) -> str:
    path = folder / "robot.toml"
    path.write_text("\n".join(tables))
    return str(path)


def test_a_healthy_robot_is_code_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with PtyHost(CxtiltEmulator(), clock=MonotonicClock()) as host:
        path = config(
            tmp_path,
            f'[devices.tilt]\nkind = "cxtilt"\nport = "{host.path}"',
            '[devices.drive]\nkind = "dry-run"',
        )
        code = main(["doctor", path, "--seconds", "0.4", "--no-bench"])
    out = capsys.readouterr().out
    assert code == 0
    assert f"tilt ({host.path}), cxtilt: good" in out
    assert "pitch" in out
    assert "drive (dry run), dry-run: good" in out
    assert "motors on, +0.00 m/s" in out
    assert "serial lines: there" in out


def test_a_fault_is_code_1_with_one_line_of_advice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = config(tmp_path, '[devices.tilt]\nkind = "cxtilt"\nport = "/dev/no-such-port"')
    code = main(["doctor", path, "--patience", "0.2", "--no-bench"])
    captured = capsys.readouterr()
    assert code == 1
    assert "tilt (/dev/no-such-port), cxtilt: FAULT" in captured.out
    assert captured.out.count("-> check that it is plugged in") == 1
    assert captured.err == ""


def test_json_has_every_number_or_null(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = config(tmp_path, '[devices.tilt]\nkind = "cxtilt"\nport = "/dev/no-such-port"')
    assert main(["doctor", path, "--patience", "0.2", "--no-bench", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "bearcub.doctor/1"
    (tilt,) = found["devices"]
    assert (tilt["grade"], tilt["rate_hz"], tilt["age_ms"]) == ("fault", None, None)
    assert tilt["remarks"][0]["advice"]


def test_a_mistake_in_the_file_is_code_2_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = config(tmp_path, '[devices.tilt]\nkind = "cxtlit"')
    assert main(["doctor", path]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "unknown kind of device cxtlit: did you mean cxtilt?" in error


def test_devices_lists_cameras_and_ports(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("cameras")
    assert "serial ports" in out
    assert main(["devices", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found) == {"schema", "cameras", "serial_ports", "software"}
