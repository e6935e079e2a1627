"""Exact disparity maps of simulated floors, small enough to render many."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.messages import Answer, Float32, Snapshot, Tilt
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig
from bearcub.sim import Rendered, render, scenes
from bearcub.sim.world import Scene


@pytest.fixture(scope="session")
def rig() -> Rig:
    """Return the paper's rig at 320 x 240: f = 192.9 px, B = 0.12 m, 1.2 m up, 5.9 deg down."""
    return scenes.paper_rig(width=320, height=240)


@pytest.fixture(scope="session")
def shot(rig: Rig) -> Callable[..., Rendered]:
    """Return a function that renders a scene once per body attitude [deg] and rig."""

    @cache
    def take(scene: Scene, *, roll: float = 0.0, pitch: float = 0.0, by: Rig = rig) -> Rendered:
        body = Attitude(roll=np.radians(roll), pitch=np.radians(pitch))
        return render(scene, by, body=body, supersample=1)

    return take


@pytest.fixture(scope="session")
def noisy() -> Callable[..., Float32]:
    """Return a function that adds seeded Gaussian noise [px] where there is a surface."""

    def spoil(disparity: Float32, sigma: float, *, seed: int = 0) -> Float32:
        noise = np.random.default_rng(seed).normal(0, sigma, disparity.shape)
        noise = np.where(disparity > 0, noise, 0)
        # nothing is beyond infinity; the sensor's least disparity above it is a hundredth
        spoiled = np.where(disparity > 0, np.maximum(disparity + noise, 0.01), 0)
        return spoiled.astype(np.float32)

    return spoil


@pytest.fixture(scope="session")
def look(rig: Rig) -> Callable[..., Answer]:
    """Return a function that answers one disparity map with a tilt reading [deg], if any."""

    def answer(
        disparity: Float32,
        *,
        roll: float | None = None,
        pitch: float | None = None,
        by: Rig = rig,
    ) -> Answer:
        tilt = None
        if roll is not None or pitch is not None:
            tilt = Tilt(roll=np.radians(roll or 0.0), pitch=np.radians(pitch or 0.0))
        return Pipeline(by).process(Snapshot(disparity=disparity, tilt=tilt))

    return answer
