"""Which answer means which thing: one to one, by direction and distance.

An answer can mean a thing when the intervals of bearings that they cover overlap, both widened by
0.5 deg (two or three pixels: a post is no wider), and their distances differ by no more than the
larger of 0.3 m and 10 %. Of all such pairs the one that fits best is taken first, then the best of
what is left (greedy): the sum of the differences of bearing and distance, each as a share of what
is allowed. Answers that are left over and could mean a thing that does not count are neither right
nor false; all others are false, a second answer for one thing included.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bearcub.evaluation.report import Found
from bearcub.evaluation.target import Target
from bearcub.messages import Float64

_SLACK = math.radians(0.5)
_NEAR, _SHARE = 0.3, 0.1  # gate of the distance [m], share of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A thing, and the answer that means it: None when it was missed."""

    target: Target
    found: Found | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Matches:
    """What became of the things and the answers of one frame.

    Attributes
    ----------
    sightings : tuple of Sighting
        Of every thing, also of those that do not count.
    false : tuple of Found
        Answers that mean nothing there is.
    pieces : int
        How many of `false` could mean a thing that another answer means already.
    """

    sightings: tuple[Sighting, ...]
    false: tuple[Found, ...]
    pieces: int


def match(found: Sequence[Found], targets: Sequence[Target]) -> Matches:
    """Pair answers and things; see the module for the rule.

    Parameters
    ----------
    found : sequence of Found
        All obstacles, or all holes, of one answer.
    targets : sequence of Target
        All obstacles, or all holes, of the truth.
    """
    costs = _costs(found, targets)
    taken: dict[int, int] = {}  # answer by thing
    free = set(range(len(found)))
    for flat in np.argsort(costs, axis=None, kind="stable"):
        i, j = (int(k) for k in np.unravel_index(flat, costs.shape))
        if not np.isfinite(costs[i, j]):
            break
        if i in free and j not in taken:
            taken[j] = i
            free.remove(i)
    ignored = np.array([not target.counts or target.passable for target in targets], dtype=bool)
    close = np.isfinite(costs)
    false = sorted(i for i in free if not (close[i] & ignored).any())
    return Matches(
        sightings=tuple(
            Sighting(target=target, found=found[taken[j]] if j in taken else None)
            for j, target in enumerate(targets)
        ),
        false=tuple(found[i] for i in false),
        pieces=sum(bool(close[i].any()) for i in false),
    )


def gate(distance: float) -> float:
    """Return how far an answer's distance may be off [m].

    Examples
    --------
    >>> gate(2.0), gate(8.0)
    (0.3, 0.8)
    """
    return max(_NEAR, _SHARE * distance)


def _costs(found: Sequence[Found], targets: Sequence[Target]) -> Float64:
    """Return how badly each pair fits, shape (found, targets); inf where it is none."""
    costs = np.full((len(found), len(targets)), np.inf)
    for i, answer in enumerate(found):
        for j, target in enumerate(targets):
            costs[i, j] = _cost(answer, target)
    return costs


def _cost(answer: Found, target: Target) -> float:
    apart = abs(answer.distance - target.distance) / gate(target.distance)
    reach = 2.0 * _SLACK + sum(
        math.atan2(0.5 * thing.width, thing.distance)
        for thing in (answer, target)
        if not math.isnan(thing.width)
    )
    aside = abs(answer.bearing - target.bearing) / reach
    return apart + aside if apart <= 1.0 and aside <= 1.0 else math.inf
