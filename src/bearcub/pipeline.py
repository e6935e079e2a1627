"""One frame in, one answer out: the paper's figure as code."""

import math
from functools import cache

import numpy as np

from bearcub.clock import Clock, MonotonicClock, elapsed_ms
from bearcub.config import Config
from bearcub.errors import InputError
from bearcub.ground.fit import Gates
from bearcub.ground.stage import GroundStage, gravity_in_camera
from bearcub.messages import Answer, DisparityMap, Ground, Snapshot, Tilt, Timing, UInt8, as_image
from bearcub.obstacles.stage import ObstacleStage
from bearcub.rig.model import Rig
from bearcub.stereo.artefacts import block_steps
from bearcub.stereo.images import grey
from bearcub.stereo.matchers import Matcher
from bearcub.stereo.rectification import Rectifier
from bearcub.stereo.region import first_row
from bearcub.stereo.stage import StereoStage, from_disparity

_LESSON = 31 * 2**20  # the largest block that teaches glibc is one of 32 MiB


class Pipeline:
    """Answer the six questions of a frame.

    How large, how far, at what angle and how high is each object ahead; how does the ground
    slope; is there a hole.

    Parameters
    ----------
    rig : Rig
        The camera and its mount. Images of another size than the camera's scale it.
    config : Config, optional
    matcher : Matcher, optional
        Replaces the configured one; any callable ``(left, right) -> disparity``.
    clock : Clock, optional
        Measures the stages.

    Examples
    --------
    >>> import cv2, bearcub.sample
    >>> from bearcub import Pipeline, Rig
    >>> sample = bearcub.sample.load()
    >>> pipeline = Pipeline(Rig.load(sample.rig))
    >>> left, right = cv2.imread(str(sample.left)), cv2.imread(str(sample.right))
    >>> answer = pipeline(left, right, roll_deg=12.0)
    >>> [round(thing.distance) for thing in answer.obstacles]
    [3]
    """

    def __init__(
        self,
        rig: Rig,
        config: Config | None = None,
        *,
        matcher: Matcher | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.rig = rig
        self.config = config or Config()
        self._matcher = matcher
        self._clock = clock or MonotonicClock()
        self._shape: tuple[int, int] | None = None
        self._stereo: StereoStage | None = None
        _keep_freed_memory()

    def __call__(
        self,
        left: UInt8,
        right: UInt8,
        *,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
        stamp_ns: int = 0,
    ) -> Answer:
        """Answer one rectified pair with the tilt sensor's reading, if there is one.

        Parameters
        ----------
        left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
        pitch_deg, roll_deg : float, optional
            Of the body against gravity [deg], nose down and right side down positive; when only
            one is given the other is taken as 0.
        stamp_ns : int
        """
        tilt = None
        if pitch_deg is not None or roll_deg is not None:
            tilt = Tilt(pitch=math.radians(pitch_deg or 0.0), roll=math.radians(roll_deg or 0.0))
        return self.process(Snapshot(left=left, right=right, tilt=tilt, stamp_ns=stamp_ns))

    def process(self, snapshot: Snapshot) -> Answer:
        """Answer one snapshot.

        Raises
        ------
        InputError
            If the images do not fit each other or the rig, or nothing can be matched.
        """
        start = self._clock.now_ns()
        return self._answer(snapshot, self.match(snapshot), start_ns=start)

    def match(self, snapshot: Snapshot) -> DisparityMap:
        """Rectify and match a snapshot's pair, or take its disparity map, and no more.

        Raises
        ------
        InputError
            As `process`.
        """
        self._fit_to(snapshot)
        return self._disparity(snapshot)

    def answer(self, snapshot: Snapshot, disparity: DisparityMap) -> Answer:
        """Answer a snapshot whose disparity another pipeline of the same rig has matched.

        Raises
        ------
        InputError
            If the images do not fit the rig.
        """
        start = self._clock.now_ns()
        self._fit_to(snapshot)
        return self._answer(snapshot, disparity, start_ns=start)

    def _answer(self, snapshot: Snapshot, disparity: DisparityMap, *, start_ns: int) -> Answer:
        matched = self._clock.now_ns()
        ground = self._ground(disparity, snapshot.tilt)
        grounded = self._clock.now_ns()
        gravity = (
            None if snapshot.tilt is None else gravity_in_camera(self.rig.mount, snapshot.tilt)
        )
        found = self._obstacles(disparity, ground, gravity=gravity)
        done = self._clock.now_ns()
        return Answer(
            obstacles=found.obstacles,
            holes=found.holes,
            terrain=found.terrain,
            ground=ground,
            free_range=found.free_range,
            layers=found.layers,
            timing=Timing(
                match=(matched - start_ns) * 1e-6,
                ground=(grounded - matched) * 1e-6,
                obstacles=(done - grounded) * 1e-6,
                total=elapsed_ms(self._clock, start_ns),
            ),
            stamp_ns=snapshot.stamp_ns,
            valid_share=disparity.valid_share,
            epipolar_offset=disparity.epipolar_offset,
            notes=_notes(disparity, ground),
        )

    def _disparity(self, snapshot: Snapshot) -> DisparityMap:
        if snapshot.disparity is not None:
            return from_disparity(snapshot.disparity, doffs=self._rig.camera.doffs)
        left = as_image(snapshot.left, name="left")
        right = as_image(snapshot.right, name="right")
        steps = 0.0
        if self._rectify is not None:
            raw = grey(left)
            left, right = self._rectify(raw, grey(right))
            steps = block_steps(raw)
        first_row = self._first_row(snapshot.tilt)
        return self._stereo_stage()(left, right, first_row=first_row, steps=steps)

    def _first_row(self, tilt: Tilt | None) -> int:
        """Return the first row to look at: where one that is lower than the robot can be seen."""
        if not self.config.matching.region_of_interest:
            return 0
        camera, detection = self._rig.camera, self.config.detection
        expected = self._ground.expect(tilt)
        return first_row(
            camera,
            height=expected.height,
            attitude=expected.attitude,
            sigma=expected.sigma,
            clearance=detection.clearance,
            nearest=camera.fx * camera.baseline / min(self._stereo_stage().largest, camera.width),
            farthest=detection.farthest,
        )

    def _fit_to(self, snapshot: Snapshot) -> None:
        """Build the stages for the size of the images; done again only when it changes."""
        first = snapshot.left if snapshot.disparity is None else snapshot.disparity
        if first is None:
            raise InputError("a snapshot needs a left and a right image, or a disparity map")
        rows, columns = first.shape[:2]
        if self._shape == (rows, columns):
            return
        self._rig = self.rig.for_image(width=columns, height=rows)
        self._rectify = (
            None
            if self._rig.rectification is None
            else Rectifier(self._rig.rectification, threads=self.config.matching.threads)
        )
        self._stereo = None
        self._ground = self._ground_stage()
        self._obstacles = self._obstacle_stage()
        self._shape = (rows, columns)

    def _stereo_stage(self) -> StereoStage:
        """Return what matches pairs of this size, built for the first of them."""
        if self._stereo is None:
            camera, mount = self._rig.camera, self._rig.mount
            self._stereo = (
                StereoStage.for_rig(camera, mount, self.config.matching)
                if self._matcher is None
                else StereoStage(self._matcher, doffs=camera.doffs)
            )
        return self._stereo

    def _ground_stage(self) -> GroundStage:
        ground = self.config.ground
        return GroundStage(
            projection=self._rig.camera.projection,
            mount=self._rig.mount,
            gates=Gates(
                height=ground.height_factor,
                pitch=math.radians(ground.pitch_deg),
                roll=math.radians(ground.roll_deg),
            ),
            sigma_height_share=ground.sigma_height_share,
            sigma_mount=math.radians(ground.sigma_mount_deg),
            sigma_tilt=math.radians(ground.sigma_tilt_deg),
            unevenness=ground.unevenness,
            steepest=math.radians(ground.steepest_deg),
            least_support=ground.least_support,
            least_share=ground.least_share,
            noise=ground.noise,
        )

    def _obstacle_stage(self) -> ObstacleStage:
        detection = self.config.detection
        return ObstacleStage(
            projection=self._rig.camera.projection,
            mount=self._rig.mount,
            least_height=detection.least_height,
            least_area=detection.least_area,
            low_height=detection.low_height,
            least_pixels=detection.least_pixels,
            least_fill=detection.least_fill,
            farthest=detection.farthest,
            clearance=detection.clearance,
            sigmas=detection.sigmas,
            unevenness=self.config.ground.unevenness,
            bias=detection.bias,
            steepest=math.radians(self.config.ground.steepest_deg),
            tilt_noise=math.radians(self.config.ground.tilt_noise_deg),
            bearing_step=math.radians(detection.bearing_step_deg),
        )


@cache
def _keep_freed_memory() -> None:
    """Let the arrays of one frame be made of the memory of the last.

    glibc gives freed memory back to the system, and the next frame's arrays begin with hundreds
    of page faults, a seventh of its time. Once a block was freed that was larger than theirs, it
    keeps what is freed, up to twice as much as that block (mallopt(3), "M_MMAP_THRESHOLD"). The
    block itself is never written and costs nothing; other allocators take no notice of it.
    """
    np.empty(_LESSON, dtype=np.uint8)


def _notes(disparity: DisparityMap, ground: Ground) -> tuple[str, ...]:
    """Say what the operator should know of this frame, one sentence each."""
    notes = []
    if not ground.seen:
        notes.append(f"no floor seen: heights rest on the {ground.source} alone")
    if abs(disparity.epipolar_offset) > 0.5:
        notes.append(
            f"the right image is {disparity.epipolar_offset:+.1f} px lower than the left: "
            "expected at most 0.5 px; it is put right, but calibrate or rectify again"
        )
    if math.degrees(ground.tilt_disagreement) > 3.0:
        notes.append(
            f"the tilt reading and the floor in the image disagree by "
            f"{math.degrees(ground.tilt_disagreement):.1f} deg; the image is believed"
        )
    if disparity.valid_share < 0.2:
        notes.append(f"only {100 * disparity.valid_share:.0f} % of the image could be matched")
    return tuple(notes)
