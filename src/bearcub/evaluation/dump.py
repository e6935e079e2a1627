"""One line of JSON for every frame, so that a failure can be looked into."""

import json
import math
from dataclasses import asdict
from typing import Any

from bearcub.evaluation.matching import Sighting
from bearcub.evaluation.verdict import Record, errors, judge


def line(record: Record, contender: str) -> str:
    """Return a frame with its truth, its answer, what they matched and the errors, as JSON.

    Angles are degrees in names that say so, else radians; what is not known is null.
    """
    verdict = judge(record, contender)
    found = {
        "name": record.name,
        "scenario": record.scenario,
        "tags": dict(record.tags),
        "tilt": None if record.tilt is None else asdict(record.tilt),
        "refused": record.refused,
        "truth": dict(record.truth),
        "answer": asdict(record.reports[contender]),
        "obstacles": [_sighting(s) for s in verdict.things],
        "overhead": [_sighting(s) for s in verdict.overhead],
        "holes": [_sighting(s) for s in verdict.holes],
        "false": [asdict(thing) for thing in verdict.false],
        "false_holes": [asdict(hole) for hole in verdict.false_holes],
        "ignored": [{"kind": t.kind, "why": t.ignored} for t in verdict.ignored],
        "ground": {name: asdict(error) for name, error in verdict.ground.items()},
    }
    return json.dumps(_known(found), allow_nan=False)


def _sighting(sighting: Sighting) -> dict[str, Any]:
    return {
        "truth": asdict(sighting.target),
        "found": None if sighting.found is None else asdict(sighting.found),
        "errors": {name: asdict(error) for name, error in errors(sighting).items()},
    }


def _known(value: Any) -> Any:
    """Return the same with None for what is not known, and plain numbers."""
    if isinstance(value, dict):
        return {key: _known(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_known(item) for item in value]
    if isinstance(value, float):
        return round(float(value), 6) if math.isfinite(value) else None
    return value
