"""PGM files are read exactly, and damaged ones are refused with one sentence."""

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from bearcub.errors import BearcubError, FormatError
from bearcub.stereo.pgm import encode_pgm, parse_pgm

EIGHT = b"P5\n3 2\n255\n\x00\x01\x02\x0a\xf0\xff"


def test_reads_eight_bits_row_by_row() -> None:
    pgm = parse_pgm(EIGHT, name="x")
    assert pgm.values.dtype == np.uint8
    assert pgm.values.tolist() == [[0, 1, 2], [10, 240, 255]]


def test_reads_sixteen_bits_most_significant_byte_first() -> None:
    pgm = parse_pgm(b"P5 2 1 65535 \x10\x80\xff\x00", name="x")
    assert pgm.values.dtype == np.uint16
    assert pgm.values.tolist() == [[0x1080, 0xFF00]]


def test_reads_comments_anywhere_in_the_header() -> None:
    data = b"P5 # made by hand\n# 9 9\n2\n#\n1 # rows\n255\n\x05\x06"
    assert parse_pgm(data, name="x").values.tolist() == [[5, 6]]


def test_reads_plain_numbers() -> None:
    assert parse_pgm(b"P2\n2 2\n300\n1 2\n 3\t300\n", name="x").values.tolist() == [
        [1, 2],
        [3, 300],
    ]


def test_a_header_with_crlf_whose_raster_fits_is_taken_at_its_word() -> None:
    # A single white space ends the header: the line feed belongs to the raster, one byte too many.
    with pytest.raises(FormatError, match="1 line feeds were turned into CR LF"):
        parse_pgm(b"P5\r\n2 1\r\n255\r\n\x05\x06", name="x")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"P6 1 1 255 \x00\x00\x00", "x: expected a PGM beginning with P5 or P2, found b'P6'"),
        (b"", "found b''"),
        (b"P5 3 2 255 \x00\x01", "6 bytes from offset 11, found 2: the file is truncated, 4"),
        (EIGHT + b"\x00\x00", "found 8: 2 bytes too many"),
        (b"P5 99999 2 255 ", "the header says 99999 x 2 pixels, expected 1 to 32768"),
        (b"P5 30000 30000 65535 ", "need 1800000000 bytes"),
        (b"P5 0 2 255 ", "the header says 0 x 2"),
        (b"P5 2 2 0 1234", "largest value 0"),
        (b"P5 2 2 65536 1234", "largest value 65536"),
        (b"P5 two 2 255 ", "offset 3: expected the width in decimal digits, found b'two 2 25'"),
        (b"P5 2", "expected the height"),
        (b"P5 2 1 255x", "offset 10: expected white space after the header, found b'x'"),
        (b"P5 2 1 15 \x0f\x10", "row 0, column 1 holds 16, more than .* 15"),
        (b"P2 2 1 15 3 16", "row 0, column 1 holds 16"),
        (b"P2 2 1 255 3", "need 2 numbers from offset 11, found 1"),
        (b"P2 2 1 255 3 -1", "pixel 1 .* found b'-1'"),
        (b"P2 2 1 65535 3 99999", "pixel 1 .* found b'99999'"),
    ],
)
def test_damage_is_one_sentence(data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=words) as caught:
        parse_pgm(data, name="x")
    assert "\n" not in str(caught.value)


def test_line_feeds_turned_into_crlf_are_told_apart_from_other_damage() -> None:
    values = np.arange(256 * 4, dtype=np.uint16).astype(np.uint8).reshape(4, 256)
    good = encode_pgm(values)
    # Three line feeds end the header's lines; the last one's CR takes the single white space, so
    # its LF is the first byte too many; the raster holds the byte 0x0A four times.
    with pytest.raises(FormatError, match="5 line feeds were turned into CR LF by a text-mode"):
        parse_pgm(good.replace(b"\n", b"\r\n"), name="x")
    with pytest.raises(FormatError, match="5 bytes too many"):
        parse_pgm(good + b"12345", name="x")


def test_crlf_turned_into_line_feeds_is_told_apart_from_a_cut() -> None:
    values = np.full((100, 100), 10, dtype=np.uint8)
    values[:4, :2] = (13, 10)
    data = encode_pgm(values)
    with pytest.raises(FormatError, match="4 are missing and no CR LF is left"):
        parse_pgm(data.replace(b"\r\n", b"\n"), name="x")
    with pytest.raises(FormatError, match="truncated, 4 bytes are missing"):
        parse_pgm(data[:-4], name="x")


@given(
    arrays(st.sampled_from([np.uint8, np.uint16]), array_shapes(min_dims=2, max_dims=2, max_side=9))
)
def test_what_is_written_is_read(values: NDArray[np.uint8]) -> None:
    again = parse_pgm(encode_pgm(values), name="x").values
    assert again.dtype == values.dtype
    np.testing.assert_array_equal(again, values)


@given(st.sampled_from([b"", b"P5", b"P5 2 2 255 ", b"P2 2 2 9 "]), st.binary(max_size=80))
def test_any_bytes_are_an_image_or_a_sentence(start: bytes, data: bytes) -> None:
    with contextlib.suppress(BearcubError):
        parse_pgm(start + data, name="x")


@given(st.integers(0, len(EIGHT) - 1), st.integers(0, 255))
def test_a_file_with_one_changed_byte_is_an_image_or_a_sentence(position: int, byte: int) -> None:
    damaged = bytearray(EIGHT)
    damaged[position] = byte
    with contextlib.suppress(BearcubError):
        parse_pgm(bytes(damaged), name="x")
