import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import UInt8
from bearcub.viewer.plot import Panel, Series, draw_page, draw_panel, nice_ticks, save

Counts = NDArray[np.int64]
RED = (0, 0, 255)


def red_pixels(picture: UInt8) -> Counts:
    return np.argwhere((picture == RED).all(axis=2))


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4), st.integers(2, 12))
def test_ticks_are_inside_evenly_spaced_and_about_as_many_as_asked(
    low: float, span: float, about: int
) -> None:
    ticks = nice_ticks(low, low + span, about=about)
    slack = 1e-6 * span
    assert all(low - slack <= tick <= low + span + slack for tick in ticks)
    assert len(ticks) <= 2 * about + 2
    if len(ticks) > 2:
        steps = np.diff(ticks)
        np.testing.assert_allclose(steps, steps[0], rtol=1e-4)


def panel(*series: Series, **changes: Any) -> Panel:
    settings: dict[str, Any] = {"x_range": (0.0, 10.0), "y_range": (0.0, 10.0), **changes}
    return Panel(title="t", x_label="x [m]", y_label="y [m]", series=series, **settings)


def test_line_lies_at_its_values() -> None:
    flat = Series(x=np.array([0.0, 10.0]), y=np.array([5.0, 5.0]), colour=RED, width=3)
    low = Series(x=np.array([0.0, 10.0]), y=np.array([0.0, 0.0]), colour=RED, width=3)
    high = Series(x=np.array([0.0, 10.0]), y=np.array([10.0, 10.0]), colour=RED, width=3)
    middle, bottom, top = (
        red_pixels(draw_panel(panel(s), width=400, height=300))[:, 0].mean()
        for s in (flat, low, high)
    )
    assert middle == pytest.approx((bottom + top) / 2, abs=1.5)
    assert bottom > middle + 80


def test_axis_may_run_backwards_as_image_rows_do() -> None:
    line = Series(x=np.array([0.0, 10.0]), y=np.array([1.0, 1.0]), colour=RED, width=3)
    upright = red_pixels(draw_panel(panel(line), width=400, height=300))
    hanging = red_pixels(draw_panel(panel(line, y_range=(10.0, 0.0)), width=400, height=300))
    assert hanging[:, 0].mean() < upright[:, 0].mean() - 80


def test_missing_value_interrupts_a_line() -> None:
    x = np.linspace(0, 10, 11)
    y = np.full(11, 5.0)
    whole = red_pixels(
        draw_panel(panel(Series(x=x, y=y, colour=RED, width=3)), width=400, height=300)
    )
    y[4:7] = math.nan
    broken = red_pixels(
        draw_panel(panel(Series(x=x, y=y, colour=RED, width=3)), width=400, height=300)
    )
    assert len(broken) == pytest.approx(0.6 * len(whole), rel=0.05)


def test_bars_are_as_high_as_their_counts() -> None:
    bars = Series(x=np.array([2.5, 7.5]), y=np.array([8.0, 4.0]), colour=RED, kind="bars")
    found = red_pixels(draw_panel(panel(bars), width=400, height=300))
    columns = np.bincount(found[:, 1])
    heights = columns[columns > 0]
    assert heights.max() == pytest.approx(2 * heights.min(), abs=2)
    assert (heights == heights.max()).sum() == pytest.approx(
        (heights == heights.min()).sum(), abs=2
    )


def test_dashed_line_has_gaps() -> None:
    x, y = np.array([0.0, 10.0]), np.array([5.0, 5.0])
    solid = Series(x=x, y=y, colour=RED, width=3)
    dashed = Series(x=x, y=y, colour=RED, width=3, kind="dashed")
    ratio = len(red_pixels(draw_panel(panel(dashed), width=400, height=300))) / len(
        red_pixels(draw_panel(panel(solid), width=400, height=300))
    )
    assert 0.4 < ratio < 0.9


def test_picture_fills_the_axes_in_its_own_proportions() -> None:
    image = np.zeros((50, 100, 3), dtype=np.uint8)
    image[:, :] = RED
    shown = panel(picture=image, x_range=(0.0, 100.0), y_range=(50.0, 0.0), aspect=0.5)
    found = red_pixels(draw_panel(shown, width=500, height=500))
    rows, columns = np.ptp(found, axis=0) + 1
    assert rows == pytest.approx(columns / 2, abs=1)
    assert len(found) == rows * columns


def test_page_has_the_width_asked_for_and_a_row_for_every_columns_panels() -> None:
    empty = panel()
    one = draw_page([empty] * 3, columns=3, width=1000, row_height=250)
    two = draw_page([empty] * 4, columns=3, width=1000, row_height=250)
    assert one.shape[1] == two.shape[1] == 1000
    assert two.shape[0] - one.shape[0] == 250


def test_page_that_cannot_be_written_names_the_file(tmp_path: Path) -> None:
    target = tmp_path / "missing" / "page.png"
    with pytest.raises(InputError, match=r"page\.png: cannot be written"):
        save(draw_page([panel()]), target)
