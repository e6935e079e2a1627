"""What every pixel was found to be: painted coarsely for the free way, in full for pictures."""

from dataclasses import dataclass, field

import numpy as np

from bearcub.messages import Int32, Painting, Pixel, UInt8
from bearcub.obstacles.joining import Box
from bearcub.obstacles.regions import Region
from bearcub.obstacles.segment import Segments
from bearcub.obstacles.sorting import Sorter, Sorting


@dataclass(frozen=True, slots=True, kw_only=True)
class Painter:
    """Everything that tells what a pixel is.

    Attributes
    ----------
    sorter : Sorter
    segments : Segments
    identities : ndarray of int32, shape (segments.count + 1,)
        `Obstacle.id` of every segment; 0 for what is none.
    holes : tuple of Region
        In the order of their numbers.
    boxes : dict
        First column and row, last column and row [px] of things without a segment, by
        `Obstacle.id`.
    """

    sorter: Sorter
    segments: Segments
    identities: Int32
    holes: tuple[Region, ...]
    boxes: dict[int, Box] = field(default_factory=dict)

    def __call__(self) -> Painting:
        """Paint every pixel."""
        part = self.sorter.part(slice(None), slice(None))
        own = self.segments
        numbers = own.enlarged(own.labels, part.between(own.farthest_level, own.nearest_level))
        labels = self._complete(self.identities.take(numbers), 1)
        return Painting(floor=part.floor, kind=kinds(part, labels), labels=labels)

    def sampled(self, step: int) -> Int32:
        """Return the labels of every `step`-th pixel of the grid that was segmented."""
        own = self.segments.labels[::step, ::step]
        return self._complete(self.identities.take(own), step * self.segments.step)

    def _complete(self, labels: Int32, step: int) -> Int32:
        for identity, (left, top, right, bottom) in self.boxes.items():
            window = labels[
                -(-top // step) : bottom // step + 1, -(-left // step) : right // step + 1
            ]
            window[window == 0] = identity
        for number, hole in enumerate(self.holes, start=1):
            v, u = -hole.top % step, -hole.left % step
            mask = hole.mask[v::step, u::step]
            row, column = (hole.top + v) // step, (hole.left + u) // step
            window = labels[row : row + mask.shape[0], column : column + mask.shape[1]]
            np.copyto(window, -number, where=mask[: window.shape[0], : window.shape[1]])
        return labels


def kinds(part: Sorting, labels: Int32) -> UInt8:
    """Return the `Pixel` codes of a part of the image with these labels."""
    kind = np.full(labels.shape, Pixel.OTHER, dtype=np.uint8)
    np.copyto(kind, np.uint8(Pixel.UNSEEN), where=np.isnan(part.disparity))
    np.copyto(kind, np.uint8(Pixel.FLOOR), where=part.on_floor)
    np.copyto(kind, np.uint8(Pixel.OBSTACLE), where=labels > 0)
    np.copyto(kind, np.uint8(Pixel.HOLE), where=labels < 0)
    return kind
