"""Rendered scenes, through the pipeline."""

import pytest

from bearcub.evaluation.runner import Runner
from bearcub.evaluation.sample import ATTITUDES, evaluate_sample, view
from bearcub.messages import Answer, Snapshot
from bearcub.rig import Rig


def test_sample_is_seen_from_twenty_one_attitudes() -> None:
    assert len(set(ATTITUDES)) == 21
    assert {pitch for pitch, _ in ATTITUDES} == {-5, 0, 5}
    assert {roll for _, roll in ATTITUDES} == {-15, -10, -5, 0, 5, 10, 15}


def test_can_is_found_with_the_tilt_reading_and_without() -> None:
    seen: list[tuple[str, Snapshot]] = []

    def watch(name: str, rig: Rig, snapshot: Snapshot, answer: Answer) -> None:
        assert rig.mount.height == 1.2
        assert answer.ground.seen
        seen.append((name, snapshot))

    sections = evaluate_sample(Runner(watch=watch), attitudes=[(5, -15)])
    (tilted, with_tilt), (plain, without) = seen
    assert tilted == "sample_with_tilt_pitch+5_roll-15"
    assert plain == "sample_without_tilt_pitch+5_roll-15"
    assert with_tilt.tilt == view(5, -15).tilt
    assert without.tilt is None
    for section in sections:
        rows = {row.measure: row for row in section.rows}
        assert rows["obstacles missed"].passed, section.name
        assert rows["distance error"].passed, section.name


def test_tilt_of_a_view_is_in_radians() -> None:
    shown = view(5, -15)
    assert shown.tilt.roll == pytest.approx(-0.2618, abs=1e-4)
    assert shown.tilt.pitch == pytest.approx(0.0873, abs=1e-4)
    assert shown.truth["tilt"] == {"pitch_deg": 5.0, "roll_deg": -15.0}
