"""The answer's JSON is the contract ``bearcub.answer/1``, key for key; unknown is null."""

import json
import math
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import (
    Answer,
    FreeRange,
    Ground,
    Hole,
    Layers,
    Limit,
    Obstacle,
    SlopeBand,
    Snapshot,
    Terrain,
    Timing,
    Vote,
    as_disparity,
    as_image,
)

NAN = math.nan

CAN = Obstacle(
    id=1,
    x=3.2,
    y=0.1,
    distance=3.05,
    bearing=math.radians(1.9),
    width=0.41,
    height=0.7,
    base_height=0.0,
    sigma_distance=0.02,
    sigma_bearing=math.radians(0.1),
    sigma_width=0.02,
    sigma_height=0.02,
    confidence=0.97,
    box=(100, 80, 140, 160),
    pixels=1840,
    votes=(Vote(sensor="stereo", vote="for", weight=2.1, reason="1840 px above the floor"),),
)
PIT = Hole(
    x=2.8,
    y=0.0,
    distance=2.3,
    bearing=0.0,
    width=0.6,
    length=0.6,
    depth=0.3,
    depth_is_lower_bound=False,
    kind="pit",
    sigma_distance=0.05,
    sigma_width=0.05,
    sigma_length=0.1,
    sigma_depth=0.05,
    confidence=0.9,
    box=(100, 180, 140, 200),
    pixels=600,
)
TERRAIN = Terrain(
    slope=math.radians(1.2),
    cross_slope=0.0,
    sigma=math.radians(0.3),
    roughness=0.01,
    reference="gravity",
    profile=(SlopeBand(start=1.5, end=2.5, slope=0.0, sigma=math.radians(0.2)),),
)
GROUND = Ground(
    plane=np.array([0.0, 0.1, -19.9]),
    covariance=np.eye(3),
    height=1.2,
    pitch=math.radians(5.9),
    roll=0.0,
    sigma_height=0.01,
    sigma_pitch=0.001,
    sigma_roll=0.001,
    noise=0.2,
    source="tilt+image",
    seen=True,
    residual=0.2,
    tilt_disagreement=math.radians(0.1),
)
EMPTY = np.zeros((2, 2), dtype=np.float32)
ANSWER = Answer(
    obstacles=(CAN,),
    holes=(PIT,),
    terrain=TERRAIN,
    ground=GROUND,
    free_range=FreeRange(
        bearing=np.radians([-40.0]), range=np.array([4.1]), limit=(Limit.OBSTACLE,)
    ),
    timing=Timing(match=4.0, ground=0.4, obstacles=0.5, total=5.2),
    layers=Layers.of(
        disparity=EMPTY,
        floor=EMPTY,
        kind=EMPTY.astype(np.uint8),
        labels=EMPTY.astype(np.int32),
    ),
)

# written out from the contract, not from the code
CONTRACT = {
    "schema": "bearcub.answer/1",
    "stamp_ns": 0,
    "frame_id": "base_link",
    "obstacles": [
        {
            "id": 1,
            "x": 3.2,
            "y": 0.1,
            "distance": 3.05,
            "bearing_deg": 1.9,
            "width": 0.41,
            "height": 0.7,
            "base_height": 0.0,
            "sigma": {"distance": 0.02, "bearing_deg": 0.1, "width": 0.02, "height": 0.02},
            "confidence": 0.97,
            "votes": [
                {
                    "sensor": "stereo",
                    "vote": "for",
                    "weight": 2.1,
                    "reason": "1840 px above the floor",
                }
            ],
        }
    ],
    "holes": [
        {
            "x": 2.8,
            "y": 0.0,
            "distance": 2.3,
            "bearing_deg": 0.0,
            "width": 0.6,
            "length": 0.6,
            "depth": 0.3,
            "depth_is_lower_bound": False,
            "kind": "pit",
            "sigma": {"distance": 0.05, "width": 0.05, "length": 0.1, "depth": 0.05},
            "confidence": 0.9,
        }
    ],
    "terrain": {
        "slope_deg": 1.2,
        "cross_slope_deg": 0.0,
        "sigma_deg": 0.3,
        "roughness": 0.01,
        "reference": "gravity",
        "profile": [{"from": 1.5, "to": 2.5, "slope_deg": 0.0, "sigma_deg": 0.2}],
    },
    "ground": {
        "height": 1.2,
        "pitch_deg": 5.9,
        "roll_deg": 0.0,
        "source": "tilt+image",
        "residual_px": 0.2,
        "tilt_disagreement_deg": 0.1,
    },
    "free_range": [{"bearing_deg": -40.0, "range": 4.1, "limit": "obstacle"}],
    "timing_ms": {"match": 4.0, "ground": 0.4, "obstacles": 0.5, "total": 5.2},
}


def test_json_is_the_contract_in_every_key_value_and_in_this_order() -> None:
    assert json.dumps(json.loads(ANSWER.to_json())) == json.dumps(CONTRACT)


def test_json_is_one_line() -> None:
    assert "\n" not in ANSWER.to_json()


@pytest.mark.parametrize(
    ("change", "path"),
    [
        (
            lambda a: replace(a, obstacles=(replace(CAN, sigma_width=NAN),)),
            "obstacles.0.sigma.width",
        ),
        (
            lambda a: replace(a, obstacles=(replace(CAN, sigma_height=NAN),)),
            "obstacles.0.sigma.height",
        ),
        (
            lambda a: replace(a, obstacles=(replace(CAN, base_height=NAN),)),
            "obstacles.0.base_height",
        ),
        (lambda a: replace(a, holes=(replace(PIT, length=NAN),)), "holes.0.length"),
        (lambda a: replace(a, holes=(replace(PIT, depth=NAN),)), "holes.0.depth"),
        (lambda a: replace(a, holes=(replace(PIT, sigma_length=NAN),)), "holes.0.sigma.length"),
        (lambda a: replace(a, terrain=replace(TERRAIN, slope=NAN)), "terrain.slope_deg"),
        (
            lambda a: replace(a, terrain=replace(TERRAIN, cross_slope=NAN)),
            "terrain.cross_slope_deg",
        ),
        (lambda a: replace(a, terrain=replace(TERRAIN, sigma=math.inf)), "terrain.sigma_deg"),
        (lambda a: replace(a, terrain=replace(TERRAIN, roughness=NAN)), "terrain.roughness"),
        (lambda a: replace(a, ground=replace(GROUND, residual=NAN)), "ground.residual_px"),
        (
            lambda a: replace(a, ground=replace(GROUND, tilt_disagreement=NAN)),
            "ground.tilt_disagreement_deg",
        ),
        (
            lambda a: replace(a, free_range=replace(a.free_range, range=np.array([NAN]))),
            "free_range.0.range",
        ),
        (lambda a: replace(a, timing=replace(a.timing, match=NAN)), "timing_ms.match"),
    ],
)
def test_unknown_is_null_and_nothing_else_changes(
    change: Callable[[Answer], Answer], path: str
) -> None:
    found = json.loads(change(ANSWER).to_json())
    *way, last = path.split(".")
    parent: Any = found
    expected: Any = json.loads(json.dumps(CONTRACT))
    whole = expected
    for step in way:
        key = int(step) if step.isdigit() else step
        parent, expected = parent[key], expected[key]
    assert parent[last] is None
    expected[last] = None
    assert found == whole


def test_nothing_found_is_empty_lists_not_missing_keys() -> None:
    none = FreeRange(bearing=np.zeros(0), range=np.zeros(0), limit=())
    terrain = replace(TERRAIN, profile=())
    bare = replace(ANSWER, obstacles=(), holes=(), free_range=none, terrain=terrain).to_dict()
    assert list(bare) == list(CONTRACT)
    assert (bare["obstacles"], bare["holes"], bare["free_range"]) == ([], [], [])
    assert bare["terrain"]["profile"] == []


def test_a_number_that_is_zero_stays_zero() -> None:
    found = replace(ANSWER, terrain=replace(TERRAIN, slope=0.0)).to_dict()
    assert found["terrain"]["slope_deg"] == 0.0
    assert found["terrain"]["slope_deg"] is not None


def test_numpy_numbers_become_plain_ones() -> None:
    wide = replace(CAN, width=np.float32(0.5))  # type: ignore[arg-type]
    found = json.loads(replace(ANSWER, obstacles=(wide,)).to_json())["obstacles"][0]
    assert (type(found["width"]), found["width"]) == (float, 0.5)


def test_stamp_keeps_every_nanosecond() -> None:
    stamp = 1_722_470_400_123_456_789
    assert json.loads(replace(ANSWER, stamp_ns=stamp).to_json())["stamp_ns"] == stamp


def test_limits_are_the_words_of_the_contract() -> None:
    assert {str(limit) for limit in Limit} == {"obstacle", "hole", "slope", "unseen"}


def test_answer_is_walked_thing_by_thing() -> None:
    assert list(replace(ANSWER, obstacles=(CAN, replace(CAN, id=2)))) == [CAN, replace(CAN, id=2)]


def test_free_range_is_as_long_as_its_directions() -> None:
    assert len(ANSWER.free_range) == 1


def test_values_are_frozen_and_name_their_fields() -> None:
    with pytest.raises(FrozenInstanceError):
        CAN.width = 0.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        Snapshot(lefft=None)  # type: ignore[call-arg]


@pytest.mark.parametrize("shape", [(16, 16), (480, 640), (20, 30, 3)])
def test_grey_and_colour_images_are_accepted_as_they_are(shape: tuple[int, ...]) -> None:
    image = np.zeros(shape, dtype=np.uint8)
    assert as_image(image, name="left") is image


@pytest.mark.parametrize(
    "image",
    [
        None,
        [[0, 1], [2, 3]],
        np.zeros((20, 20), dtype=np.uint16),
        np.zeros((20, 20), dtype=np.float32),
        np.zeros((20, 20, 4), dtype=np.uint8),
        np.zeros((2, 20, 20, 3), dtype=np.uint8),
        np.zeros(400, dtype=np.uint8),
        np.zeros((15, 40), dtype=np.uint8),
        np.zeros((40, 15, 3), dtype=np.uint8),
    ],
)
def test_what_is_no_image_is_refused_by_its_name(image: object) -> None:
    with pytest.raises(InputError, match=r"^right: expected .*, found "):
        as_image(image, name="right")


def test_disparity_becomes_contiguous_float32_with_the_same_values() -> None:
    source = np.array([[1.5, np.nan], [0.0, 7.25]])
    for given in (source, source.astype(np.float16), source.T.copy().T, source[::1, ::1]):
        found = as_disparity(given, name="d")
        assert found.dtype == np.float32
        assert found.flags.c_contiguous
        np.testing.assert_array_equal(found, source)


@pytest.mark.parametrize(
    "disparity",
    [None, np.zeros((4, 4), dtype=np.uint16), np.zeros((4, 4, 1)), np.zeros(4), [[1.0, 2.0]]],
)
def test_what_is_no_disparity_map_is_refused_by_its_name(disparity: object) -> None:
    with pytest.raises(InputError, match=r"^file\.pfm: expected a disparity map of floats"):
        as_disparity(disparity, name="file.pfm")
