"""Render the cases of the simulator and answer them, in several processes at once.

Every worker renders the frames of one world after each other, so that the world is built once. The
disparity is matched once a frame and every contender gets the same. What comes out depends on the
cases alone, not on how many processes there are.
"""

import hashlib
import multiprocessing
import os
import signal
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import cv2

from bearcub.config import Config
from bearcub.errors import InputError
from bearcub.evaluation.contenders import Contenders, Given
from bearcub.evaluation.frames import Kept, load_frame, save_frame
from bearcub.evaluation.verdict import Record
from bearcub.sim.case import Case
from bearcub.sim.render import Rendered, render
from bearcub.sim.sensor import SENSORS

RENDERERS = ("mujoco", "rays")
"""What can draw a case: MuJoCo (fast, the extra ``sim``) or the ray caster (slow, no grass)."""

_LONGEST = 10  # frames of a world that one task renders, so that no worker is left with many


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """How cases are rendered and answered.

    Attributes
    ----------
    baselines : tuple of str
        Names of `BASELINES` that answer, too.
    config : Config
        Of the pipeline; the robot's height is taken from the case.
    renderer : {"mujoco", "rays"}
    frames : Path or None
        Folder that keeps rendered frames for the next time.
    jobs : int
        Processes; 1 is this one alone.
    """

    baselines: tuple[str, ...] = ()
    config: Config = field(default_factory=Config)
    renderer: str = RENDERERS[0]
    frames: Path | None = None
    jobs: int = 1


class Studio(Protocol):
    """Takes stereo pairs of one world."""

    def shot(self, *, body: Any, noise: Any, seed: int) -> Rendered:
        """Take one pair."""
        ...


def answered(cases: Sequence[Case], method: Method) -> Iterator[Record]:
    """Render and answer cases; yields them in their order.

    Parameters
    ----------
    cases : sequence of Case
        Those of one world after each other.
    method : Method

    Raises
    ------
    InputError
        If a worker process dies.
    DeviceError
        If the renderer is not installed.
    """
    tasks = list(drives(cases))
    if method.jobs <= 1:
        for task in tasks:
            yield from answer_world(task, method)
        return
    with _workers(min(method.jobs, len(tasks)) or 1) as pool:
        waiting = iter(tasks)
        # A few tasks ahead of the workers: results stay in order and memory small.
        queue: list[Future[list[Record]]] = [
            pool.submit(answer_world, task, method) for task in islice(waiting, 2 * method.jobs)
        ]
        while queue:
            records = _result(queue.pop(0))
            queue += [pool.submit(answer_world, task, method) for task in islice(waiting, 1)]
            yield from records


def _result(task: "Future[list[Record]]") -> list[Record]:
    try:
        return task.result()
    except BrokenProcessPool as broken:
        raise InputError(
            "a worker process died, of too little memory most likely: try fewer with --jobs"
        ) from broken


@contextmanager
def _workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Provide processes that end with this block, also when it is interrupted."""
    pool = ProcessPoolExecutor(
        count, mp_context=multiprocessing.get_context("spawn"), initializer=_start_worker
    )
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()
        raise
    pool.shutdown()


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and the other cores to the other workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)


def drives(cases: Iterable[Case]) -> Iterator[tuple[Case, ...]]:
    """Cut the cases where the world changes, and long worlds in pieces: each is one drive."""
    task: list[Case] = []
    for case in cases:
        if task and (not _one_world(task[-1], case) or len(task) == _LONGEST):
            yield tuple(task)
            task = []
        task.append(case)
    if task:
        yield tuple(task)


def _one_world(one: Case, other: Case) -> bool:
    return one.scene is other.scene and one.rig is other.rig and one.light is other.light


def answer_world(cases: Sequence[Case], method: Method) -> list[Record]:
    """Render and answer cases of one world."""
    contenders = Contenders(baselines=method.baselines, config=method.config)
    return [contenders.record(given) for given in frames_of(cases, method)]


def frames_of(cases: Sequence[Case], method: Method) -> Iterator[Given]:
    """Yield the rendered frames of one world, from the folder that keeps them where they are."""
    studio: Studio | None = None
    try:
        for case in cases:
            path = None if method.frames is None else method.frames / _key(case, method.renderer)
            kept = None if path is None else load_frame(path)
            if kept is None:
                studio = studio or open_studio(case, method.renderer)
                shot = studio.shot(body=case.body, noise=case.noise, seed=case.seed)
                kept = Kept(left=shot.left, right=shot.right, truth=shot.truth)
                if path is not None:
                    save_frame(path, kept)
            yield _given(case, kept)
    finally:
        close = getattr(studio, "close", None)
        if close is not None:
            close()


def _given(case: Case, kept: Kept) -> Given:
    return Given(
        name=case.name,
        scenario=case.scenario,
        tags={"noise": case.noise, **case.tags},
        rig=case.rig,
        tilt=case.tilt,
        left=kept.left,
        right=kept.right,
        truth=kept.truth,
    )


def _key(case: Case, renderer: str) -> str:
    """Return a name that changes with everything that the picture depends on."""
    sensor = SENSORS[case.noise]
    shown = repr(
        (case.scene, case.rig, case.body, case.light, sensor, case.seed, case.rig_seed, renderer)
    )
    return hashlib.sha256(shown.encode()).hexdigest()[:24]


def open_studio(case: Case, renderer: str) -> Studio:
    """Return what takes pictures of a case's world.

    Raises
    ------
    DeviceError
        If MuJoCo or its OpenGL is missing.
    """
    if renderer == "rays":
        return _RayStudio(case)
    # MuJoCo is an optional extra and takes a second to import.
    from bearcub.sim.mujoco import Studio as Drawn  # noqa: PLC0415

    studio: Studio = Drawn(case.scene, case.rig, light=case.light, rig_seed=case.rig_seed)
    return studio


@dataclass(frozen=True, slots=True)
class _RayStudio:
    """The ray caster as a studio."""

    case: Case

    def shot(self, *, body: Any, noise: Any, seed: int) -> Rendered:
        """Take one pair."""
        case = self.case
        return render(
            case.scene, case.rig, body=body, noise=noise, seed=seed, rig_seed=case.rig_seed
        )


def cores() -> int:
    """Return how many processes this one may run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
