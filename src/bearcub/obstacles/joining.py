"""Whole things from the pieces that grouping leaves of them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from bearcub.obstacles.measure import Extent

_PIECE = 0.5  # most of a thing's width that its foot or ledge has
_AHEAD = (0.4, 0.12)  # how far before or behind it a foot may lie [m], share of the distance
_APART = math.radians(1.0)  # most that the pieces of a surface are apart
_BESIDE = (0.1, 0.02)  # how far before or behind it a piece may lie [m], share of the distance
_SLIVER = 0.05  # most of a surface's width that what a matcher leaves over of it has
_LEAST_SLANT = 0.5  # sine of the least angle under which a surface is taken to be seen
_ABOVE = 0.1  # how far above another a piece of the same surface may begin [m]
_LEVEL = 0.2  # share of a thing's height within which something is level with its top

Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """One thing, or a piece of one.

    Attributes
    ----------
    extent : Extent
    box : tuple of int
        First column and row, last column and row [px].
    pixels : int
    numbers : tuple of int
        Of the segments that it is made of.
    """

    extent: Extent
    box: Box
    pixels: int
    numbers: tuple[int, ...]


Asked = Callable[[Thing, Thing], bool]
"""What the map is asked about two pieces."""


def _never(_one: Thing, _other: Thing) -> bool:
    return False


def joined(
    pieces: list[Thing], *, low: float, unseen: Asked = _never, standing: Asked = _never
) -> list[Thing]:
    """Join pieces to whole things.

    The foot of a bank, or what the tolerance leaves of a kerb's, is grouped apart: it lies at
    other levels. A long surface whose range changes along it, or that is matched badly in places,
    falls into pieces side by side; or the two ends of it are left, which lie on one line. Of a kerb
    hardly higher than the tolerance parts are left. What is seen over a thing's top and is level
    with it is its top face, or ground that goes on behind it.

    Parameters
    ----------
    pieces : list of Thing
    low : float
        What does not rise above it is low [m].
    unseen : callable, optional
        Tells of two pieces whether what is between them is out of sight.
    standing : callable, optional
        Tells of two pieces whether what is seen between them goes on from one to the other.

    Returns
    -------
    list of Thing
        Nearest first.
    """
    left = sorted(pieces, key=lambda piece: -piece.extent.width)
    kept: list[Thing] = []
    while left:
        piece = left.pop(0)
        for k, whole in enumerate(kept):
            if _are_one(piece, whole, low=low, unseen=unseen, standing=standing):
                del kept[k]
                left.insert(0, _together(whole, piece))  # and may now touch others
                break
            larger = _with_part(whole, piece, low=low) or _with_part(piece, whole, low=low)
            if larger:
                kept[k] = larger
                break
        else:
            kept.append(piece)
    return sorted(kept, key=lambda thing: thing.extent.distance)


def _are_one(piece: Thing, whole: Thing, *, low: float, unseen: Asked, standing: Asked) -> bool:
    """Tell whether two pieces are of one surface."""
    one, other = piece.extent, whole.extent
    return (
        _continues(one, other)
        or (_is_other_end(one, other, low=low) and unseen(piece, whole))
        or (_ends_alike(one, other, low=low) and standing(piece, whole))
    )


def _with_part(whole: Thing, part: Thing, *, low: float) -> Thing | None:
    """Return a thing with its foot or its top face, None where `part` is neither."""
    if _is_foot(part.extent, whole.extent, low=low):
        return _on_foot(whole, part)
    if _is_level_top(part.extent, whole.extent):
        return replace(whole, numbers=whole.numbers + part.numbers)
    return None


def _is_foot(piece: Extent, whole: Extent, *, low: float) -> bool:
    """Tell whether a low piece lies along a much wider thing, or ends where that begins."""
    aside = abs(piece.bearing - whole.bearing) * whole.distance
    apart = abs(piece.distance - whole.distance)
    ledge = whole.top < 2 * low and piece.top < 1.2 * whole.top
    return (
        (piece.top < low or ledge)
        and (piece.width < _PIECE * whole.width or whole.lowest > piece.top - _ABOVE)
        and aside < 0.5 * whole.width
        and apart < max(_AHEAD[0], _AHEAD[1] * whole.distance)
    )


def _on_foot(whole: Thing, foot: Thing) -> Thing:
    """Return a thing that begins where its foot does."""
    extent, nearer = whole.extent, foot.extent
    if nearer.distance < extent.distance:
        extent = replace(extent, distance=nearer.distance, x=nearer.x, y=nearer.y)
    return replace(whole, extent=extent, numbers=whole.numbers + foot.numbers)


def _continues(piece: Extent, whole: Extent) -> bool:
    """Tell whether two pieces touch, side by side or one before the other, at the same range."""
    if _gap(piece, whole) > _APART or not _at_one_height(piece, whole):
        return False
    at = _nearest_bearing(piece, whole)
    slack = 2 if piece.width < _SLIVER * whole.width else 1
    return _meets(piece, whole, at, _range_at(whole, at), slack=slack)


def _is_other_end(piece: Extent, whole: Extent, *, low: float) -> bool:
    """Tell whether a piece lies on a wider one's line, no farther beyond it than it is long."""
    gap = _gap(piece, whole)
    if not _APART < gap <= whole.left - whole.right or min(piece.top, whole.top) < low:
        return False
    at = _nearest_bearing(piece, whole)
    return _at_one_height(piece, whole) and _meets(piece, whole, at, _on_line(whole, at), slack=1)


def _ends_alike(piece: Extent, whole: Extent, *, low: float) -> bool:
    """Tell whether two things side by side, neither of them tall, end at one height."""
    return (
        _gap(piece, whole) > 0
        and max(piece.top, whole.top) < 2 * low
        and (piece.bottom > 0) == (whole.bottom > 0)
        and abs(piece.top - whole.top) <= _ABOVE
    )


def _is_level_top(piece: Extent, whole: Extent) -> bool:
    """Tell whether all that is seen of a piece lies behind a thing, level with its top.

    Nor does it stand where all that hides its foot hangs.
    """
    inside = whole.right < piece.bearing < whole.left
    # of what is low the tolerance leaves no more than is level with another low thing
    level = min(_ABOVE, _LEVEL * whole.top)
    rise = piece.ground - whole.ground
    hang_alike = (piece.bottom > 0) == (whole.bottom > 0) or piece.lowest > whole.bottom > 0
    return (
        inside
        and piece.left - piece.right < whole.left - whole.right
        and hang_alike
        and piece.distance > whole.distance - _beside(whole.distance)
        and max(rise + piece.top - whole.top, whole.top - piece.lowest - rise) <= level
    )


def _gap(piece: Extent, whole: Extent) -> float:
    """Return the angle between two things side by side [rad]; negative where they overlap."""
    return max(piece.right - whole.left, whole.right - piece.left)


def _at_one_height(piece: Extent, whole: Extent) -> bool:
    """Tell whether two things could be one: the way goes on under what hangs, and not through it.

    Nor does one of them begin far above the other.
    """
    if (piece.bottom > 0) != (whole.bottom > 0):
        return False
    return max(piece.bottom - whole.top, whole.bottom - piece.top) <= _ABOVE


def _nearest_bearing(piece: Extent, whole: Extent) -> float:
    """Return the direction of a piece that is nearest to the other's [rad]."""
    where = min(max(piece.bearing, whole.right), whole.left)
    return min(max(where, piece.right), piece.left)


def _meets(piece: Extent, whole: Extent, at: float, there: float, *, slack: float) -> bool:
    """Tell whether a piece is, in one of its directions, at the range where the other would be."""
    apart = _slant(whole, there) * abs(_range_at(piece, at) - there)
    noise = 2 * math.hypot(piece.sigma_distance, whole.sigma_distance)
    return apart < slack * _beside(there) + noise


def _range_at(extent: Extent, bearing: float) -> float:
    """Return the range [m] of the straight line between a thing's two ends in a direction.

    Beyond an end it goes on for a little: an end is where a thing was matched last.
    """
    span = extent.left - extent.right
    if span <= 0:
        return extent.distance
    inside = min(max(bearing, extent.right), extent.left)
    there = _on_line(extent, inside)
    if inside == bearing:
        return max(extent.distance, there)
    beyond = _on_line(extent, min(max(bearing, inside - span), inside + span))
    return min(max(beyond, there - _beside(there)), there + _beside(there))


def _on_line(extent: Extent, bearing: float) -> float:
    """Return the range [m] of the line through a thing's two ends in a direction."""
    a, b = extent.range_right, extent.range_left
    across = a * math.sin(bearing - extent.right) + b * math.sin(extent.left - bearing)
    return a * b * math.sin(extent.left - extent.right) / max(across, 1e-9)


def _beside(there: float) -> float:
    """Return how far before or behind a surface at a range its pieces may lie [m]."""
    return max(_BESIDE[0], _BESIDE[1] * there)


def _slant(extent: Extent, there: float) -> float:
    """Return the sine of the angle under which a thing's line is seen at a range.

    So far off the line is what lies 1 m behind it. It is that of 30 deg at least: along a line that
    is seen from its end other things stand.
    """
    a, b, span = extent.range_right, extent.range_left, extent.left - extent.right
    length = math.sqrt(max(a * a + b * b - 2 * a * b * math.cos(span), 1e-9))
    return min(max(a * b * math.sin(span) / (length * there), _LEAST_SLANT), 1.0)


def _together(one: Thing, other: Thing) -> Thing:
    """Return the thing that two pieces are."""
    wide, small = sorted((one.extent, other.extent), key=lambda extent: -extent.width)
    near = min(wide, small, key=lambda extent: extent.distance)
    right = min(wide, small, key=lambda extent: extent.right)
    left = max(wide, small, key=lambda extent: extent.left)
    half = 0.5 * (left.left - right.right)
    # a few pixels tell no better than the rest where it begins
    doubt = 2 * small.sigma_top if small.width < _SLIVER * wide.width else 0.0
    bottom = wide.bottom if wide.bottom < small.bottom + doubt else small.bottom
    extent = replace(
        wide,
        x=near.x,
        y=near.y,
        distance=near.distance,
        sigma_distance=near.sigma_distance,
        bearing=right.right + half,
        right=right.right,
        left=left.left,
        range_right=right.range_right,
        range_left=left.range_left,
        width=max(wide.width, (right.range_right + left.range_left) * math.sin(half)),
        top=max(wide.top, small.top),
        bottom=bottom,
    )
    boxes = list(zip(one.box, other.box, strict=True))
    return Thing(
        extent=extent,
        box=(min(boxes[0]), min(boxes[1]), max(boxes[2]), max(boxes[3])),
        pixels=one.pixels + other.pixels,
        numbers=one.numbers + other.numbers,
    )
