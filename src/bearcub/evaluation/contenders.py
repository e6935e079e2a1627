"""The pipeline, and the baselines on its disparity, before one frame after another."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from bearcub.clock import Clock, MonotonicClock, elapsed_ms
from bearcub.config import Config
from bearcub.errors import InputError
from bearcub.evaluation.baselines import BASELINES, Frame
from bearcub.evaluation.report import Report
from bearcub.evaluation.verdict import Record, Tags, clearance
from bearcub.messages import Answer, Snapshot, Tilt, UInt8
from bearcub.pipeline import Pipeline
from bearcub.rig import Rig

OURS = "bearcub"
"""The pipeline's name among the contenders."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """One frame with its truth, before it is answered.

    Attributes
    ----------
    name, scenario : str
    rig : Rig
    tilt : Tilt or None
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
    truth : dict
        A ``bearcub.truth/1`` object.
    tags : mapping of str to str or float
        See `bearcub.sim.case.Case`.
    """

    name: str
    scenario: str
    rig: Rig
    tilt: Tilt | None
    left: UInt8
    right: UInt8
    truth: Mapping[str, Any]
    tags: Tags = field(default_factory=dict)


class Contenders:
    """Answers frames.

    Parameters
    ----------
    baselines : tuple of str
        Names of `BASELINES` that answer, too.
    config : Config, optional
        Of the pipeline; the robot's height is taken from the frame.
    clock : Clock, optional
        For the baselines' time.
    """

    def __init__(
        self,
        *,
        baselines: tuple[str, ...] = (),
        config: Config | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._baselines = baselines
        self._config = config or Config()
        self._clock = clock or MonotonicClock()
        self._pipeline: Pipeline | None = None

    def answer(self, given: Given) -> Answer:
        """Return the pipeline's answer.

        Raises
        ------
        InputError
            If it refuses the images.
        """
        highest = clearance(given.tags)
        built = self._pipeline
        if built is None or built.rig != given.rig or built.config.detection.clearance != highest:
            detection = replace(self._config.detection, clearance=highest)
            built = Pipeline(given.rig, replace(self._config, detection=detection))
            self._pipeline = built
        return built.process(Snapshot(left=given.left, right=given.right, tilt=given.tilt))

    def record(self, given: Given) -> Record:
        """Return the truth and what everyone answers; a refused frame is answered by nobody."""
        refused, reports = "", dict.fromkeys((OURS, *self._baselines), Report())
        try:
            reports = self._reports(given)
        except InputError as error:
            refused = str(error)
        return Record(
            name=given.name,
            scenario=given.scenario,
            tags=given.tags,
            rig=given.rig,
            tilt=given.tilt,
            truth=given.truth,
            reports=reports,
            refused=refused,
        )

    def _reports(self, given: Given) -> dict[str, Report]:
        answer = self.answer(given)
        disparity = answer.layers.disparity
        rows, columns = disparity.shape
        rig = given.rig.for_image(width=columns, height=rows)
        frame = Frame(disparity=disparity, rig=rig, tilt=given.tilt)
        reports = {OURS: Report.of(answer)}
        for name in self._baselines:
            start = self._clock.now_ns()
            report = BASELINES[name](frame)
            timing = {"total": elapsed_ms(self._clock, start)}
            reports[name] = replace(report, timing=timing)
        return reports
