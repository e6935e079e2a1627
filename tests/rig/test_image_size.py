"""A rig follows its images to another size, and refuses those of another camera."""

from dataclasses import replace

import pytest

from bearcub.errors import ConfigError, InputError
from bearcub.rig import Camera, Lens, Mount, Rig

CAMERA = Camera(width=640, height=480, fx=400, fy=420, cx=319.5, cy=200.0, baseline=0.12, doffs=6.0)
LENS = Lens(fx=410, fy=412, cx=300.5, cy=239.5, distortion=(-0.1, 0.0, 0.0, 0.0))
RIG = Rig(camera=CAMERA, mount=Mount(height=1.2), lenses=(LENS, LENS), source="rig.toml")


def test_scales_by_the_pixel_centre_rule() -> None:
    half = RIG.for_image(width=320, height=240)
    # cx' = (cx + 0.5) s - 0.5
    assert (half.camera.fx, half.camera.fy) == (200, 210)
    assert (half.camera.cx, half.camera.cy) == (159.5, 99.75)
    assert (half.camera.doffs, half.camera.baseline) == (3.0, 0.12)
    assert half.lenses is not None
    assert (half.lenses[1].fx, half.lenses[1].cx, half.lenses[1].cy) == (205, 150.0, 119.5)
    assert half.lenses[1].distortion == LENS.distortion


def test_the_middle_of_the_view_stays_in_the_middle() -> None:
    camera = replace(CAMERA, cx=319.5, cy=239.5)
    big = camera.for_image(width=1920, height=1440)
    assert (big.cx, big.cy) == (959.5, 719.5)


def test_the_right_size_changes_nothing() -> None:
    assert RIG.for_image(width=640, height=480).camera == CAMERA


def test_halving_an_odd_image_is_no_crop() -> None:
    odd = replace(CAMERA, width=2079, height=1041, cx=1039.0, cy=520.0, fx=1389, fy=1389)
    assert odd.for_image(width=1039, height=520).fx == pytest.approx(1389 * 1039 / 2079)


def test_a_crop_is_refused_with_both_sizes() -> None:
    with pytest.raises(InputError, match=r"640 x 360 px.*640 x 480 px.*\(in rig\.toml\)"):
        RIG.for_image(width=640, height=360)


def test_an_unknown_size_is_taken_from_the_first_image_only() -> None:
    unknown = replace(RIG, camera=replace(CAMERA, width=0, height=0))
    first = unknown.for_image(width=640, height=480)
    assert first.camera == CAMERA
    assert first.lenses == RIG.lenses
    with pytest.raises(InputError, match="another aspect"):
        first.for_image(width=640, height=360)


def test_a_first_image_that_cannot_belong_is_refused() -> None:
    unknown = replace(RIG, camera=replace(CAMERA, width=0, height=0))
    with pytest.raises(ConfigError, match=r"cx = 319\.5: the principal point lies outside"):
        unknown.for_image(width=300, height=240)
