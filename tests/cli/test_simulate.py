import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bearcub.cli.main import main
from bearcub.devices.carmen import read_carmen
from bearcub.sim import folder, scenario

RAYCAST = ("--renderer", "raycast")


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("simulate") / "scene"
    assert main(["simulate", "garbage-can", "--save", str(place), *RAYCAST]) == 0
    return place


def test_list_has_one_line_for_every_scenario(bearcub: Any) -> None:
    lines = bearcub("simulate", "--list").out.splitlines()[1:]
    assert [line.split()[0] for line in lines] == list(scenario.names())
    assert all(line.endswith(".") for line in lines)


def test_saved_frames_can_be_read_and_answered(bearcub: Any, saved: Path) -> None:
    (frame,) = folder.read(saved)
    (can,) = frame.truth["obstacles"]
    outcome = bearcub(
        "detect", saved / "left", saved / "right", "--rig", saved / "rig.toml",
        "--tilt", saved / "tilt.csv", "--json",
    )  # fmt: skip
    assert outcome.code == 0
    (found,) = json.loads(outcome.out)["obstacles"]
    assert found["distance"] == pytest.approx(can["distance"], rel=0.02)
    assert found["bearing_deg"] == pytest.approx(can["bearing_deg"], abs=0.5)
    assert frame.truth["tags"]["case"] == "garbage-can/000-0"


def test_saved_folder_explains_every_file_in_it(saved: Path) -> None:
    text = (saved / "README.md").read_text(encoding="utf-8")
    for entry in saved.iterdir():
        assert entry.name == "README.md" or entry.name in text
    ((_, scan),) = read_carmen(saved / "scan.clf")
    assert np.nanmin(scan.ranges) < 3.2  # the floor, the robot rolled


def test_without_save_the_truth_is_shown(bearcub: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bearcub.sim.sampling.WIDTH", 160)
    monkeypatch.setattr("bearcub.sim.sampling.HEIGHT", 120)
    out = bearcub("simulate", "table", "--frames", 1, "--noise", "none", *RAYCAST).out
    header, first, *rest = out.splitlines()
    assert header.split()[:2] == ["Frame", "What"]
    assert first.startswith("table/000-0")
    assert any("table top (passable)" in line for line in (first, *rest))
    assert any("table leg " in line for line in (first, *rest))


def test_seed_and_noise_change_what_they_name(
    bearcub: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bearcub.sim.sampling.WIDTH", 160)
    monkeypatch.setattr("bearcub.sim.sampling.HEIGHT", 120)
    options = {"plain": (), "noisy": ("--noise", "strong"), "other": ("--seed", 99)}
    for name, words in options.items():
        place = tmp_path / name
        common = ("--frames", 1, "--save", place, *RAYCAST)
        outcome = bearcub("simulate", "small-box", *words, *common)
        assert outcome.out == f"{place}: 1 frame\n"
    plain, noisy, other = (next(folder.read(tmp_path / name)) for name in options)
    assert plain.truth == noisy.truth
    assert plain.left.read_bytes() != noisy.left.read_bytes()
    assert plain.truth["obstacles"] != other.truth["obstacles"]


def test_every_rig_has_a_folder_of_its_own(
    bearcub: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bearcub.sim.sampling.WIDTH", 80)
    monkeypatch.setattr("bearcub.sim.sampling.HEIGHT", 60)
    out = bearcub("simulate", "floor", "--frames", 6, "--save", tmp_path / "all", *RAYCAST).out
    assert out.splitlines()[-1].startswith("One folder for every rig")
    frames = list(folder.read(tmp_path / "all"))
    assert len(frames) == 6
    assert len({frame.rig.mount.height for frame in frames}) == 2
    tags = [frame.truth["tags"] for frame in frames]
    assert [tag["height"] for tag in tags] == [frame.rig.mount.height for frame in frames]
    assert np.all([tag["empty"] for tag in tags])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("garbage-cna",), "unknown scenario garbage-cna: did you mean garbage-can?"),
        ((), "which scenario?"),
        (("floor", "--seed", "x"), "'x': expected a whole number"),
        (("floor", "--frames", "0"), "'0': expected a whole number, 1 or more"),
        (("floor", "--noise", "loud"), "invalid choice: 'loud'"),
    ],
)
def test_mistakes_are_one_line(bearcub: Any, words: tuple[str, ...], message: str) -> None:
    outcome = bearcub("simulate", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.count("\n") == 1
    assert message in outcome.err


def test_a_machine_without_mujoco_is_told_and_served(
    bearcub: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    monkeypatch.setattr("bearcub.sim.sampling.WIDTH", 80)
    monkeypatch.setattr("bearcub.sim.sampling.HEIGHT", 60)
    outcome = bearcub("simulate", "floor", "--frames", 1)
    assert outcome.code == 0
    assert outcome.err.startswith("note: MuJoCo is not installed")
    assert "nothing but ground" in outcome.out
