"""The stereo stage: a pair, or a disparity map, becomes one `DisparityMap`."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np

from bearcub.config import Matching
from bearcub.errors import InputError
from bearcub.messages import DisparityMap, Float32, UInt8, as_disparity, as_image
from bearcub.rig.model import Camera, Mount
from bearcub.stereo.artefacts import block_steps, without_blocks, without_frame
from bearcub.stereo.checks import check_disparity, check_order
from bearcub.stereo.choice import matcher_for, refinement
from bearcub.stereo.gates import gate
from bearcub.stereo.grain import without_grain
from bearcub.stereo.images import grey
from bearcub.stereo.matchers import Matcher
from bearcub.stereo.native import COMPILED, NativeGate, core
from bearcub.stereo.rows import TRIES, RowTracker
from bearcub.stereo.search import search_range

_SOUND = 0.5  # share of matched pixels that leaves no doubt of a map
_MANY = 0.6  # share of matched pixels that no swapped pair has
_COMPRESSED = 1.25  # times the steps between JPEG blocks that texture must have
_COARSE = 0.25  # step of the contrast that is asked for [grey levels]


class StereoStage:
    """Match a rectified pair and keep what can be believed.

    Parameters
    ----------
    matcher : Matcher
        Measures disparity.
    doffs : float
        ``cx_right - cx_left`` [px], added to what the matcher measures.
    agreement : float
        Largest share of a patch's texture on which left and right may disagree.
    contrast : float
        Least RMS gradient that counts as texture [grey levels]; more where the images show the
        blocks of a compression.
    speckle_area : int
        Smallest connected patch that is kept [px].
    sharpen : bool
        Register every window once more for an unbiased fraction of a pixel.
    align : bool
        Measure how the rows of the pair are off, and put the right image's right. The first pair
        is matched again where they were.
    threads : int
        That gate and registration use where they are compiled.
    """

    def __init__(
        self,
        matcher: Matcher,
        *,
        doffs: float = 0.0,
        agreement: float = 0.65,
        contrast: float = 0.5,
        speckle_area: int = 100,
        sharpen: bool = True,
        align: bool = True,
        threads: int = 1,
    ) -> None:
        self._matcher = matcher
        self._doffs = doffs
        self._contrast = contrast
        self._gate = cache(
            partial(_gate, agreement=agreement, speckle_area=speckle_area, threads=threads)
        )
        self._sharpen = refinement(threads=threads) if sharpen else None
        self._align = align
        self._rows = RowTracker()
        self._order_settled = False

    @classmethod
    def for_rig(
        cls, camera: Camera, mount: Mount, matching: Matching, *, align: bool = True
    ) -> "StereoStage":
        """Return the stage that `matching` configures for this camera on this mount."""
        search = search_range(camera, mount, nearest=matching.nearest)
        return cls(
            matcher_for(search, matching),
            doffs=camera.doffs,
            agreement=matching.agreement,
            contrast=matching.contrast,
            speckle_area=matching.speckle_area,
            sharpen=matching.sharpen,
            align=align and matching.align,
            threads=matching.threads,
        )

    @property
    def largest(self) -> float:
        """The largest disparity that it can report [px], adjusted for `doffs`."""
        return self._matcher.largest + self._doffs

    def __call__(
        self, left: UInt8, right: UInt8, *, first_row: int = 0, steps: float = 0.0
    ) -> DisparityMap:
        """Match one pair.

        Parameters
        ----------
        left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
            Rectified pair, colour as BGR.
        first_row : int
            Rows above it are left out.
        steps : float
            Between the blocks of the raw images, where these were rectified: see `block_steps`.

        Returns
        -------
        DisparityMap
            Adjusted for `doffs`.

        Raises
        ------
        InputError
            If they are not two images of one size, or are swapped.
        """
        left, right = grey(as_image(left, name="left")), grey(as_image(right, name="right"))
        if left.shape != right.shape:
            raise InputError(
                f"left is {left.shape[1]} x {left.shape[0]} pixels and right "
                f"{right.shape[1]} x {right.shape[0]}: expected one size"
            )
        matched = self._match(left, right, first_row, steps)
        for _ in range(TRIES if self._align else 0):
            if not self._rows.learn(matched):
                break
            matched = self._match(left, right, first_row, steps)
        return replace(matched, epipolar_offset=self._rows.offset)

    def _match(self, left: UInt8, right: UInt8, first_row: int, steps: float) -> DisparityMap:
        """Match two grey images, the right one's rows put right by what is known of them."""
        right = self._rows.rows.undone(right)
        clear = without_grain(left, right)
        rows = np.s_[first_row:]
        found = self._matcher(clear[0][rows], clear[1][rows])
        matched = self._believe(left[rows], right[rows], found, steps)
        if first_row > 0:
            unseen = np.full((first_row, left.shape[1]), np.nan, dtype=np.float32)
            disparity = np.concatenate([unseen, matched.disparity])
            disparity.flags.writeable = False
            matched = replace(matched, disparity=disparity, first_row=first_row)
        grainy = clear[0] is not left
        return replace(matched, left=left, right=right, offset=self._doffs, grainy=grainy)

    def _believe(self, left: UInt8, right: UInt8, found: Float32, steps: float) -> DisparityMap:
        """Gate and sharpen what the matcher found in two grey images."""
        found = without_frame(left, right, found)
        own = block_steps(left)
        if _coarse(own) > self._contrast:
            found = without_blocks(left, found, contrast=_coarse(own))
        contrast = max(self._contrast, _coarse(max(own, steps)))
        disparity = self._gate(contrast=contrast)(left, right, found)
        if not self._order_settled:
            self._order_settled = self._check_order(left, right, disparity)
        if self._sharpen is not None:
            disparity = self._sharpen(left, right, disparity)
        if self._doffs != 0.0:
            disparity += np.float32(self._doffs)
        return _taken(
            disparity,
            smallest=self._matcher.smallest + self._doffs,
            largest=self.largest,
            fattening=self._matcher.fattening,
        )

    def _check_order(self, left: UInt8, right: UInt8, disparity: Float32) -> bool:
        """Tell whether left and right are known not to be swapped; raise when they are."""
        if np.count_nonzero(np.isfinite(disparity)) > _MANY * disparity.size:
            return True
        largest = min(self._matcher.largest, left.shape[1] / 4)
        return check_order(left, right, largest=largest, doffs=self._doffs)


def _coarse(steps: float) -> float:
    """Return the contrast that is asked for where blocks differ by so much [grey levels]."""
    return _COARSE * math.ceil(_COMPRESSED * steps / _COARSE)


def from_disparity(
    disparity: Float32, *, doffs: float = 0.0, name: str = "disparity"
) -> DisparityMap:
    """Take a disparity map that something else has measured.

    Parameters
    ----------
    disparity : ndarray of floats, shape (H, W)
        As measured [px]; NaN or infinite where unmatched, 0 at infinity (``-doffs`` with `doffs`).
        A sound map that is read-only is taken as it is, any other is copied.
    doffs : float
        ``cx_right - cx_left`` [px], added.
    name : str
        What to call it in an error.

    Returns
    -------
    DisparityMap

    Raises
    ------
    InputError
        If it is not a map of floats, nothing is matched, or most disparities are negative.
    """
    adjusted = as_disparity(disparity, name=name)
    if doffs != 0.0 or adjusted.flags.writeable:
        adjusted = adjusted + np.float32(doffs)
    taken = _taken(adjusted, smallest=0.0, largest=math.inf, fattening=0.0)
    if taken.valid_share < _SOUND:
        check_disparity(as_disparity(disparity, name=name) + np.float32(doffs), name=name)
    return taken


def _gate(
    *, contrast: float, agreement: float, speckle_area: int, threads: int
) -> Callable[[UInt8, UInt8, Float32], Float32]:
    """Return the fastest form of the gate that is there; all do the same."""
    if not COMPILED:
        return partial(gate, agreement=agreement, contrast=contrast, speckle_area=speckle_area)
    return NativeGate(
        agreement=agreement, contrast=contrast, speckle_area=speckle_area, threads=threads
    )


def _count_valid(disparity: Float32) -> tuple[int, int]:
    """Return how many disparities are from 0 on and finite, and how many are no numbers."""
    unmatched = int(np.count_nonzero(np.isnan(disparity)))
    # these two leave NaN out, and are quick
    if (
        np.fmin.reduce(disparity, axis=None) >= 0
        and np.fmax.reduce(disparity, axis=None) < math.inf
    ):
        return disparity.size - unmatched, unmatched
    return int(np.count_nonzero((disparity >= 0) & (disparity < math.inf))), unmatched


def _taken(adjusted: Float32, *, smallest: float, largest: float, fattening: float) -> DisparityMap:
    """Make a map of adjusted disparity, its own from now on.

    What lies up to a pixel beyond infinity is infinity; what lies farther beyond, or is infinite,
    is no match.
    """
    valid, unmatched = core.count_valid(adjusted) if COMPILED else _count_valid(adjusted)
    if valid + unmatched < adjusted.size:
        known = (adjusted >= -1.0) & (adjusted < math.inf)
        valid = int(np.count_nonzero(known))
        adjusted = np.where(known, np.maximum(adjusted, np.float32(0)), np.float32(np.nan))
    adjusted.flags.writeable = False
    return DisparityMap(
        disparity=adjusted,
        smallest=max(smallest, 0.0),
        largest=largest,
        valid_share=valid / adjusted.size,
        fattening=fattening,
    )
