"""A video through all stages at once: the answers of the pipeline, and times that add up."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bearcub import sample
from bearcub.clock import MonotonicClock
from bearcub.config import Config
from bearcub.devices import open_frames
from bearcub.errors import InputError
from bearcub.messages import Answer
from bearcub.pipeline import Pipeline
from bearcub.runtime import bench_video
from bearcub.runtime.bench import WARM_UP
from bearcub.runtime.bench_video import AGE, Played, play
from bearcub.runtime.feed import Feed, Shot
from bearcub.runtime.loop import Interruption
from bearcub.runtime.relay import Passed
from bearcub.runtime.sample_video import sample_video
from bearcub.runtime.tilt import same_tilt
from bearcub.viewer import annotate

STAGES = ["decode", "rectify", "match", "answer", "overlay"]


def shots(count: int, *, size: tuple[int, int]) -> list[Shot]:
    with (
        sample_video(size=size, frames=count) as (path, rig),
        open_frames(path, side_by_side=True) as frames,
    ):
        return list(Feed(frames, rig, tilts=same_tilt(sample.load().tilt), source="video"))


@pytest.fixture(scope="module")
def small() -> list[Shot]:
    return shots(WARM_UP + 4, size=(160, 120))


def played(given: Iterator[Shot], **options: Any) -> Played:
    asked: dict[str, Any] = {"clock": MonotonicClock(), "interruption": Interruption(), **options}
    return play(given, Config(), **asked)


def test_the_sample_as_a_shaken_video_still_shows_the_garbage_can() -> None:
    first, second = shots(2, size=(320, 240))
    assert first.snapshot.left is not None
    assert second.snapshot.left is not None
    assert not np.array_equal(first.snapshot.left, second.snapshot.left)
    assert first.rig.rectification is not None
    assert first.rig.rectification.needed
    for shot in (first, second):
        found = Pipeline(shot.rig).process(shot.snapshot).obstacles
        assert [thing.distance for thing in found] == pytest.approx([3.05], abs=0.15)


def test_the_answers_are_those_of_the_pipeline(
    small: list[Shot], monkeypatch: pytest.MonkeyPatch
) -> None:
    answers: list[Answer] = []

    def draw(answer: Answer, *given: Any, **options: Any) -> Any:
        answers.append(answer)
        return annotate(answer, *given, **options)

    monkeypatch.setattr("bearcub.runtime.bench_video.annotate", draw)
    result = played(iter(small[:3]))
    pipeline = Pipeline(small[0].rig)
    for shot, answer in zip(small, answers, strict=False):
        expected = pipeline.process(shot.snapshot)
        assert answer.obstacles == expected.obstacles
        assert answer.valid_share == expected.valid_share
        np.testing.assert_array_equal(answer.ground.plane, expected.ground.plane)
        np.testing.assert_array_equal(answer.free_range.range, expected.free_range.range)
    assert len(answers) == 3
    assert result.frames == 0  # all of them warmed up
    assert result.size == (160, 120)


def test_every_frame_but_the_warm_up_is_counted(small: list[Shot]) -> None:
    seen = 0

    def advance() -> None:
        nonlocal seen
        seen += 1

    result = played(iter(small), advance=advance)
    assert (seen, result.frames) == (WARM_UP + 4, 4)
    assert list(result.times) == [*STAGES, AGE]
    work = sum(result.times[name] for name in STAGES[:4])
    assert (result.times[AGE] >= work).all()
    assert 0 < result.rate_hz <= 1000 / np.mean(result.times["overlay"]) + 1e-6


def test_the_arithmetic_of_rate_and_age() -> None:
    milliseconds = 1_000_000
    passed = [
        Passed(
            began_ns={name: (100 * n + 10 * k) * milliseconds for k, name in enumerate(STAGES)},
            ended_ns={name: (100 * n + 10 * k + 7) * milliseconds for k, name in enumerate(STAGES)},
        )
        for n in range(WARM_UP + 5)
    ]
    result = bench_video._summary(passed, size=(4, 3))
    assert result.frames == 5
    assert result.rate_hz == pytest.approx(10.0)
    np.testing.assert_allclose(result.times["match"], 7.0)
    np.testing.assert_allclose(result.times[AGE], 37.0)  # from 0 to the answer's end at 30 + 7


def test_an_interruption_keeps_what_was_played(small: list[Shot]) -> None:
    interruption = Interruption()
    seen: list[None] = []

    def advance() -> None:
        seen.append(None)
        interruption.requested = len(seen) == WARM_UP + 2

    assert played(iter(small), advance=advance, interruption=interruption).frames == 2


def test_what_cannot_be_decoded_is_said_and_leaves_no_thread(small: list[Shot]) -> None:
    def broken() -> Iterator[Shot]:
        yield from small[:2]
        raise InputError("video: frame 2 is damaged")

    with pytest.raises(InputError, match="frame 2 is damaged"):
        played(broken())
    assert not [thread.name for thread in threading.enumerate() if "bearcub" in thread.name]
