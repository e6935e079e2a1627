"""Figures over frames whose answers are made by hand."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bearcub.evaluation.breakdown import grids
from bearcub.evaluation.matching import Sighting
from bearcub.evaluation.metrics import Metrics, allowed, relative
from bearcub.evaluation.report import Found
from bearcub.evaluation.table import Row
from bearcub.evaluation.target import Target
from bearcub.evaluation.targets import by_number, comparison, promises, rows
from bearcub.evaluation.things import Error
from bearcub.evaluation.verdict import Tags, Verdict
from bearcub.rig import Camera, Mount, Rig

RIG = Rig(
    camera=Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12),
    mount=Mount(height=1.2),
)


def sighting(found: bool = True, *, kind: str = "can", far: float = 4.0, **off: float) -> Sighting:  # noqa: FBT001, FBT002
    target = Target(kind=kind, distance=far, bearing=0.0, width=0.5, height=0.8, base_height=0.0)
    answer = Found(
        distance=far + off.get("distance", 0.0),
        bearing=math.radians(off.get("bearing", 0.0)),
        width=0.5 + off.get("width", 0.0),
        height=0.8 + off.get("height", 0.0),
        sigma={name: off["sigma"] for name in ("distance", "width", "height") if "sigma" in off},
    )
    return Sighting(target=target, found=answer if found else None)


def stray() -> Found:
    return Found(distance=5.0, bearing=0.5, width=0.2)


def frames(things: Iterable[tuple[Sighting, ...]], **more: Any) -> list[Verdict]:
    return [
        Verdict(name=f"a/{k}", scenario="a", tags={}, rig=RIG, things=seen, **more)
        for k, seen in enumerate(things)
    ]


def test_recall_and_precision_count_every_thing_once() -> None:
    metrics = Metrics(
        [
            *frames([(sighting(), sighting(found=False)), (sighting(),)]),
            *frames([(sighting(),)], false=(stray(),)),
        ]
    )
    assert metrics.recall().estimate.value == pytest.approx(75.0)
    assert metrics.recall().worst == ("a/0",)
    assert metrics.precision().estimate.value == pytest.approx(75.0)
    assert metrics.false_per_thousand().estimate.value == pytest.approx(1000.0 / 3.0)


def test_things_that_are_not_asked_for_do_not_count() -> None:
    metrics = Metrics(frames([(sighting(far=3.0), sighting(found=False, far=9.0))]))
    assert metrics.recall(lambda t: t.distance < 8.0).estimate.value == 100.0
    assert metrics.recall(frames=lambda v: v.name == "b").estimate.count == 0


def test_errors_are_those_that_were_put_in() -> None:
    metrics = Metrics(frames([(sighting(distance=d),) for d in (-0.04, 0.02, 0.08, 0.0, 0.06)]))
    assert metrics.error("distance", scale=relative).estimate.value == pytest.approx(0.01)
    assert metrics.error("distance", share=1.0).estimate.value == pytest.approx(0.08)
    assert metrics.bias("distance").value == pytest.approx(0.024)
    assert metrics.error("distance").worst[0] == "a/2"
    assert metrics.error("distance").best == ("a/3",)


def test_a_frame_that_tells_no_number_is_no_example_of_a_good_one() -> None:
    metrics = Metrics(
        [
            *frames([()], ground={"slope": Error(value=math.nan, truth=0.1, sigma=math.nan)}),
            *[
                replace(verdict, name="b/0")
                for verdict in frames(
                    [()], ground={"slope": Error(value=0.15, truth=0.1, sigma=0.1)}
                )
            ],
        ]
    )
    assert metrics.ground_rms(["slope"]).best == ("b/0",)


def test_small_things_are_allowed_2_cm_and_large_ones_5_percent() -> None:
    assert allowed(Error(value=0.1, truth=0.07, sigma=0.0)) == 0.02
    assert allowed(Error(value=0.1, truth=-0.8, sigma=0.0)) == pytest.approx(0.04)


def test_intervals_of_gaussian_errors_cover_68_and_95_percent() -> None:
    rng = np.random.default_rng(3)
    metrics = Metrics(
        frames([(sighting(distance=x, sigma=0.05),) for x in rng.normal(0.0, 0.05, 4000)])
    )
    one, two = (metrics.coverage(k, things=("distance",)).estimate for k in (1.0, 1.959964))
    assert one.value == pytest.approx(68.27, abs=2.2)  # three standard errors of 4,000 draws
    assert two.value == pytest.approx(95.0, abs=1.0)
    assert one.count == 4000


def test_sigma_half_as_large_as_it_should_be_is_found_out() -> None:
    rng = np.random.default_rng(3)
    metrics = Metrics(
        frames([(sighting(distance=x, sigma=0.025),) for x in rng.normal(0.0, 0.05, 2000)])
    )
    assert metrics.coverage(1.0, things=("distance",)).estimate.value == pytest.approx(38.3, abs=4)


def test_numbers_without_a_sigma_have_no_coverage() -> None:
    metrics = Metrics(frames([(sighting(distance=0.01),)]))
    assert metrics.coverage(1.0, things=("distance", "bearing")).estimate.count == 0


def test_attitude_is_the_root_mean_square_of_both_angles() -> None:
    ground = {
        "pitch": Error(value=3.0, truth=0.0, sigma=math.nan),
        "roll": Error(value=0.0, truth=4.0, sigma=math.nan),
    }
    metrics = Metrics(frames([()], ground=ground))
    assert metrics.ground_rms(["pitch", "roll"]).estimate.value == pytest.approx(math.sqrt(12.5))


def test_passage_below_things_is_the_share_that_nobody_calls_in_the_way() -> None:
    metrics = Metrics(
        frames([(), ()], overhead=(sighting(), sighting(found=False), sighting(found=False)))
    )
    assert metrics.passed_under().estimate.value == pytest.approx(100.0 * 2 / 3)


def test_time_is_that_of_the_stage() -> None:
    metrics = Metrics([*frames([()], timing={"match": 4.0}), *frames([()], timing={"match": 6.0})])
    assert metrics.stage("match").value == 5.0
    assert math.isnan(metrics.stage("ground").value)


def test_perfect_answers_keep_every_promise_they_are_measured_by() -> None:
    perfect = Metrics(frames([(sighting(), sighting(kind="wall", far=2.0))] * 20))
    table, shown = rows(promises(), perfect, {})
    assert len(table) >= 8
    assert [row.measure for row in table if row.passed is False] == []
    assert {row.measure for row in table} == set(shown)


def test_missing_a_tenth_misses_the_promise() -> None:
    found = Metrics(frames([(sighting(found=k > 0),) for k in range(10)]))
    (recall, *_), _ = rows(promises(), found, {})
    assert (recall.value, recall.count, recall.passed) == (90.0, 10, False)


def test_frames_with_more_noise_are_left_out_of_the_table() -> None:
    noisy = [
        Verdict(name="n", scenario="a", tags={"noise": "strong"}, rig=RIG, false=(stray(),)),
        *frames([(sighting(),)]),
    ]
    table, _ = rows(promises(), Metrics(noisy), {})
    precision = next(row for row in table if row.measure.endswith("precision"))
    assert precision.value == 100.0


def test_false_obstacles_on_grass_and_gravel_stand_apart() -> None:
    def floor(surface: str, **more: Any) -> Verdict:
        tags: Tags = {"empty": True, "surface": surface}
        return Verdict(name=surface, scenario="floor", tags=tags, rig=RIG, **more)

    metrics = Metrics([floor("tall-grass", false=(stray(),)), floor("asphalt")])
    table = {row.measure: row for row in rows(promises(), metrics, {})[0]}
    assert table["false obstacles in 1,000 frames of empty floor, all sweeps"].value == 0.0
    assert table["the same on tall grass"].value == 1000.0


def test_comparison_names_the_rows_that_a_baseline_wins() -> None:
    good = Metrics(frames([(sighting(distance=0.04),)] * 4))
    better = Metrics(frames([(sighting(distance=0.02),)] * 4))
    table, _ = rows(promises(), good, {"zband": better})
    (verdict,) = comparison(table)
    assert verdict.passed is False
    assert "distance 1 to 4 m" in verdict.note
    assert "recall" not in verdict.note  # both find all: nothing can be better


def test_baseline_that_does_not_answer_is_worse() -> None:
    row = Row(measure="slope", value=0.4, limit=0.5, rivals={"classic": math.nan})
    assert row.best is True
    assert Row(measure="slope", value=0.4, limit=0.5, rivals={"classic": 0.3}).best is False
    assert Row(measure="slope", value=0.4, limit=0.5).best is None


def test_intervals_by_number_are_measured_one_by_one() -> None:
    metrics = Metrics(frames([(sighting(distance=0.01, width=0.05, sigma=0.02),)] * 5))
    table = {row.measure: row.value for row in rows(by_number(), metrics, {})[0]}
    assert table["obstacle distance: 68 %"] == 100.0
    assert table["obstacle width: 68 %"] == 0.0
    assert "obstacle bearing: 68 %" not in table


def test_break_downs_show_every_group_that_there_is() -> None:
    metrics = Metrics(frames([(sighting(), sighting(found=False, kind="post", far=7.0))]))
    tables = {grid.title: grid for grid in grids(metrics)}
    assert [line[0] for line in tables["Obstacles by range"].lines] == ["4 to 6 m", "6 to 8 m"]
    assert [line[:3] for line in tables["Obstacles by kind"].lines] == [
        ("can", "1", "100"),
        ("post", "1", "0"),
    ]
    assert tables["By scenario"].lines[0][:4] == ("a", "1", "2", "50")
