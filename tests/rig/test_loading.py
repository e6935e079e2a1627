"""Every calibration format gives the camera it describes; `samples` has an example of each."""

import re
from pathlib import Path

import numpy as np
import pytest

from bearcub.errors import CalibrationError, ConfigError
from bearcub.rig import Rig

SAMPLES = Path(__file__).parent / "samples"
FILES = sorted(path for path in SAMPLES.glob("*/*") if path.stem not in {"right", "extrinsics"})
every_format = pytest.mark.parametrize("path", FILES, ids=[path.parent.name for path in FILES])


def sample(name: str) -> str:
    """Return the text of a sample file."""
    return (SAMPLES / name).read_text(encoding="utf-8")


@every_format
def test_printed_rig_loads_and_prints_the_same(tmp_path: Path, path: Path) -> None:
    rig = Rig.load(path, height=1.5, pitch_deg=3.3)
    printed = tmp_path / "printed.toml"
    printed.write_text(rig.to_toml(), encoding="utf-8")
    again = Rig.load(printed)
    assert again.to_toml() == rig.to_toml()
    assert again.camera == rig.camera
    assert again.lenses == rig.lenses


@every_format
def test_a_folder_stands_for_the_calibration_in_it(path: Path) -> None:
    folder, alone = Rig.load(path.parent, height=1.5), Rig.load(path, height=1.5)
    assert folder.to_toml() == alone.to_toml()
    assert folder.source == alone.source


@every_format
def test_asks_for_the_height_where_the_file_has_no_mount(path: Path) -> None:
    if path.suffix == ".toml":
        assert Rig.load(path).mount.height == 1.2
    else:
        with pytest.raises(ConfigError, match=rf"--height.*{path.name}"):
            Rig.load(path)


def test_toml_gives_camera_and_mount_and_prints_itself() -> None:
    rig = Rig.load(SAMPLES / "toml" / "rig.toml")
    assert rig.to_toml() == sample("toml/rig.toml")
    assert (rig.camera.fx, rig.camera.baseline, rig.mount.height) == (386.0, 0.12, 1.2)
    assert np.degrees(rig.mount.attitude.pitch) == pytest.approx(5.9)
    assert np.degrees(rig.mount.sigma_roll) == pytest.approx(2.5)
    assert rig.mount.sigma_height == 0.02
    assert rig.rectification is None


def test_options_override_the_mount_of_a_toml() -> None:
    mount = Rig.load(SAMPLES / "toml", height=0.8, pitch_deg=0.0, roll_deg=1.0, x=0.0).mount
    assert (mount.height, mount.pitch, mount.x, mount.y) == (0.8, 0.0, 0.0, 0.06)
    assert mount.roll == pytest.approx(np.radians(1.0))


def test_kitti_takes_the_colour_pair_unless_told_otherwise() -> None:
    colour = Rig.load(SAMPLES / "kitti", height=1.65)
    grey = Rig.load(SAMPLES / "kitti", height=1.65, cameras=(0, 1))
    # (P2[3] - P3[3]) / fx and (P0[3] - P1[3]) / fx
    assert colour.camera.baseline == pytest.approx(0.532331, abs=1e-6)
    assert grey.camera.baseline == pytest.approx(0.537166, abs=1e-6)
    assert (grey.camera.width, grey.camera.height) == (0, 0)
    assert grey.mount.pitch == 0.0


def test_kitti_lines_without_names_are_p0_and_p1() -> None:
    camera = Rig.load(SAMPLES / "kitti_bare", height=1.65, size=(1226, 370)).camera
    assert camera.baseline == pytest.approx(0.53715065, abs=1e-8)
    assert (camera.width, camera.cx, camera.cy, camera.doffs) == (1226, 601.8873, 183.1104, 0.0)


def test_kitti_raw_file_names_its_matrices_by_camera_and_has_the_size(tmp_path: Path) -> None:
    matrices = re.sub(r"P(\d):", r"P_rect_0\1:", sample("kitti/calib.txt"))
    path = tmp_path / "calib_cam_to_cam.txt"
    path.write_text(
        f"calib_time: 09-Jan-2012 13:57:47\nS_rect_00: 1.242e+03 3.75e+02\n{matrices}",
        encoding="utf-8",
    )
    camera = Rig.load(path, height=1.65, cameras=(0, 1)).camera
    assert (camera.width, camera.height, camera.fx) == (1242, 375, 718.856)


def test_middlebury_is_in_millimetres_and_keeps_doffs() -> None:
    camera = Rig.load(SAMPLES / "middlebury", height=1.0).camera
    assert camera.baseline == pytest.approx(0.193001)
    assert (camera.width, camera.height, camera.doffs) == (741, 497, 31.086)


def test_ros_pair_of_a_bumblebee() -> None:
    left, right = SAMPLES / "ros" / "left.yaml", SAMPLES / "ros" / "right.yaml"
    rig = Rig.load(left, height=1.0)
    assert rig.camera.baseline == pytest.approx(0.107788, abs=1e-6)
    assert (rig.camera.cx, rig.camera.cy) == (648.988281, 521.579632)
    assert rig.lenses is not None
    assert rig.lenses[0].distortion == (-0.108, 0.152, 0.0004, -0.0007, 0.0)
    assert Rig.load(left, right=right, height=1.0).to_toml() == rig.to_toml()
    assert Rig.load(left, height=1.0, rectified=True).rectification is None


def test_ros_as_echoed_from_a_topic(tmp_path: Path) -> None:
    for side, offset in (("left", 0.0), ("right", -48.0)):
        (tmp_path / f"my_{side}.yaml").write_text(
            "header:\n  frame_id: left\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
            "d: []\nk: [400, 0, 320, 0, 400, 240, 0, 0, 1]\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
            f"p: [400, 0, 320, {offset}, 0, 400, 240, 0, 0, 0, 1, 0]\n---\n",
            encoding="utf-8",
        )
    rig = Rig.load(tmp_path / "my_left.yaml", height=1.0)
    assert rig.camera.baseline == pytest.approx(0.12)
    assert rig.rectification is None, "a pair without distortion is rectified already"


def test_opencv_pair_counts_squares_until_told_their_side() -> None:
    rig = Rig.load(SAMPLES / "opencv", height=1.0, unit=0.025, size=(640, 480))
    assert rig.camera.baseline == pytest.approx(3.34 * 0.025)
    assert (rig.camera.fx, rig.camera.cx, rig.camera.doffs) == (500.0, 330.0, 4.0)
    assert rig.rectification is not None
    assert rig.rectification.right_projection[0, 2] == 334.0
    other_first = SAMPLES / "opencv" / "extrinsics.yml"
    again = Rig.load(other_first, height=1.0, unit=0.025, size=(640, 480))
    assert again.to_toml() == rig.to_toml()


def test_opencv_q_alone_gives_the_camera() -> None:
    camera = Rig.load(SAMPLES / "opencv_q" / "stereo.yml", height=1.0).camera
    assert (camera.fx, camera.cx, camera.cy, camera.width) == (500.0, 330.0, 240.0, 640)
    assert camera.baseline == 0.125  # 1 / Q[3, 2]
    assert camera.doffs == -4.0  # Q[3, 3] B = cx' - cx


def test_opencv_without_p_is_rectified_from_r_and_t(tmp_path: Path) -> None:
    extrinsics = sample("opencv/extrinsics.yml").removeprefix("%YAML:1.0\n---\n")
    path = tmp_path / "calibrated.yml"
    path.write_text(
        sample("opencv/intrinsics.yml") + extrinsics[: extrinsics.index("R1:")], encoding="utf-8"
    )
    with pytest.raises(CalibrationError, match=r"--size \(in .*calibrated\.yml\)"):
        Rig.load(path, height=1.0)
    rig = Rig.load(path, height=1.0, unit=0.025, size=(640, 480))
    assert rig.camera.baseline == pytest.approx(3.34 * 0.025)
    assert rig.camera.doffs == 0.0
    assert rig.lenses is not None


def test_kalibr_chain_is_rectified_from_its_transform() -> None:
    rig = Rig.load(SAMPLES / "kalibr", height=1.0)
    # The rectified baseline is the distance between the cameras, |T_cn_cnm1[:3, 3]|.
    length = np.linalg.norm([-0.1100738, 0.0003991, -0.0008537])
    assert rig.camera.baseline == pytest.approx(length, abs=1e-6)
    assert (rig.camera.width, rig.camera.height) == (752, 480)
    assert rig.lenses is not None
    assert rig.lenses[1].fx == 457.587


@pytest.mark.parametrize("count", [1, 2])
def test_kalibr_fisheye_lenses_keep_the_resolution_of_the_middle(
    tmp_path: Path, count: int
) -> None:
    path = tmp_path / "camchain.yaml"
    text = sample("kalibr/camchain.yaml").replace("radtan", "equidistant", count)
    path.write_text(text, encoding="utf-8")
    rig = Rig.load(path, height=1.0)
    assert rig.lenses is not None
    assert [lens.model for lens in rig.lenses][:count] == ["equidistant"] * count
    assert rig.camera.fx == pytest.approx(457, rel=0.1)


def test_kalibr_cameras_can_be_named_from_right_to_left(tmp_path: Path) -> None:
    path = tmp_path / "camchain.yaml"
    text = sample("kalibr/camchain.yaml").replace("-0.1100738", "0.1100738")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="swapped"):
        Rig.load(path, height=1.0)
    camera = Rig.load(path, height=1.0, cameras=(1, 0)).camera
    assert camera.baseline == pytest.approx(0.11008, abs=1e-4)
