"""Pixels without a match never add things."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bearcub.messages import Answer, Float32
from bearcub.sim import Rendered, scenes
from bearcub.sim.world import Ground, Scene, Thing

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]

# patches (row, column, rows, columns) and a share of single pixels that lose their match
patches = st.lists(
    st.tuples(st.integers(0, 239), st.integers(0, 319), st.integers(5, 120), st.integers(5, 160)),
    max_size=4,
)


@given(patches=patches, share=st.floats(0, 0.6), seed=st.integers(0, 99))
@settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_empty_floor_with_pixels_missing_stays_empty(
    shot: Shot,
    noisy: Noisy,
    look: Look,
    patches: list[tuple[int, int, int, int]],
    share: float,
    seed: int,
) -> None:
    disparity = noisy(shot(scenes.floor(), roll=5).disparity, 0.2, seed=seed)
    answer = look(spoiled(disparity, patches, share, seed))
    assert answer.obstacles == ()
    assert answer.holes == ()


@given(share=st.floats(0, 0.6), seed=st.integers(0, 99))
@settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_single_pixels_missing_never_add_a_thing(
    shot: Shot,
    noisy: Noisy,
    look: Look,
    crate: Callable[..., Thing],
    share: float,
    seed: int,
) -> None:
    things = (crate(2.5, 0.8), crate(3.2, -0.9))
    frame = shot(Scene(ground=Ground(texture=scenes.ASPHALT), things=things))
    disparity = noisy(frame.disparity, 0.1)
    assert len(look(disparity).obstacles) == 2
    answer = look(spoiled(disparity, [], share, seed))
    assert len(answer.obstacles) <= 2
    assert answer.holes == ()


def spoiled(
    disparity: Float32, patches: list[tuple[int, int, int, int]], share: float, seed: int
) -> Float32:
    """Return the map without the matches of those patches and of a share of the others."""
    lost = disparity.copy()
    for row, column, rows, columns in patches:
        lost[row : row + rows, column : column + columns] = np.nan
    lost[np.random.default_rng(seed).random(lost.shape) < share] = np.nan
    if not np.isfinite(lost).any():
        pytest.skip("no pixel left")
    return lost
