"""Reading one image file: what is accepted, how it is scaled, and every way it can be bad."""

import contextlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.devices.images import IMAGE_SUFFIXES, list_folder, quiet_opencv, read_image
from bearcub.errors import FormatError, InputError

GREY = np.arange(20 * 24, dtype=np.uint8).reshape(20, 24)


def write(path: Path, image: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), image)
    return path


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".tif"])
def test_grey_image_is_read_as_it_is(tmp_path: Path, suffix: str) -> None:
    image = read_image(write(tmp_path / f"grey{suffix}", GREY))
    np.testing.assert_array_equal(image, GREY)
    assert image.dtype == np.uint8


def test_colour_image_is_bgr(tmp_path: Path) -> None:
    blue = np.zeros((16, 16, 3), dtype=np.uint8)
    blue[..., 0] = 200
    np.testing.assert_array_equal(read_image(write(tmp_path / "blue.png", blue)), blue)


# The upper 8 of the bits in use: 4095 >> 4 = 255, 1000 >> 2 = 250, 65535 >> 8 = 255, 200 >> 0
@pytest.mark.parametrize(
    ("brightest", "scaled"), [(4095, 255), (1000, 250), (65535, 255), (16384, 64), (200, 200)]
)
def test_16_bit_image_keeps_the_upper_8_of_its_used_bits(
    tmp_path: Path, brightest: int, scaled: int
) -> None:
    image = np.zeros((16, 16), dtype=np.uint16)
    image[3, 4] = brightest
    read = read_image(write(tmp_path / "deep.png", image))
    assert read.dtype == np.uint8
    assert read[3, 4] == read.max() == scaled


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.png: no such file"):
        read_image(tmp_path / "gone.png")


def test_folder_is_no_image(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder, not a file"):
        read_image(tmp_path)


def test_empty_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.png").touch()
    with pytest.raises(FormatError, match=r"empty\.png: is empty \(0 bytes\)"):
        read_image(tmp_path / "empty.png")


def test_text_is_refused_with_the_formats_that_are_read(tmp_path: Path) -> None:
    (tmp_path / "notes.png").write_text("no picture")
    with pytest.raises(FormatError, match=r"notes\.png: 10 bytes .* \.png \.jpg"):
        read_image(tmp_path / "notes.png")


@pytest.mark.parametrize("suffix", IMAGE_SUFFIXES)
def test_image_that_was_cut_off_is_refused_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str
) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (40, 40, 3), dtype=np.uint8)
    image = noise[..., 0] if suffix == ".pgm" else noise
    path = write(tmp_path / f"cut{suffix}", image)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(FormatError, match=rf"cut\{suffix}: \d+ bytes that are no complete image"):
        read_image(path)
    assert capfd.readouterr() == ("", "")


def test_floating_point_pixels_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "depth.tif", np.ones((16, 16), dtype=np.float32))
    with pytest.raises(FormatError, match=r"depth\.tif: pixels are float32, expected 8 or 16 bit"):
        read_image(path)


@settings(max_examples=60, deadline=None)
@given(
    head=st.sampled_from([b"", b"P5\n", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"]), tail=st.binary()
)
def test_any_bytes_give_an_image_or_our_error(
    tmp_path_factory: pytest.TempPathFactory, head: bytes, tail: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.png"
    path.write_bytes(head + tail)
    try:
        assert read_image(path).dtype == np.uint8
    except FormatError as error:
        assert "any.png" in str(error)  # noqa: PT017


def test_folder_lists_numbers_in_their_order_and_no_hidden_or_other_files(tmp_path: Path) -> None:
    for name in ("img_10.png", "img_9.png", "img_1.PNG", "._img_1.png", "calib.txt", "b.jpg"):
        (tmp_path / name).touch()
    found = list_folder(tmp_path, IMAGE_SUFFIXES)
    assert [path.name for path in found] == ["b.jpg", "img_1.PNG", "img_9.png", "img_10.png"]


def test_folder_without_images_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no file that ends in \.png"):
        list_folder(tmp_path, IMAGE_SUFFIXES)


def test_two_files_of_one_frame_are_refused(tmp_path: Path) -> None:
    (tmp_path / "7.png").touch()
    (tmp_path / "7.jpg").touch()
    with pytest.raises(InputError, match=r"holds both 7\.jpg and 7\.png"):
        list_folder(tmp_path, IMAGE_SUFFIXES)


def test_opencv_speaks_again_when_the_last_of_two_overlapping_readers_is_done() -> None:
    logging = getattr(cv2.utils, "logging", cv2)
    level = logging.getLogLevel()
    assert level > 0
    first, second = quiet_opencv(), quiet_opencv()
    with contextlib.ExitStack() as late:
        with first:
            late.enter_context(second)
        assert logging.getLogLevel() == 0
    assert logging.getLogLevel() == level
