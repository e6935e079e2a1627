"""``bearcub detect``: what it prints and what it writes."""

import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.devices import VideoSink
from bearcub.stereo import write_disparity

NUMBERS = (int, float)
CONTRACT: dict[str, Any] = {
    "schema": str,
    "stamp_ns": int,
    "frame_id": str,
    "obstacles": [
        {
            "id": int,
            "x": float,
            "y": float,
            "distance": float,
            "bearing_deg": float,
            "width": float,
            "height": float,
            "base_height": float,
            "sigma": {"distance": float, "bearing_deg": float, "width": float, "height": float},
            "confidence": float,
            "votes": [{"sensor": str, "vote": str, "weight": float, "reason": str}],
        }
    ],
    "holes": [
        {
            "x": float,
            "y": float,
            "distance": float,
            "bearing_deg": float,
            "width": float,
            "length": float,
            "depth": float,
            "depth_is_lower_bound": bool,
            "kind": str,
            "sigma": {"distance": float, "width": float, "length": float, "depth": float},
            "confidence": float,
        }
    ],
    "terrain": {
        "slope_deg": float,
        "cross_slope_deg": float,
        "sigma_deg": float,
        "roughness": float,
        "reference": str,
        "profile": [{"from": float, "to": float, "slope_deg": float, "sigma_deg": float}],
    },
    "ground": {
        "height": float,
        "pitch_deg": float,
        "roll_deg": float,
        "source": str,
        "residual_px": float,
        "tilt_disagreement_deg": float,
    },
    "free_range": [{"bearing_deg": float, "range": float, "limit": str}],
    "timing_ms": {"match": float, "ground": float, "obstacles": float, "total": float},
}


def _fits(value: Any, wanted: Any) -> bool:
    """Tell whether a JSON value has exactly the contract's keys and types."""
    if isinstance(wanted, dict):
        same = isinstance(value, dict) and list(value) == list(wanted)
        return same and all(_fits(value[key], wanted[key]) for key in wanted)
    if isinstance(wanted, list):
        return isinstance(value, list) and all(_fits(item, wanted[0]) for item in value)
    if wanted is float:
        return value is None or (isinstance(value, NUMBERS) and not isinstance(value, bool))
    return isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool))


@pytest.fixture
def pair(files: Any) -> tuple[str, ...]:
    """The arguments that answer the rendered pair."""
    return ("detect", files.left, files.right, "--rig", files.rig)


@pytest.fixture
def sequence(files: Any, tmp_path: Path) -> tuple[str, ...]:
    """The arguments that answer the same pair four times, from two folders."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for index in range(4):
            target = tmp_path / side / f"{index:02d}.png"
            target.write_bytes(Path(getattr(files, side)).read_bytes())
    return ("detect", str(tmp_path / "left"), str(tmp_path / "right"), "--rig", files.rig)


def _nearest(out: str) -> dict[str, Any]:
    nearest: dict[str, Any] = json.loads(out)["obstacles"][0]
    return nearest


def test_without_arguments_the_sample_answers_all_six_questions(bearcub: Any) -> None:
    outcome = bearcub("detect")
    assert outcome.code == 0
    assert outcome.out.startswith("The embedded sample: a garbage can 10 ft ahead")
    for question in (
        "How far?",
        "At what angle?",
        "How large?",
        "How high?",
        "How does the ground slope?",
        "Is there a hole?",
    ):
        assert question in outcome.out
    assert "\x1b" not in outcome.out  # no colours where there is no terminal
    assert max(map(len, outcome.out.splitlines())) <= 120


def test_sample_as_json_says_on_stderr_what_it_is(bearcub: Any) -> None:
    outcome = bearcub("detect", "--json")
    assert outcome.out.count("\n") == 1
    assert math.isclose(_nearest(outcome.out)["distance"], 3.05, rel_tol=0.03)
    assert outcome.err.startswith("note: no input given, this is the embedded sample")


def test_json_is_the_contract_and_nothing_else(bearcub: Any, pair: tuple[str, ...]) -> None:
    outcome = bearcub(*pair, "--json", "--pitch", "0")
    answer = json.loads(outcome.out)
    assert _fits(answer, CONTRACT)
    assert answer["schema"] == "bearcub.answer/1"
    assert answer["terrain"]["reference"] == "gravity"
    assert outcome.out == f"{json.dumps(answer)}\n"


def test_the_rendered_can_is_found_where_it_is(bearcub: Any, files: Any) -> None:
    path = Path(files.disparity).with_name("exact.npy")
    write_disparity(path, files.rendered.disparity, encoding="pixels")
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig, "--json")
    can = _nearest(outcome.out)
    assert math.isclose(can["distance"], 3.05, rel_tol=0.02)  # a pixel is 6 % at this size
    assert math.isclose(can["bearing_deg"], 2.0, abs_tol=0.5)


def test_depth_means_the_same_as_disparity(bearcub: Any, files: Any, tmp_path: Path) -> None:
    # fx B = 193 px * 0.12 m; in an image of half the size the rig's focal length is half, too.
    with np.errstate(divide="ignore"):
        depth = np.minimum(1000.0 * 193.0 * 0.12 / files.rendered.disparity, 65535.0)
    cv2.imwrite(str(tmp_path / "depth.png"), depth.astype(np.uint16)[::2, ::2])
    outcome = bearcub(
        "detect", "--disparity", tmp_path / "depth.png", "--encoding", "depth_mm", "--rig",
        files.rig, "--json",
    )  # fmt: skip
    assert math.isclose(_nearest(outcome.out)["distance"], 3.05, rel_tol=0.04)


def test_scaled_input_keeps_its_metres(bearcub: Any) -> None:
    half = json.loads(bearcub("detect", "--json", "--scale", 0.5).out)
    can = min(half["obstacles"], key=lambda thing: abs(thing["bearing_deg"] - 2.0))
    assert math.isclose(can["distance"], 3.05, rel_tol=0.04)
    assert math.isclose(can["width"], 0.45, rel_tol=0.2)


def test_mount_options_move_the_camera(bearcub: Any, pair: tuple[str, ...]) -> None:
    here = _nearest(bearcub(*pair, "--json").out)
    moved = _nearest(bearcub(*pair, "--json", "--x", "0.5", "--y", "0.2").out)
    assert math.isclose(moved["x"] - here["x"], 0.5, abs_tol=0.03)  # another point may be nearest
    assert math.isclose(moved["y"] - here["y"], 0.2, abs_tol=0.1)


def test_a_sequence_is_one_line_a_frame_and_a_summary(
    bearcub: Any, sequence: tuple[str, ...]
) -> None:
    outcome = bearcub(*sequence)
    lines = outcome.out.splitlines()
    assert lines[1].split() == [
        "Frame",
        "Obstacles",
        "Nearest",
        "Bearing",
        "Slope",
        "Holes",
        "Time",
    ]
    assert [line.split()[0] for line in lines[2:6]] == ["00", "01", "02", "03"]
    assert lines[6].startswith("4 frames: ")


def test_a_sequence_as_json_is_one_object_a_line(bearcub: Any, sequence: tuple[str, ...]) -> None:
    lines = bearcub(*sequence, "--json", "--limit", 3).out.splitlines()
    assert len(lines) == 3
    assert all(_fits(json.loads(line), CONTRACT) for line in lines)


def test_a_tilt_file_gives_every_frame_its_own(
    bearcub: Any, sequence: tuple[str, ...], tmp_path: Path
) -> None:
    path = tmp_path / "tilts.csv"
    path.write_text("pitch,roll\n0,0\n,\n0.5,0\n")
    outcome = bearcub(*sequence, "--json", "--tilt-file", path)
    lines = [json.loads(line) for line in outcome.out.splitlines()]
    references = [line["terrain"]["reference"] for line in lines]
    assert references == ["gravity", "robot", "gravity"]
    assert outcome.code == 2  # the fourth frame has no reading
    assert "holds 3 readings" in outcome.err


@pytest.mark.parametrize("method", ["bearcub", "classic"])
def test_the_saved_picture_can_be_read(
    bearcub: Any, pair: tuple[str, ...], tmp_path: Path, method: str
) -> None:
    path = tmp_path / "out.png"
    assert bearcub(*pair, "--save", path, "--method", method).code == 0
    picture = cv2.imread(str(path))
    assert picture is not None
    assert picture.shape[1] > 320  # the plan view is beside it


def test_the_saved_video_has_every_frame(
    bearcub: Any, sequence: tuple[str, ...], tmp_path: Path
) -> None:
    path = tmp_path / "out.mp4"
    assert bearcub(*sequence, "--save", path).code == 0
    assert _frames(path) == 4


def _frames(path: Path) -> int:
    video = cv2.VideoCapture(str(path))
    count = 0
    while video.read()[0]:
        count += 1
    video.release()
    return count


@pytest.mark.parametrize("method", ["bearcub", "classic", "classic-printed"])
def test_figures_are_those_of_the_first_frame(
    bearcub: Any, sequence: tuple[str, ...], tmp_path: Path, method: str
) -> None:
    folder = tmp_path / "figures"
    assert bearcub(*sequence, "--figures", folder, "--limit", 2, "--method", method).code == 0
    assert len(list(folder.glob("*.png"))) == 6


def test_a_bad_frame_leaves_the_ones_before_it_intact(
    bearcub: Any, sequence: tuple[str, ...], tmp_path: Path
) -> None:
    bad = tmp_path / "right" / "02.png"
    bad.write_bytes(bad.read_bytes()[:2000])
    outcome = bearcub(*sequence, "--json", "--save", tmp_path / "out.mp4")
    assert outcome.code == 2
    assert [_fits(json.loads(line), CONTRACT) for line in outcome.out.splitlines()] == [True] * 2
    assert outcome.err.count("\n") == 1
    assert str(bad) in outcome.err
    assert _frames(tmp_path / "out.mp4") == 2


def test_a_video_that_ends_early_leaves_the_frames_it_had(
    bearcub: Any, files: Any, tmp_path: Path
) -> None:
    for side, frames in (("left", 4), ("right", 3)):
        with VideoSink(tmp_path / f"{side}.avi", rate_hz=5.0) as sink:
            for index in range(frames):
                sink.write(getattr(files.rendered, side), name=str(index))
    outcome = bearcub(
        "detect", tmp_path / "left.avi", tmp_path / "right.avi", "--rig", files.rig, "--json"
    )
    assert outcome.code == 2
    assert [json.loads(line)["stamp_ns"] for line in outcome.out.splitlines()] == [
        0,
        200_000_000,
        400_000_000,
    ]
    assert "right.avi" in outcome.err
    assert "ended after frame 3" in outcome.err


def test_side_by_side_pictures_are_halved(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "both.png"
    cv2.imwrite(str(path), np.hstack([files.rendered.left, files.rendered.right]))
    both = bearcub("detect", path, "--side-by-side", "--rig", files.rig, "--json")
    apart = bearcub("detect", files.left, files.right, "--rig", files.rig, "--json")
    assert _nearest(both.out) == _nearest(apart.out)


def test_classic_answers_in_the_same_form_with_nulls(bearcub: Any, pair: tuple[str, ...]) -> None:
    answer = json.loads(bearcub(*pair, "--method", "classic", "--json").out)
    assert _fits(answer, CONTRACT)
    can = answer["obstacles"][0]
    assert math.isclose(can["distance"], 3.05, rel_tol=0.1)  # a whole level is 13 % here
    assert math.isclose(can["bearing_deg"], 2.0, abs_tol=1.0)
    assert set(can["sigma"].values()) == {None}
    assert answer["terrain"]["slope_deg"] is None
    assert answer["free_range"] == []


def test_notes_are_said_once_and_counted(bearcub: Any, files: Any, tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    sky = np.full((240, 320), 0.01, dtype=np.float32)
    for index in range(3):
        np.save(folder / f"{index}.npy", sky)
    outcome = bearcub("detect", "--disparity", folder, "--rig", files.rig, "--json")
    assert outcome.code == 0
    said, counted = (line for line in outcome.err.splitlines() if "no floor seen" in line)
    assert counted == said.replace("note: ", "note: in 3 of 3 frames: ")
