"""The scan of a mould: its file and its size."""

from pathlib import Path

import numpy as np
import pytest

from bearcub.errors import FormatError, InputError
from bearcub.evaluation.mould import measure, read_points

HEADER = (
    b"ply\nformat binary_little_endian 1.0\ncomment by hand\nelement vertex 2\n"
    b"property float x\nproperty float y\nproperty float z\n"
    b"property uchar red\nproperty uchar green\nproperty uchar blue\n"
    b"element face 0\nproperty list uchar int vertex_indices\nend_header\n"
)
LAYOUT = [("p", "<f4", 3), ("colour", "u1", 3)]
VERTICES = np.array([((1, 2, 3), (9, 9, 9)), ((-4, 5.5, 6), (8, 8, 8))], dtype=LAYOUT)


def test_reads_the_vertices_between_their_colours(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(HEADER + VERTICES.tobytes())
    assert read_points(path).tolist() == [[1.0, 2.0, 3.0], [-4.0, 5.5, 6.0]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (HEADER + VERTICES.tobytes()[:-1], "29 bytes after the header, expected 2 vertices of 15"),
        (HEADER.replace(b"binary_little_endian", b"ascii"), "expected a binary little-endian PLY"),
        (HEADER.replace(b"element vertex 2", b"element edge 2"), "expected `element vertex N`"),
        (HEADER.replace(b"float y", b"float q"), "plain numbers with x, y and z"),
        (b"P5 640 480 255\n", "expected a binary little-endian PLY"),
        (b"", "expected a binary little-endian PLY"),
    ],
)
def test_says_what_is_wrong_with_a_file(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=message):
        read_points(path)


def test_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.ply: cannot be read"):
        read_points(tmp_path / "a.ply")


def test_round_mould_is_equally_wide_from_every_side() -> None:
    turn = np.radians(np.arange(0, 360, 1.0))
    rim = np.stack([40 * np.cos(turn), 40 * np.sin(turn), 0 * turn], axis=1)
    top = rim * [0.2, 0.2, 1] + [0, 0, 35]
    mould = measure(np.concatenate([rim, top]))
    assert mould.depth == pytest.approx(0.035)
    assert (mould.narrowest, mould.widest) == pytest.approx((0.080, 0.080), abs=1e-5)


def test_one_point_that_flies_above_the_scan_is_not_the_top() -> None:
    flat = np.zeros((5000, 3))
    flat[2500:, 2] = 40.0
    flat[-1, 2] = 90.0
    assert measure(flat).depth == pytest.approx(0.040)
