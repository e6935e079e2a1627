"""The column histogram of the paper, with levels finer than a pixel."""

import numpy as np
import pytest

from bearcub.obstacles.histograms import Levels, level_centres

LEVELS = Levels(width=0.25, knee=16.0, largest=64.0)


def test_levels_are_even_below_the_knee() -> None:
    np.testing.assert_allclose(
        LEVELS.of(np.array([0.0, 0.25, 1.0, 8.1, 16.0])), [0, 1, 4, 32.4, 64]
    )


def test_levels_widen_in_proportion_above_the_knee() -> None:
    # each doubling adds 16 ln 2 / 0.25 = 44.36 levels
    low, middle, high = LEVELS.of(np.array([16.0, 32.0, 64.0]))
    assert middle - low == pytest.approx(44.361, abs=1e-3)
    assert high - middle == pytest.approx(middle - low)


def test_levels_have_no_step_and_no_kink_at_the_knee() -> None:
    at = LEVELS.of(np.array([16 - 1e-6, 16.0, 16 + 1e-6]))
    np.testing.assert_allclose(np.diff(at), 4e-6, rtol=1e-3)


def test_centre_of_a_level_lies_in_that_level() -> None:
    centres = level_centres(LEVELS)
    assert len(centres) == LEVELS.count
    assert (np.diff(centres) > 0).all()
    np.testing.assert_allclose(LEVELS.of(centres), np.arange(LEVELS.count) + 0.5, rtol=1e-12)


def test_largest_disparity_has_a_level() -> None:
    assert int(LEVELS.of(np.array(64.0))) < LEVELS.count
