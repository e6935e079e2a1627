"""Promises kept and missed, as text, Markdown and JSON."""

import json
import math

import pytest
from rich.console import Console

from bearcub.evaluation.table import Row, Section, to_dict, to_markdown, to_rich

KEPT = Row(measure="height error", value=2.5, unit="%", limit=5.0)
MISSED = Row(measure="found", value=80.0, unit="%", limit=90.0, sense="at least", note="frame 3")
SHOWN = Row(measure="reported", value=15)
UNKNOWN = Row(measure="depth error", value=math.nan, unit="mm", limit=6.0)
SECTION = Section(name="a", title="A", about="Words.", rows=(KEPT, MISSED, SHOWN, UNKNOWN))


def test_a_limit_itself_is_kept() -> None:
    assert Row(measure="x", value=5.0, limit=5.0).passed is True
    assert Row(measure="x", value=5.0, limit=5.0, sense="at least").passed is True


def test_what_is_not_known_is_not_kept() -> None:
    assert UNKNOWN.passed is False
    assert SHOWN.passed is None
    assert SECTION.missed == (MISSED, UNKNOWN)


@pytest.mark.parametrize(
    ("row", "reached", "target"),
    [
        (KEPT, "2.5 %", "at most 5 %"),
        (MISSED, "80 %", "at least 90 %"),
        (SHOWN, "15", ""),
        (UNKNOWN, "-", "at most 6 mm"),
        (Row(measure="x", value=206, limit=0), "206", "at most 0"),
        (Row(measure="x", value=0.0912, unit="deg"), "0.0912 deg", ""),
    ],
)
def test_numbers_are_short(row: Row, reached: str, target: str) -> None:
    assert (row.reached, row.target) == (reached, target)


def test_json_names_the_set_in_every_row_and_knows_no_nan() -> None:
    skipped = Section(name="b", title="B", about="", skipped="there is no folder")
    found = json.loads(json.dumps(to_dict([SECTION, skipped]), allow_nan=False))
    assert found["skipped"] == {"b": "there is no folder"}
    assert found["rows"][1] == {
        "set": "a",
        "measure": "found",
        "value": 80.0,
        "unit": "%",
        "target": "at least 90 %",
        "passed": False,
        "note": "frame 3",
    }
    assert found["rows"][3]["value"] is None


def test_markdown_shows_what_was_missed_and_what_was_skipped() -> None:
    skipped = Section(name="b", title="B", about="More words.", skipped="there is no folder")
    text = to_markdown([SECTION, skipped], command="bearcub evaluate sample")
    assert text.startswith("    bearcub evaluate sample\n")
    assert "| found | 80 % | at least 90 % | MISSED | frame 3 |" in text
    assert text.endswith("### B\n\nMore words.\n\nSkipped: there is no folder.")


def test_bar_in_a_note_does_not_end_its_cell() -> None:
    row = Row(measure="x", value=1, note="a | b")
    assert r"a \| b" in to_markdown([Section(name="", title="", about="", rows=(row,))], command="")


def test_terminal_table_tells_the_verdicts() -> None:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(*to_rich(SECTION))
    lines = capture.get().splitlines()
    assert next("kept" in line for line in lines if "height error" in line)
    assert next("MISSED" in line and "frame 3" in line for line in lines if "found" in line)


def test_terminal_table_gives_the_reason_of_a_skipped_set() -> None:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(
            *to_rich(Section(name="b", title="B", about="", skipped="there is no folder"))
        )
    assert "there is no folder" in capture.get()
