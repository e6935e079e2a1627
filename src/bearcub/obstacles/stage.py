"""The obstacle stage: disparity and floor become things, holes, terrain and free range."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bearcub.geometry import (
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    forward_in_camera,
)
from bearcub.messages import (
    DisparityMap,
    FreeRange,
    Ground,
    Hole,
    Int32,
    Layers,
    Obstacle,
    Terrain,
    Vote,
)
from bearcub.obstacles.cloud import View
from bearcub.obstacles.free_range import free_range
from bearcub.obstacles.holes import find_holes
from bearcub.obstacles.joining import Box, Thing, joined
from bearcub.obstacles.layers import Painter
from bearcub.obstacles.measure import MARGIN, RISEN, STEP, Extent, cut_sides, measure
from bearcub.obstacles.ramps import carries_on, over_a_crest
from bearcub.obstacles.segment import Member, Segments, segment
from bearcub.obstacles.silhouette import with_silhouettes
from bearcub.obstacles.small import small_things
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.obstacles.strips import without_strips
from bearcub.obstacles.surroundings import (
    flaring,
    goes_on_below,
    hidden_below,
    mixed,
    stands_between,
    unseen_beside,
    unseen_between,
)
from bearcub.obstacles.terrain import lie_of_the_land
from bearcub.obstacles.trim import Trimmer
from bearcub.obstacles.verify import Witness, confirmed
from bearcub.rig.model import Mount
from bearcub.robust import median

_SURE = 1.5  # standard errors by which the images must speak for a thing
_SURE_FOOT = 2.0  # ... for one whose foot is lost in the tolerance
_SURE_FEW, _FEW = 2.0, 2  # ... for one of so few times the least pixels: errors are not normal
_SURE_STRAY = 2.5  # ... for what is as small or sparse as stray matches in the air are
_SPARSE = 0.6  # of the share of its outline that a thing must cover, where the images can be asked
_WITNESSED = 2 / 3  # of the sigmas will do where the images can be asked
_TRIMMED = 0.25  # past a silhouette lies the column in which trimming ends, on average [px]
_FEET = 0.25  # 1-sigma of how much wider a thing is at its foot, share of the height that is hidden
_FLARES = 1.5  # ... share of how much wider its lower third is than its upper one
_SEEN_FLARES = 0.3  # ... where the images are asked for the foot, see `with_silhouettes`
_GOES_ON = 0.5  # 1-sigma of how far a thing goes on where nothing is matched, share of the columns
_REFINED = 4.0  # half the window in which a matched map was refined [px]
_ACROSS = 0.9  # share of the columns of ground that goes on beyond both borders
_BEHIND = 1.1  # times as far as two things is what is behind them, at least
_ROUGH = 0.3  # noise of ground in clear images that is the ground's own [px]
_SMALL = 400  # pixels of a thing that may be mixed ones
_LARGE_IMAGE = 200_000  # pixels of an image of which every third column and row is looked at first
_LARGE = 8000  # pixels of a thing that needs no second look at the images


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What the stage found in one frame."""

    obstacles: tuple[Obstacle, ...]
    holes: tuple[Hole, ...]
    terrain: Terrain
    free_range: FreeRange
    layers: Layers


@dataclass(frozen=True, slots=True, kw_only=True)
class _Frame:
    """What every step of one frame looks at; the witnesses are None for a map without its images.

    `clear` is the witness of what stands: without the grain, where there is much.
    """

    disparity: DisparityMap
    ground: Ground
    view: View
    witness: Witness | None
    clear: Witness | None
    sorter: Sorter
    sorting: Sorting
    segments: Segments


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleStage:
    """Find what stands on the floor, what is missing from it and how it lies.

    Attributes
    ----------
    projection : Projection
    mount : Mount
    least_height : float
        Lowest thing that is reported [m].
    least_area : float
        Smallest outline that is reported [m²].
    low_height : float
        What does not rise above it (kerbs, banks) does not join what does [m].
    least_pixels : int
        Smallest thing that is reported [px].
    least_fill : float
        Share of its outline that a thing's pixels must cover.
    farthest : float
        How far to look [m].
    clearance : float
        What hangs higher than this does not block the way [m].
    sigmas : float
        How many sigmas off the floor a pixel must be.
    unevenness : float
        Height of bumps that are still floor [m].
    bias : float
        1-sigma of the disparity error that all pixels of a thing share [px].
    steepest : float
        Steepest ground that is still a way [rad].
    tilt_noise : float
        1-sigma of a tilt reading against gravity [rad].
    bearing_step : float
        Between the directions of the free range [rad].
    """

    projection: Projection
    mount: Mount
    least_height: float
    least_area: float
    low_height: float
    least_pixels: int
    least_fill: float
    farthest: float
    clearance: float
    sigmas: float
    unevenness: float
    bias: float
    steepest: float
    tilt_noise: float
    bearing_step: float

    def __call__(
        self, disparity: DisparityMap, ground: Ground, *, gravity: Float64 | None
    ) -> Findings:
        """Answer the six questions of one frame.

        Parameters
        ----------
        disparity : DisparityMap
        ground : Ground
        gravity : ndarray of float64, shape (3,), or None
            Direction of gravity in optical axes when a tilt sensor told it.

        Returns
        -------
        Findings
        """
        frame = self._frame(disparity, ground)
        obstacles, identities, boxes = self._obstacles(frame)
        holes, regions = find_holes(
            frame.sorter,
            frame.sorting,
            frame.segments,
            identities > 0,
            frame.view,
            ground,
            farthest=self.farthest,
            witness=frame.witness,
            offset=disparity.offset,
            fringe=disparity.fattening + (0.0 if frame.witness is None else _REFINED),
            rough=ground.noise > _ROUGH and not disparity.grainy,
        )
        painter = Painter(
            sorter=frame.sorter,
            segments=frame.segments,
            identities=identities,
            boxes=boxes,
            holes=regions,
        )
        terrain = lie_of_the_land(
            frame.sorting, frame.view, ground, gravity=gravity, tilt_noise=self.tilt_noise
        )
        way = free_range(
            frame.sorting,
            painter,
            obstacles,
            terrain,
            frame.view,
            bearing_step=self.bearing_step,
            farthest=self.farthest,
            clearance=self.clearance,
            steepest=self.steepest,
        )
        return Findings(
            obstacles=obstacles,
            holes=holes,
            terrain=terrain,
            free_range=way,
            layers=Layers(disparity=disparity.disparity, paint=painter),
        )

    @property
    def _focal(self) -> float:
        """Focal length times baseline [px m]."""
        return self.projection.fx * self.projection.baseline

    def _frame(self, disparity: DisparityMap, ground: Ground) -> _Frame:
        """Sort the pixels by the floor and group those above it."""
        d = disparity.disparity
        farthest_level = self._focal / self.farthest
        witness = Witness.of(disparity)
        sorter = Sorter.of(
            d,
            ground,
            sigmas=self.sigmas if witness is None else _WITNESSED * self.sigmas,
            unevenness=self.unevenness,
            farthest_level=farthest_level,
        )
        step = 3 if d.size > _LARGE_IMAGE else 1
        sorting = sorter.part(np.s_[::step], np.s_[::step])
        segments = segment(
            sorting,
            self.projection,
            step=step,
            camera_height=ground.height,
            lean=math.tan(ground.roll),
            least_height=self.least_height,
            low_height=min(self.low_height, 0.5 * ground.height),
            clearance=self.clearance,
            least_pixels=self.least_pixels,
            nearest_level=min(disparity.largest, 0.5 * d.shape[1]),
            farthest_level=farthest_level,
        )
        return _Frame(
            disparity=disparity,
            ground=ground,
            view=self.view(ground),
            witness=witness,
            clear=witness.without_grain() if witness and disparity.grainy else witness,
            sorter=sorter,
            sorting=sorting,
            segments=segments,
        )

    def view(self, ground: Ground) -> View:
        """Return the camera in ``base_link`` over this ground."""
        down = Attitude(roll=ground.roll, pitch=ground.pitch).down()
        return View(
            projection=self.projection,
            base_from_optical=base_from_optical(down, forward_in_camera(self.mount.attitude)),
            origin=np.array([self.mount.x, self.mount.y, ground.height]),
        )

    def _obstacles(self, frame: _Frame) -> tuple[tuple[Obstacle, ...], Int32, dict[int, Box]]:
        """Return the things, numbered from the nearest.

        The second value is the number of the obstacle that each segment is, 0 for none; the third
        is the outline of those that are no segment, by number.
        """
        identities = np.zeros(frame.segments.count + 1, dtype=np.int32)
        boxes: dict[int, Box] = {}
        obstacles: list[Obstacle] = []
        shape, first_row = frame.disparity.disparity.shape, frame.disparity.first_row
        for identity, thing in enumerate(self._whole(frame), start=1):
            identities[list(thing.numbers)] = identity
            if not thing.numbers:
                boxes[identity] = thing.box
            cut = cut_sides(thing.box, shape, first_row=first_row)
            obstacles.append(self._obstacle(identity, thing, cut))
        return tuple(obstacles), identities, boxes

    def _whole(self, frame: _Frame) -> list[Thing]:
        """Return the things between sides as sure as the images, or what is beside them, tell."""
        things = self._things(frame)
        if frame.witness is not None:
            return with_silhouettes(things, frame.witness.left, frame.view)
        return [self._with_doubt(thing, frame) for thing in things]

    def _things(self, frame: _Frame) -> list[Thing]:
        """Measure every segment that counts, and what the images alone show."""
        found: list[Thing] = []
        rising: list[Thing] = []
        shape = frame.disparity.disparity.shape
        for member in self._members(frame):
            extent, sure = self._extent(member, frame)
            if extent is None:
                continue
            box, numbers = _box(member, shape), (member.number,)
            thing = Thing(extent=extent, box=box, pixels=member.pixels, numbers=numbers)
            if extent.climbs:
                rising.append(thing)
            if math.isfinite(sure) and _believed(member, frame, sure=sure):
                found.append(thing)
        found += small_things(
            found,
            frame.witness,
            frame.sorter,
            frame.view,
            offset=frame.disparity.offset,
            least_height=self.least_height,
            least_area=self.least_area,
            bias=self.bias,
        )
        return joined(
            [
                thing
                for thing in found
                if not any(self._goes_on(ramp, thing.extent, frame) for ramp in rising)
            ],
            low=self.low_height,
            unseen=lambda one, other: self._unseen_between(one, other, frame),
            standing=lambda one, other: stands_between(
                frame.sorter, frame.view, one.extent, other.extent
            ),
        )

    def _members(self, frame: _Frame) -> Iterator[Member]:
        """Yield the pixels of every segment, without what a matcher carried past its sides."""
        witness, clear, offset = frame.witness, frame.clear, frame.disparity.offset
        if witness is None or clear is None:
            yield from frame.segments.members(frame.sorter, least=self.least_pixels)
            return
        trim = Trimmer(left=witness.left, right=witness.right, offset=offset)
        for member in frame.segments.members(frame.sorter, least=self.least_pixels, trim=trim):
            yield without_strips(clear, frame.sorter, member, offset=offset)

    def _extent(self, member: Member, frame: _Frame) -> tuple[Extent | None, float]:
        """Measure one segment, if it is large enough.

        The second value is how sure the images must be that it is a thing [standard errors];
        infinitely where its shape tells that it is none.
        """
        d, u, v = frame.disparity.disparity, member.u, member.v
        if member.pixels < self.least_pixels:
            return None, math.inf
        if member.pixels < _SMALL and mixed(d, frame.segments, member):
            return None, math.inf
        own = d.ravel().take(v * d.shape[1] + u)  # several times faster than by pairs
        witnessed, fattening = frame.witness is not None, frame.disparity.fattening
        extent = measure(
            frame.view,
            frame.sorter.surface,
            np.add(u, 0.5 * (member.stride - 1), dtype=np.float64),
            np.add(v, 0.5 * (member.stride - 1), dtype=np.float64),
            own,
            stride=member.stride,
            pixels=member.pixels,
            noise=frame.ground.noise,
            bias=self.bias,
            fattening=fattening,
            fringe=_TRIMMED if witnessed else fattening,
            witnessed=witnessed,
        )
        if self._sure(extent, member.pixels, frame, hangs=False) == math.inf:
            return extent, math.inf  # whatever is below it
        hidden = frame.ground.height * median(frame.sorter.tolerance_at(u, v) / own)
        hangs, least = self._hangs(extent, hidden), _SURE
        if hangs:
            below_the_image = v[-1] >= d.shape[0] - MARGIN
            if below_the_image or hidden_below(d, frame.segments, member):
                hangs = False  # its foot is out of sight
            elif witnessed and goes_on_below(frame.sorter, member):
                hangs, least = False, _SURE_FOOT
        sure = self._sure(extent, member.pixels, frame, hangs=hangs)
        flare = flaring(member) / self.projection.fx
        feet, flares = (0.0, _SEEN_FLARES) if witnessed else (_FEET, _FLARES)
        seen = replace(
            extent,
            bottom=extent.bottom if hangs else 0.0,
            sigma_width=math.hypot(
                extent.sigma_width, feet * hidden, flares * flare * extent.distance
            ),
        )
        return seen, max(sure, least)

    def _sure(self, extent: Extent, pixels: int, frame: _Frame, *, hangs: bool) -> float:
        """Return how sure the images must be that this is a thing; inf for what cannot be one.

        Stray matches fill little of their outline, or hang in the sky.
        """
        witnessed = frame.witness is not None
        # a matcher's window alone makes a thing as wide as itself; a blade of grass has no area
        least = self.least_area if witnessed else 2 * self.least_area
        small = extent.width <= 0.0 or extent.width * extent.top < least
        low = extent.top < self.least_height
        if small or low or extent.climbs or extent.distance > self.farthest:
            return math.inf
        if extent.top < self.low_height and extent.front < RISEN * extent.top:
            return math.inf  # ground that climbs
        if over_a_crest(
            extent,
            frame.ground,
            frame.sorter.surface,
            focal=self._focal,
            carried=frame.disparity.fattening * extent.distance / self.projection.fy,
        ):
            return math.inf
        sparse = witnessed and not hangs  # of what stands, some may be matched in places only
        if extent.fill <= (_SPARSE if sparse else 1.0) * self.least_fill:
            return math.inf
        stray = pixels <= 10 * self.least_pixels or extent.fill <= 2 * self.least_fill
        if (hangs and stray) or extent.fill <= self.least_fill:
            return _SURE_STRAY if witnessed else math.inf
        return _SURE_FEW if pixels <= _FEW * self.least_pixels else _SURE

    def _hangs(self, extent: Extent, hidden: float) -> bool:
        """Tell what hangs; the tolerance hides the lowest part of what stands on the floor."""
        return extent.bottom > max(
            2 * self.least_height + 3 * self.unevenness, min(1.5 * hidden, 0.4)
        )

    def _goes_on(self, ramp: Thing, extent: Extent, frame: _Frame) -> bool:
        """Tell what is only more of a ramp, see `carries_on`."""
        columns = ramp.box[2] + 1 - ramp.box[0]
        along = 2 * frame.ground.noise * extent.distance**2 / self._focal
        return carries_on(
            ramp.extent,
            extent,
            across=columns > _ACROSS * frame.disparity.disparity.shape[1],
            blur=max(along, STEP + 3 * extent.sigma_distance),
            least=self.least_height,
            overhead=self.clearance,
        )

    def _unseen_between(self, one: Thing, other: Thing, frame: _Frame) -> bool:
        """Tell whether what is between two things is out of sight, see `unseen_between`."""
        ends = (x for e in (one.extent, other.extent) for x in (e.range_left, e.range_right))
        farthest = self._focal / (_BEHIND * max(ends))
        return unseen_between(frame.disparity.disparity, one.box, other.box, farthest=farthest)

    def _with_doubt(self, thing: Thing, frame: _Frame) -> Thing:
        """Return a thing whose sides are as doubtful as what is beside them."""
        extent, p = thing.extent, self.projection
        disparity = p.fx * p.baseline / max(extent.distance, 1e-6)
        columns = unseen_beside(frame.disparity.disparity, thing.box, disparity)
        angle = _GOES_ON * math.hypot(*columns) / p.fx
        doubtful = replace(
            extent,
            sigma_bearing=math.hypot(extent.sigma_bearing, 0.5 * angle),
            sigma_width=math.hypot(extent.sigma_width, angle * extent.distance),
        )
        return replace(thing, extent=doubtful)

    def _obstacle(self, identity: int, thing: Thing, cut: tuple[str, ...]) -> Obstacle:
        extent, box, pixels = thing.extent, thing.box, thing.pixels
        weight = min(6.0, math.log(pixels / self.least_pixels) + 0.5)
        remark = f"; cut by the image's {' and '.join(cut)} border" if cut else ""
        return Obstacle(
            id=identity,
            x=extent.x,
            y=extent.y,
            distance=extent.distance,
            bearing=extent.bearing,
            width=extent.width,
            height=extent.top,
            base_height=extent.bottom,
            sigma_distance=extent.sigma_distance,
            sigma_bearing=extent.sigma_bearing,
            sigma_width=math.nan if {"left", "right"} & set(cut) else extent.sigma_width,
            sigma_height=math.nan if "top" in cut else extent.sigma_top,
            confidence=1 / (1 + math.exp(-weight)),
            box=box,
            pixels=pixels,
            truncated=cut,
            votes=(
                Vote(
                    sensor="stereo",
                    vote="for",
                    weight=weight,
                    reason=f"{pixels} px above the floor{remark}",
                ),
            ),
        )


def _believed(member: Member, frame: _Frame, *, sure: float) -> bool:
    """Tell whether a thing is too large to be doubted, or the images are sure of it."""
    return member.pixels > _LARGE or confirmed(
        frame.clear, frame.sorter, member.u, member.v, offset=frame.disparity.offset, sure=sure
    )


def _box(member: Member, shape: tuple[int, int]) -> tuple[int, int, int, int]:
    u, v, more = member.u, member.v, member.stride - 1
    right, bottom = int(u.max()) + more, int(v[-1]) + more
    return int(u.min()), int(v[0]), min(right, shape[1] - 1), min(bottom, shape[0] - 1)
