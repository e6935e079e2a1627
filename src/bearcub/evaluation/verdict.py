"""One frame, one contender: what was found, missed, false, and how far off every number is."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bearcub.config import Detection
from bearcub.evaluation import target
from bearcub.evaluation.inclination import inclination
from bearcub.evaluation.matching import Sighting, match
from bearcub.evaluation.report import Found, Report
from bearcub.evaluation.target import Target
from bearcub.evaluation.things import Error
from bearcub.geometry import Attitude, camera_attitude
from bearcub.messages import Tilt
from bearcub.rig import Rig

MISLEADING = ("biased", "late")
"""Tilt readings that are off by more than their noise, as a frame's tag "tilt" says."""

FACES = ("step", "bank")
"""Names of obstacles that are a part of the ground."""

_SLOPE_END = 5.0  # the slope is that of the ground from 1.5 m to here [m]

Tags = Mapping[str, str | float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One answered frame with its truth.

    Attributes
    ----------
    name, scenario : str
    tags : mapping of str to str or float
        See `bearcub.sim.case.Case`.
    rig : Rig
    tilt : Tilt or None
        What the tilt sensor read.
    truth : dict
        A ``bearcub.truth/1`` object.
    reports : mapping of str to Report
        By contender.
    refused : str
        Why the pipeline refused the images; empty when it did not.
    """

    name: str
    scenario: str
    rig: Rig
    tilt: Tilt | None
    truth: Mapping[str, Any]
    reports: Mapping[str, Report]
    tags: Tags = field(default_factory=dict)
    refused: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How one contender did in one frame.

    Attributes
    ----------
    name, scenario : str
    tags : mapping of str to str or float
    rig : Rig
    things, holes : tuple of Sighting
        What counts, found or missed.
    overhead : tuple of Sighting
        What the robot fits under, with the answer that calls it an obstacle in the way, if any.
    false, false_holes : tuple of Found
    pieces : int
        How many of `false` are second answers for one thing.
    ignored : tuple of Target
        What is there and does not count.
    ground : mapping of str to Error
        Of "slope", "cross_slope", "pitch" and "roll" [deg], and "height" [m].
    timing : mapping of str to float
        Milliseconds by stage.
    tilt_error : float
        How far the tilt reading's pitch was off [deg]; NaN without a reading.
    """

    name: str
    scenario: str
    tags: Tags
    rig: Rig
    things: tuple[Sighting, ...] = ()
    overhead: tuple[Sighting, ...] = ()
    holes: tuple[Sighting, ...] = ()
    false: tuple[Found, ...] = ()
    false_holes: tuple[Found, ...] = ()
    pieces: int = 0
    ignored: tuple[Target, ...] = ()
    ground: Mapping[str, Error] = field(default_factory=dict)
    timing: Mapping[str, float] = field(default_factory=dict)
    tilt_error: float = math.nan


def judge(record: Record, contender: str) -> Verdict:
    """Compare a contender's report with the truth of the frame."""
    report, rig = record.reports[contender], record.rig
    obstacles = match(report.obstacles, target.obstacles(record.truth, rig))
    holes = match(report.holes, target.holes(record.truth, rig))
    return Verdict(
        name=record.name,
        scenario=record.scenario,
        tags=record.tags,
        rig=rig,
        things=tuple(s for s in obstacles.sightings if s.target.counts and not s.target.passable),
        overhead=tuple(
            _in_the_way(s, clearance(record.tags))
            for s in obstacles.sightings
            if s.target.counts and s.target.passable
        ),
        holes=tuple(s for s in holes.sightings if s.target.counts),
        false=obstacles.false,
        false_holes=holes.false,
        pieces=obstacles.pieces,
        ignored=tuple(
            s.target for s in (*obstacles.sightings, *holes.sightings) if not s.target.counts
        ),
        ground=_ground_errors(report, record),
        timing=report.timing,
        tilt_error=_tilt_error(record),
    )


def clearance(tags: Tags) -> float:
    """Return the height of the robot [m] that a frame's tags state, else the default one."""
    return float(tags.get("clearance", Detection().clearance))


def _tilt_error(record: Record) -> float:
    true = record.truth.get("tilt")
    if record.tilt is None or not true:
        return math.nan
    return math.degrees(record.tilt.pitch) - float(true["pitch_deg"])


def _in_the_way(sighting: Sighting, highest: float) -> Sighting:
    """Drop the answer that says itself that the robot fits under the thing."""
    found = sighting.found
    below = found is not None and found.base_height >= highest
    return Sighting(target=sighting.target, found=None if below else found)


def errors(sighting: Sighting) -> dict[str, Error]:
    """Return how far off an answer is, by the name of the number; empty where it was missed.

    [m]; "bearing" [deg]. What the image cuts has no true width, middle, height or length.
    """
    found, thing = sighting.found, sighting.target
    if found is None:
        return {}
    pairs = {
        "distance": (found.distance, thing.distance),
        "bearing": (math.degrees(found.bearing), math.degrees(thing.bearing)),
        "width": (found.width, thing.width),
        "height": (found.height, thing.height),
        "length": (found.length, thing.length),
        "depth": (found.depth, thing.depth),
    }
    cut = _unknown(thing)
    return {
        name: Error(value=value, truth=true, sigma=_sigma(found, name))
        for name, (value, true) in pairs.items()
        if name not in cut and math.isfinite(true)
    }


def _unknown(thing: Target) -> set[str]:
    unknown = set() if thing.whole else {"width", "bearing"}
    if {"top"} & set(thing.truncated):
        unknown |= {"height"}
    if {"bottom"} & set(thing.truncated):
        unknown |= {"distance", "length"}
    return unknown


def _sigma(found: Found, name: str) -> float:
    sigma = found.sigma.get(name, math.nan)
    return math.degrees(sigma) if name == "bearing" else sigma


def _ground_errors(report: Report, record: Record) -> dict[str, Error]:
    """Compare slope and attitude; what the truth does not say is left out.

    So is a slope against gravity where the tilt reading is known to be wrong, as it is the only
    witness of gravity there is, and the slope of ground that a step or a bank ends: those are
    obstacles, and what lies behind is another ground.
    """
    truth = record.truth
    found: dict[str, Error] = {}
    terrain, ground = truth.get("terrain"), truth.get("ground")
    misled = report.reference == "gravity" and record.tags.get("tilt") in MISLEADING
    if terrain and not misled and not _ends(truth):
        along, across = true_slopes(truth, record.rig, reference=report.reference)
        sigma = math.degrees(report.sigma_slope)
        for name, value, true in (
            ("slope", report.slope, along),
            ("cross_slope", report.cross_slope, across),
        ):
            found[name] = Error(value=math.degrees(value), truth=true, sigma=sigma)
    if ground:
        for name, value in (("pitch", report.pitch), ("roll", report.roll)):
            sigma = math.degrees(report.sigma.get(name, math.nan))
            true = float(ground[f"{name}_deg"])
            found[name] = Error(value=math.degrees(value), truth=true, sigma=sigma)
        sigma = report.sigma.get("height", math.nan)
        found["height"] = Error(value=report.height, truth=float(ground["height"]), sigma=sigma)
    return found


def _ends(truth: Mapping[str, Any]) -> bool:
    """Tell whether a step or a bank ends the ground before the slope's range does."""
    return any(
        thing.get("name") in FACES and thing["distance"] < _SLOPE_END
        for thing in truth.get("obstacles", ())
    )


def true_slopes(truth: Mapping[str, Any], rig: Rig, *, reference: str) -> tuple[float, float]:
    """Return slope and cross slope [deg] against gravity or the ground under the robot.

    Parameters
    ----------
    truth : dict
        A ``bearcub.truth/1`` object.
    rig : Rig
    reference : {"gravity", "robot"}
    """
    terrain = truth["terrain"]
    slopes = float(terrain["slope_deg"]), float(terrain["cross_slope_deg"])
    if reference == "gravity":
        return slopes
    under = _ground_under_robot(truth, rig)
    return slopes[0] - under[0], slopes[1] - under[1]


def _ground_under_robot(truth: Mapping[str, Any], rig: Rig) -> tuple[float, float]:
    """Return the inclination of the ground under the robot against gravity, ahead and left [deg].

    It is what the camera's attitude against that ground and against gravity leave between them.
    """
    gravity = camera_attitude(body=_attitude(truth["tilt"]), mount=rig.mount.attitude)
    floor = _attitude(truth["ground"])
    along, across = inclination(floor.down(), gravity=gravity.down(), mount=rig.mount.attitude)
    return math.degrees(along), math.degrees(across)


def _attitude(said: Mapping[str, Any]) -> Attitude:
    """Return the attitude that the truth states as "pitch_deg" and "roll_deg"."""
    return Attitude(roll=math.radians(said["roll_deg"]), pitch=math.radians(said["pitch_deg"]))
