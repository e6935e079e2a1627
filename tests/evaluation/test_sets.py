"""What each set of recordings scores, on answers written by hand."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from bearcub.evaluation import inria, kitti, pothole, sslg
from bearcub.evaluation.mould import Mould
from bearcub.evaluation.table import Row
from bearcub.messages import Answer, FreeRange, Ground, Hole, Layers, Limit, Obstacle
from bearcub.rig import Camera, Mount, Rig

MOULD = Mould(depth=0.040, narrowest=0.070, widest=0.090)
PAIR_1 = pothole.PAIRS[0]


def by_name(rows: list[Row]) -> dict[str, Row]:
    return {row.measure: row for row in rows}


def labelled(labels: NDArray[np.int32], disparity: float = 1.0) -> Layers:
    """Return layers where everything is measured at one disparity."""
    return Layers.of(
        disparity=np.full(labels.shape, disparity, dtype=np.float32),
        floor=np.zeros(labels.shape, dtype=np.float32),
        kind=np.zeros(labels.shape, dtype=np.uint8),
        labels=labels,
    )


class TestInria:
    def test_worst_guess_counts(self, make_ground: Callable[..., Ground]) -> None:
        fitted = {
            (1.0, 0.0): make_ground(height=1.28 * 1.02, pitch=math.radians(0.2)),
            (2.0, -10.0): make_ground(height=1.28 * 0.96, pitch=math.radians(-1.1)),
        }
        height, pitch = inria.score(46, fitted)
        assert height.value == pytest.approx(4.0)
        assert pitch.value == pytest.approx(1.1)
        assert [height.passed, pitch.passed] == [True, False]
        assert pitch.note == "deg by guess: 1 m +0 deg 0.20; 2 m -10 deg -1.10"

    def test_guess_that_was_never_corrected_is_no_fit(
        self, make_ground: Callable[..., Ground]
    ) -> None:
        rows = inria.score(46, {(1.28, 0.0): make_ground(seen=False)})
        assert [row.passed for row in rows] == [False, False]


class TestPothole:
    def test_hole_in_its_place_is_found(
        self, make_answer: Callable[..., Answer], make_hole: Callable[..., Hole]
    ) -> None:
        answer = make_answer(holes=(make_hole(box=PAIR_1.box, depth=0.043, width=0.08),))
        rows = by_name(pothole.score(PAIR_1, MOULD, answer))
        assert all(row.passed for row in rows.values())
        assert rows["pair 1: depth error"].value == pytest.approx(3.0)
        assert rows["pair 1: width outside of the mould's"].value == 0.0

    def test_other_holes_are_false_and_one_elsewhere_is_not_it(
        self, make_answer: Callable[..., Answer], make_hole: Callable[..., Hole]
    ) -> None:
        answer = make_answer(holes=(make_hole(box=(0, 0, 100, 100)),))
        rows = by_name(pothole.score(PAIR_1, MOULD, answer))
        assert rows["pair 1: pothole found"].passed is False
        assert rows["pair 1: other things called a hole"].value == 1
        assert rows["pair 1: depth error"].passed is False

    def test_width_may_be_that_from_any_side(self) -> None:
        assert pothole.outside(0.069, MOULD) == pytest.approx(1 / 70)
        assert pothole.outside(0.099, MOULD) == pytest.approx(0.1)
        assert math.isnan(pothole.outside(math.nan, MOULD))


class TestSslg:
    TRUTH = np.ones((40, 60), dtype=np.uint8)
    TRUTH[5:25, 10:25] = 2  # 300 px
    TRUTH[30:34, 40:44] = 2  # 16 px: too small to count

    def scored(self, labels: NDArray[np.int32], answer: Answer) -> list[Row]:
        return sslg.summary({"a": sslg.score(answer, self.TRUTH)})

    def test_obstacle_on_a_label_finds_it(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        labels = np.zeros(self.TRUTH.shape, dtype=np.int32)
        labels[5:15, 10:25] = 1  # its upper half, 150 px
        labels[30:40, 0:10] = 2  # 100 px of drivable ground
        answer = make_answer(
            obstacles=(make_obstacle(id=1), make_obstacle(id=2)), layers=labelled(labels)
        )
        found, false, reported = self.scored(labels, answer)
        assert (found.value, found.note) == (100.0, "covered: a: 50 %")
        assert (false.value, false.passed, false.note) == (1, False, "a: 1")
        assert reported.value == 2

    def test_obstacle_of_two_pieces_does_not_add_up(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        labels = np.zeros(self.TRUTH.shape, dtype=np.int32)
        labels[5:10, 10:25], labels[20:25, 10:25] = 1, 2  # a quarter each
        answer = make_answer(
            obstacles=(make_obstacle(id=1), make_obstacle(id=2)), layers=labelled(labels)
        )
        assert self.scored(labels, answer)[0].value == 0.0

    def test_what_has_no_depth_need_not_be_covered(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        labels = np.zeros(self.TRUTH.shape, dtype=np.int32)
        labels[5:10, 10:25] = 1
        layers = labelled(labels)
        layers.disparity[10:25] = np.nan
        answer = make_answer(obstacles=(make_obstacle(id=1),), layers=layers)
        assert self.scored(labels, answer)[0].note == "covered: a: 100 %"


class TestKitti:
    RIG = Rig(
        camera=Camera(width=30, height=20, fx=30.0, fy=30.0, cx=14.5, cy=9.5, baseline=0.5),
        mount=Mount(height=1.65),
    )

    @staticmethod
    def straight(count: int) -> NDArray[np.float64]:
        poses = np.zeros((count, 3, 4))
        poses[:, :, :3] = np.eye(3)
        poses[:, 2, 3] = np.arange(count)
        return poses

    def answer(self, make_answer: Callable[..., Answer], *obstacles: Obstacle) -> Answer:
        """Return an answer whose obstacles fill their boxes at their distance, on a level floor."""
        labels = np.zeros((20, 30), dtype=np.int32)
        layers = labelled(labels)
        for thing in obstacles:
            u0, v0, u1, v1 = thing.box
            labels[v0 : v1 + 1, u0 : u1 + 1] = thing.id
            layers.disparity[v0 : v1 + 1, u0 : u1 + 1] = 30.0 * 0.5 / thing.distance
        plane = self.RIG.camera.projection.plane(height=1.65, down=np.array([0.0, 1.0, 0.0]))
        ground = replace(make_answer().ground, plane=plane)
        return make_answer(obstacles=obstacles, layers=layers, ground=ground)

    def test_pixels_stand_where_their_disparity_says(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        # column 20 is 5.5 px right of the centre: 5.5 / 30 * 6 m = 1.1 m to the right
        answer = self.answer(make_answer, make_obstacle(distance=6.0, box=(20, 9, 20, 10)))
        positions = kitti.ground_positions(answer, self.RIG, 1)
        assert positions == pytest.approx(np.array([[6.0, -1.1], [6.0, -1.1]]), abs=1e-4)

    def test_thing_whose_nearest_point_is_in_the_way_is_false(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        thing = make_obstacle(x=6.0, y=0.9, distance=6.07, bearing=0.15, box=(0, 0, 1, 1))
        (said,) = kitti.swept(self.answer(make_answer, thing), self.RIG, self.straight(20), 0)
        assert said.startswith("6.1 m, +9 deg")

    def test_thing_that_reaches_into_the_way_is_false(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        # 6 m ahead, from 2.9 m to 0.9 m on the left: one column of eleven within 1 m
        beside = make_obstacle(x=6.0, y=1.3, distance=6.0, box=(0, 5, 7, 9))
        into = make_obstacle(x=6.0, y=1.1, distance=6.0, box=(1, 5, 10, 9))
        poses = self.straight(20)
        assert kitti.swept(self.answer(make_answer, beside), self.RIG, poses, 0) == []
        assert len(kitti.swept(self.answer(make_answer, into), self.RIG, poses, 0)) == 1

    def test_thing_beyond_the_last_pose_may_be_true(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        answer = self.answer(make_answer, make_obstacle(x=6.0, distance=6.0))
        assert len(kitti.swept(answer, self.RIG, self.straight(8), 0)) == 1
        assert kitti.swept(answer, self.RIG, self.straight(8), 3) == []

    def test_free_range_that_ends_on_the_way_is_told(
        self, make_answer: Callable[..., Answer]
    ) -> None:
        def told(limit: Limit, distance: float) -> list[str]:
            free = FreeRange(bearing=np.zeros(1), range=np.array([distance]), limit=(limit,))
            answer = make_answer(free_range=free)
            return kitti.shortened(answer, self.RIG, self.straight(20), 0)

        assert told(Limit.OBSTACLE, 7.0) == ["obstacle at 7.0 m"]
        assert told(Limit.OBSTACLE, 12.5) == []
        assert told(Limit.UNSEEN, 7.0) == []

    def test_parked_car_in_a_larger_thing_is_found_but_not_alone(
        self, make_answer: Callable[..., Answer], make_obstacle: Callable[..., Obstacle]
    ) -> None:
        answer = self.answer(make_answer, make_obstacle(box=(0, 0, 19, 9)))
        assert kitti.found_at(answer, (12, 0, 19, 9)) == (1.0, 0.4)
        assert kitti.found_at(answer, (16, 0, 23, 9)) == (0.5, 40 / 240)
        assert kitti.found_at(answer, (25, 0, 28, 9)) == (0.0, 0.0)
        boxes = {(0, (k, 0, k, 0)): pair for k, pair in enumerate([(1.0, 0.4), (0.4, 0.6), (0, 0)])}
        drive = kitti.Drive(
            frames=np.zeros(1, dtype=np.int64),
            height=np.full(1, 1.65),
            pitch=np.zeros(1),
            in_the_way=(),
            cut_short=(),
            parked=boxes,
        )
        rows = by_name(kitti.score(drive, self.straight(1)))
        assert rows["sightings of parked cars found"].value == pytest.approx(200 / 3)
        assert rows["sightings of parked cars that stand alone"].value == pytest.approx(100 / 3)

    def test_pitch_counts_from_the_first_frame(self) -> None:
        poses = self.straight(3)
        s, c = math.sin(math.radians(1.0)), math.cos(math.radians(1.0))
        poses[1, :, :3] = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])  # nose down by 1 deg
        drive = kitti.Drive(
            frames=np.arange(3),
            height=np.array([1.65, 1.70, 1.80]),
            pitch=np.radians([0.5, 1.5, 0.8]),
            in_the_way=(),
            cut_short=(),
            parked={},
        )
        rows = by_name(kitti.score(drive, poses))
        # differences 0, 0 and 0.3 deg
        assert rows["pitch against the poses, RMS"].value == pytest.approx(0.3 / math.sqrt(3))
        assert rows["frames with height within 5 %"].value == pytest.approx(200 / 3)
        assert rows["frames with height within 5 %"].note == "worst +9.1 % in frame 2"

    def test_drive_without_a_floor_keeps_no_promise(self) -> None:
        nothing = np.full(3, math.nan)
        drive = kitti.Drive(
            frames=np.arange(3),
            height=nothing,
            pitch=nothing,
            in_the_way=(),
            cut_short=(),
            parked={},
        )
        rows = kitti.score(drive, self.straight(3))
        assert [row.passed for row in rows[:2]] == [False, False]
