"""``bearcub evaluate``: what it prints and how it exits."""

import argparse
import json
from collections.abc import Iterable
from pathlib import Path

import pytest

from bearcub.cli import evaluate
from bearcub.errors import InputError
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
