"""Quick runs over the real recordings, where they are beside the repository."""

from collections.abc import Callable
from pathlib import Path

import pytest

from bearcub.errors import InputError
from bearcub.evaluation import inria, kitti, pothole, sslg
from bearcub.evaluation.mould import measure, read_points
from bearcub.evaluation.poses import nose_down, read_poses
from bearcub.evaluation.real import SETS, evaluate_real
from bearcub.evaluation.runner import Runner, pair
from bearcub.evaluation.table import Row, Section
from bearcub.rig import Rig

Find = Callable[[str], Path]


def by_name(section: Section) -> dict[str, Row]:
    return {row.measure: row for row in section.rows}


def test_floor_of_a_road_is_found_from_a_poor_guess(real: Find) -> None:
    folder = real("inria_road")
    rig = Rig(camera=inria.CAMERA, mount=inria.guessed(2.0, -10.0))
    shot = pair(folder / "left_46.png", folder / "right_46.png")
    ((_, answer),) = Runner().answers(rig, {"46": shot}, name="inria_road")
    assert answer.ground.height == pytest.approx(inria.HEIGHT, rel=0.05)
    assert abs(answer.ground.pitch) < 0.0175  # 1 deg


def test_way_that_the_car_took_is_free_and_the_parked_car_found(real: Find) -> None:
    rows = by_name(kitti.evaluate(real("kitti_odometry"), Runner(), frames=[0, 18, 40]))
    assert rows["frames with height within 5 %"].value == 100.0
    assert rows["false obstacles in the way"].value <= 1
    assert rows["sightings of parked cars found"].value == 100.0


def test_poses_of_the_drive_nod_by_less_than_a_degree(real: Find) -> None:
    pitch = nose_down(read_poses(real("kitti_odometry") / "poses.txt"))
    assert len(pitch) == 51
    assert float(pitch.max() - pitch.min()) == pytest.approx(0.0162, abs=0.0005)  # 0.93 deg


def test_moulds_are_as_large_as_their_authors_say(real: Find) -> None:
    folder = real("pothole")
    one, two = (measure(read_points(folder / f"model{k}/gt/model_1.ply")) for k in (1, 2))
    assert one.depth == pytest.approx(0.040, abs=0.0005)
    assert one.narrowest < 0.077 < 0.082 < one.widest
    assert two.depth == pytest.approx(0.0387, abs=0.0005)


def test_potholes_have_their_rows(real: Find) -> None:
    rows = by_name(pothole.evaluate(real("pothole"), Runner()))
    assert len(rows) == 12
    assert all(rows[f"pair {p.number}: other things called a hole"].passed for p in pothole.PAIRS)


def test_labelled_obstacles_are_found(real: Find) -> None:
    rows = by_name(sslg.evaluate(real("sslg"), Runner()))
    assert all(row.passed is not False for row in rows.values())


def test_set_without_a_folder_is_skipped_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def road(folder: Path, _: Runner) -> Section:
        return Section(name=folder.name, title="Road", about="", rows=(Row(measure="x", value=1),))

    monkeypatch.setitem(SETS, "inria_road", road)
    (tmp_path / "inria_road").mkdir()
    found, skipped = evaluate_real(tmp_path, only=["pothole", "inria_road"])
    assert (found.name, len(found.rows), found.skipped) == ("inria_road", 1, "")
    assert (skipped.name, skipped.rows) == ("pothole", ())
    assert skipped.skipped == f"there is no folder {tmp_path / 'pothole'}"


def test_set_that_lost_a_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "inria_road").mkdir()
    with pytest.raises(InputError, match=r"left_46\.png: no such file"):
        evaluate_real(tmp_path, only=["inria_road"])


def test_folder_without_any_set_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds none of the folders inria_road, kitti_odometry"):
        evaluate_real(tmp_path)
