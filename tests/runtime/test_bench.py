"""The benchmark's inputs and its arithmetic."""

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.messages import Answer, Snapshot
from bearcub.runtime.bench import STAGES, WARM_UP, measure, summarise, wall_disparity
from bearcub.runtime.classic import ClassicPipeline
from bearcub.sim.render import render
from bearcub.sim.scenes import paper_rig, wall

RIG = paper_rig(width=320, height=240)


def test_the_wall_is_the_one_the_simulator_renders() -> None:
    exact = render(wall(distance=2.0), RIG, supersample=1).disparity
    difference = wall_disparity(RIG, distance=2.0) - exact
    inside = exact > 0  # the rendered wall ends 4 m up
    assert abs(float(difference[inside].mean())) < 0.01
    assert float(difference[inside].std()) == pytest.approx(0.2, abs=0.01)


def test_every_frame_but_the_warm_up_is_counted_on_one_thread() -> None:
    threads: list[int] = []

    class Counting(ClassicPipeline):
        def process(self, snapshot: Snapshot) -> Answer:
            threads.append(cv2.getNumThreads())
            return super().process(snapshot)

    before = cv2.getNumThreads()
    stage = Counting(RIG, clock=ManualClock())
    times = measure(stage, Snapshot(disparity=wall_disparity(RIG)), frames=3)
    assert set(threads) == {1}
    assert len(threads) == WARM_UP + 3
    assert cv2.getNumThreads() == before
    assert list(times) == list(STAGES)
    assert times["total"].tolist() == [0.0, 0.0, 0.0]


def test_summary_is_median_tail_and_share_of_the_frame() -> None:
    summary = summarise({"total": np.arange(1.0, 101.0)})["total"]
    assert summary["p50"] == 50.5
    assert summary["p99"] == pytest.approx(99.01)
    assert summary["max"] == 100.0
    assert summary["share"] == pytest.approx(0.7575)  # of 1000 / 15 ms


def test_something_else_has_its_turn_after_every_tenth_frame() -> None:
    turns: list[int] = []
    stage = ClassicPipeline(RIG, clock=ManualClock())
    snapshot = Snapshot(disparity=wall_disparity(RIG))
    measure(stage, snapshot, frames=16, between=lambda: turns.append(1))
    assert len(turns) == 3  # of 21 frames, those that warm up included
