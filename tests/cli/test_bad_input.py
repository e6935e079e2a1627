"""Everything a user can get wrong: one sentence on stderr, exit code 2, no traceback."""

import itertools
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.stereo.pgm import encode_pgm, parse_pgm

WRONG_RIGS = [
    ("baseline = 0.12", "baseline = 120.0", "camera.baseline = 120 m", "millimetres"),
    ("baseline = 0.12", "baseline = -0.12", "camera.baseline = -0.12 m", "exchange left and right"),
    ("height = 1.2", "height = 1200.0", "mount.height = 1200 m", "millimetres"),
    ("width = 320", "width = 640", "320 x 240", "another aspect"),
    ("fx = 193.0", "fx = 0.19", "camera.fx = 0.19", "px"),
    ("fx = 193.0", "fxx = 193.0", "camera.fxx", "fx"),
]


def _refused(outcome: Any, *words: object) -> None:
    """One line that names these words, and nothing on stdout."""
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.startswith("bearcub: error: ")
    assert outcome.err.count("\n") == 1
    for word in words:
        assert str(word) in outcome.err


def test_a_missing_picture_is_named(bearcub: Any, files: Any) -> None:
    outcome = bearcub("detect", "nowhere.png", files.right, "--rig", files.rig)
    _refused(outcome, "nowhere.png", "no such file")


def test_a_picture_that_is_none_is_named(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "text.png"
    path.write_text("not a picture")
    _refused(bearcub("detect", path, files.right, "--rig", files.rig), path, "13 bytes")


def test_sizes_that_differ_are_both_named(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "small.png"
    cv2.imwrite(str(path), files.rendered.right[:200])
    outcome = bearcub("detect", files.left, path, "--rig", files.rig)
    _refused(outcome, path, "320 x 200", "320 x 240")


def test_a_picture_of_another_size_than_its_disparity_is_named(
    bearcub: Any, files: Any, tmp_path: Path
) -> None:
    path = tmp_path / "small.png"
    cv2.imwrite(str(path), files.rendered.left[:120, :160])
    outcome = bearcub("detect", path, "--disparity", files.disparity, "--rig", files.rig)
    _refused(outcome, files.disparity, "320 x 240", "160 x 120")


def test_pictures_without_a_rig_ask_for_one(bearcub: Any, files: Any) -> None:
    _refused(bearcub("detect", files.left, files.right), "--rig")


def test_a_rig_without_pictures_asks_for_them(bearcub: Any, files: Any) -> None:
    _refused(bearcub("detect", "--rig", files.rig), files.rig, "LEFT and RIGHT")


def test_one_picture_asks_for_the_other(bearcub: Any, files: Any) -> None:
    _refused(bearcub("detect", files.left, "--rig", files.rig), files.left, "right image")


def test_a_truncated_map_is_named(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "cut.pgm"
    path.write_bytes(Path(files.disparity).read_bytes()[:-1000])
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig)
    _refused(outcome, path, "153600")


def test_a_map_mangled_by_line_end_conversion_is_named(
    bearcub: Any, files: Any, tmp_path: Path
) -> None:
    path = tmp_path / "mangled.pgm"
    path.write_bytes(Path(files.disparity).read_bytes().replace(b"\n", b"\r\n"))
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig)
    _refused(outcome, path, "CR LF", "binary mode")


def test_a_wrong_byte_order_is_named(bearcub: Any, files: Any) -> None:
    outcome = bearcub(
        "detect", "--disparity", files.disparity, "--rig", files.rig, "--byte-order", "little"
    )
    _refused(outcome, files.disparity, "read as little-endian", "looks like big-endian")


def test_a_map_in_the_other_byte_order_is_recognised(
    bearcub: Any, files: Any, tmp_path: Path
) -> None:
    path = tmp_path / "swapped.pgm"
    words = parse_pgm(Path(files.disparity).read_bytes(), name="disparity").values
    path.write_bytes(encode_pgm(words.byteswap()))
    answers = []
    for given in (files.disparity, path):
        outcome = bearcub("detect", "--disparity", given, "--rig", files.rig, "--json")
        assert outcome.code == 0
        answers.append(json.loads(outcome.out))
    assert f"{path}: read as little-endian" in outcome.err
    assert answers[0]["obstacles"] == answers[1]["obstacles"] != []


def test_a_map_without_any_match_is_named(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "empty.npy"
    np.save(path, np.full((240, 320), np.nan, dtype=np.float32))
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig)
    _refused(outcome, path, "none of the 76800 pixels")


def test_negative_disparities_are_named(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "negative.npy"
    np.save(path, np.full((240, 320), -3.0, dtype=np.float32))
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig)
    _refused(outcome, path, "negative", "swapped")


def test_an_unknown_encoding_lists_the_known(bearcub: Any, files: Any) -> None:
    outcome = bearcub(
        "detect", "--disparity", files.disparity, "--rig", files.rig, "--encoding", "float"
    )
    _refused(outcome, "'float'", "pointgrey16", "depth_mm")


def test_a_swapped_pair_is_told(bearcub: Any, files: Any) -> None:
    outcome = bearcub("detect", files.right, files.left, "--rig", files.rig)
    _refused(outcome, "other order", files.right)


@pytest.mark.parametrize("swapped", [True, False])
def test_an_upside_down_pair_is_told(
    bearcub: Any, files: Any, tmp_path: Path, *, swapped: bool
) -> None:
    """Cameras hung upside down see the pair turned and swapped; software may only turn it."""
    left, right = (tmp_path / name for name in ("left.png", "right.png"))
    cv2.imwrite(str(left), files.rendered.left[::-1, ::-1].copy())
    cv2.imwrite(str(right), files.rendered.right[::-1, ::-1].copy())
    pair = (right, left) if swapped else (left, right)
    outcome = bearcub("detect", *pair, "--rig", files.rig)
    _refused(outcome, *pair, "180 degrees", "upside down")


def test_an_upside_down_map_is_told(bearcub: Any, files: Any, tmp_path: Path) -> None:
    path = tmp_path / "turned.npy"
    np.save(path, files.rendered.disparity[::-1, ::-1].copy())
    outcome = bearcub("detect", "--disparity", path, "--rig", files.rig)
    _refused(outcome, path, "floor is at the top", "upside down")


@pytest.mark.parametrize(("right", "wrong", "found", "hint"), WRONG_RIGS)
def test_a_wrong_rig_is_named(
    bearcub: Any, files: Any, tmp_path: Path, right: str, wrong: str, found: str, hint: str
) -> None:
    path = tmp_path / "rig.toml"
    text = Path(files.rig).read_text()
    assert right in text
    path.write_text(text.replace(right, wrong))
    outcome = bearcub("detect", files.left, files.right, "--rig", path)
    _refused(outcome, path, found, hint)


def test_a_calibration_without_the_mount_asks_for_the_height(
    bearcub: Any, files: Any, tmp_path: Path
) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(Path(files.rig).read_text().partition("# the left camera")[0])
    outcome = bearcub("detect", files.left, files.right, "--rig", path)
    _refused(outcome, path, "--height")


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--pitch", "12deg", ("--pitch", "'12deg'", "degrees")),
        ("--roll", "0.2rad", ("--roll", "'0.2rad'", "degrees")),
        ("--roll", "-120", ("--roll", "-120", "between -90 and 90")),
        ("--pitch", "nan", ("--pitch", "nan", "between -90 and 90")),
        ("--height", "1,2", ("--height", "'1,2'", "number")),
        ("--limit", "0", ("--limit", "'0'", "1 or more")),
        ("--scale", "2", ("scale 2", "0.05 to 1")),
        ("--method", "new", ("--method", "'new'", "classic")),
        ("--nearest", "-1", ("matching.nearest = -1", "from 0 to 100")),
        ("--height", "-1", ("mount.height = -1 m", "more than 0")),
        ("--baseline", "120", ("camera.baseline = 120 m", "millimetres")),
        ("--config", "nowhere.toml", ("nowhere.toml", "cannot be read")),
    ],
)
def test_a_wrong_option_is_named(
    bearcub: Any, files: Any, option: str, value: str, words: tuple[str, ...]
) -> None:
    pair = ("detect", files.left, files.right, "--rig", files.rig)
    _refused(bearcub(*pair, option, value), *words)


def test_a_tilt_in_radians_is_told_by_the_floor(bearcub: Any) -> None:
    # The sample's robot is rolled by 12 deg, 0.2094 rad.
    for pitch in ("0", "0.1"):
        outcome = bearcub("detect", "--pitch", pitch, "--roll", "0.2094")
        _refused(outcome, "--roll 0.2094", "12.0 deg", "radians")


def test_a_tilt_file_in_radians_is_told_by_the_floor(bearcub: Any, tmp_path: Path) -> None:
    path = tmp_path / "tilts.csv"
    path.write_text("pitch,roll\n0.0,0.2094\n")
    _refused(bearcub("detect", "--tilt-file", path), path, "roll 0.2094", "radians")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2,3\n", ("line 1", "'1,2,3'")),
        ("pitch,roll\n1.0,2.0deg\n", ("line 2", "'2.0deg'")),
        ("", ("found none",)),
    ],
)
def test_a_wrong_tilt_file_is_named_with_its_line(
    bearcub: Any, tmp_path: Path, text: str, words: tuple[str, ...]
) -> None:
    path = tmp_path / "tilts.csv"
    path.write_text(text)
    _refused(bearcub("detect", "--tilt-file", path), path, *words)


def test_tilt_is_given_one_way(bearcub: Any, tmp_path: Path) -> None:
    path = tmp_path / "tilts.csv"
    path.write_text("0,0\n")
    _refused(bearcub("detect", "--tilt-file", path, "--pitch", "1"), path, "--pitch and --roll")


def test_an_unknown_key_of_the_configuration_names_the_nearest(
    bearcub: Any, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("[matching]\nneerest = 1.0\n")
    for command in (("detect", "--config", path), ("config", path)):
        _refused(bearcub(*command), path, "neerest", "did you mean nearest")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("out.gif", ("out.gif", ".mp4")),
        ("nowhere/out.png", ("out.png", "no folder")),
    ],
)
def test_a_picture_that_cannot_be_saved_is_told_before_any_work(
    bearcub: Any, files: Any, tmp_path: Path, name: str, words: tuple[str, ...]
) -> None:
    pair = ("detect", files.left, files.right, "--rig", files.rig)
    _refused(bearcub(*pair, "--save", tmp_path / name), *words)


def test_inputs_are_never_overwritten(bearcub: Any, files: Any) -> None:
    pair = ("detect", files.left, files.right, "--rig", files.rig)
    before = Path(files.left).read_bytes()
    _refused(bearcub(*pair, "--save", files.left), files.left, "replace the input")
    assert Path(files.left).read_bytes() == before


def test_one_picture_does_not_hold_a_sequence(bearcub: Any, files: Any, tmp_path: Path) -> None:
    for side, index in itertools.product(("left", "right"), range(2)):
        (tmp_path / side).mkdir(exist_ok=True)
        (tmp_path / side / f"{index}.png").write_bytes(Path(getattr(files, side)).read_bytes())
    outcome = bearcub(
        "detect", tmp_path / "left", tmp_path / "right", "--rig", files.rig, "--save",
        tmp_path / "out.png",
    )  # fmt: skip
    _refused(outcome, "out.png", "a video")


@pytest.mark.parametrize(
    "argv", [(), ("detct",), ("detect", "--unknown"), ("bench", "--size", "4")]
)
def test_a_command_line_that_makes_no_sense_is_one_line_too(
    bearcub: Any, argv: tuple[str, ...]
) -> None:
    _refused(bearcub(*argv), "--help")
