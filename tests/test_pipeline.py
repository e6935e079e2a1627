"""The whole way from one frame to its answer, on the embedded sample and on exact maps."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

import bearcub.sample
from bearcub.clock import ManualClock
from bearcub.config import Config, Detection
from bearcub.errors import InputError
from bearcub.geometry import Attitude
from bearcub.messages import Answer, Float32, Snapshot, Tilt, UInt8
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig
from bearcub.sim import Rendered, render, scenes
from bearcub.sim.materials import BRICK
from bearcub.sim.solids import Box
from bearcub.sim.world import Thing

Pair = tuple[UInt8, UInt8]

RIG = scenes.paper_rig()
HALF = scenes.paper_rig(width=320, height=240)
LEVEL = Attitude(roll=0.0, pitch=0.0)


@pytest.fixture(scope="module")
def pair() -> Pair:
    """Return the sample's images."""
    sample = bearcub.sample.load()
    left, right = (cv2.imread(str(path)) for path in (sample.left, sample.right))
    assert left is not None
    assert right is not None
    return left.astype(np.uint8), right.astype(np.uint8)


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    """Return a pipeline for the sample's rig; it is pure, so all tests may share it."""
    return Pipeline(Rig.load(bearcub.sample.load().rig))


@pytest.fixture(scope="module")
def truth() -> dict[str, Any]:
    """Return the truth of the sample."""
    found: dict[str, Any] = json.loads(bearcub.sample.load().truth.read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def answer(pair: Pair, pipeline: Pipeline) -> Answer:
    """Return the sample's answer with its tilt reading."""
    tilt = bearcub.sample.load().tilt
    return pipeline.process(Snapshot(left=pair[0], right=pair[1], tilt=tilt))


@pytest.fixture(scope="module")
def can() -> Callable[[Rig], Rendered]:
    """Return the paper's garbage can 10 ft ahead, seen by a rig."""
    frames: dict[Rig, Rendered] = {}

    def seen_by(rig: Rig) -> Rendered:
        if rig not in frames:
            frames[rig] = render(scenes.garbage_can(), rig, body=LEVEL, supersample=1)
        return frames[rig]

    return seen_by


def without_timing(answer: Answer) -> dict[str, Any]:
    return {**answer.to_dict(), "timing_ms": None}


def test_sample_is_answered_as_its_truth_says(answer: Answer, truth: dict[str, Any]) -> None:
    (thing,) = answer.obstacles
    (true,) = truth["obstacles"]
    assert abs(thing.distance - true["distance"]) < 3 * thing.sigma_distance
    assert thing.distance == pytest.approx(true["distance"], abs=0.1)
    assert math.degrees(thing.bearing) == pytest.approx(true["bearing_deg"], abs=0.3)
    # the matcher's window blurs the edges by a few pixels of 8 mm at this range
    assert thing.width == pytest.approx(true["width"], abs=0.05)
    assert thing.height == pytest.approx(true["height"], abs=0.05)
    assert thing.base_height == 0.0
    assert answer.holes == ()


def test_samples_ground_is_that_of_its_truth(answer: Answer, truth: dict[str, Any]) -> None:
    ground, true = answer.ground, truth["ground"]
    assert ground.seen
    assert ground.source == "tilt+image"
    assert ground.height == pytest.approx(true["height"], rel=0.02)
    assert math.degrees(ground.pitch) == pytest.approx(true["pitch_deg"], abs=0.5)
    assert math.degrees(ground.roll) == pytest.approx(true["roll_deg"], abs=0.5)
    assert math.degrees(ground.tilt_disagreement) < 1.0
    assert answer.terrain.reference == "gravity"
    assert abs(math.degrees(answer.terrain.slope)) < 1.5
    assert abs(math.degrees(answer.terrain.cross_slope)) < 1.0
    assert answer.notes == ()


def test_sample_without_its_tilt_reading_gives_the_same_can(
    pair: Pair, pipeline: Pipeline, answer: Answer
) -> None:
    (blind,), (told,) = pipeline(*pair).obstacles, answer.obstacles
    assert blind.distance == pytest.approx(told.distance, abs=told.sigma_distance)
    assert blind.bearing == pytest.approx(told.bearing, abs=math.radians(0.3))
    assert blind.height == pytest.approx(told.height, abs=0.03)


def test_call_in_degrees_is_the_same_as_the_snapshot(
    pair: Pair, pipeline: Pipeline, answer: Answer
) -> None:
    called = pipeline(*pair, roll_deg=12.0, stamp_ns=5)
    assert {**without_timing(called), "stamp_ns": 0} == without_timing(answer)
    assert called.stamp_ns == 5


def test_grey_images_give_roughly_the_answer_of_colour_ones(
    pair: Pair, pipeline: Pipeline, answer: Answer
) -> None:
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.uint8) for image in pair)
    (grey,), (colour,) = pipeline(left, right, roll_deg=12.0).obstacles, answer.obstacles
    assert grey.distance == pytest.approx(colour.distance, abs=colour.sigma_distance)
    assert grey.width == pytest.approx(colour.width, abs=3 * colour.sigma_width)


def test_same_frame_gives_the_same_answer_again(
    pair: Pair, pipeline: Pipeline, answer: Answer
) -> None:
    again = pipeline(*pair, roll_deg=12.0)
    assert without_timing(again) == without_timing(answer)
    np.testing.assert_array_equal(again.layers.labels, answer.layers.labels)


def test_right_image_one_row_lower_is_noted(pair: Pair, pipeline: Pipeline) -> None:
    left, right = pair
    answer = pipeline(left, np.roll(right, 1, axis=0), roll_deg=12.0)
    assert answer.epipolar_offset == pytest.approx(1.0, abs=0.3)
    assert any("px lower than the left" in note for note in answer.notes)


def test_disparity_map_alone_is_answered(can: Callable[[Rig], Rendered]) -> None:
    answer = Pipeline(RIG).process(Snapshot(disparity=can(RIG).disparity))
    (thing,) = answer.obstacles
    assert thing.distance == pytest.approx(3.05, abs=3 * thing.sigma_distance)
    assert answer.terrain.reference == "robot"
    assert answer.ground.source == "image"
    assert math.isnan(answer.epipolar_offset)
    assert answer.valid_share == 1.0


def test_left_image_beside_a_disparity_map_is_only_a_picture(
    can: Callable[[Rig], Rendered],
) -> None:
    frame = can(HALF)
    black: UInt8 = np.zeros_like(frame.left)
    pipeline = Pipeline(RIG)
    alone = pipeline.process(Snapshot(disparity=frame.disparity))
    beside = pipeline.process(Snapshot(disparity=frame.disparity, left=black))
    assert without_timing(alone) == without_timing(beside)


def test_size_may_change_between_frames(can: Callable[[Rig], Rendered]) -> None:
    pipeline = Pipeline(RIG)
    whole, half = can(RIG).disparity, can(HALF).disparity
    first = pipeline.process(Snapshot(disparity=whole))
    (small,) = pipeline.process(Snapshot(disparity=half)).obstacles
    again = pipeline.process(Snapshot(disparity=whole))
    assert without_timing(first) == without_timing(again)
    (large,) = first.obstacles
    assert small.distance == pytest.approx(large.distance, abs=small.sigma_distance)
    assert small.bearing == pytest.approx(large.bearing, abs=1 / HALF.camera.fx)
    assert small.height == pytest.approx(large.height, abs=0.03)


def test_frame_of_another_shape_is_refused_and_does_not_spoil_the_next(
    can: Callable[[Rig], Rendered],
) -> None:
    pipeline = Pipeline(RIG)
    before = pipeline.process(Snapshot(disparity=can(RIG).disparity))
    with pytest.raises(InputError):
        pipeline.process(Snapshot(disparity=can(RIG).disparity[:200]))
    after = pipeline.process(Snapshot(disparity=can(RIG).disparity))
    assert without_timing(before) == without_timing(after)


@pytest.mark.parametrize(
    "snapshot",
    [
        Snapshot(),
        Snapshot(right=np.zeros((480, 640), dtype=np.uint8)),
        Snapshot(left=np.zeros((480, 640), dtype=np.uint8)),
        Snapshot(tilt=Tilt(pitch=0.0, roll=0.0)),
    ],
)
def test_snapshot_without_a_pair_or_a_map_is_refused(snapshot: Snapshot) -> None:
    with pytest.raises(InputError):
        Pipeline(RIG).process(snapshot)


@pytest.mark.parametrize(
    "disparity",
    [
        np.full((240, 320), np.nan, dtype=np.float32),
        np.full((240, 320), -7.0, dtype=np.float32),
        np.zeros((240, 320), dtype=np.uint16),
        np.zeros((240, 320, 1), dtype=np.float32),
    ],
    ids=["nothing matched", "swapped", "still encoded", "three axes"],
)
def test_map_that_cannot_be_one_is_refused(disparity: Float32) -> None:
    with pytest.raises(InputError, match="disparity"):
        Pipeline(RIG).process(Snapshot(disparity=disparity))


def test_offset_of_the_principal_points_is_added_to_what_was_measured(
    can: Callable[[Rig], Rendered],
) -> None:
    frame = can(HALF)
    plain = Pipeline(HALF).process(Snapshot(disparity=frame.disparity))
    offset = replace(HALF, camera=replace(HALF.camera, doffs=5.0))
    measured = (frame.disparity - 5).astype(np.float32)
    found = Pipeline(offset).process(Snapshot(disparity=measured))
    assert found.obstacles[0].distance == pytest.approx(plain.obstacles[0].distance, rel=1e-4)
    np.testing.assert_allclose(found.layers.disparity, plain.layers.disparity, atol=1e-5)


def test_infinite_values_count_as_no_match(can: Callable[[Rig], Rendered]) -> None:
    disparity = can(HALF).disparity.copy()
    disparity[:, :40] = np.inf
    answer = Pipeline(HALF).process(Snapshot(disparity=disparity))
    assert answer.valid_share == pytest.approx(280 / 320)
    assert np.isnan(answer.layers.disparity[:, :40]).all()


def test_configuration_reaches_the_stages(can: Callable[[Rig], Rendered]) -> None:
    snapshot = Snapshot(disparity=can(HALF).disparity)
    near = Config(detection=Detection(farthest=2.0, bearing_step_deg=5.0))
    answer = Pipeline(HALF, near).process(snapshot)
    assert answer.obstacles == ()  # the can is 3.05 m ahead
    np.testing.assert_allclose(np.diff(np.degrees(answer.free_range.bearing)), 5.0, atol=1e-9)
    tall = Config(detection=Detection(least_height=0.9))
    assert Pipeline(HALF, tall).process(snapshot).obstacles == ()


def test_rows_above_the_robot_can_be_left_out_and_what_they_cut_says_so() -> None:
    face = Box(x=6.1, y=0.0, bottom=0.0, size=(0.2, 1.5, 2.6), texture=BRICK)
    scene = replace(scenes.floor(), things=(Thing(name="door", foot=(6.0, 0.0), parts=(face,)),))
    frame = render(scene, RIG, body=LEVEL, supersample=1)
    snapshot = Snapshot(left=frame.left, right=frame.right, tilt=Tilt(pitch=0.0, roll=0.0))
    low = Config(detection=Detection(clearance=0.8))
    region = replace(low, matching=replace(low.matching, region_of_interest=True))
    whole, below = (Pipeline(RIG, config) for config in (low, region))
    # 0.8 m is no higher than row 206 up to 20 m; nose down by 3 times 1.5 deg, than 175.
    assert below.match(snapshot).first_row == 128
    assert whole.match(snapshot).first_row == 0
    ((tall,), (cut,)) = (each.process(snapshot).obstacles for each in (whole, below))
    assert tall.truncated == ()
    assert tall.height == pytest.approx(2.6, abs=0.1)
    assert cut.truncated == ("top",)
    # Row 128 is 1.1 m higher than the camera at 6 m, and the matcher's margin below it.
    assert 2.0 < cut.height < 2.4
    assert math.isnan(cut.sigma_height)
    assert cut.distance == pytest.approx(tall.distance, abs=2 * tall.sigma_distance)
    for name in ("bearing", "width"):
        assert getattr(cut, name) == pytest.approx(getattr(tall, name), abs=0.05)


def test_wrong_tilt_reading_is_noted_with_its_size(can: Callable[[Rig], Rendered]) -> None:
    tilt = Tilt(pitch=0.0, roll=math.radians(8))
    answer = Pipeline(HALF).process(Snapshot(disparity=can(HALF).disparity, tilt=tilt))
    (note,) = answer.notes
    assert "disagree by 8.0 deg" in note
    assert answer.to_dict()["ground"]["tilt_disagreement_deg"] == pytest.approx(8.0, abs=0.2)


def test_right_tilt_reading_is_not_noted(can: Callable[[Rig], Rendered]) -> None:
    tilt = Tilt(pitch=0.0, roll=0.0)
    answer = Pipeline(HALF).process(Snapshot(disparity=can(HALF).disparity, tilt=tilt))
    assert answer.notes == ()


def test_missing_floor_and_few_matches_are_noted(can: Callable[[Rig], Rendered]) -> None:
    frame = can(HALF)
    disparity = np.where(frame.labels == 1, frame.disparity, np.float32(np.nan))
    notes = Pipeline(HALF).process(Snapshot(disparity=disparity)).notes
    assert any(note.startswith("no floor seen: heights rest on the mount") for note in notes)
    assert any(note.startswith("only ") and "could be matched" in note for note in notes)


class Ticking(ManualClock):
    """A clock that moves by a millisecond whenever it is read."""

    def now_ns(self) -> int:
        """Return the time and move on."""
        self.advance(0.001)
        return super().now_ns()


def test_stages_are_timed_by_the_clock_that_is_passed_in(can: Callable[[Rig], Rendered]) -> None:
    snapshot = Snapshot(disparity=can(HALF).disparity)
    still = Pipeline(HALF, clock=ManualClock()).process(snapshot).timing
    assert (still.match, still.ground, still.obstacles, still.total) == (0, 0, 0, 0)
    moving = Pipeline(HALF, clock=Ticking()).process(snapshot).timing
    stages = (moving.match, moving.ground, moving.obstacles)
    assert min(stages) >= 1.0 - 1e-9
    assert moving.total >= sum(stages) - 1e-9


def test_answer_of_a_real_frame_is_strict_json(answer: Answer) -> None:
    told = json.loads(answer.to_json(), parse_constant=pytest.fail)
    assert told["schema"] == "bearcub.answer/1"
    assert told["obstacles"][0]["id"] == 1
    bearings = [entry["bearing_deg"] for entry in told["free_range"]]
    assert bearings == sorted(bearings)


def test_one_pipeline_may_match_and_another_answer(pair: Pair) -> None:
    left, right = pair
    snapshot = Snapshot(left=left, right=right, tilt=Tilt(pitch=0.0, roll=math.radians(12)))
    whole = Pipeline(RIG).process(snapshot)
    parted = Pipeline(RIG).answer(snapshot, Pipeline(RIG).match(snapshot))
    assert parted.obstacles == whole.obstacles
    assert parted.valid_share == whole.valid_share
    np.testing.assert_array_equal(parted.ground.plane, whole.ground.plane)


@pytest.mark.skipif(sys.platform != "linux", reason="counts Linux's page faults")
def test_frames_are_made_of_the_memory_of_the_frames_before() -> None:
    """In a process of its own: other tests may have taught the allocator already."""
    counted = subprocess.run(
        [sys.executable, "-c", PAGE_FAULTS], capture_output=True, text=True, check=True
    )
    assert float(counted.stdout) < 50  # 620 where freed memory is given back


PAGE_FAULTS = """
import resource
import numpy as np
import bearcub.sample
from bearcub.messages import Snapshot, Tilt
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig

rig = Rig.load(bearcub.sample.load().rig)
a, b, c = rig.camera.projection.plane(height=rig.mount.height, down=rig.mount.attitude.down())
disparity = np.empty((480, 640), dtype=np.float32)
for v, row in enumerate(disparity):
    row[:] = np.maximum(23.0, a * np.arange(640) + b * v + c)
process = Pipeline(rig).process
snapshot = Snapshot(disparity=disparity, tilt=Tilt(pitch=0.0, roll=0.0))
faults = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(10):
    process(snapshot)
before = faults()
for _ in range(20):
    process(snapshot)
print((faults() - before) / 20)
"""
