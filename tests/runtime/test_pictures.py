"""Pictures of sequences, and outputs that must not be inputs."""

from pathlib import Path

import pytest

from bearcub.errors import InputError
from bearcub.runtime.notes import Notes
from bearcub.runtime.pictures import require_separate, steady_reach
from bearcub.sim.scenes import paper_rig


def test_the_plan_view_of_a_sequence_reaches_as_far_as_the_rig_measures() -> None:
    assert steady_reach(paper_rig()) == pytest.approx(386 * 0.12 / 4)  # disparity 4 px
    assert steady_reach(paper_rig(width=64, height=48)) == 6.0


def test_outputs_that_are_or_join_an_input_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "left"
    folder.mkdir()
    picture = folder / "0.png"
    picture.touch()
    for output, given, words in (
        (picture, picture, "replace the input"),
        (folder / ".." / "left" / "0.png", picture, "replace the input"),
        (folder, folder, "replace the input"),
        (folder / "out.mp4", folder, "become part of the input"),
    ):
        with pytest.raises(InputError, match=words):
            require_separate(output, [given])
    require_separate(tmp_path / "out.png", [picture, folder])
    require_separate(folder / "out.png", [picture])


def test_notes_that_differ_in_numbers_are_said_once() -> None:
    said: list[str] = []
    notes = Notes(said.append)
    notes.add(["off by 3.1 deg", "no floor"])
    notes.add(["off by -4 deg"])
    assert said == ["off by 3.1 deg", "no floor"]
    notes.repeat(frames=5)
    assert said[2:] == ["in 2 of 5 frames: off by 3.1 deg"]
