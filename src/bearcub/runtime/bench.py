"""How long the stages take, on the embedded sample and in the worst case."""

import contextlib
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from bearcub import sample
from bearcub.config import Config
from bearcub.devices.images import read_image
from bearcub.errors import InputError
from bearcub.geometry import base_from_optical, forward_in_camera
from bearcub.messages import Float32, Float64, Snapshot, Tilt, Timing, UInt8
from bearcub.rig import Rig
from bearcub.runtime.loop import Stage
from bearcub.stereo import StereoStage
from bearcub.stereo.images import shrunk
from bearcub.stereo.native import levels

FRAME_BUDGET_MS = 1000.0 / 15.0
"""What a frame may take at the 15 frames per second of the paper [ms]."""

STAGES = tuple(item.name for item in fields(Timing))
WARM_UP = 5
"""Frames that are not counted: caches fill, buffers are allocated."""

_TURN = 10  # frames after which something else has its turn
_WALL = 2.0  # distance of the wall [m]
_NOISE = 0.2  # 1-sigma of its disparity [px]
_STEPS = 16.0  # a pixel, as matchers give


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One snapshot that is processed again and again."""

    name: str
    snapshot: Snapshot
    rig: Rig
    config: Config


def cases(*, size: tuple[int, int], config: Config, pair: bool = False) -> list[Case]:
    """Return the cases of the benchmark.

    Parameters
    ----------
    size : tuple of int
        Width and height [px], of the sample's aspect.
    config : Config
        Of every case, and of the matching that makes the sample's disparity.
    pair : bool
        Also match the sample's pair in every frame, by OpenCV and, where it is there, by the
        native core.

    Raises
    ------
    InputError
        If the aspect is another.
    """
    found = sample.load()
    width, height = size
    if min(size) < 64:
        raise InputError(f"size {width}x{height}: expected at least 64 px each")
    rig = Rig.load(found.rig).for_image(width=width, height=height)
    left, right = sample_pair(width=width, height=height)
    match = StereoStage.for_rig(rig.camera, rig.mount, config.matching)
    matched = match(left, right).disparity - np.float32(rig.camera.doffs)
    matched.flags.writeable = False
    snapshots = {
        "sample, disparity given": Snapshot(disparity=matched, tilt=found.tilt),
        f"wall at {_WALL:g} m, disparity given": Snapshot(
            disparity=wall_disparity(rig), tilt=Tilt(pitch=0.0, roll=0.0)
        ),
    }
    given = [
        Case(name=name, snapshot=shot, rig=rig, config=config) for name, shot in snapshots.items()
    ]
    if not pair:
        return given
    shot = Snapshot(left=left, right=right, tilt=found.tilt)
    matchers = ("sgbm", "native") if levels() else ("sgbm",)
    return given + [
        Case(
            name=f"sample, pair by {matcher}",
            snapshot=shot,
            rig=rig,
            config=replace(config, matching=replace(config.matching, matcher=matcher)),
        )
        for matcher in matchers
    ]


def sample_pair(*, width: int, height: int) -> tuple[UInt8, UInt8]:
    """Return the sample's images in this size [px], of its aspect, colour as BGR.

    Raises
    ------
    InputError
        If the aspect is another.
    """
    found = sample.load()
    left, right = (
        shrunk(read_image(path), width=width, height=height) for path in (found.left, found.right)
    )
    return left, right


def wall_disparity(rig: Rig, *, distance: float = _WALL, seed: int = 0) -> Float32:
    """Return what a matcher sees of a wall across the whole view, on a level floor.

    Parameters
    ----------
    rig : Rig
        On a level body.
    distance : float
        Of the wall, from under the camera [m].
    seed : int
        Of the noise.

    Returns
    -------
    ndarray of float32, shape (H, W)
        [px], with noise, in sixteenths; 0 at infinity.
    """
    camera = rig.camera
    down = rig.mount.attitude.down()
    a, b, c = camera.projection.plane(height=rig.mount.height, down=down)
    ahead = base_from_optical(down, forward_in_camera(rig.mount.attitude))[0]
    u, v = np.arange(camera.width), np.arange(camera.height)[:, np.newaxis]
    # depth Z along a ray r is distance / (ahead . r), and d = fx B / Z
    slope = ahead[0] * (u - camera.cx) / camera.fx + ahead[1] * (v - camera.cy) / camera.fy
    wall = camera.fx * camera.baseline / distance * (slope + ahead[2])
    noise = np.random.default_rng(seed).normal(0.0, _NOISE, wall.shape)
    seen = np.maximum(np.maximum(wall, a * u + b * v + c) + noise, 0.0)
    steps: Float64 = np.round(seen * _STEPS) / _STEPS - camera.doffs
    quantised = steps.astype(np.float32)
    quantised.flags.writeable = False
    return quantised


def measure(
    stage: Stage,
    snapshot: Snapshot,
    *,
    frames: int,
    threads: int = 1,
    between: Callable[[], object] = lambda: None,
) -> dict[str, Float64]:
    """Process a snapshot `frames` times, after a warm-up.

    Parameters
    ----------
    stage : Stage
    snapshot : Snapshot
    frames : int
    threads : int
        Of OpenCV; the stage's own are its configuration's.
    between : callable
        Called after every tenth frame.

    Returns
    -------
    dict of str to ndarray of float64, shape (frames,)
        Milliseconds of every stage.
    """
    timings = []
    with on_threads(threads):
        for number in range(WARM_UP + frames):
            timings.append(stage.process(snapshot).timing)
            if number % _TURN == 0:
                between()
    timings = timings[WARM_UP:]
    return {name: np.array([getattr(timing, name) for timing in timings]) for name in STAGES}


def summarise(times: dict[str, Float64]) -> dict[str, dict[str, float]]:
    """Return median, 99th percentile and maximum [ms], and the median's share of the budget."""
    return {
        name: {
            "p50": float(np.median(ms)),
            "p99": float(np.percentile(ms, 99)),
            "max": float(ms.max()),
            "share": float(np.median(ms)) / FRAME_BUDGET_MS,
        }
        for name, ms in times.items()
    }


@contextlib.contextmanager
def on_threads(count: int) -> Iterator[None]:
    """Let OpenCV use this many threads inside."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(count)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def machine() -> dict[str, Any]:
    """Return what ran the benchmark: processor and versions."""
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "bearcub": version("bearcub"),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
    }


def _processor() -> str:
    """Return the processor's name, which Python itself does not know on Linux."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"
