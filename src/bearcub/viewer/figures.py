"""The figures of the paper, drawn for one input.

Bearcat Cub's paper shows the disparity map and its histogram, the column and row profiles of a
level before and after the floor is cancelled, and the rows that are cancelled under a tilt.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import Answer, Float32, Float64, Pixel, UInt8
from bearcub.viewer.counting import (
    equalised,
    level_counts,
    level_profile,
    nearest_levels,
    proportional,
    quartile_levels,
)
from bearcub.viewer.palette import (
    BLUE,
    FLOOR,
    GREEN,
    MUTED,
    NIGHT,
    PURPLE,
    SERIES,
    SKY,
    WHITE,
    Colour,
    blended,
    coloured,
    in_colour,
)
from bearcub.viewer.plot import Panel, Series, draw_page, save

_HEAT: tuple[Colour, ...] = ((60, 20, 10), (150, 40, 90), (80, 80, 220), (60, 190, 250), WHITE)
_PROFILES = (
    (
        "Column",
        "column",
        "What stands upright is a peak as wide as it is; the floor, low and everywhere, goes.",
    ),
    (
        "Row",
        "row",
        "What stands upright is as wide as it is high; the floor's peak, broad when rolled, goes.",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Maps:
    """What the figures are drawn from; float32, shape (H, W) each.

    Attributes
    ----------
    before : ndarray
        Disparity [px]; NaN unmatched, 0 at infinity.
    after : ndarray
        The same with the floor cancelled: NaN there.
    floor : ndarray
        Disparity [px] of the floor at every pixel; 0 or less above the horizon.
    """

    before: Float32
    after: Float32
    floor: Float32


def figures(
    answer: Answer,
    image: UInt8 | None,
    directory: Path,
    *,
    after: Float32 | None = None,
    levels: Sequence[int] = (),
) -> list[Path]:
    """Draw what the figures of the paper show, for one answer.

    Parameters
    ----------
    answer : Answer
        With its layers of shape (H, W).
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        The left image, shown beside the disparity map.
    directory : Path
        Made when it is not there.
    after : ndarray of float32, shape (H, W), optional
        The disparity with the floor cancelled (NaN); by default without the pixels that the
        answer calls floor.
    levels : sequence of int, optional
        Levels [px] whose profiles are drawn; by default those of the nearest obstacles, or the
        quartiles of what is left after the cancellation.

    Returns
    -------
    list of Path
        The PNG files, in the order of the paper.

    Raises
    ------
    InputError
        If the directory cannot be made or a file in it cannot be written.
    """
    layers = answer.layers
    if after is None:
        after = np.where(layers.kind == Pixel.FLOOR, np.float32(np.nan), layers.disparity)
    maps = Maps(before=layers.disparity, after=after, floor=layers.floor)
    return draw_figures(maps, directory, levels=levels or nearest_levels(answer), image=image)


def draw_figures(
    maps: Maps, directory: Path, *, levels: Sequence[int] = (), image: UInt8 | None = None
) -> list[Path]:
    """Draw the figures of the paper from arrays alone; see `figures`."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory}: cannot be made: {error.strerror}") from error
    chosen = list(levels) or quartile_levels(maps.after)
    pages = {
        "1_disparity": _disparity_page(maps, image),
        "2_histogram": _histogram_page(maps),
        "3_column_profiles": _profiles_page(maps, chosen, axis=0),
        "4_row_profiles": _profiles_page(maps, chosen, axis=1),
        "5_cancelled_floor": _cancelled_page(maps, chosen),
        "6_uv_disparity": _uv_page(maps, chosen),
    }
    return [save(page, directory / f"{name}.png") for name, page in pages.items()]


def _disparity_page(maps: Maps, image: UInt8 | None) -> UInt8:
    codes = equalised(maps.before)
    scale = blended(_HEAT)
    scale[0] = (96, 92, 90)
    shown = [_image_panel(coloured(codes, scale), "Disparity, histogram equalised")]
    if image is None or image.shape[:2] != codes.shape:
        shown.insert(0, _image_panel(coloured(proportional(maps.before), scale), "Disparity"))
    else:
        shown.insert(0, _image_panel(in_colour(image), "Left image"))
    share = 100.0 * float(np.isfinite(maps.before).mean())
    return draw_page(
        shown,
        columns=2,
        title="Disparity map",
        caption=f"Dark is far, light is near, grey has no disparity; {share:.1f} % of the pixels "
        "have one. Equalised, every colour covers as many of them as every other.",
    )


def _histogram_page(maps: Maps) -> UInt8:
    before, after = level_counts(maps.before), level_counts(maps.after)
    grey = np.bincount(equalised(maps.before).ravel(), minlength=256)[1:]
    levels = Panel(
        title="Levels of the map",
        x_label="disparity [px]",
        y_label="pixels",
        x_range=(-0.5, len(before) - 0.5),
        series=(
            _bars(before, first=0, colour=MUTED, label="all"),
            _bars(after, first=0, colour=BLUE, label="floor cancelled"),
        ),
    )
    spread = Panel(
        title="After equalisation",
        x_label="grey level",
        y_label="pixels",
        x_range=(0.5, 255.5),
        series=(_bars(grey, first=1, colour=BLUE),),
    )
    return draw_page(
        [levels, spread],
        columns=2,
        title="Histogram of the disparity map",
        caption="Pixels of every level before equalisation, left, one bar a pixel of disparity, "
        "and after it, right: the crowded levels are drawn apart, the empty ones closed up.",
    )


def _bars(counts: NDArray[np.int64], *, first: int, colour: Colour, label: str = "") -> Series:
    at = np.arange(first, first + len(counts), dtype=np.float64)
    return Series(x=at, y=counts.astype(np.float64), colour=colour, kind="bars", label=label)


def _profiles_page(maps: Maps, levels: Sequence[int], *, axis: int) -> UInt8:
    """Draw the profiles of the chosen levels, with the floor and without it, on one scale."""
    named, other, sense = _PROFILES[axis]
    panels = []
    for level in levels:
        before = level_profile(maps.before, level, axis=axis)
        after = level_profile(maps.after, level, axis=axis)
        top = 1.06 * max(1, int(before.max()))
        at = np.arange(len(before), dtype=np.float64)
        for counts, colour, state in (
            (before, MUTED, "with the floor"),
            (after, BLUE, "floor cancelled"),
        ):
            panels.append(
                Panel(
                    title=f"Level {level}, {state}",
                    x_label=f"{other} [px]",
                    y_label=f"pixels in the {other}",
                    x_range=(0.0, len(before) - 1.0),
                    y_range=(0.0, top),
                    series=(Series(x=at, y=counts.astype(np.float64), colour=colour, kind="area"),),
                )
            )
    return draw_page(
        panels,
        columns=2,
        title=f"{named} profiles",
        caption=f"Pixels of a level, its disparity to half a pixel, in every {other} of the "
        f"image. {sense}",
        row_height=300,
    )


def _cancelled_page(maps: Maps, levels: Sequence[int]) -> UInt8:
    grey = np.repeat(equalised(maps.before)[:, :, None] // 2 + np.uint8(40), 3, axis=2)
    cancelled = np.isfinite(maps.before) & np.isnan(maps.after)
    band, everything = grey.copy(), grey.copy()
    for level, colour in zip(levels, SERIES, strict=False):
        rows = (maps.floor >= level - 0.5) & (maps.floor < level + 0.5)
        _wash(band, rows, colour, opacity=0.35)
        _wash(band, rows & cancelled, colour, opacity=0.75)
    _wash(everything, cancelled, FLOOR, opacity=0.6)
    none = np.zeros(0)
    keys = tuple(
        Series(x=none, y=none, colour=colour, kind="bars", label=f"level {level}")
        for level, colour in zip(levels, SERIES, strict=False)
    )
    share = 100.0 * float(cancelled.sum()) / max(1, int(np.isfinite(maps.before).sum()))
    key = Series(
        x=none, y=none, colour=FLOOR, kind="bars", label=f"{share:.1f} % of the disparities"
    )
    return draw_page(
        [
            _image_panel(band, "Where the floor has the level", series=keys),
            _image_panel(everything, "Cancelled, all levels", series=(key,)),
        ],
        columns=2,
        title="Floor cancelled under the present tilt",
        caption="Left: the rows in which the floor has the disparity of a level, strong where "
        "pixels were cancelled; they slope as the camera rolls. Right: all that was cancelled.",
    )


def _uv_page(maps: Maps, levels: Sequence[int]) -> UInt8:
    """Draw counts per (level, column) and per (row, level), with the floor and the levels."""
    height, width = maps.before.shape
    v, u = np.nonzero(maps.before >= 0)
    d = maps.before[v, u]
    top = float(np.ceil(np.quantile(d, 0.999))) + 2.0 if d.size else 2.0
    fine = min(400, max(64, int(top * 4)))
    by_column, _, _ = np.histogram2d(d, u, bins=(fine, width), range=((0, top), (0, width)))
    by_row, _, _ = np.histogram2d(v, d, bins=(height, fine), range=((0, height), (0, top)))
    column_histogram = Panel(
        title="Column histogram, u-disparity",
        x_label="column [px]",
        y_label="disparity [px]",
        picture=_heat(by_column[::-1]),
        series=_level_lines(levels, width=width),
        x_range=(0.0, width),
        y_range=(0.0, top),
    )
    row_histogram = Panel(
        title="Row histogram, v-disparity",
        x_label="disparity [px]",
        y_label="row [px]",
        picture=_heat(by_row),
        series=_floor_lines(maps.floor),
        x_range=(0.0, top),
        y_range=(height, 0.0),
    )
    return draw_page(
        [column_histogram, row_histogram],
        columns=2,
        title="Column and row histograms",
        caption="Pixels of every disparity per column and per row, on a logarithmic scale. An "
        "upright thing is a bar at its level in the left picture, the floor a slanted line in "
        "the right one; its lines at the image's borders part as the camera rolls.",
        row_height=520,
    )


def _level_lines(levels: Sequence[int], *, width: int) -> tuple[Series, ...]:
    across = np.array([0.0, width])
    return tuple(
        Series(
            x=across,
            y=np.full(2, float(level)),
            colour=colour,
            kind="dashed",
            label=f"level {level}",
            width=2,
        )
        for level, colour in zip(levels, SERIES, strict=False)
    )


def _floor_lines(floor: Float32) -> tuple[Series, ...]:
    """Return the floor's disparity down the left, middle and right column."""
    height, width = floor.shape
    rows = np.arange(height, dtype=np.float64) + 0.5
    shown: list[Series] = []
    for column, name, colour in (
        (0, "floor, left column", GREEN),
        (width - 1, "right column", PURPLE),
        (width // 2, "middle column", SKY),
    ):
        level = np.array(floor[:, column], dtype=np.float64)
        level[level <= 0] = np.nan
        shown.append(Series(x=level, y=rows, colour=colour, kind="dashed", label=name, width=2))
    return tuple(shown)


def _heat(counts: Float64) -> UInt8:
    """Return counts in colours by their logarithm; none is dark."""
    place = np.log1p(counts) / max(1e-9, float(np.log1p(counts.max())))
    scale = blended(_HEAT)
    scale[0] = NIGHT
    return coloured((place * 255).astype(np.uint8), scale)


def _image_panel(picture: UInt8, title: str, *, series: tuple[Series, ...] = ()) -> Panel:
    height, width = picture.shape[:2]
    return Panel(
        title=title,
        x_label="column [px]",
        y_label="row [px]",
        picture=picture,
        series=series,
        x_range=(0.0, width),
        y_range=(height, 0.0),
        aspect=height / width,
    )


def _wash(canvas: UInt8, mask: NDArray[np.bool_], colour: Colour, *, opacity: float) -> None:
    """Tint the pixels of a mask."""
    mixed = canvas[mask] * (1.0 - opacity) + np.array(colour) * opacity
    canvas[mask] = mixed.round().astype(np.uint8)
