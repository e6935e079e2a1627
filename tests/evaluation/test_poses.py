"""Signs and frames of a drive: KITTI's axes against ours."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bearcub.errors import FormatError, InputError
from bearcub.evaluation.poses import climb, nose_down, read_poses, way_ahead


def poses_at(*positions: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return poses that look along z at these positions."""
    poses = np.zeros((len(positions), 3, 4))
    poses[:, :, :3] = np.eye(3)
    poses[:, :, 3] = positions
    return poses


def about_x(degrees: float) -> NDArray[np.float64]:
    """Return the turn about x (to the right) that takes y (down) to z: the nose goes up."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def about_y(degrees: float) -> NDArray[np.float64]:
    """Return the turn about y (down) that takes z (ahead) to x: to the right."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def test_nose_down_is_positive_and_heading_does_not_matter() -> None:
    poses = poses_at((0, 0, 0), (0, 0, 0), (0, 0, 0))
    poses[1, :, :3] = about_x(-3.0)
    poses[2, :, :3] = about_y(40.0) @ about_x(2.0)
    assert np.degrees(nose_down(poses)) == pytest.approx([0.0, 3.0, -2.0], abs=1e-9)


def test_road_that_rises_has_a_positive_climb() -> None:
    # y points down: from 0 to -1 in 10 m of way is 1 in 10 up
    poses = poses_at((0, 0, 0), (0, -1.0, 9.95), (0, -2.0, 19.9))
    assert np.degrees(climb(poses, ahead=10.0)) == pytest.approx([5.74] * 3, abs=0.01)


def test_climb_is_that_of_the_stretch_ahead() -> None:
    poses = poses_at(*[(0, -0.1 * max(0, z - 20), z) for z in range(41)])
    ahead = np.degrees(climb(poses, ahead=10.0))
    assert ahead[5] == pytest.approx(0.0, abs=1e-9)
    assert ahead[15] == pytest.approx(np.degrees(np.arctan(0.05)), abs=0.02)
    assert ahead[40] == pytest.approx(np.degrees(np.arctan(0.1)), abs=1e-6)


def test_way_ahead_is_in_the_frame_of_its_own_pose() -> None:
    # Heading 90 deg to the right at (10, 0, 0), then on along the first camera's x, and 1 m to its
    # left, which is the first camera's +z.
    poses = poses_at((0, 0, 0), (10, 0, 0), (14, 0, 1))
    poses[1:, :, :3] = about_y(90.0)
    assert way_ahead(poses, 1) == pytest.approx(np.array([[0.0, 0.0], [4.0, 1.0]]), abs=1e-9)


def test_reads_twelve_numbers_a_line(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 8 0 1 0 9 0 0 1 10")
    assert read_poses(path)[:, :, 3].tolist() == [[5, 6, 7], [8, 9, 10]]


@pytest.mark.parametrize("text", ["1 2 3\n", "1 0 0 5 0 1 0 6 0 0 1 seven\n"])
def test_names_the_line_that_is_no_pose(tmp_path: Path, text: str) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("1 0 0 5 0 1 0 6 0 0 1 7\n" + text)
    with pytest.raises(FormatError, match=r"poses\.txt, line 2"):
        read_poses(path)


def test_missing_poses_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"poses\.txt: cannot be read"):
        read_poses(tmp_path / "poses.txt")
