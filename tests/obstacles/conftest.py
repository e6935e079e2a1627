"""Exact disparity maps of simulated scenes, rendered once per session."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.messages import Answer, Float32, Snapshot, Tilt
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig
from bearcub.sim import Rendered, render, scenes
from bearcub.sim.solids import Box
from bearcub.sim.world import Scene, Thing


@pytest.fixture(scope="session")
def rig() -> Rig:
    """Return the paper's rig: f = 386 px, B = 0.12 m, 1.2 m up, 5.9 deg down."""
    return scenes.paper_rig()


@pytest.fixture(scope="session")
def small_rig() -> Rig:
    """Return the paper's rig at a quarter of its pixels."""
    return scenes.paper_rig(width=320, height=240)


@pytest.fixture(scope="session")
def shot(small_rig: Rig) -> Callable[..., Rendered]:
    """Return a function that renders a scene once per body attitude [deg] and rig."""

    @cache
    def take(
        scene: Scene, *, roll: float = 0.0, pitch: float = 0.0, by: Rig = small_rig
    ) -> Rendered:
        body = Attitude(roll=math.radians(roll), pitch=math.radians(pitch))
        return render(scene, by, body=body, supersample=1)

    return take


@pytest.fixture(scope="session")
def noisy() -> Callable[..., Float32]:
    """Return a function that adds seeded Gaussian noise [px] where there is a surface."""

    def spoil(disparity: Float32, sigma: float = 0.2, *, seed: int = 0) -> Float32:
        noise = np.random.default_rng(seed).normal(0, sigma, disparity.shape)
        spoiled = np.where(disparity > 0, np.maximum(disparity + noise, 0.01), 0)
        return spoiled.astype(np.float32)

    return spoil


@pytest.fixture(scope="session")
def look(small_rig: Rig) -> Callable[..., Answer]:
    """Return a function that answers one disparity map with a tilt reading [deg], if any."""
    pipelines: dict[Rig, Pipeline] = {}

    def answer(
        disparity: Float32,
        *,
        roll: float | None = None,
        pitch: float | None = None,
        by: Rig = small_rig,
    ) -> Answer:
        tilt = None
        if roll is not None or pitch is not None:
            tilt = Tilt(roll=math.radians(roll or 0.0), pitch=math.radians(pitch or 0.0))
        pipeline = pipelines.setdefault(by, Pipeline(by))
        return pipeline.process(Snapshot(disparity=disparity, tilt=tilt))

    return answer


@pytest.fixture(scope="session")
def crate() -> Callable[..., Thing]:
    """Return a function that makes a crate whose front face is centred at (x, y)."""

    def make(
        x: float, y: float, *, width: float = 0.5, height: float = 0.6, bottom: float = 0.0
    ) -> Thing:
        box = Box(x=x + 0.2, y=y, bottom=bottom, size=(0.4, width, height), texture=scenes.WOOD)
        return Thing(name="crate", foot=(x, y), parts=(box,))

    return make
