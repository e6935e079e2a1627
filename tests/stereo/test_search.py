"""The search range covers the floor in view and follows the rig's numbers."""

import math
from dataclasses import replace

import pytest

from bearcub.rig import Camera, Mount
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.search import search_range

VGA = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
PAPER = Mount(height=1.2, pitch=math.radians(5.9))


def test_a_nearest_range_is_turned_into_its_disparity() -> None:
    # 386 * 0.12 / 0.4 = 115.8: 117 whole disparities from 0, 128 in sixteens
    assert search_range(VGA, PAPER, nearest=0.4) == SearchRange(0, 128)
    # 386 * 0.12 / 4 = 11.58
    assert search_range(VGA, PAPER, nearest=4.0) == SearchRange(0, 16)


def test_doffs_moves_the_range() -> None:
    camera = replace(VGA, doffs=31.09)
    # Infinity is measured as -31.09; 115.8 adjusted is 84.7: -32 to 85 are 118 disparities.
    assert search_range(camera, PAPER, nearest=0.4) == SearchRange(-32, 128)


def test_the_paper_rig_searches_64_of_640() -> None:
    assert search_range(VGA, PAPER) == SearchRange(0, 64)


def test_a_low_wide_baseline_rig_stops_at_a_quarter_of_the_width() -> None:
    camera = replace(VGA, baseline=0.5)
    # d = (B / h) (...) is several hundred pixels at 0.3 m; a quarter of 640 is 160, plus 0.
    assert search_range(camera, Mount(height=0.3)) == SearchRange(0, 176)


def test_the_floor_at_the_bottom_is_inside_for_every_attitude_allowed_for() -> None:
    camera = Camera(width=500, height=312, fx=410, fy=410, cx=258, cy=156, baseline=0.22)
    mount = Mount(height=1.5, sigma_height=0.5, sigma_pitch=math.radians(20))
    # At 1.0 m, 20 deg down: 0.22 ((311 - 156) cos 20 + 410 sin 20) = 62.9: 64 from 0.
    assert search_range(camera, mount) == SearchRange(0, 64)
    assert search_range(camera, Mount(height=1.5, sigma_height=0.6)).count == 64
    # At 0.75 m (half, the least believed), 20 deg down: 83.8
    low = Mount(height=1.5, sigma_height=1.4, sigma_pitch=math.radians(20))
    assert search_range(camera, low) == SearchRange(0, 96)


@pytest.mark.parametrize("width", [160, 320, 640, 1280])
def test_at_least_a_tenth_of_the_width_is_searched(width: int) -> None:
    far = Mount(height=50.0)
    height = width * 3 // 4
    camera = VGA.scaled(width=width, height=height)
    assert search_range(camera, far).count >= width / 10
