"""A folder written is the folder read; what is wrong with one is named."""

import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.devices.carmen import read_carmen
from bearcub.errors import BearcubError, FormatError, InputError
from bearcub.geometry import Attitude
from bearcub.messages import Tilt
from bearcub.sim import SKY, folder, ladar, render, scenes
from bearcub.sim.folder import Taken
from bearcub.stereo import read_disparity

RIG = scenes.paper_rig(width=160, height=120)
BODY = Attitude(roll=math.radians(12), pitch=0.0)
TILT = Tilt(roll=BODY.roll, pitch=math.radians(-0.25))
CAN = Taken(
    rendered=render(scenes.garbage_can(), RIG, body=BODY, supersample=1),
    tilt=TILT,
    scan=ladar.sweep(scenes.garbage_can(), BODY, seed=1),
    tags={"kind": "can", "range": 3.05},
)
WALL = ladar.sweep(scenes.wall(), BODY, seed=1)
PIT = Taken(rendered=render(scenes.pit(), RIG, supersample=1))


@pytest.fixture
def written(tmp_path: Path) -> Path:
    place = tmp_path / "scene"
    assert folder.write(place, iter([CAN, PIT]), rig=RIG, title="Two") == 2
    return place


def test_what_was_written_is_read(written: Path) -> None:
    first, second = folder.read(written)
    assert (first.name, second.name) == ("000000", "000001")
    assert first.rig == RIG
    assert first.tilt is not None
    assert (first.tilt.pitch, first.tilt.roll) == pytest.approx((TILT.pitch, TILT.roll), abs=1e-6)
    assert second.tilt is None
    assert first.truth == {**CAN.rendered.truth, "tags": {"kind": "can", "range": 3.05}}
    np.testing.assert_array_equal(cv2.imread(str(first.left)), CAN.rendered.left)
    np.testing.assert_array_equal(cv2.imread(str(second.right)), PIT.rendered.right)


def test_disparity_is_exact_for_everyone_who_reads_pfm(written: Path) -> None:
    first, _ = folder.read(written)
    assert first.disparity is not None
    np.testing.assert_array_equal(read_disparity(first.disparity).disparity, CAN.rendered.disparity)


def test_disparity_is_as_measured_where_the_principal_points_differ(tmp_path: Path) -> None:
    rig = replace(RIG, camera=replace(RIG.camera, doffs=2.5))
    folder.write(tmp_path, [CAN], rig=rig)
    (frame,) = folder.read(tmp_path)
    assert frame.disparity is not None
    np.testing.assert_allclose(
        read_disparity(frame.disparity).disparity + 2.5, CAN.rendered.disparity, atol=1e-5
    )


def test_labels_keep_ground_things_holes_and_sky(written: Path) -> None:
    frames = folder.read(written)
    for frame, taken in zip(frames, (CAN, PIT), strict=True):
        assert frame.labels is not None
        np.testing.assert_array_equal(folder.read_labels(frame.labels), taken.rendered.labels)
    codes = cv2.imread(str(written / "labels" / "000001.png"), cv2.IMREAD_UNCHANGED)
    assert set(np.unique(np.asarray(codes))) == {0, 65535, 32768}
    assert (PIT.rendered.labels == SKY).any()


def test_scans_are_a_carmen_log(tmp_path: Path) -> None:
    ranges = WALL.ranges.copy()
    ranges[[9, 10]] = -np.inf, np.nan
    close = replace(WALL, ranges=ranges)
    folder.write(tmp_path, [CAN, PIT, Taken(rendered=PIT.rendered, scan=close)], rig=RIG)
    (first, can), (third, wall) = read_carmen(tmp_path / "scan.clf")
    assert first == 0.0
    assert third == pytest.approx(2 / 15, abs=1e-5)
    for scan, taken in ((can, CAN.scan), (wall, close)):
        assert taken is not None
        np.testing.assert_allclose(scan.angles, taken.angles, atol=1e-6)
        np.testing.assert_allclose(scan.ranges, taken.ranges, atol=6e-4)
    assert np.isinf(wall.ranges[100:]).any()


def test_only_pairs_rig_and_truth_are_needed(written: Path) -> None:
    (written / "tilt.csv").unlink()
    for part in ("disparity", "labels"):
        for path in (written / part).iterdir():
            path.unlink()
    first, _ = folder.read(written)
    assert (first.tilt, first.disparity, first.labels) == (None, None, None)


def test_folder_of_folders_is_read_one_after_another(written: Path, tmp_path: Path) -> None:
    other = replace(RIG, mount=replace(RIG.mount, height=0.8))
    folder.write(tmp_path / "zoo", [PIT], rig=other)
    heights = [frame.rig.mount.height for frame in folder.read(tmp_path)]
    assert heights == [1.2, 1.2, 0.8]
    assert written.parent == tmp_path


def refused(place: Path, kind: type[BearcubError], *words: str) -> None:
    with pytest.raises(kind) as raised:
        list(folder.read(place))
    for word in words:
        assert word in str(raised.value)


def test_missing_partner_is_named(written: Path) -> None:
    (written / "right" / "000001.png").unlink()
    refused(written, InputError, "left holds 2 pictures, right 1")


def test_missing_reading_is_named(written: Path) -> None:
    (written / "tilt.csv").write_text("pitch,roll\n1,2\n")
    refused(written, InputError, "tilt.csv", "holds 1 readings", "2 frames")


@pytest.mark.parametrize(
    ("text", "words"),
    [("{", "is not JSON"), ("[]", "bearcub.truth/1"), ('{"schema": "x"}', "bearcub.truth/1")],
)
def test_damaged_truth_is_named(written: Path, text: str, words: str) -> None:
    (written / "truth" / "000001.json").write_text(text)
    refused(written, FormatError, "000001.json", words)


def test_missing_truth_is_named(written: Path) -> None:
    (written / "truth" / "000000.json").unlink()
    refused(written, InputError, "000000.json", "cannot be read")


def test_a_folder_that_is_none_is_named(tmp_path: Path) -> None:
    refused(tmp_path, InputError, str(tmp_path), "expected a folder with left, right, rig.toml")
    refused(tmp_path / "nowhere", InputError, "nowhere", "cannot be read")


def test_picture_that_holds_no_labels_is_named(written: Path) -> None:
    with pytest.raises(FormatError, match=r"000000\.png: expected a grey picture of 16 bit"):
        folder.read_labels(written / "left" / "000000.png")


def test_older_frames_make_room_for_new_ones(written: Path) -> None:
    assert folder.write(written, [PIT], rig=RIG) == 1
    (frame,) = folder.read(written)
    assert frame.truth["holes"][0]["kind"] == "pit"


def test_frames_of_somebody_else_are_left_alone(written: Path) -> None:
    (written / "README.md").write_text("My robot in the garden.")
    with pytest.raises(InputError, match="did not write, such as"):
        folder.write(written, [PIT], rig=RIG)
    assert len(list(folder.read(written))) == 2


def test_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: cannot be written"):
        folder.write(tmp_path / "file", [PIT], rig=RIG)


def test_truth_of_a_written_frame_is_plain_json(written: Path) -> None:
    text = (written / "truth" / "000001.json").read_text(encoding="utf-8")
    assert json.loads(text)["holes"][0]["kind"] == "pit"
