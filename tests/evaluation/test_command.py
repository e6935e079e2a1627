"""``bearcub evaluate``: what it prints and how it exits."""

import argparse
import json
from collections.abc import Iterable
from pathlib import Path

import pytest

from bearcub.cli import evaluate, evaluate_sim
from bearcub.errors import InputError
from bearcub.evaluation import floors, sim
from bearcub.evaluation.runner import Runner
from bearcub.evaluation.table import Row, Section


def parsed(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    evaluate.configure(parser)
    return parser.parse_args(words)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Row]:
    """Replace the evaluation of recordings by the rows that the test puts into the list."""
    rows: list[Row] = []

    def fake(folder: Path, runner: Runner, *, only: Iterable[str]) -> list[Section]:
        kept = list(runner.track(rows, total=len(rows), name="rows"))
        name = ",".join([folder.name, *only])
        return [Section(name=name, title="Road", about="A drive.", rows=tuple(kept))]

    monkeypatch.setattr(evaluate, "evaluate_real", fake)
    return rows


def test_missed_promise_exits_with_1(
    measured: list[Row], capsys: pytest.CaptureFixture[str]
) -> None:
    measured.append(Row(measure="height error", value=4.0, unit="%", limit=5.0))
    assert evaluate.execute(parsed("real", "data")) == 0
    measured.append(Row(measure="false obstacles", value=2, limit=1))
    assert evaluate.execute(parsed("real", "data")) == 1
    assert "MISSED" in capsys.readouterr().out


def test_json_is_one_object_on_stdout(
    measured: list[Row], capsys: pytest.CaptureFixture[str]
) -> None:
    measured.append(Row(measure="height error", value=4.0, unit="%", limit=5.0))
    evaluate.execute(parsed("real", "data", "--json", "--only", "sslg"))
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["set"] == "data,sslg"
    assert row["passed"] is True


def test_markdown_begins_with_the_command_that_remakes_it(
    measured: list[Row], capsys: pytest.CaptureFixture[str]
) -> None:
    measured.append(Row(measure="height error", value=4.0, unit="%", limit=5.0))
    evaluate.execute(parsed("real", "some/data", "--markdown", "--only", "sslg"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "    bearcub evaluate real some/data --only sslg"
    assert "| height error | 4 % | at most 5 % | kept |  |" in lines


def test_unknown_set_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parsed("real", "data", "--only", "kiti")
    assert "kitti_odometry" in capsys.readouterr().err


def test_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(InputError, match="file: cannot be made"):
        evaluate.execute(parsed("sample", "--save", str(blocked)))


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[Row]:
    """Replace the rendering and answering by the rows that the test puts into the list."""
    rows: list[Row] = []

    def fake(cases: object, method: object, track: object) -> sim.Result:
        section = Section(name="sim", title="Simulated", about="", rows=tuple(rows))
        return sim.Result(sections=(section,), shown={}, records=())

    monkeypatch.setattr(sim, "evaluate", fake)
    monkeypatch.setattr(floors, "read", lambda: {"recall": 90.0})
    return rows


def recall(value: float) -> Row:
    return Row(measure="recall", value=value, unit="%", limit=98.0, sense="at least", count=100)


def test_whole_suite_fails_on_a_promise_and_the_quick_one_on_a_floor(simulated: list[Row]) -> None:
    simulated.append(recall(95.0))
    assert evaluate.execute(parsed("sim")) == 1
    assert evaluate.execute(parsed("sim", "--quick")) == 0
    simulated[0] = recall(89.0)
    assert evaluate.execute(parsed("sim", "--quick")) == 1


def test_part_of_the_quick_suite_has_no_floors(simulated: list[Row]) -> None:
    simulated.append(recall(0.0))
    assert evaluate.execute(parsed("sim", "--quick", "--scenario", "garbage-can")) == 0


def test_table_says_how_to_remake_it(
    simulated: list[Row], capsys: pytest.CaptureFixture[str]
) -> None:
    simulated.append(recall(99.0))
    evaluate.execute(parsed("sim", "--quick", "--against", "classic,zband", "--markdown"))
    first = capsys.readouterr().out.splitlines()[0]
    assert first == "    bearcub evaluate sim --quick --against classic,zband"


@pytest.mark.parametrize("names", ["classical", "", "classic,zbands"])
def test_unknown_baseline_is_refused(names: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parsed("sim", "--against", names)
    assert "expected some of classic,vdisparity,ransac,zband" in capsys.readouterr().err


def test_lines_that_cannot_be_written_are_one_sentence(
    simulated: list[Row], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        evaluate_sim.evaluate(
            parsed("sim", "--quick", "--frames-json", str(tmp_path / "no" / "file")), Runner().track
        )


def test_drive_needs_its_poses(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parsed("drive", "data")
    assert "--poses" in capsys.readouterr().err
