"""How answers are put into words on a terminal."""

import math
from collections.abc import Sequence

from bearcub.messages import Answer, FreeRange, Hole, Obstacle, Terrain
from bearcub.viewer.wording import number

_HANGING = 0.15  # base heights from here on are said [m]


def measured(value: float, sigma: float, *, unit: str, digits: int) -> str:
    """Return a number with its unit and 1-sigma, with a digit more where that sigma needs it.

    Examples
    --------
    >>> measured(3.047, 0.021, unit=" m", digits=2), measured(1.2034, 0.0042, unit=" m", digits=2)
    ('3.05 m ±0.02', '1.203 m ±0.004')
    >>> (
    ...     measured(5.77, math.nan, unit="°", digits=1),
    ...     measured(math.nan, math.nan, unit="°", digits=1),
    ... )
    ('5.8°', '?')
    """
    if math.isnan(value):
        return "?"
    if math.isnan(sigma):
        return f"{number(value, digits)}{unit}"
    if round(sigma, digits) == 0.0:
        digits += 1
    return f"{number(value, digits)}{unit} ±{number(max(sigma, 0.1**digits), digits)}"


def metres(value: float, sigma: float) -> str:
    """Return a length [m], to the centimetre within 10 m."""
    return measured(value, sigma, unit=" m", digits=2 if value < 10.0 else 1)


def degrees(angle: float, sigma: float = math.nan) -> str:
    """Return an angle [rad] in degrees with its 1-sigma.

    Examples
    --------
    >>> degrees(0.0332, 0.0017), degrees(-0.2), degrees(math.nan)
    ('1.9° ±0.1', '-11.5°', '?')
    """
    return measured(math.degrees(angle), math.degrees(sigma), unit="°", digits=1)


def sided(angle: float, sides: tuple[str, str], sigma: float = math.nan) -> str:
    """Return an angle without its sign and with the word for it: positive, negative.

    Examples
    --------
    >>> sided(0.0332, ("left", "right")), sided(-0.2, ("left", "right"), 0.01)
    ('1.9° left', '11.5° ±0.6 right')
    """
    rounded = round(math.degrees(angle), 1) if math.isfinite(angle) else 0.0
    word = "" if rounded == 0.0 else f" {sides[0] if rounded > 0 else sides[1]}"
    return degrees(abs(angle), sigma) + word


def bearing(angle: float, sigma: float = math.nan) -> str:
    """Return a bearing [rad] with its side."""
    return sided(angle, ("left", "right"), sigma)


def at_least(text: str, *, bound: bool) -> str:
    """Return `text` as a lower bound if it is one."""
    return f"≥ {text}" if bound else text


def share(value: float) -> str:
    """Return a share as per cent.

    Examples
    --------
    >>> share(0.974), share(math.nan)
    ('97 %', '?')
    """
    return "?" if math.isnan(value) else f"{100 * value:.0f} %"


def obstacle_cells(thing: Obstacle) -> tuple[str, ...]:
    """Return number, distance, bearing, width, height, confidence and remarks of an obstacle."""
    cut = set(thing.truncated)
    return (
        str(thing.id),
        metres(thing.distance, thing.sigma_distance),
        bearing(thing.bearing, thing.sigma_bearing),
        at_least(metres(thing.width, thing.sigma_width), bound=bool({"left", "right"} & cut)),
        at_least(metres(thing.height, thing.sigma_height), bound="top" in cut),
        share(thing.confidence),
        "; ".join(_remarks(thing.truncated, base=thing.base_height)),
    )


def hole_cells(hole: Hole) -> tuple[str, ...]:
    """Return kind, distance, bearing, width, length, depth, confidence and remarks of a hole."""
    return (
        hole.kind,
        metres(hole.distance, hole.sigma_distance),
        bearing(hole.bearing),
        at_least(
            metres(hole.width, hole.sigma_width),
            bound=bool({"left", "right"} & set(hole.truncated)),
        ),
        "no end seen" if math.isnan(hole.length) else metres(hole.length, hole.sigma_length),
        at_least(metres(hole.depth, hole.sigma_depth), bound=hole.depth_is_lower_bound),
        share(hole.confidence),
        "; ".join(_remarks(hole.truncated)),
    )


def _remarks(truncated: Sequence[str], *, base: float = math.nan) -> list[str]:
    remarks = [f"hangs {number(base)} m up"] if base >= _HANGING else []
    if truncated:
        remarks.append(f"cut by the image border: {', '.join(truncated)}")
    return remarks


def slope(terrain: Terrain) -> str:
    """Return the ground's slope in one line."""
    if math.isnan(terrain.slope):
        return "not known: too little ground seen from 1.5 to 5 m ahead"
    against = "gravity" if terrain.reference == "gravity" else "the ground under the robot"
    parts = [f"{sided(terrain.slope, ('up', 'down'), terrain.sigma)} ahead"]
    if not math.isnan(terrain.cross_slope):
        across = sided(terrain.cross_slope, ("rising to the left", "rising to the right"))
        parts.append(f"{across} across")
    if not math.isnan(terrain.roughness):
        parts.append(f"rough by {number(1000 * terrain.roughness, 1)} mm")
    return f"{', '.join(parts)}; against {against}"


def no_hole(answer: Answer) -> str:
    """Return what can be said when no hole was found."""
    return "none in the floor that is seen" if answer.ground.seen else "not known: no floor seen"


def no_obstacle(answer: Answer) -> str:
    """Return what can be said when no obstacle was found."""
    known = answer.valid_share
    seen = "" if math.isnan(known) else f" in the {share(known)} of the picture that were measured"
    return f"Nothing stands in the way{seen}."


def camera(answer: Answer) -> str:
    """Return where the camera is against the floor."""
    ground = answer.ground
    pitch = sided(ground.pitch, ("down", "up"), ground.sigma_pitch)
    roll = sided(ground.roll, ("right side down", "left side down"), ground.sigma_roll)
    height = metres(ground.height, ground.sigma_height)
    return f"{height} above the floor, looking {pitch}, rolled {roll}"


def floor(answer: Answer) -> str:
    """Return how the floor is known."""
    ground = answer.ground
    if not ground.seen:
        return f"not seen; taken from the {ground.source} alone"
    text = f"seen, from {ground.source.replace('+', ' and ')}"
    if not math.isnan(ground.residual):
        text += f"; its pixels lie within {number(ground.residual)} px of it"
    if not math.isnan(ground.tilt_disagreement):
        text += f"; {degrees(ground.tilt_disagreement)} from the tilt reading"
    return text


def free_way(free: FreeRange) -> str:
    """Return how far the way is free straight ahead, and where it is free farthest."""
    if not len(free):
        return "not known"
    ahead = int(abs(free.bearing).argmin())
    farthest = int(free.range.argmax())
    text = f"straight ahead {_stretch(free, ahead)}"
    if free.range[farthest] > free.range[ahead] + 0.1:
        text += f"; farthest {bearing(float(free.bearing[farthest]))} {_stretch(free, farthest)}"
    return text


def _stretch(free: FreeRange, index: int) -> str:
    return f"{number(float(free.range[index]), 1)} m, then {free.limit[index]}"


def timing(answer: Answer) -> str:
    """Return the milliseconds of every stage that was timed."""
    spent = answer.timing
    stages = {"match": spent.match, "ground": spent.ground, "obstacles": spent.obstacles}
    parts = [f"{name} {number(ms, 1)}" for name, ms in stages.items() if not math.isnan(ms)]
    return f"{' + '.join(parts)} = {number(spent.total, 1)} ms"
