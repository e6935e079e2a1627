"""INRIA road pairs: the floor found from a mount that was only guessed."""

import math
from itertools import product
from pathlib import Path

from bearcub.evaluation.runner import Runner, pair
from bearcub.evaluation.score import worst
from bearcub.evaluation.table import Row, Section
from bearcub.messages import Ground
from bearcub.rig import Camera, Mount, Rig

CAMERA = Camera(width=500, height=312, fx=410, fy=410, cx=258, cy=156, baseline=0.22)
HEIGHT = 1.28  # of the camera above a flat road, and parallel to it [m]
PAIRS = (46, 89)
GUESSES = tuple(product((1.0, 1.5, 2.0), (-10.0, 0.0, 10.0)))
"""Heights [m] and pitches [deg] of the guessed mounts."""

_ABOUT = (
    "Two road pairs taken 1.28 m above a flat road by cameras parallel to it. The mount is guessed "
    "nine times: 1, 1.5 and 2 m high (1-sigma 0.5 m), pitched -10, 0 and 10 deg (1-sigma "
    "10 deg); no tilt reading. The number is the worst of the nine."
)


def guessed(height: float, pitch_deg: float) -> Mount:
    """Return a mount that is not well known."""
    return Mount(
        height=height,
        pitch=math.radians(pitch_deg),
        sigma_height=0.5,
        sigma_pitch=math.radians(10.0),
    )


def evaluate(folder: Path, runner: Runner) -> Section:
    """Fit the floor of both pairs from every guess."""
    rows: list[Row] = []
    for number in PAIRS:
        shot = pair(folder / f"left_{number}.png", folder / f"right_{number}.png")
        fitted: dict[tuple[float, float], Ground] = {}
        for height, pitch_deg in GUESSES:
            rig = Rig(camera=CAMERA, mount=guessed(height, pitch_deg))
            name = f"{number}_{height:g}m_{pitch_deg:+g}deg"
            for _, answer in runner.answers(rig, {name: shot}, name="inria_road"):
                fitted[height, pitch_deg] = answer.ground
        rows += score(number, fitted)
    return Section(
        name="inria_road",
        title="INRIA road: height and pitch from a guess",
        about=_ABOUT,
        rows=tuple(rows),
    )


def score(number: int, fitted: dict[tuple[float, float], Ground]) -> list[Row]:
    """Compare the floors fitted from each guess with the truth: 1.28 m, 0 deg."""
    heights = {guess: _seen(ground, ground.height) for guess, ground in fitted.items()}
    pitches = {guess: _seen(ground, math.degrees(ground.pitch)) for guess, ground in fitted.items()}
    return [
        Row(
            measure=f"pair {number}: height error",
            value=worst([100.0 * (height / HEIGHT - 1.0) for height in heights.values()]),
            unit="%",
            limit=5.0,
            note=_by_guess(heights, "m"),
        ),
        Row(
            measure=f"pair {number}: pitch error",
            value=worst(list(pitches.values())),
            unit="deg",
            limit=1.0,
            note=_by_guess(pitches, "deg"),
        ),
    ]


def _seen(ground: Ground, value: float) -> float:
    """Return a fitted value; a floor that was not seen has none."""
    return value if ground.seen else math.nan


def _by_guess(values: dict[tuple[float, float], float], unit: str) -> str:
    """List the values by guess, as in ``m: 1 m -10 deg 1.28, +0 deg 1.28; 2 m +0 deg 1.29``."""
    lines: dict[float, list[str]] = {}
    for (height, pitch), value in values.items():
        lines.setdefault(height, []).append(f"{pitch:+g} deg {value:.2f}")
    listed = "; ".join(f"{height:g} m {', '.join(words)}" for height, words in lines.items())
    return f"{unit} by guess: {listed}"
