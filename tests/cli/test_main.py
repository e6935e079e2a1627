"""The command as a process: start-up, interruption, closed pipes; and the small commands."""

import json
import signal
import subprocess
import sys
import tomllib
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2
import pytest

from bearcub.cli.main import COMMANDS
from bearcub.config import Config
from bearcub.stereo.native import reason_missing

LIMIT = 60.0  # seconds until a process that hangs is given up


def _process(*argv: str) -> "subprocess.Popen[str]":
    program = "from bearcub.cli.main import run; run()"
    return subprocess.Popen(
        [sys.executable, "-c", program, *argv],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def long_sequence(files: Any, tmp_path: Path) -> tuple[str, ...]:
    """Two folders with far more frames than a test waits for."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for index in range(2000):
            (tmp_path / side / f"{index:04d}.png").symlink_to(getattr(files, side))
    return ("detect", str(tmp_path / "left"), str(tmp_path / "right"), "--rig", files.rig, "--json")


def test_ctrl_c_leaves_complete_lines_and_a_video_that_plays(
    long_sequence: tuple[str, ...], tmp_path: Path
) -> None:
    video = tmp_path / "out.mp4"
    with _process(*long_sequence, "--save", str(video)) as process:
        assert process.stdout is not None
        first = [process.stdout.readline() for _ in range(2)]
        process.send_signal(signal.SIGINT)
        rest, error = process.communicate(timeout=LIMIT)
    lines = [*first, *rest.splitlines(keepends=True)]
    assert process.returncode == 130
    assert all(json.loads(line)["schema"] == "bearcub.answer/1" for line in lines)
    assert f"bearcub: interrupted after {len(lines)} frames" in error
    assert "Traceback" not in error
    capture = cv2.VideoCapture(str(video))
    assert int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) == len(lines)
    assert capture.read()[0]
    capture.release()


def test_a_reader_that_goes_away_is_no_error(long_sequence: tuple[str, ...]) -> None:
    with _process(*long_sequence) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        told = process.stderr.read().splitlines()
        assert [line for line in told if "the native matcher is not there" not in line] == []
        assert process.wait(timeout=LIMIT) == 141


def test_help_of_the_program_loads_no_command() -> None:
    program = (
        "import sys\nfrom bearcub.cli.main import main\nassert main(['--help']) == 0\n"
        "print([m for m in sys.modules if m in ('rich', 'bearcub.viewer', 'bearcub.sim') "
        "or m.startswith('bearcub.cli.') and m.split('.')[2] not in ('main', 'parsing', 'codes')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=LIMIT
    )
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_explains_itself(bearcub: Any, command: str) -> None:
    assert command in bearcub("--help").out
    outcome = bearcub(command, "--help")
    assert outcome.code == 0
    assert outcome.out.startswith(f"usage: bearcub {command}")


def test_version_is_that_of_the_package(bearcub: Any) -> None:
    assert bearcub("--version").out == f"bearcub {version('bearcub')}\n"


def test_config_prints_the_defaults_so_that_they_load_again(bearcub: Any, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(bearcub("config").out)
    assert Config.load(path) == Config()


def test_config_of_a_file_prints_what_is_in_effect(bearcub: Any, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("[matching]\nnearest = 0.7\n")
    shown = tomllib.loads(bearcub("config", path).out)
    assert shown["matching"] == {**asdict(Config().matching), "nearest": 0.7}


def test_bench_prints_every_stage_of_every_case(bearcub: Any) -> None:
    outcome = bearcub("bench", "--frames", 2, "--size", "160x120", "--json", "--pair")
    found = json.loads(outcome.out)
    matchers = ("sgbm",) if reason_missing() else ("sgbm", "native")
    assert [case["name"] for case in found["cases"]] == [
        "sample, disparity given",
        "wall at 2 m, disparity given",
        *(f"sample, pair by {matcher}" for matcher in matchers),
    ]
    for case in found["cases"]:
        assert list(case["stages_ms"]) == ["match", "ground", "obstacles", "total"]
        for spent in case["stages_ms"].values():
            assert 0.0 <= spent["p50"] <= spent["p99"] <= spent["max"]
    assert found["machine"]["opencv"] == cv2.__version__


def test_bench_shows_a_table_with_the_share_of_the_budget(bearcub: Any) -> None:
    out = bearcub("bench", "--frames", 1, "--size", "160x120").out
    assert "p50 [ms]" in out
    assert "of 66.7 ms" in out
    assert out.count("total") == 2
