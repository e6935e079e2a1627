from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.viewer import figures
from bearcub.viewer.counting import equalised, level_profile, nearest_levels, quartile_levels
from bearcub.viewer.figures import Maps, draw_figures

NAMES = [
    "1_disparity.png",
    "2_histogram.png",
    "3_column_profiles.png",
    "4_row_profiles.png",
    "5_cancelled_floor.png",
    "6_uv_disparity.png",
]


def test_every_figure_of_the_paper_is_a_picture_1200_px_wide(
    world: Any, box: Any, tmp_path: Path
) -> None:
    answer = world(obstacles=(box(),)).answer()
    paths = figures(answer, None, tmp_path / "new" / "folder")
    assert [path.name for path in paths] == NAMES
    for path in paths:
        picture = np.asarray(cv2.imread(str(path)))
        assert picture.shape[1] == 1200
        assert picture.shape[0] > 300
        assert picture.std() > 10


def test_profile_counts_pixels_within_half_a_level() -> None:
    disparity = np.array(
        [[4.5, 5.0, 5.49, 5.5], [np.nan, 5.2, 0.0, 4.49], [5.0, 5.0, 9.0, 9.0]], dtype=np.float32
    )
    assert level_profile(disparity, 5, axis=0).tolist() == [2, 3, 1, 0]
    assert level_profile(disparity, 5, axis=1).tolist() == [3, 1, 2]


def test_column_profile_of_a_box_is_its_height_over_its_width(world: Any, box: Any) -> None:
    layers = world(obstacles=(box(distance=4.0),)).answer().layers  # 20 / 4 = 5 px
    standing = np.where(layers.labels == 1, layers.disparity, np.float32(np.nan))
    profile = level_profile(standing, 5, axis=0)
    assert (profile[140:180] == 100).all()
    assert profile.sum() == 40 * 100


def test_equalised_map_uses_grey_levels_evenly_and_keeps_the_order() -> None:
    rng = np.random.default_rng(1)
    disparity = (rng.random((80, 80)) ** 4 * 60).astype(np.float32)
    disparity[:5] = np.nan
    grey = equalised(disparity)
    assert (grey[:5] == 0).all()
    assert grey[5:].min() >= 1
    counts, _ = np.histogram(grey[5:], bins=4, range=(1, 256))
    assert counts.max() < 1.15 * counts.min()
    order = np.argsort(disparity[5:].ravel())
    assert (np.diff(grey[5:].ravel()[order].astype(int)) >= 0).all()


def test_levels_are_those_of_the_nearest_obstacles(world: Any, box: Any) -> None:
    near = box(id=1, distance=2.0, box=(10, 130, 60, 200))  # 10 px
    far = box(id=2, distance=5.0, box=(100, 130, 160, 200))  # 4 px
    assert nearest_levels(world(obstacles=(far, near)).answer()) == [10, 4]
    assert nearest_levels(world().answer()) == []


def test_levels_without_obstacles_are_quartiles() -> None:
    disparity = np.concatenate([np.full(100, 4), np.full(100, 8), np.full(100, 12)])
    assert quartile_levels(disparity.astype(np.float32).reshape(10, 30)) == [12, 8, 4]


def test_map_without_any_disparity_still_gives_its_figures(tmp_path: Path) -> None:
    nothing = np.full((60, 80), np.nan, dtype=np.float32)
    paths = draw_figures(Maps(before=nothing, after=nothing, floor=nothing), tmp_path)
    assert [path.name for path in paths] == NAMES


def test_all_infinite_and_image_of_colour_are_drawn(tmp_path: Path) -> None:
    far = np.zeros((60, 80), dtype=np.float32)
    image = np.zeros((60, 80, 3), dtype=np.uint8)
    maps = Maps(before=far, after=far, floor=far)
    assert len(draw_figures(maps, tmp_path, levels=[3], image=image)) == 6


def test_folder_that_cannot_be_made_is_named(world: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="file"):
        figures(world().answer(), None, tmp_path / "file" / "below")
