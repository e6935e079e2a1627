"""Cases are rendered, answered, kept and drawn."""

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
import pytest

from bearcub.evaluation import frames, sim
from bearcub.evaluation.contenders import OURS, Contenders
from bearcub.evaluation.dump import line
from bearcub.evaluation.folder import evaluate_folder
from bearcub.evaluation.pictures import save_pictures
from bearcub.evaluation.simulated import Method, answered, frames_of
from bearcub.evaluation.verdict import judge
from bearcub.geometry import Attitude
from bearcub.messages import Tilt
from bearcub.sim import render, scenes
from bearcub.sim.case import Case
from bearcub.sim.folder import Taken, write
from bearcub.sim.light import Light

_T = TypeVar("_T")
METHOD = Method(renderer="rays")
LIGHT = Light()


def track(items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:
    return items


@pytest.fixture(scope="module")
def case() -> Case:
    return Case(
        name="can/000-0",
        scenario="can",
        scene=scenes.garbage_can(),
        rig=scenes.paper_rig(width=320, height=240),
        body=Attitude(roll=0.0, pitch=0.0),
        tilt=Tilt(pitch=0.0, roll=0.0),
        light=LIGHT,
        noise="weak",
        seed=1,
        rig_seed=1,
        tags={"tilt": "good", "clearance": 2.0, "kind": "can", "range": 3.05},
    )


@pytest.fixture(scope="module")
def kept(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Method:
    """A method whose frame is rendered already."""
    method = replace(METHOD, frames=tmp_path_factory.mktemp("frames"))
    list(frames_of([case], method))
    return method


def test_answer_and_truth_come_together(case: Case, kept: Method) -> None:
    method = replace(kept, baselines=("classic", "zband"))
    (record,) = answered([case], method)
    assert record.name == "can/000-0"
    assert record.tags["noise"] == "weak"
    assert set(record.reports) == {OURS, "classic", "zband"}
    assert record.truth["obstacles"][0]["name"] == "can"
    (can,) = judge(record, OURS).things
    assert can.found is not None
    assert can.found.distance == pytest.approx(3.05, abs=0.15)  # of 28 pixels
    assert record.reports["zband"].timing["total"] > 0.0


def test_kept_frame_is_not_rendered_again(
    case: Case, kept: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    (before,) = frames_of([case], kept)
    monkeypatch.setattr("bearcub.evaluation.simulated.render", None)
    (again,) = frames_of([case], kept)
    assert np.array_equal(again.left, before.left)
    assert np.array_equal(again.right, before.right)
    assert again.truth == before.truth


def test_another_body_or_seed_is_another_frame(
    case: Case, kept: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("bearcub.evaluation.simulated.render", refuse)
    changed: list[dict[str, Any]] = [{"seed": 2}, {"body": Attitude(roll=0.1, pitch=0.0)}]
    for change in changed:
        with pytest.raises(AssertionError):
            list(frames_of([replace(case, **change)], kept))


def test_interrupted_frame_is_none(tmp_path: Path) -> None:
    (tmp_path / "left.png").write_bytes(b"")
    assert frames.load_frame(tmp_path) is None


def test_images_that_are_refused_are_answered_by_nobody(case: Case, kept: Method) -> None:
    (given,) = frames_of([case], kept)
    cropped = replace(given, right=given.right[:, :-10])
    record = Contenders(baselines=("zband",)).record(cropped)
    assert "expected one size" in record.refused
    assert record.reports["zband"].obstacles == ()
    assert judge(record, OURS).things[0].found is None


def test_result_is_the_same_from_several_processes(case: Case, kept: Method) -> None:
    cases = [case, replace(case, name="can/001-0", scene=scenes.garbage_can())]
    alone, shared = (
        [json.loads(line(record, OURS)) for record in answered(cases, replace(kept, jobs=jobs))]
        for jobs in (1, 2)
    )
    for frame in (*alone, *shared):
        del frame["answer"]["timing"]
    assert [frame["name"] for frame in shared] == ["can/000-0", "can/001-0"]
    assert alone == shared


def test_table_has_the_rows_that_the_frames_show(case: Case, kept: Method) -> None:
    medium = replace(case, tags={**case.tags, "noise": "medium"})
    result = sim.evaluate([medium], replace(kept, baselines=("zband",)), track)
    table = {row.measure: row for row in result.sections[0].rows}
    recall = table["obstacles >= 0.3 m wide and high, 1 to 8 m, visible >= 70 %: recall"]
    assert (recall.value, recall.count) == (100.0, 1)
    assert recall.rivals == {"zband": 100.0}
    assert "hole distance, median absolute error" not in table
    assert [section.name for section in result.sections] == [
        "sim",
        "sim_intervals",
        "sim_breakdown",
    ]


def test_line_of_a_frame_holds_answer_truth_and_errors(case: Case, kept: Method) -> None:
    (record,) = answered([case], kept)
    found = json.loads(line(record, OURS))
    (can,) = found["obstacles"]
    assert can["truth"]["kind"] == "can"
    assert can["errors"]["distance"]["truth"] == pytest.approx(3.05)
    assert can["found"]["distance"] == can["errors"]["distance"]["value"]
    assert found["answer"]["pitch"] == pytest.approx(math.radians(5.9), abs=0.01)
    assert found["tags"]["kind"] == "can"


def test_worst_and_best_frames_are_drawn(case: Case, kept: Method, tmp_path: Path) -> None:
    medium = replace(case, tags={**case.tags, "noise": "medium"})
    result = sim.evaluate([medium], kept, track)
    recall = next(iter(result.shown))
    save_pictures({recall: result.shown[recall]}, [medium], kept, tmp_path / "pictures")
    (path,) = (tmp_path / "pictures").iterdir()
    assert path.name.endswith("_best_can-000-0.png")
    picture = cv2.imread(str(path))
    assert picture is not None
    assert (picture == 255).all(axis=2).sum() > 50  # the outline of the truth


def test_folder_of_ones_own_is_scored(case: Case, tmp_path: Path) -> None:
    rendered = render(case.scene, case.rig, body=case.body, noise="medium", supersample=1)
    write(tmp_path / "mine", [Taken(rendered=rendered, tilt=case.tilt)], rig=case.rig)
    result = evaluate_folder(tmp_path / "mine", track, baselines=("classic",))
    assert [record.name for record in result.records] == ["mine/000000"]
    assert result.sections[0].title == "Mine: what is promised"
    assert result.sections[0].rows[0].value == 100.0


def test_every_scenario_of_the_catalogue_has_cases() -> None:
    quick, whole = sim.cases(quick=True), sim.cases(["garbage-can"])
    assert len({case.name for case in quick}) == len(quick) > 50
    assert [case.scenario for case in whole] == ["garbage-can"]
