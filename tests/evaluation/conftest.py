"""Answers written by hand, and where the real recordings are."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bearcub.messages import (
    Answer,
    FreeRange,
    Ground,
    Hole,
    Layers,
    Limit,
    Obstacle,
    Terrain,
    Timing,
)

NAN = math.nan


def _obstacle(**changes: Any) -> Obstacle:
    thing = Obstacle(
        id=1,
        x=4.0,
        y=0.0,
        distance=4.0,
        bearing=0.0,
        width=0.8,
        height=1.2,
        base_height=0.0,
        sigma_distance=0.05,
        sigma_bearing=0.002,
        sigma_width=0.02,
        sigma_height=0.02,
        confidence=0.97,
        box=(14, 10, 17, 19),
        pixels=40,
    )
    return replace(thing, **changes)


def _hole(**changes: Any) -> Hole:
    thing = Hole(
        x=0.6,
        y=0.0,
        distance=0.6,
        bearing=0.0,
        width=0.08,
        length=0.08,
        depth=0.04,
        depth_is_lower_bound=False,
        kind="pit",
        sigma_distance=0.01,
        sigma_width=0.01,
        sigma_length=0.01,
        sigma_depth=0.002,
        confidence=0.9,
        box=(514, 406, 631, 503),
        pixels=5000,
    )
    return replace(thing, **changes)


def _ground(**changes: Any) -> Ground:
    floor = Ground(
        plane=np.array([0.0, 0.1, 0.0]),
        covariance=np.zeros((3, 3)),
        height=1.28,
        pitch=0.0,
        roll=0.0,
        sigma_height=0.01,
        sigma_pitch=0.001,
        sigma_roll=0.001,
        noise=0.2,
        source="image",
        seen=True,
        residual=0.2,
        tilt_disagreement=NAN,
    )
    return replace(floor, **changes)


def _answer(**changes: Any) -> Answer:
    nothing = np.zeros((20, 30))
    answer = Answer(
        obstacles=(),
        holes=(),
        terrain=Terrain(slope=NAN, cross_slope=NAN, sigma=NAN, roughness=NAN, reference="robot"),
        ground=_ground(),
        free_range=FreeRange(
            bearing=np.radians([-10.0, 0.0, 10.0]),
            range=np.array([20.0, 20.0, 20.0]),
            limit=(Limit.UNSEEN,) * 3,
        ),
        timing=Timing(match=1.0, ground=1.0, obstacles=1.0, total=3.0),
        layers=Layers.of(
            disparity=np.ones((20, 30), dtype=np.float32),
            floor=nothing.astype(np.float32),
            kind=nothing.astype(np.uint8),
            labels=nothing.astype(np.int32),
        ),
    )
    return replace(answer, **changes)


@pytest.fixture
def make_obstacle() -> Callable[..., Obstacle]:
    return _obstacle


@pytest.fixture
def make_hole() -> Callable[..., Hole]:
    return _hole


@pytest.fixture
def make_ground() -> Callable[..., Ground]:
    return _ground


@pytest.fixture
def make_answer() -> Callable[..., Answer]:
    return _answer


@pytest.fixture(scope="session")
def real() -> Callable[[str], Path]:
    """Return a finder of the folder of one set of recordings, which skips where it is absent."""
    shared = Path(__file__).parents[2] / ".." / "shared" / "data"

    def find(name: str) -> Path:
        if not (shared / name).is_dir():
            pytest.skip(f"the recordings of {name} are not beside the repository")
        return shared / name

    return find
