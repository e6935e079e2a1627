"""Floors under the quick suite."""

from pathlib import Path

import pytest

from bearcub.errors import FormatError
from bearcub.evaluation import floors
from bearcub.evaluation.table import Row

RECALL = Row(measure="recall", value=96.0, unit="%", limit=98.0, sense="at least", count=100)
FALSE = Row(measure="false in 1,000", value=0.0, limit=1.0, count=500)
COVERED = Row(measure="68 % intervals", value=61.0, unit="%", limit=(64.0, 72.0), count=300)
INFORMATION = Row(measure="on gravel", value=3.0, count=20)


def test_floor_leaves_some_slack() -> None:
    assert floors.slackened(RECALL) == 91.0
    assert floors.slackened(FALSE) == 4.0  # two in 500 frames
    assert floors.slackened(COVERED) == (53.0, 80.0)
    assert floors.slackened(Row(measure="a", value=0.2, unit="deg", limit=0.2)) == 0.26
    assert floors.slackened(INFORMATION) is None


def test_what_is_recorded_is_held(tmp_path: Path) -> None:
    path = tmp_path / "floors.toml"
    floors.write([RECALL, FALSE, COVERED, INFORMATION], path)
    recorded = floors.read(path)
    assert list(recorded) == ["recall", "false in 1,000", "68 % intervals"]
    section = floors.held([RECALL, FALSE, COVERED, INFORMATION], recorded)
    assert len(section.rows) == 3
    assert section.missed == ()


def test_figure_below_its_floor_is_missed() -> None:
    worse = Row(measure="recall", value=90.9, unit="%", limit=98.0, sense="at least", count=100)
    (missed,) = floors.held([worse], {"recall": 91.0}).missed
    assert missed.target == "at least 91 %"


def test_figure_that_was_not_measured_is_missed() -> None:
    assert len(floors.held([], {"recall": 91.0}).missed) == 1


def test_file_without_floors_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "floors.toml"
    path.write_text("recall = 91")
    with pytest.raises(FormatError, match=r"floors.toml: holds no floors.*record_floors"):
        floors.read(path)


def test_floors_of_the_package_can_be_read() -> None:
    assert len(floors.read()) >= 15
