"""Makers' buffers become pictures: small arrays by hand, and what is refused."""

import threading

import numpy as np
import pytest

from bearcub.clock import ManualClock, MonotonicClock
from bearcub.devices.cameras import CameraSource, aravis, depthai, genicam, realsense
from bearcub.devices.cameras.capture import decode_pixels, split_side_by_side
from bearcub.devices.cameras.genicam import Component
from bearcub.devices.cameras.plugins import PluginSettings, build_capture, import_sdk, plugin_names
from bearcub.errors import ConfigError, DeviceError, FormatError
from bearcub.messages import UInt8

RED, GREEN, BLUE = (0, 0, 200), (0, 200, 0), (200, 0, 0)  # BGR


def mosaic(pattern: str, colour: tuple[int, int, int], *, side: int = 8) -> UInt8:
    """What a sensor with that pattern sees of one colour: ``RG`` is red, green in its first row."""
    rows = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}[pattern]
    cell = np.array([colour["BGR".index(letter)] for letter in rows], dtype=np.uint8)
    return np.tile(cell.reshape(2, 2), (side // 2, side // 2))


@pytest.mark.parametrize("colour", [RED, GREEN, BLUE])
@pytest.mark.parametrize("pattern", ["RG", "GR", "GB", "BG"])
def test_a_bayer_mosaic_keeps_its_colour(pattern: str, colour: tuple[int, int, int]) -> None:
    picture = decode_pixels(
        mosaic(pattern, colour), width=8, height=8, pixel_format=f"Bayer{pattern}8", name="x"
    )
    assert tuple(picture[4, 4]) == colour
    assert tuple(picture[3, 4]) == colour


def test_rgb_becomes_bgr_and_bgr_stays() -> None:
    data = np.arange(12, dtype=np.uint8)
    rgb = decode_pixels(data, width=2, height=2, pixel_format="RGB8", name="x")
    bgr = decode_pixels(data, width=2, height=2, pixel_format="BGR8", name="x")
    assert rgb[0, 0].tolist() == [2, 1, 0]
    assert bgr[0, 0].tolist() == [0, 1, 2]
    assert rgb.flags.c_contiguous


@pytest.mark.parametrize(("bits", "value"), [(8, 255), (10, 1023), (12, 4095), (16, 65535)])
def test_the_upper_8_bits_are_taken(bits: int, value: int) -> None:
    wide = np.array([0, value], dtype=np.uint16)
    data = wide.astype(np.uint8) if bits == 8 else wide
    picture = decode_pixels(data, width=2, height=1, pixel_format=f"Mono{bits}", name="x")
    assert picture.tolist() == [[0, 255]]


def test_a_buffer_is_copied_because_its_memory_goes_back_to_the_camera() -> None:
    data = np.zeros(4, dtype=np.uint8)
    picture = decode_pixels(data, width=2, height=2, pixel_format="Mono8", name="x")
    data[:] = 9
    assert picture.max() == 0


@pytest.mark.parametrize(
    ("pixel_format", "size", "reason"),
    [
        ("Coord3D_C16", 4, "pixel format Coord3D_C16"),
        ("Mono7", 4, "pixel format Mono7"),
        ("RGB16", 12, "pixel format RGB16"),
        ("Mono8", 5, "5 values in a buffer of 2 x 2 Mono8: expected 4"),
        ("RGB8", 4, "expected 12"),
    ],
)
def test_an_unknown_buffer_is_refused(pixel_format: str, size: int, reason: str) -> None:
    data = np.zeros(size, dtype=np.uint8)
    with pytest.raises(FormatError, match=reason):
        decode_pixels(data, width=2, height=2, pixel_format=pixel_format, name="camera")


def test_an_odd_side_by_side_picture_is_refused() -> None:
    with pytest.raises(FormatError, match="5 columns"):
        split_side_by_side(np.zeros((2, 5), dtype=np.uint8), name="camera")


GREY_LEFT, GREY_RIGHT = (np.full((4, 6), level, dtype=np.uint8) for level in (10, 20))


def test_depthai_messages_become_a_pair_with_their_skew() -> None:
    taken = depthai.convert(GREY_LEFT, GREY_RIGHT, stamps=(5.0, 5.002), numbers=(7, 7))
    assert taken.right is not None
    assert (taken.left[0, 0], taken.right[0, 0]) == (10, 20)
    assert taken.stamp_ns == 5_001_000_000
    assert taken.skew == pytest.approx(0.002)


def test_depthai_messages_of_two_shutter_releases_are_no_pair() -> None:
    with pytest.raises(FormatError, match="left picture 7 with right picture 8"):
        depthai.convert(GREY_LEFT, GREY_RIGHT, stamps=(5.0, 5.066), numbers=(7, 8))
    with pytest.raises(FormatError, match="one size"):
        depthai.convert(GREY_LEFT, GREY_RIGHT[:2], stamps=(5.0, 5.0), numbers=(7, 7))


def test_realsense_frames_become_a_pair() -> None:
    taken = realsense.convert(GREY_LEFT, GREY_RIGHT, numbers=(3, 3), stamp_ns=11)
    assert taken.right is not None
    assert (taken.left[0, 0], taken.right[0, 0], taken.stamp_ns, taken.skew) == (10, 20, 11, 0.0)
    assert not np.shares_memory(taken.left, GREY_LEFT)


@pytest.mark.parametrize(
    ("right", "numbers", "reason"),
    [
        (GREY_RIGHT, (3, 4), "left frame 3 with right frame 4"),
        (GREY_RIGHT[:, :4], (3, 3), "one size"),
    ],
)
def test_realsense_frames_that_do_not_belong_together_are_refused(
    right: UInt8, numbers: tuple[int, int], reason: str
) -> None:
    with pytest.raises(FormatError, match=reason):
        realsense.convert(GREY_LEFT, right, numbers=numbers, stamp_ns=0)


def component(picture: UInt8, pixel_format: str = "Mono8") -> Component:
    height, width = picture.shape
    return Component(data=picture.ravel(), width=width, height=height, pixel_format=pixel_format)


def test_one_or_two_genicam_components_become_a_picture_or_a_pair() -> None:
    single = genicam.convert([component(GREY_LEFT)], name="x", stamp_ns=5)
    assert single.right is None
    pair = genicam.convert([component(GREY_LEFT), component(GREY_RIGHT)], name="x", stamp_ns=5)
    assert pair.right is not None
    assert pair.right.tolist() == GREY_RIGHT.tolist()
    with pytest.raises(FormatError, match="0 images"):
        genicam.convert([], name="x", stamp_ns=5)
    with pytest.raises(FormatError, match="one size"):
        genicam.convert([component(GREY_LEFT), component(GREY_RIGHT[:2])], name="x", stamp_ns=5)


def test_aravis_buffers_are_read_by_their_pixel_format() -> None:
    eight = aravis.component(bytes([1, 2, 3, 4, 5, 6]), width=3, height=2, pixel_format="Mono8")
    assert genicam.convert([eight], name="x", stamp_ns=0).left.tolist() == [[1, 2, 3], [4, 5, 6]]
    # 12 bits: 0x0FF0 and 0x0010 become 0xFF and 0x01.
    twelve = aravis.component(
        bytes([0xF0, 0x0F, 0x10, 0x00]), width=2, height=1, pixel_format="Mono12"
    )
    assert genicam.convert([twelve], name="x", stamp_ns=0).left.tolist() == [[0xFF, 0x01]]
    cut_off = aravis.component(bytes(5), width=3, height=2, pixel_format="Mono8")
    with pytest.raises(FormatError, match="5 values in a buffer of 3 x 2"):
        genicam.convert([cut_off], name="x", stamp_ns=0)


def test_frames_that_aravis_did_not_get_are_counted_across_the_turn_of_their_numbers() -> None:
    assert [aravis.lost_between(7, number) for number in (8, 9, 12)] == [0, 1, 4]
    assert aravis.lost_between(65535, 2) == 1
    assert aravis.lost_between(None, 5) == 0


@pytest.mark.filterwarnings("ignore:DynamicImporter:ImportWarning")  # PyGObject's own
def test_the_fake_camera_of_aravis_is_read_like_a_real_one() -> None:
    gi = pytest.importorskip("gi", reason="needs PyGObject and Aravis")
    try:
        gi.require_version("Aravis", "0.8")
    except ValueError as missing:
        pytest.skip(str(missing))
    settings = PluginSettings(device="Fake_1", width=64, height=48, rate_hz=50.0)
    capture = build_capture("aravis", settings, clock=MonotonicClock())
    with CameraSource(capture, clock=MonotonicClock(), rate_hz=50.0, role="eye") as source:
        for _ in range(500):
            if source.health().values >= 20:
                break
            threading.Event().wait(0.01)
        reading, health = source.latest(), source.health()
    assert reading is not None
    assert reading.value.left is not None
    assert reading.value.left.shape == (48, 64)
    assert reading.value.left.std() > 5  # it draws a ramp
    assert health.rate_hz == pytest.approx(50.0, rel=0.3)
    assert (health.drops, health.errors) == (0, 0)


def test_a_plug_in_without_its_software_says_what_to_install() -> None:
    with pytest.raises(DeviceError, match="pip install no-such-camera"):
        import_sdk("no_such_camera_sdk", package="no-such-camera")


def test_an_unknown_plug_in_names_the_nearest() -> None:
    assert {"aravis", "depthai", "realsense", "genicam"} <= set(plugin_names())
    with pytest.raises(ConfigError, match="did you mean realsense"):
        build_capture("realsence", PluginSettings(), clock=ManualClock())


def test_a_genicam_camera_asks_for_its_producer() -> None:
    with pytest.raises(ConfigError, match="library"):
        build_capture("genicam", PluginSettings(), clock=ManualClock())
