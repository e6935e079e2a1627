"""Confidence intervals of figures whose uncertainty is known."""

import math

import numpy as np
import pytest

from bearcub.evaluation.bootstrap import Bootstrap, wilson


def test_interval_of_a_mean_is_that_of_the_central_limit_theorem() -> None:
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    found = Bootstrap(400).mean(values, range(400))
    spread = 1.96 * values.std() / math.sqrt(400)
    assert found.value == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - spread, abs=0.03)
    assert found.high == pytest.approx(values.mean() + spread, abs=0.03)


def test_interval_of_a_median_holds_the_true_median() -> None:
    inside = 0
    for seed in range(100):
        values = np.random.default_rng(seed).exponential(1.0, 80)
        found = Bootstrap(80, seed=seed, resamples=300).quantile(values, range(80))
        assert found.value == pytest.approx(np.median(values))
        inside += found.low <= math.log(2.0) <= found.high
    assert inside >= 88  # 95 expected; 88 or fewer would happen once in 300


def test_errors_of_one_frame_count_as_one_draw() -> None:
    values = np.repeat([0.0, 1.0], 50)
    apart = Bootstrap(100).mean(values, range(100))
    together = Bootstrap(2).mean(values, np.repeat([0, 1], 50))
    assert apart.high - apart.low < 0.25
    assert (together.low, together.high) == (0.0, 1.0)


def test_rate_that_nothing_contradicts_has_wilsons_interval() -> None:
    found = Bootstrap(60).rate([1] * 60, [1] * 60)
    assert found.value == 1.0
    assert (found.low, found.high) == wilson(60, 60)
    assert found.low == pytest.approx(0.9398, abs=1e-4)


def test_none_in_n_frames_is_bounded_by_three_in_n() -> None:
    found = Bootstrap(600).per_frame([0] * 600, [1] * 600).times(1000.0)
    assert (found.value, found.high, found.count) == (0.0, 5.0, 600)


def test_root_mean_square_of_known_errors() -> None:
    found = Bootstrap(4).rms([3.0, -4.0, math.nan, 0.0, 0.0], [0, 1, 1, 2, 3])
    assert found.value == pytest.approx(2.5)
    assert found.count == 4


def test_nothing_measured_is_unknown() -> None:
    found = Bootstrap(3).quantile([math.nan], [0])
    assert math.isnan(found.value)
    assert found.count == 0
    assert math.isnan(Bootstrap(3).rate([0] * 3, [0] * 3).value)


def test_same_seed_gives_the_same_interval() -> None:
    values = np.arange(50.0)
    one, other = (Bootstrap(50, seed=7).quantile(values, range(50)) for _ in range(2))
    assert one == other


@pytest.mark.parametrize("seed", range(8))
def test_one_resample_gives_values_without_intervals(seed: int) -> None:
    # of three frames, a resample leaves the only one that counts out in 8 of 27 cases
    bootstrap = Bootstrap(3, seed=seed, resamples=1)
    for found in (bootstrap.rms([2.0], [1]), bootstrap.quantile([2.0], [1])):
        assert found.value == 2.0
        assert math.isnan(found.low)
