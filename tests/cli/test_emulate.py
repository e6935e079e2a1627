"""``bearcub emulate``: serves a device until Ctrl-C, and says where."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bearcub.cli.main import main
from bearcub.devices.link import SerialLink

HANGS = 30.0  # seconds


def test_it_says_where_the_device_is_and_ctrl_c_ends_it(tmp_path: Path) -> None:
    name = tmp_path / "tilt"
    program = "from bearcub.cli.main import run; run()"
    with subprocess.Popen(
        [sys.executable, "-c", program, "emulate", "cxtilt", "--link", str(name)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        where, what = process.stdout.readline().rstrip("\n").split("\t")
        assert (where, what) == (str(name), "cxtilt: Crossbow CXTILT02 tilt sensor; Ctrl-C ends it")
        link = SerialLink(where, baud=9600)
        link.open()
        link.write(b"G")
        assert link.read(HANGS)[:1] == b"\xff"
        link.close()
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=HANGS) == ("", "")
        assert process.returncode == 0
    assert not name.is_symlink()


def test_any_device_can_be_served_on_a_port(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["emulate", "nmea", "--tcp", "0", "--seconds", "0.01"]) == 0
    assert capsys.readouterr().out.startswith("127.0.0.1:")


def test_a_fault_is_put_in(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["emulate", "cxtilt", "--fault", "stuck", "--after", "1", "--lasting", "2"]
    assert main([*argv, "--seconds", "0.01"]) == 0
    assert "cxtilt" in capsys.readouterr().out


def test_the_faults_of_a_device_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["emulate", "xsens", "--faults"]) == 0
    names = capsys.readouterr().out.split()
    assert {"split", "merged", "corrupt", "stuck", "half", "wrong-baud", "restart"} <= set(names)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["cxtilt", "--fault", "nosuch"], "--fault nosuch: cxtilt has split, merged"),
        (["cxtilt", "--tcp", "0", "--link", "x"], "--link x: expected a pseudo-terminal"),
        (["cxtilt", "--tcp", "70000"], "'70000': expected a port from 0 to 65535"),
        (["cxtilt", "--tcp", "0", "--pty"], "not allowed with argument"),
        (["nosuch"], "invalid choice: 'nosuch'"),
    ],
)
def test_bad_arguments_are_one_line(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["emulate", *argv]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
