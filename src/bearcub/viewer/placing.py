"""Where labels go: beside what they name, inside the picture, never on each other."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple


class Area(NamedTuple):
    """A rectangle [px]: left and top border, width and height."""

    x: int
    y: int
    width: int
    height: int

    def overlap(self, other: "Area") -> int:
        """Return the pixels that both cover."""
        wide = min(self.x + self.width, other.x + other.width) - max(self.x, other.x)
        high = min(self.y + self.height, other.y + other.height) - max(self.y, other.y)
        return wide * high if wide > 0 and high > 0 else 0


@dataclass(slots=True)
class Placing:
    """A picture that fills with labels: first come, first served.

    Attributes
    ----------
    bounds : Area
        Labels stay inside.
    taken : list of Area
        Labels never cover these; every placed label joins them.
    things : list of Area
        Labels cover as little as possible of these.
    """

    bounds: Area
    taken: list[Area] = field(default_factory=list)
    things: list[Area] = field(default_factory=list)

    def place(self, size: tuple[int, int], *, beside: Area, cover: float = math.inf) -> Area | None:
        """Reserve and return the best place for a label beside an area.

        None when there is no room, or none that covers less than a share `cover` of the label's
        own size of the things.
        """
        best, least = None, cover * size[0] * size[1]
        for candidate in _candidates(size, beside):
            place = self._inside(candidate)
            if place is None or any(place.overlap(t) for t in self.taken):
                continue
            covered = sum(place.overlap(t) for t in self.things)
            if covered < least:
                best, least = place, covered
            if not covered:
                break
        if best:
            self.taken.append(best)
        return best

    def _inside(self, place: Area) -> Area | None:
        width, height = place.width, place.height
        if width > self.bounds.width or height > self.bounds.height:
            return None
        x = min(max(place.x, self.bounds.x), self.bounds.x + self.bounds.width - width)
        y = min(max(place.y, self.bounds.y), self.bounds.y + self.bounds.height - height)
        return Area(x, y, width, height)


def _candidates(size: tuple[int, int], beside: Area) -> Iterable[Area]:
    """Yield places from the preferred one on: above, below, beside, inside, then further away."""
    width, height = size
    left, right = beside.x, beside.x + beside.width
    top, bottom = beside.y, beside.y + beside.height
    for x, y in (
        (left, top - height - 2),
        (right - width, top - height - 2),
        (left, bottom + 2),
        (right - width, bottom + 2),
        (right + 2, top),
        (left - width - 2, top),
        (right + 2, bottom - height),
        (left - width - 2, bottom - height),
        (left + 2, top + 2),
        (left + 2, bottom - height - 2),
    ):
        yield Area(x, y, width, height)
    for step in range(1, 4):
        for x in (left, left - width, right):
            yield Area(x, top - height - 2 - step * (height // 2 + 1), width, height)
            yield Area(x, bottom + 2 + step * (height // 2 + 1), width, height)
