"""How large is the hole that seems to open? The likeliest far wall, seen through the floor.

The line of sight over the near lip of a pit ends at its far wall. The wall is upright and ends at
the floor: it has the disparity of the floor at the far lip, whatever the row. Two explanations of
the same pixels, as of what stands (`bearcub.obstacles.upright`): the floor, and a wall that hangs
down from one of its lines. The lines and columns in which the wall explains the images better by
most are the mouth's likeliest extent [1]_. Around a mouth there is floor: the claim does not go on
to any of its four sides.

References
----------
.. [1] L. Matthies, A. Rankin: "Negative obstacle detection by thermal signature", IROS 2003; the
   geometry of the visible far wall.
"""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.messages import Float32
from bearcub.obstacles.floor_lines import LARGEST, FloorLines, floor_lines
from bearcub.obstacles.mouths import Mouth, accumulated
from bearcub.obstacles.upright import Scene
from bearcub.stereo.native import COMPILED, core

_BEFORE, _BEHIND = 0.4, 1.3  # ground before and behind the lip that is looked at [m]
_NEAREST = 0.3  # [m]
_COARSE = (24, 48)  # lines and columns of a first look ...
_FINE = (36, 90)  # ... and of a second one
_ASIDE = (0.9, 1.8)  # ground to either side that is looked at, the less the better [m]
_PLAIN = 5.0  # standard errors by which a mouth shows that needs no first look
_WORTH = 2.5  # log-likelihood ratio that is worth a second look ...
_LIKELY = 8.5  # ... and the least of a hole
_PRICE = 0.03  # log-likelihood of a pixel: noise alone makes nothing larger
_LEAST_LINES = 3  # of a mouth
_EVEN = 0.25  # how far the floor that was followed may bend off a slope [px]
_BORDER = (0.25, 3)  # share of a mouth's extent, at least lines and columns, that borders it
_RETURNS = (-3.0, 1.0)  # largest log-likelihood ratio of what borders a mouth, all of it and one
_GOES_ON = 0.1  # ... or of the claim's own: a quarter of its extent returns a quarter if it goes on
_HALF = 0.5  # of the largest parallax: the lower ground that may go on before and behind
_SIDE = (0.6, 0.3)  # of the far wall's parallax that a side wall has
_BLUR = 0.8  # how far a silhouette's blur carries the floor past its rim [px]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sunken:
    """The mouth of a hole, as the images tell it.

    Attributes
    ----------
    left, right : float
        First and last column [px].
    near, far : float
        Levels of its lips: of the floor's plane there [px].
    likely : float
        Log-likelihood ratio against the floor.
    """

    left: float
    right: float
    near: float
    far: float
    likely: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """First and last lines and columns of a wall; its log-likelihood ratio against the floor.

    Attributes
    ----------
    far, near : int
        Lines.
    left, right : int
        Columns.
    gain : float
    """

    far: int
    near: int
    left: int
    right: int
    gain: float

    @property
    def lines(self) -> slice:
        """All of its lines."""
        return slice(self.far, self.near + 1)

    @property
    def columns(self) -> slice:
        """All of its columns."""
        return slice(self.left, self.right + 1)


def opening(scene: Scene, mouth: Mouth) -> Sunken | None:
    """Return the hole that opens where one seems to, None for none and for what has no end.

    Parameters
    ----------
    scene : Scene
        The images and the floor.
    mouth : Mouth
        Where one seems to.
    """
    if mouth.sure < _PLAIN and not _worth_it(scene, mouth):
        return None
    for aside in _ASIDE:
        part = _around(scene, mouth, aside, _FINE)
        if part is None:
            return None
        claim = likeliest(part, 1)
        if claim.gain < _LIKELY or not _even(part):
            return None
        if claim.left > 1 and claim.right < len(part.u) - 2:
            return _sunken(part, claim) if _bordered(part, claim) else None
    return None


def _worth_it(scene: Scene, mouth: Mouth) -> bool:
    """Take a first, coarse look."""
    part = _around(scene, mouth, _ASIDE[0], _COARSE)
    return part is not None and likeliest(part, 2).gain >= _WORTH


def _around(scene: Scene, mouth: Mouth, aside: float, most: tuple[int, int]) -> FloorLines | None:
    """Return the lines around a mouth."""
    p = scene.projection
    focal = p.fx * p.baseline
    depth = focal / mouth.level
    levels = focal / (depth + _BEHIND), focal / max(depth - _BEFORE, _NEAREST)
    reach = aside * mouth.level / p.baseline
    return floor_lines(scene, (mouth.u - reach, mouth.u + reach), levels, most=most)


def likeliest(part: FloorLines, every: int, *, compiled: bool = COMPILED) -> Claim:
    """Return the likeliest wall that hangs down from one of the lines.

    Parameters
    ----------
    part : FloorLines
    every : int
        Of so many lines from the second on one is tried.
    compiled : bool
        By the native core, ``native/src/walls.cpp``; else by NumPy. The same but for rounding.
    """
    return (_compiled if compiled else _in_numpy)(part, every)


def _compiled(part: FloorLines, every: int) -> Claim:
    far, near, left, right, gain = core.likeliest_wall(
        part.right,
        part.u - np.float32(part.first),
        part.floor,
        part.v,
        part.left,
        part.misfit,
        part.known,
        (part.scale, LARGEST, part.weight, _PRICE),
        every,
        _LEAST_LINES,
    )
    return Claim(far=far, near=near, left=left, right=right, gain=gain)


def _in_numpy(part: FloorLines, every: int) -> Claim:
    lines = len(part.v)
    fars = np.arange(1, lines - _LEAST_LINES, every)
    ratios = part.ratios(np.repeat(part.floor[fars, None], lines, axis=1))
    ratios -= np.float32(_PRICE)
    ratios[np.arange(lines) < fars[:, None]] = 0
    sums = accumulated(np.add, ratios.transpose(1, 0, 2))
    until = accumulated(np.add, sums.transpose(2, 1, 0))
    least = np.zeros_like(until)
    least[1:] = until[:-1]
    gain = until - accumulated(np.minimum, least)
    gain *= (np.arange(lines) >= fars[:, None] + _LEAST_LINES - 1).astype(np.float32)
    right, index, near = (int(k) for k in np.unravel_index(int(gain.argmax()), gain.shape))
    return Claim(
        far=int(fars[index]),
        near=near,
        left=int(np.append(0, until[:right, index, near]).argmin()),
        right=right,
        gain=float(gain[right, index, near]),
    )


def _even(part: FloorLines) -> bool:
    """Tell whether the floor that was followed has no step there."""
    line = np.arange(len(part.bend)) - 0.5 * (len(part.bend) - 1)
    bend = part.bend - part.bend.mean()
    bend -= line * (line @ bend) / (line @ line)
    return bool(np.abs(bend).max() < _EVEN)


def _bordered(part: FloorLines, claim: Claim) -> bool:
    """Tell whether floor is all around."""
    share, least = _BORDER
    side = max(least, math.ceil(share * (claim.right - claim.left + 1)))
    end = max(least, math.ceil(share * (claim.near - claim.far + 1)))
    fall = np.float32(_HALF) * (part.floor[claim.near] - part.floor[claim.far])
    wall, lower = part.ratios(
        np.stack([np.full_like(part.floor, part.floor[claim.far]), part.floor - fall])
    )
    left, right = max(0, claim.left - 1), claim.right + 2
    far, near = max(0, claim.far - 1), claim.near + 2
    around = [
        wall[claim.lines, max(0, left - side) : left],
        wall[claim.lines, right : right + side],
        lower[max(0, far - end) : far, claim.columns],
        lower[near : near + end, claim.columns],
    ]
    told = [float(border.sum()) for border in around]
    all_there = all(border.size for border in around)
    most = max(_RETURNS[1], _GOES_ON * claim.gain)
    return all_there and sum(told) < _RETURNS[0] and max(told) < most


def _sunken(part: FloorLines, claim: Claim) -> Sunken:
    """Return the mouth that a claim and the side walls beside it are."""
    left, right = _sides(part, claim)
    line = float(part.level[1] - part.level[0])
    # what only the left camera sees of a wall is as wide as its parallax, half of it on average
    hidden = _HALF * float(part.floor[claim.near] - part.floor[claim.far])
    half = 0.5 * part.step[0] + _BLUR
    return Sunken(
        left=float(part.u[left]) - half,
        right=float(part.u[right]) + half + hidden,
        near=float(part.level[claim.near]) + (0.5 + _BLUR / part.step[1]) * line,
        far=float(part.level[claim.far]) - 0.5 * line,
        likely=claim.gain,
    )


def _sides(part: FloorLines, claim: Claim) -> tuple[int, int]:
    """Return the first and last column of a mouth whose side walls are seen.

    A side wall has disparities between those of the far wall and the floor.
    """
    left, right = claim.left, claim.right
    fall = part.floor - part.floor[claim.far]
    for share in _SIDE:
        ratio = part.ratio(part.floor - np.float32(share) * fall)[claim.lines] - np.float32(_PRICE)
        column = ratio.sum(axis=0)
        left -= _further(column[:left][::-1])
        right += _further(column[right + 1 :])
    return left, right


def _further(column: Float32) -> int:
    """Return how many columns from the first on have the largest sum, if that is positive."""
    until = np.cumsum(column)
    return int(until.argmax()) + 1 if len(until) and until.max() > 0 else 0
