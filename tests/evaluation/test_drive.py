"""Where the car drove on, nothing stood in the way."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.evaluation.drive import evaluate_drive
from bearcub.evaluation.runner import Runner, Shot
from bearcub.messages import Answer, Obstacle, Snapshot
from bearcub.rig import Camera, Mount, Rig

RIG = Rig(
    camera=Camera(width=30, height=20, fx=20, fy=20, cx=14.5, cy=9.5, baseline=0.1),
    mount=Mount(height=1.0),
)


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Three frames, 2 m of straight road between them."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for k in range(3):
            cv2.imwrite(str(tmp_path / side / f"{k}.png"), np.zeros((20, 30), np.uint8))
    lines = [f"1 0 0 0 0 1 0 0 0 0 1 {2.0 * k}" for k in range(3)]
    (tmp_path / "poses.txt").write_text("\n".join(lines))
    return tmp_path


def runner(*answers: Answer) -> Runner:
    """Return one that gives these answers, whatever it is shown."""

    class Told(Runner):
        def answers(
            self, _rig: Rig, shots: Mapping[str, Shot], *, name: str, config: Any = None
        ) -> Iterator[tuple[Snapshot, Answer]]:
            assert len(shots) == len(answers)
            yield from ((Snapshot(), answer) for answer in answers)

    return Told()


def test_obstacle_where_the_car_then_was_is_false(
    drive: Path, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
) -> None:
    ahead, beside = make_obstacle(x=2.0), make_obstacle(x=2.0, y=3.0)
    answers = [make_answer(obstacles=(thing,)) for thing in (ahead, beside, beside)]
    section = evaluate_drive(drive, RIG, drive / "poses.txt", runner(*answers))
    false, shortened = section.rows
    assert false.value == pytest.approx(1000.0 / 3.0)
    assert false.note.startswith("0: 4.0 m")
    assert (shortened.value, shortened.high) == (0.0, 1000.0)


def test_narrow_vehicle_passes_what_a_wide_one_meets(
    drive: Path, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
) -> None:
    post = make_answer(obstacles=(make_obstacle(x=2.0, y=0.8),))
    none = replace(post, obstacles=())
    for half_width, false in ((1.0, 1000.0 / 3.0), (0.5, 0.0)):
        section = evaluate_drive(
            drive, RIG, drive / "poses.txt", runner(post, none, none), half_width=half_width
        )
        assert section.rows[0].value == pytest.approx(false)


def test_poses_for_every_pair_are_asked_for(drive: Path) -> None:
    (drive / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    with pytest.raises(InputError, match="3 left and 3 right pictures, and 1 poses"):
        evaluate_drive(drive, RIG, drive / "poses.txt", Runner())


def test_folder_without_pictures_names_what_is_expected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="left and right, image_l and image_r"):
        evaluate_drive(tmp_path, RIG, tmp_path / "poses.txt", Runner())
