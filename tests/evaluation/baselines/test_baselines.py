"""The other methods on exact disparity: what they are good at they must get right."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from bearcub.evaluation.baselines import BASELINES, Frame
from bearcub.evaluation.baselines.clusters import clustered, numbered
from bearcub.evaluation.report import Report
from bearcub.geometry import Attitude
from bearcub.messages import Tilt
from bearcub.sim import Rendered, render, scenes
from bearcub.sim.world import Scene

RIG = scenes.paper_rig(width=320, height=240)
ALL = pytest.mark.parametrize("name", BASELINES)
FITTING = pytest.mark.parametrize("name", ["vdisparity", "ransac"])


@cache
def shot(build: Callable[[], Scene], pitch_deg: float = 0.0, roll_deg: float = 0.0) -> Rendered:
    body = Attitude(pitch=math.radians(pitch_deg), roll=math.radians(roll_deg))
    return render(build(), RIG, body=body, supersample=1)


def answered(name: str, rendered: Rendered, tilt: Tilt | None) -> Report:
    return BASELINES[name](Frame(disparity=rendered.disparity, rig=RIG, tilt=tilt))


def level(pitch_deg: float = 0.0, roll_deg: float = 0.0) -> Tilt:
    return Tilt(pitch=math.radians(pitch_deg), roll=math.radians(roll_deg))


@ALL
def test_can_is_found_where_it_is(name: str) -> None:
    report = answered(name, shot(scenes.garbage_can), level())
    # whole levels and a cut-off lowest part are the classic's way
    loose = 2.0 if name == "classic" else 1.0
    (can,) = [thing for thing in report.obstacles if abs(thing.distance - 3.05) < 0.3]
    assert can.distance == pytest.approx(3.05, abs=0.08 * loose)
    assert math.degrees(can.bearing) == pytest.approx(2.0, abs=0.5)
    assert can.width == pytest.approx(0.45, abs=0.05 * loose)
    assert can.height == pytest.approx(0.70, abs=0.06 * loose)


@ALL
def test_can_is_found_with_the_body_rolled(name: str) -> None:
    report = answered(name, shot(scenes.garbage_can, 3.0, 10.0), level(3.0, 10.0))
    assert any(
        abs(thing.distance - 3.05) < 0.3 and abs(math.degrees(thing.bearing) - 2.0) < 1.0
        for thing in report.obstacles
    )


@ALL
def test_empty_floor_without_noise_is_empty(name: str) -> None:
    assert answered(name, shot(scenes.floor), level()).obstacles == ()


@FITTING
def test_floor_is_found_with_a_reading_that_is_off(name: str) -> None:
    report = answered(name, shot(scenes.floor, 4.0), level(0.0))
    assert math.degrees(report.pitch) == pytest.approx(9.9, abs=0.4)
    assert report.height == pytest.approx(1.2, abs=0.03)


def test_fixed_band_believes_a_reading_that_is_off() -> None:
    report = answered("zband", shot(scenes.floor, 4.0), level(0.0))
    assert math.degrees(report.pitch) == pytest.approx(5.9, abs=0.01)
    assert len(report.obstacles) >= 1  # floor that seems to rise


def test_ransac_sees_the_slope_of_all_it_sees() -> None:
    rendered = shot(scenes.cross_slope)
    report = answered("ransac", rendered, level())
    assert math.degrees(report.cross_slope) == pytest.approx(6.0, abs=0.3)


@ALL
def test_without_a_reading_there_is_no_slope_against_gravity(name: str) -> None:
    assert math.isnan(answered(name, shot(scenes.floor), None).slope)


@ALL
def test_nothing_measured_is_nothing_found(name: str) -> None:
    nothing = np.full((240, 320), np.nan, dtype=np.float32)
    report = BASELINES[name](Frame(disparity=nothing, rig=RIG, tilt=level()))
    assert (report.obstacles, report.holes) == ((), ())


@ALL
def test_same_frame_gives_the_same_answer(name: str) -> None:
    rendered = shot(scenes.garbage_can)
    assert answered(name, rendered, level()) == answered(name, rendered, level())


def test_ransac_reports_what_lies_below_the_floor() -> None:
    rig = scenes.paper_rig()
    disparity = render(scenes.pit(), rig, supersample=1).disparity
    (pit,) = BASELINES["ransac"](Frame(disparity=disparity, rig=rig, tilt=level())).holes
    assert math.degrees(pit.bearing) == pytest.approx(0.0, abs=1.0)
    assert pit.distance == pytest.approx(2.5, abs=0.25)
    assert pit.width == pytest.approx(0.8, abs=0.15)  # the rim is within the tolerance


def test_points_of_touching_cells_are_one_thing() -> None:
    left = np.random.default_rng(0).uniform((2.0, 0.5, 0.2), (2.3, 0.8, 0.6), (300, 3))
    right = left - (0.0, 1.0, 0.0)
    strays = np.array([[5.0, 3.0, 0.4]] * 4)
    labels = clustered(np.concatenate([left, right, strays]))
    assert set(labels[:300]) == {labels[0]}
    assert set(labels[300:600]) == {labels[300]}
    assert sorted({int(labels[0]), int(labels[300])}) == [1, 2]
    assert set(labels[600:]) == {0}


def test_small_sets_lose_their_number_and_the_rest_close_up() -> None:
    labels = np.repeat(np.array([1, 2, 3], dtype=np.int32), [60, 3, 70])
    assert np.unique(numbered(labels), return_counts=True)[1].tolist() == [3, 60, 70]
    assert numbered(labels).max() == 2
