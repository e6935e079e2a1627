"""How numbers are written on pictures: with their error bar, and "?" for what is not known."""

import math

from bearcub.messages import Answer, Hole, Obstacle

_HANGING = 0.15  # base heights from here on are said [m]


def number(value: float, digits: int = 2) -> str:
    """Return a number with so many decimals; "?" when it is NaN.

    Examples
    --------
    >>> number(3.047), number(float("nan")), number(-0.001, 1)
    ('3.05', '?', '0.0')
    """
    if math.isnan(value):
        return "?"
    return f"{round(value, digits) + 0.0:.{digits}f}"


def metres(value: float, sigma: float) -> str:
    """Return a distance with its 1-sigma, to the centimetre within 10 m.

    Examples
    --------
    >>> metres(3.05, 0.02), metres(14.33, 0.56), metres(2.0, float("nan"))
    ('3.05 m ±0.02', '14.3 m ±0.6', '2.00 m')
    """
    digits = 2 if value < 10 else 1
    spread = "" if math.isnan(sigma) else f" ±{number(sigma, digits)}"
    return f"{number(value, digits)} m{spread}"


def bearing(angle: float) -> str:
    """Return a bearing [rad] in degrees with its side.

    Examples
    --------
    >>> bearing(0.0332), bearing(-0.2), bearing(0.0)
    ('1.9° L', '11.5° R', '0.0°')
    """
    degrees = number(abs(math.degrees(angle)), 1)
    side = "" if degrees in {"0.0", "?"} else " L" if angle > 0 else " R"
    return f"{degrees}°{side}"


def obstacle_lines(thing: Obstacle) -> tuple[str, str]:
    """Return the two lines that name an obstacle: how far, then how large and where."""
    wider = "≥" if {"left", "right"} & set(thing.truncated) else ""
    higher = "≥" if "top" in thing.truncated else ""
    size = f"{wider}{number(thing.width)}×{higher}{number(thing.height)} m"
    hangs = f" from {number(thing.base_height)}" if thing.base_height >= _HANGING else ""
    return (
        f"{thing.id}  {metres(thing.distance, thing.sigma_distance)}",
        f"{size}{hangs}  {bearing(thing.bearing)}",
    )


def hole_lines(hole: Hole) -> tuple[str, str]:
    """Return the two lines that name a hole: how far, then how large and how deep."""
    deeper = "≥" if hole.depth_is_lower_bound else ""
    size = number(hole.width) + ("" if math.isnan(hole.length) else f"×{number(hole.length)}")
    return (
        f"{hole.kind}  {metres(hole.distance, hole.sigma_distance)}",
        f"{size} m, {deeper}{number(hole.depth)} deep",
    )


def status(answer: Answer) -> list[str]:
    """Return what the status line says, the most important first."""
    ground, terrain = answer.ground, answer.terrain
    seen = f"floor: {ground.source}" if ground.seen else "no floor seen"
    slope = number(math.degrees(terrain.slope), 1)
    spread = "" if math.isnan(terrain.sigma) else f" ±{number(math.degrees(terrain.sigma), 1)}"
    return [
        f"camera {number(ground.height)} m",
        f"pitch {number(math.degrees(ground.pitch), 1)}°",
        f"roll {number(math.degrees(ground.roll), 1)}°",
        seen,
        f"slope {slope}{spread}°",
        f"{number(answer.timing.total, 1)} ms",
    ]
