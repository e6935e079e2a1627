"""The 2005 column analysis in the place of the pipeline: the same answer, with fewer numbers."""

import math

import numpy as np

from bearcub.classic import ClassicAnswer, ClassicConfig, ClassicObject, detect
from bearcub.clock import Clock, MonotonicClock, elapsed_ms
from bearcub.config import Config
from bearcub.errors import InputError
from bearcub.geometry import Attitude, base_from_optical, camera_attitude, forward_in_camera
from bearcub.messages import (
    Answer,
    DisparityMap,
    Float32,
    Float64,
    FreeRange,
    Ground,
    Layers,
    Obstacle,
    Pixel,
    Snapshot,
    Terrain,
    Tilt,
    Timing,
)
from bearcub.rig import Rig
from bearcub.stereo import StereoStage, from_disparity
from bearcub.stereo.rectification import Rectifier


class ClassicPipeline:
    """Answers with `bearcub.classic`: objects alone, and NaN for what it does not know.

    Its floor is where tilt sensor and mount say, as in the paper: the image corrects nothing.

    Parameters
    ----------
    rig : Rig
        Of the size of the snapshots.
    config : Config, optional
        For the matching.
    printed : bool
        Correct the tilt as the paper prints it instead of as it was meant.
    clock : Clock, optional
        For the timing.
    """

    def __init__(
        self,
        rig: Rig,
        config: Config | None = None,
        *,
        printed: bool = False,
        clock: Clock | None = None,
    ) -> None:
        self._rig = rig
        self._printed = printed
        self._clock = clock or MonotonicClock()
        matching = (config or Config()).matching
        self._match = StereoStage.for_rig(rig.camera, rig.mount, matching, align=False)
        self._rectify = Rectifier(rig.rectification) if rig.rectification else None

    def process(self, snapshot: Snapshot) -> Answer:
        """Answer one frame.

        Raises
        ------
        InputError
            If the snapshot holds neither a pair nor a disparity map, or none that can be.
        """
        start_ns = self._clock.now_ns()
        found = self._disparity(snapshot)
        match_ms = elapsed_ms(self._clock, start_ns)
        attitude = camera_attitude(body=_body(snapshot.tilt), mount=self._rig.mount.attitude)
        projection = self._rig.camera.projection
        plane = projection.plane(height=self._rig.mount.height, down=attitude.down())
        config = ClassicConfig.from_plane(plane, shape=found.disparity.shape)
        answer = detect(found.disparity, projection, config=config, printed=self._printed)
        placed = self._placed(answer.objects, attitude)
        total_ms = elapsed_ms(self._clock, start_ns)
        return Answer(
            obstacles=tuple(
                _obstacle(thing, place, number=number, image_width=self._rig.camera.width)
                for number, (place, thing) in enumerate(placed, 1)
            ),
            holes=(),
            terrain=_no_terrain("robot" if snapshot.tilt is None else "gravity"),
            ground=_prior_ground(self._rig, attitude, plane, tilted=snapshot.tilt is not None),
            free_range=FreeRange(bearing=np.zeros(0), range=np.zeros(0), limit=()),
            timing=Timing(
                match=match_ms, ground=math.nan, obstacles=total_ms - match_ms, total=total_ms
            ),
            layers=_layers(answer, [thing for _, thing in placed], found.disparity, plane),
            stamp_ns=snapshot.stamp_ns,
            valid_share=found.valid_share,
        )

    def _disparity(self, snapshot: Snapshot) -> DisparityMap:
        if snapshot.disparity is not None:
            return from_disparity(snapshot.disparity, doffs=self._rig.camera.doffs)
        left, right = snapshot.left, snapshot.right
        if left is None or right is None:
            raise InputError("expected a left and a right image, or a disparity map")
        if self._rectify is not None:
            left, right = self._rectify(left, right)
        return self._match(left, right)

    def _placed(
        self, things: tuple[ClassicObject, ...], attitude: Attitude
    ) -> list[tuple[Float64, ClassicObject]]:
        """Return the objects with their places, nearest first."""
        turn = base_from_optical(attitude.down(), forward_in_camera(self._rig.mount.attitude))
        placed = [(self._place(thing, turn), thing) for thing in things]
        return sorted(placed, key=lambda pair: float(np.hypot(*pair[0])))

    def _place(self, thing: ClassicObject, turn: Float64) -> Float64:
        """Return (x, y) [m] in ``base_link`` of the middle of an object's face."""
        u, v = np.array([thing.peak.centre]), np.array([(thing.top + thing.bottom) / 2])
        level = np.array([float(thing.peak.level)])
        ahead: Float64 = turn @ self._rig.camera.projection.points(u, v, level)[0]
        mount = self._rig.mount
        return np.array([ahead[0] + mount.x, ahead[1] + mount.y])


def _body(tilt: Tilt | None) -> Attitude:
    return (
        Attitude(roll=0.0, pitch=0.0)
        if tilt is None
        else Attitude(roll=tilt.roll, pitch=tilt.pitch)
    )


def _obstacle(thing: ClassicObject, place: Float64, *, number: int, image_width: int) -> Obstacle:
    peak = thing.peak
    borders = {"left": peak.first == 0, "right": peak.last == image_width - 1}
    return Obstacle(
        id=number,
        x=float(place[0]),
        y=float(place[1]),
        distance=float(np.hypot(*place)),
        bearing=math.atan2(place[1], place[0]),
        width=thing.width,
        height=thing.height,
        base_height=math.nan,
        sigma_distance=math.nan,
        sigma_bearing=math.nan,
        sigma_width=math.nan,
        sigma_height=math.nan,
        confidence=math.nan,
        box=(peak.first, thing.top, peak.last, thing.bottom),
        pixels=peak.area,
        truncated=tuple(name for name, cut in borders.items() if cut),
    )


def _prior_ground(rig: Rig, attitude: Attitude, plane: Float64, *, tilted: bool) -> Ground:
    return Ground(
        plane=plane,
        covariance=np.full((3, 3), math.nan),
        height=rig.mount.height,
        pitch=attitude.pitch,
        roll=attitude.roll,
        sigma_height=math.nan,
        sigma_pitch=math.nan,
        sigma_roll=math.nan,
        noise=math.nan,
        source="tilt" if tilted else "mount",
        seen=False,
        residual=math.nan,
        tilt_disagreement=math.nan,
    )


def _no_terrain(reference: str) -> Terrain:
    unknown = math.nan
    return Terrain(
        slope=unknown, cross_slope=unknown, sigma=unknown, roughness=unknown, reference=reference
    )


def _layers(
    answer: ClassicAnswer, things: list[ClassicObject], disparity: Float32, plane: Float64
) -> Layers:
    """Return the per-pixel view: what was cancelled is floor, what has a peak's level obstacle."""
    rows, columns = disparity.shape
    u, v = np.arange(columns), np.arange(rows)[:, np.newaxis]
    kind = np.where(np.isfinite(disparity), Pixel.OTHER, Pixel.UNSEEN).astype(np.uint8)
    kind[answer.kept != answer.levels] = Pixel.FLOOR
    labels = np.zeros(disparity.shape, dtype=np.int32)
    for number, thing in enumerate(things, 1):
        part = np.s_[thing.top : thing.bottom + 1, thing.peak.first : thing.peak.last + 1]
        labels[part][answer.kept[part] == thing.peak.level] = number
    kind[labels > 0] = Pixel.OBSTACLE
    floor = (plane[0] * u + plane[1] * v + plane[2]).astype(np.float32)
    return Layers.of(disparity=disparity, floor=floor, kind=kind, labels=labels)
