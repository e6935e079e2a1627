"""Run frames through the pipeline as any user does, with someone looking on."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar

from bearcub.config import Config
from bearcub.devices.images import read_image
from bearcub.messages import Answer, Snapshot, Tilt
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig

_T = TypeVar("_T")

Shot = Callable[[], Snapshot]
"""Loads or renders one frame when it is its turn."""


class Track(Protocol):
    """Hands on items one by one and shows how far they are."""

    def __call__(self, items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:
        """Return the items in their order; `name` says what they are."""
        ...


class Watch(Protocol):
    """Looks at every answer, to draw it."""

    def __call__(self, name: str, rig: Rig, snapshot: Snapshot, answer: Answer) -> None:
        """Take one answered frame; `name` can be a file name."""
        ...


def _untracked(items: Iterable[_T], *, total: int, name: str) -> Iterable[_T]:  # noqa: ARG001
    return items


def _unwatched(name: str, rig: Rig, snapshot: Snapshot, answer: Answer) -> None:
    """Look away."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Runner:
    """How frames are answered.

    Attributes
    ----------
    config : Config
        The same for every set.
    track : Track
        Shows progress.
    watch : Watch
        Sees every answer.
    """

    config: Config = field(default_factory=Config)
    track: Track = _untracked
    watch: Watch = _unwatched

    def answers(
        self, rig: Rig, shots: Mapping[str, Shot], *, name: str, config: Config | None = None
    ) -> Iterator[tuple[Snapshot, Answer]]:
        """Answer frames in their order with one pipeline.

        Parameters
        ----------
        rig : Rig
        shots : mapping of str to Shot
            The frames by their names.
        name : str
            Of the set, for progress and for `watch`.
        config : Config, optional
            Instead of `self.config`, where the rig wants another (its nearest range).
        """
        pipeline = Pipeline(rig, config or self.config)
        for label, load in self.track(shots.items(), total=len(shots), name=name):
            snapshot = load()
            answer = pipeline.process(snapshot)
            self.watch(f"{name}_{label}", rig, snapshot, answer)
            yield snapshot, answer


def pair(left: Path, right: Path, *, tilt: Tilt | None = None) -> Shot:
    """Return the shot of a stereo pair in two files."""
    return lambda: Snapshot(left=read_image(left), right=read_image(right), tilt=tilt)
