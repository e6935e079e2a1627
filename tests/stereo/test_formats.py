"""Every disparity encoding ends in float32 pixels, NaN unmatched, 0 at infinity."""

import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bearcub.errors import BearcubError, FormatError, InputError
from bearcub.messages import Float32
from bearcub.sim.render import render
from bearcub.sim.scenes import garbage_can, paper_rig
from bearcub.stereo.encodings import Encoding, decode, is_little_endian, read_both_ways
from bearcub.stereo.formats import read_disparity, write_disparity
from bearcub.stereo.pgm import encode_pgm

nan = np.nan
in_one_folder = settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)


def u16(*values: int) -> NDArray[np.uint16]:
    return np.array([values], dtype=np.uint16)


def same(found: Float32, expected: list[float]) -> None:
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found[0], np.array(expected, dtype=np.float32))


@pytest.mark.parametrize(
    ("encoding", "values", "expected"),
    [
        (Encoding.POINTGREY8, np.array([[0, 26, 239, 240, 255]], np.uint8), [0, 26, 239, nan, nan]),
        (Encoding.POINTGREY16, u16(0, 0x1080, 0xFEFF, 0xFF00), [0, 16.5, 254.99609375, nan]),
        (Encoding.OPENCV16, np.array([[0, 24, -16, -17]], np.int16), [0, 1.5, nan, nan]),
        (Encoding.OPENCV16, u16(24, 65520), [1.5, nan]),
        (Encoding.KITTI, u16(0, 256, 65535), [nan, 1, 255.99609375]),
        (Encoding.INTEGER, np.array([[0, 6]], np.uint8), [nan, 6]),
        (Encoding.PIXELS, np.array([[0, 2.5, nan, np.inf, -np.inf]]), [0, 2.5, nan, nan, nan]),
    ],
)
def test_reserved_codes_become_nan(
    encoding: Encoding, values: NDArray[Any], expected: list[float]
) -> None:
    same(decode(values, encoding, name="x"), expected)


def test_opencv_marks_no_match_below_its_smallest_disparity() -> None:
    values = np.array([[-64, -80, 0]], np.int16)  # minDisparity -4: (-4 - 1) * 16 is no match
    same(decode(values, Encoding.OPENCV16, name="x", minimum=-4), [-4, nan, 0])


def test_quarter_pixels_are_scaled() -> None:
    values = np.array([[0, 101]], np.uint8)
    same(decode(values, Encoding.INTEGER, name="x", scale=4), [nan, 25.25])


def test_depth_becomes_disparity() -> None:
    # fx B = 50 px m: 2 m is 25 px; 0 and 65535 are not measured
    found = decode(u16(2000, 0, 65535), Encoding.DEPTH_MM, name="x", focal_baseline=50.0)
    same(found, [25, nan, nan])
    metres = np.array([[2.0, np.inf, nan, 0.0, -1.0, -np.inf, 0.5]], np.float32)
    found = decode(metres, Encoding.DEPTH_M, name="x", focal_baseline=50.0)
    same(found, [25, 0, nan, nan, nan, 100, 100])


def test_depth_without_a_rig_says_what_is_missing() -> None:
    with pytest.raises(InputError, match="needs the rig's focal length and baseline"):
        decode(u16(2000), Encoding.DEPTH_MM, name="x")


def test_an_array_of_another_type_is_refused_with_both_types() -> None:
    with pytest.raises(FormatError, match="x: kitti is stored as uint16, found uint8"):
        decode(np.zeros((2, 2), np.uint8), Encoding.KITTI, name="x")
    with pytest.raises(FormatError, match=r"expected one channel \(H, W\), found .*\(2, 2, 3\)"):
        decode(np.zeros((2, 2, 3), np.uint8), Encoding.INTEGER, name="x")


def fixed_point(disparity: NDArray[Any], *, steps: int = 256) -> NDArray[np.uint16]:
    """Return 8.8 words rounded to so many steps a pixel."""
    words = np.rint(np.clip(disparity, 0, 239) * steps) * (256 // steps)
    return np.asarray(words, dtype=np.uint16)


@given(
    slope=st.floats(0.02, 0.5),
    start=st.floats(0.0, 60.0),
    invalid=st.floats(0.0, 0.6),
    code=st.sampled_from([0xFFFF, 0xFF00, 0xFF10]),
    steps=st.sampled_from([256, 16, 4, 1]),
    seed=st.integers(0, 1000),
)
@settings(deadline=None)
def test_byte_order_is_recognised(
    *, slope: float, start: float, invalid: float, code: int, steps: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    rows = np.arange(120)[:, None]
    words = fixed_point(start + slope * rows + rng.normal(0, 0.3, (120, 160)), steps=steps)
    words[rng.random(words.shape) < invalid] = code
    assert not is_little_endian(words)
    assert is_little_endian(words.byteswap())


@pytest.fixture(scope="module", params=[0.12, 0.03, 0.012])
def rendered_disparity(request: pytest.FixtureRequest) -> Float32:
    """A can 3 m ahead on a floor, by a rig that sees 26, 2 or less than 1 px at the nearest."""
    rig = paper_rig(width=320, height=240)
    camera = replace(rig.camera, baseline=request.param)
    return render(garbage_can(), replace(rig, camera=camera), supersample=1).disparity


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("invalid", [0.0, 0.9])
@pytest.mark.parametrize("steps", [256, 2, 1])
def test_byte_order_is_recognised_in_rendered_maps(
    rendered_disparity: Float32, noise: float, invalid: float, steps: int
) -> None:
    rng = np.random.default_rng(0)
    shape = rendered_disparity.shape
    words = fixed_point(rendered_disparity + rng.normal(0, noise, shape), steps=steps)
    words[rng.random(shape) < invalid] = 0xFF10
    assert not is_little_endian(words)
    assert is_little_endian(words.byteswap())


def test_neighbours_tell_the_byte_order_where_most_disparities_are_below_a_pixel() -> None:
    # 0.0, 0.2 .. 1.4 px from top to bottom: five of eight rows have a whole part of 0
    words = np.repeat(fixed_point(0.2 * np.arange(8)[:, None]), 8, axis=1)
    big, little = read_both_ways(words)
    assert (big.jumps, little.jumps) == (0.0, 1.0)
    assert not is_little_endian(words)
    assert is_little_endian(words.byteswap())


@pytest.mark.parametrize("word", [0, 0xFFFF, 0xFF10, 0x4040])
def test_a_map_that_tells_no_byte_order_is_big_endian(word: int) -> None:
    assert not is_little_endian(np.full((4, 4), word, np.uint16))


def test_a_little_endian_pgm_is_read_and_said_so(tmp_path: Path) -> None:
    rows = np.arange(40)[:, None] * 37 + np.arange(60) + 256
    path = tmp_path / "d.pgm"
    path.write_bytes(encode_pgm(rows.astype(np.uint16).byteswap()))
    read = read_disparity(path)
    assert read.encoding is Encoding.POINTGREY16
    assert read.note == "read as little-endian"
    np.testing.assert_array_equal(read.disparity, (rows / 256).astype(np.float32))
    asked = read_disparity(path, byte_order="little")
    assert asked.note == ""
    np.testing.assert_array_equal(asked.disparity, read.disparity)


@pytest.mark.parametrize(("wanted", "likely"), [("little", "big"), ("big", "little")])
def test_a_byte_order_that_leaves_no_disparity_map_is_refused(
    tmp_path: Path, wanted: Literal["big", "little"], likely: str
) -> None:
    # 37 steps a row: read the other way round, every row jumps by 37 px
    words = fixed_point((np.arange(40)[:, None] * 37 + np.arange(60) + 256) / 256)
    path = tmp_path / "d.pgm"
    path.write_bytes(encode_pgm(words if wanted == "little" else words.byteswap()))
    with pytest.raises(FormatError) as caught:
        read_disparity(path, byte_order=wanted)
    assert str(caught.value) == (
        f"{path}: read as {wanted}-endian, as asked for, 100 % of the disparities jump from "
        f"their neighbours, expected at most 50 %; it looks like {likely}-endian, where 0 % do"
    )


def test_a_byte_order_against_the_evidence_is_obeyed_with_a_note(tmp_path: Path) -> None:
    # whole pixels: read the other way round they are smooth fractions, possible if unlikely
    path = tmp_path / "d.pgm"
    path.write_bytes(encode_pgm(fixed_point(np.arange(40)[:, None] + np.zeros(60))))
    read = read_disparity(path, byte_order="little")
    assert read.disparity[39, 0] == pytest.approx(39 / 256)
    assert read.note == "looks like big-endian; read as little-endian because it was asked for"
    assert read_disparity(path, byte_order="big").note == ""


def test_the_offset_of_an_extended_range_is_added(tmp_path: Path) -> None:
    path = tmp_path / "d.pgm"
    path.write_bytes(encode_pgm(np.array([[10, 255]], np.uint8)))
    same(read_disparity(path, offset=60.0).disparity, [70, nan])


def test_a_16_bit_png_is_kitti_unless_told_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "d.png"
    cv2.imwrite(str(path), u16(512, 0, 2000))
    read = read_disparity(path)
    same(read.disparity, [2, nan, 7.8125])
    assert "KITTI" in read.note
    assert "depth_mm" in read.note
    same(read_disparity(path, encoding="depth_mm", focal_baseline=8.0).disparity, [15.625, nan, 4])


def test_a_signed_tiff_and_npy_are_opencv(tmp_path: Path) -> None:
    steps = np.array([[40, -16]], np.int16)
    cv2.imwrite(str(tmp_path / "d.tiff"), steps)
    np.save(tmp_path / "d.npy", steps)
    for name in ("d.tiff", "d.npy"):
        same(read_disparity(tmp_path / name).disparity, [2.5, nan])


def test_npz_with_one_array_is_read(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "d.npz", np.array([[1.5, np.inf]], np.float32))
    same(read_disparity(tmp_path / "d.npz").disparity, [1.5, nan])
    np.savez(tmp_path / "two.npz", a=np.ones((2, 2)), b=np.ones((2, 2)))
    with pytest.raises(FormatError, match="expected one array, found 2"):
        read_disparity(tmp_path / "two.npz")


def test_pfm_is_read_bottom_up_in_either_byte_order(tmp_path: Path) -> None:
    rows = np.array([[3, 4], [1, np.inf]])  # as stored: the bottom row first
    for scale, order in ((b"-1.0", "<f4"), (b"0.25", ">f4")):
        path = tmp_path / "d.pfm"
        path.write_bytes(b"Pf\n2 2\n" + scale + b"\n" + rows.astype(order).tobytes())
        found = read_disparity(path).disparity
        np.testing.assert_array_equal(found, np.array([[1, nan], [3, 4]], np.float32))


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("d.pfm", b"Pf\n2 2\n-1.0\n1234", "need 16 bytes from offset 12, found 4"),
        ("d.pfm", b"PF\n1 1\n-1.0\n" + bytes(12), "expected a grey PFM"),
        ("d.pfm", b"Pf\n1 1\n0\n1234", "a scale whose sign tells the byte order"),
        ("d.pfm", b"P5 1 1 255 1", "expected the header of a PFM"),
        ("d.npy", b"\x93NUMPY", "is not a NumPy array"),
        ("d.npz", b"PK\x03\x04broken", "is not a NumPy array"),
        ("d.png", b"\x89PNG\r\n\x1a\n" + bytes(40), "the header says 0 x 0 pixels"),
        ("d.png", b"no picture", "cannot be decoded as an image"),
        ("d.tif", b"II*\x00", "cannot be decoded as an image"),
        ("d.pgm", b"", "the file is empty"),
    ],
)
def test_damaged_files_are_one_sentence(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(FormatError, match=words) as caught:
        read_disparity(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_cut_or_altered_png_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "d.png"
    cv2.imwrite(str(path), np.random.default_rng(0).integers(0, 999, (50, 50)).astype(np.uint16))
    whole = path.read_bytes()
    path.write_bytes(whole[:-200])
    with pytest.raises(FormatError, match=r"offset \d+: the chunk b'IDAT' .* truncated"):
        read_disparity(path)
    altered = bytearray(whole)
    altered[len(whole) // 2] ^= 1
    path.write_bytes(altered)
    with pytest.raises(FormatError, match="contradicts its checksum"):
        read_disparity(path)


def test_an_array_that_claims_more_than_the_file_holds_is_refused(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": (10**6, 10**6)}
    np.lib.format.write_array_header_1_0(buffer, header)
    (tmp_path / "d.npy").write_bytes(buffer.getvalue() + bytes(16))
    with pytest.raises(FormatError, match="need 4000000000000 bytes"):
        read_disparity(tmp_path / "d.npy")


def test_what_cannot_be_told_apart_must_be_named(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "d.png"), np.ones((2, 2), np.uint8))
    with pytest.raises(InputError, match=r"uint8 values can mean several things.*integer"):
        read_disparity(tmp_path / "d.png")
    assert read_disparity(tmp_path / "d.png", encoding="integer").disparity[0, 0] == 1


def test_a_missing_file_unknown_suffix_or_encoding_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.pgm: cannot be read: No such file"):
        read_disparity(tmp_path / "none.pgm")
    (tmp_path / "d.jpg").write_bytes(b"x")
    with pytest.raises(InputError, match=r"ending in \.pgm"):
        read_disparity(tmp_path / "d.jpg")
    with pytest.raises(InputError, match="encoding 'kiti': expected one of auto, pointgrey8"):
        read_disparity(tmp_path / "d.jpg", encoding="kiti")


@pytest.mark.parametrize(
    ("encoding", "suffix", "step", "largest"),
    [
        ("pointgrey8", ".pgm", 1.0, 239.0),
        ("pointgrey16", ".pgm", 1 / 256, 254.75),
        ("kitti", ".png", 1 / 256, 255.75),
        ("pixels", ".pfm", 0.0, 900.0),
        ("pixels", ".npy", 0.0, 900.0),
    ],
)
@in_one_folder
@given(data=st.data())
def test_writing_then_reading_keeps_disparity(
    tmp_path: Path, data: st.DataObject, encoding: str, suffix: str, step: float, largest: float
) -> None:
    number = st.one_of(st.floats(0.0, largest, width=32), st.just(0.0), st.just(nan))
    rows = data.draw(st.lists(st.lists(number, min_size=3, max_size=3), min_size=1, max_size=4))
    disparity = np.array(rows, dtype=np.float32)
    path = tmp_path / f"d{suffix}"
    write_disparity(path, disparity, encoding=encoding)
    again = read_disparity(path, byte_order="big").disparity
    np.testing.assert_array_equal(np.isnan(again), np.isnan(disparity))
    # KITTI writes infinity (0) as one step; the others round to half a step.
    allowed = step if encoding == "kitti" else step / 2
    np.testing.assert_allclose(again, disparity, rtol=0, atol=allowed + 1e-6)


def test_disparities_that_do_not_fit_are_refused_with_the_value(tmp_path: Path) -> None:
    for value in (240.0, -3.0):
        with pytest.raises(InputError, match=rf"from 0 to 239.00 px, found {value:.2f} px"):
            write_disparity(tmp_path / "d.pgm", np.array([[value]]), encoding="pointgrey8")
    with pytest.raises(InputError, match=r"pointgrey8 is written to \.pgm, not to '\.png'"):
        write_disparity(tmp_path / "d.png", np.array([[1.0]]), encoding="pointgrey8")
    with pytest.raises(InputError, match="cannot write depth_mm"):
        write_disparity(tmp_path / "d.png", np.array([[1.0]]), encoding="depth_mm")


@in_one_folder
@given(
    suffix=st.sampled_from([".pgm", ".pfm", ".npy", ".npz", ".png", ".tif"]),
    encoding=st.sampled_from(list(Encoding)),
    position=st.integers(0, 10**6),
    byte=st.integers(0, 255),
    cut=st.booleans(),
)
def test_a_damaged_file_is_a_map_or_a_sentence(
    tmp_path: Path, suffix: str, encoding: Encoding, position: int, byte: int, *, cut: bool
) -> None:
    path = tmp_path / f"d{suffix}"
    values = np.arange(12, dtype=np.uint16).reshape(3, 4)
    match suffix:
        case ".pgm":
            path.write_bytes(encode_pgm(values))
        case ".npy":
            np.save(path, values)
        case ".npz":
            np.savez_compressed(path, values)
        case ".pfm":
            write_disparity(path, values.astype(np.float32), encoding="pixels")
        case _:
            cv2.imwrite(str(path), values)
    data = bytearray(path.read_bytes())
    position %= len(data)
    data[position] = byte
    path.write_bytes(data[:position] if cut else data)
    with contextlib.suppress(BearcubError):
        found = read_disparity(path, encoding=encoding, focal_baseline=50.0).disparity
        assert found.dtype == np.float32
        assert not np.isinf(found).any()
