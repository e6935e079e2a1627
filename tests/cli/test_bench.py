"""``bearcub bench`` beyond the plain table: videos, matchers, sizes and threads."""

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.runtime.sample_video import sample_video
from bearcub.stereo import write_disparity
from bearcub.stereo.native import reason_missing
from bearcub.viewer import annotate

SMALL = ("--size", "160x120")


def test_several_sizes_are_measured_on_the_threads_asked_for(bearcub: Any) -> None:
    sizes = ("--size", "160x120", "128x96")
    lines = bearcub("bench", "--frames", 1, *sizes, "--threads", "all", "--json").out.splitlines()
    found = [json.loads(line) for line in lines]
    assert [one["size"] for one in found] == [[160, 120], [128, 96]]
    assert {one["threads"] for one in found} == {len(os.sched_getaffinity(0))}
    out = bearcub("bench", "--frames", 1, *sizes, "--threads", 2).out
    assert out.count(", 1 frames a case after 5 to warm up, 2 threads") == 2


def test_the_sample_is_played_as_a_video(bearcub: Any) -> None:
    found = json.loads(bearcub("bench", "--video", "--frames", 2, *SMALL, "--json").out)
    assert found["schema"] == "bearcub.bench/1"
    assert (found["size"], found["frames"]) == ([160, 120], 2)
    assert found["matcher"] == ("sgbm" if reason_missing() else "native")
    assert list(found["stages_ms"]) == ["decode", "rectify", "match", "answer", "overlay"]
    assert found["age_ms"]["p50"] > found["stages_ms"]["answer"]["p50"]
    assert found["rate_hz"] > 0
    outcome = bearcub("bench", "--video", "--frames", 1, *SMALL, "--matcher", "bm")
    assert "160 x 120 px, 1 frames after 5 to warm up, matched by bm, one thread" in outcome.out
    assert "age of the answer" in outcome.out
    assert "frames per second" in outcome.out
    assert outcome.err == ""


@pytest.fixture
def video(tmp_path: Path) -> Iterator[tuple[Path, Path]]:
    """A side-by-side video of eight frames and its rig."""
    with sample_video(size=(160, 120), frames=8) as (path, rig):
        calibration = tmp_path / "rig.toml"
        calibration.write_text(rig.to_toml())
        yield path, calibration


def test_a_video_of_ones_own_is_played_to_its_end(bearcub: Any, video: tuple[Path, Path]) -> None:
    path, rig = video
    found = json.loads(bearcub("bench", "--video", path, "--rig", rig, "--json").out)
    assert (found["size"], found["frames"]) == ([160, 120], 3)


def test_ctrl_c_ends_with_the_result_so_far(
    bearcub: Any, video: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = 0

    def draw(*given: Any, **options: Any) -> Any:
        nonlocal drawn
        drawn += 1
        if drawn == 6:
            os.kill(os.getpid(), signal.SIGINT)
        return annotate(*given, **options)

    monkeypatch.setattr("bearcub.runtime.bench_video.annotate", draw)
    path, rig = video
    outcome = bearcub("bench", "--video", path, "--rig", rig, "--json")
    assert outcome.code == 130
    frames = json.loads(outcome.out)["frames"]
    assert outcome.err == f"bearcub: interrupted after {frames} frames\n"
    assert frames in (1, 2)


def test_what_cannot_be_played_is_said_in_one_line(
    bearcub: Any, video: tuple[Path, Path], tmp_path: Path
) -> None:
    path, rig = video

    def refusal(*words: object) -> str:
        outcome = bearcub("bench", *words)
        assert outcome.code == 2
        assert outcome.out == ""
        assert outcome.err.count("\n") == 1
        return str(outcome.err)

    assert "a video needs a rig" in refusal("--video", path)
    assert "expected one side-by-side video, or left and right" in refusal(
        "--video", path, path, path, "--rig", rig
    )
    assert "--size is for the sample" in refusal("--video", path, "--rig", rig, *SMALL)
    assert "without a video of its own" in refusal("--rig", rig)
    assert "not allowed with argument" in refusal("--video", "--pair")
    assert "missing.avi" in refusal("--video", tmp_path / "missing.avi", "--rig", rig)
    with sample_video(size=(160, 120), frames=4) as (short, _):
        assert "too short; expected more than 5 frames" in refusal("--video", short, "--rig", rig)


def test_matchers_are_compared_with_the_reference_and_with_truth(
    bearcub: Any, tmp_path: Path
) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (64, 120)).astype(np.uint8)
    texture = cv2.GaussianBlur(noise, (5, 5), 0)
    cv2.imwrite(str(tmp_path / "im0.png"), texture[:, :96])
    cv2.imwrite(str(tmp_path / "im1.png"), texture[:, 5:101])
    write_disparity(tmp_path / "disp0.pfm", np.full((64, 96), 5, np.float32), encoding="pixels")
    words = ("bench", "--matchers", tmp_path, "--frames", 1, "--size", "96x64", "128x64")
    found = json.loads(bearcub(*words, "--json").out)
    assert [one["size"] for one in found["sizes"]] == [[96, 64], [128, 64]]
    first = found["sizes"][0]["matchers"][0]
    assert (first["name"], first["ratio"]) == ("SGBM 3WAY", 1.0)
    scores = {(one["pair"], one["matcher"]): one for one in found["accuracy"]}
    assert scores["mean", "SGBM 3WAY"]["bad_2"] < 0.05
    assert scores[tmp_path.name, "SGBM 3WAY"]["density"] > 0.7
    out = bearcub(*words).out
    assert out.count("  1.000  ") == 2
    assert "96 x 64 x 16" in out
    assert "off by 2 px" in out


def test_growth_of_the_cost_is_shown_over_sizes_and_disparities(bearcub: Any) -> None:
    words = ("bench", "--matchers", "--frames", 1, "--size", "96x64", "128x64")
    found = json.loads(bearcub(*words, "--disparities", 16, 48, "--json").out)["sizes"]
    searched = [(*one["size"], one["disparities"]) for one in found]
    assert searched == [(96, 64, 16), (96, 64, 48), (128, 64, 16), (128, 64, 48)]
    matchers = {one["name"]: one for one in found[1]["matchers"]}
    first = matchers["SGBM 3WAY"]
    assert first["candidate_ps"] == pytest.approx(first["p50"] * 1e9 / (96 * 64 * 48))
    assert first["memory_mb"] is None
    if not reason_missing():
        assert 0.01 < matchers["native, 1 thread"]["memory_mb"] < 1.0
    assert "96 x 64 x 48" in bearcub(*words, "--disparities", 48).out


def test_disparities_are_whole_sixteens_and_of_the_matchers(bearcub: Any) -> None:
    refused = bearcub("bench", "--disparities", 64)
    assert refused.code == 2
    assert "--disparities is for --matchers" in refused.err
    refused = bearcub("bench", "--matchers", "--disparities", 40)
    assert refused.code == 2
    assert "'40': expected a multiple of 16" in refused.err
