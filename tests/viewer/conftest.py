"""A small world drawn by hand: a plane floor, one box, one hole."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from bearcub.geometry import Attitude
from bearcub.messages import (
    Answer,
    Float64,
    FreeRange,
    Ground,
    Hole,
    Layers,
    Limit,
    Obstacle,
    Pixel,
    Terrain,
    Timing,
)
from bearcub.rig import Camera, Mount, Rig

WIDTH, HEIGHT = 320, 240
RIG = Rig(
    camera=Camera(width=WIDTH, height=HEIGHT, fx=200.0, fy=200.0, cx=159.5, cy=119.5, baseline=0.1),
    mount=Mount(height=1.0),
)
BOX = (140, 100, 179, 199)
PIT = (40, 180, 99, 209)


def obstacle(**changes: object) -> Obstacle:
    """Return a box 4 m ahead; `changes` replace fields."""
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
        box=BOX,
        pixels=4000,
    )
    return replace(thing, **changes)  # type: ignore[arg-type]


def hole(**changes: object) -> Hole:
    """Return a pit ahead to the left; `changes` replace fields."""
    thing = Hole(
        x=2.4,
        y=0.9,
        distance=2.5,
        bearing=0.4,
        width=0.7,
        length=0.5,
        depth=0.3,
        depth_is_lower_bound=True,
        kind="pit",
        sigma_distance=0.04,
        sigma_width=0.05,
        sigma_length=0.1,
        sigma_depth=0.05,
        confidence=0.9,
        box=PIT,
        pixels=1800,
    )
    return replace(thing, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True)
class World:
    """What an answer is made from."""

    roll: float = 0.0
    obstacles: tuple[Obstacle, ...] = ()
    holes: tuple[Hole, ...] = ()
    notes: tuple[str, ...] = ()
    seen: bool = True
    bearing: Float64 = field(default_factory=lambda: np.radians(np.arange(-30.0, 31.0)))
    range: float = 5.0
    limit: Limit = Limit.UNSEEN

    @property
    def plane(self) -> Float64:
        """The floor's plane: camera 1 m above it."""
        return RIG.camera.projection.plane(
            height=1.0, down=Attitude(roll=self.roll, pitch=0.0).down()
        )

    def layers(self) -> Layers:
        """Floor below the horizon, boxes on it, nothing seen in the bottom 20 rows."""
        v, u = np.mgrid[:HEIGHT, :WIDTH]
        a, b, c = self.plane
        floor = (a * u + b * v + c).astype(np.float32)
        disparity = np.where(floor > 0, floor, np.float32(np.nan))
        kind = np.where(floor > 0, Pixel.FLOOR, Pixel.UNSEEN).astype(np.uint8)
        labels = np.zeros((HEIGHT, WIDTH), dtype=np.int32)
        kind[-20:], disparity[-20:] = Pixel.UNSEEN, np.nan
        kind[:10], disparity[:10] = Pixel.OTHER, 1.0
        for thing in self.obstacles:
            u0, v0, u1, v1 = thing.box
            part = slice(v0, v1 + 1), slice(u0, u1 + 1)
            disparity[part] = 20.0 / thing.distance
            kind[part], labels[part] = Pixel.OBSTACLE, thing.id
        for i, missing in enumerate(self.holes):
            u0, v0, u1, v1 = missing.box
            part = slice(v0, v1 + 1), slice(u0, u1 + 1)
            kind[part], labels[part] = Pixel.HOLE, -1 - i
        return Layers.of(disparity=disparity, floor=floor, kind=kind, labels=labels)

    def ground(self) -> Ground:
        """The true floor."""
        return Ground(
            plane=self.plane,
            covariance=np.eye(3) * 1e-6,
            height=1.0,
            pitch=0.0,
            roll=self.roll,
            sigma_height=0.01,
            sigma_pitch=0.002,
            sigma_roll=0.002,
            noise=0.2,
            source="image" if self.seen else "mount",
            seen=self.seen,
            residual=0.2,
            tilt_disagreement=math.nan,
        )

    def answer(self) -> Answer:
        """Everything as the pipeline would answer it."""
        count = len(self.bearing)
        return Answer(
            obstacles=self.obstacles,
            holes=self.holes,
            terrain=Terrain(
                slope=0.02, cross_slope=0.0, sigma=0.005, roughness=0.01, reference="robot"
            ),
            ground=self.ground(),
            free_range=FreeRange(
                bearing=self.bearing, range=np.full(count, self.range), limit=(self.limit,) * count
            ),
            timing=Timing(match=4.0, ground=0.4, obstacles=0.5, total=5.2),
            layers=self.layers(),
            notes=self.notes,
        )


@pytest.fixture
def rig() -> Rig:
    """A level camera 1 m above the floor: f = 200 px, B = 0.1 m, 320 x 240."""
    return RIG


@pytest.fixture
def world() -> type[World]:
    """Build a world and its answer."""
    return World


@pytest.fixture
def box() -> Callable[..., Obstacle]:
    """Build an obstacle."""
    return obstacle


@pytest.fixture
def pit() -> Callable[..., Hole]:
    """Build a hole."""
    return hole
