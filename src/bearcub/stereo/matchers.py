"""Matchers: a rectified pair in, disparity out. OpenCV's two, and any callable.

Every matcher also answers the left strip of the image, whose search range reaches beyond the
right image: OpenCV leaves it out, here both images are extended by their border first and matches
that fall outside the right image are taken back.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8, as_disparity
from bearcub.stereo.images import grey, mirrored, shifted

_STEPS = 16  # OpenCV's matchers answer in sixteenths of a pixel


class Matcher(Protocol):
    """Anything that measures disparity.

    Attributes
    ----------
    smallest, largest : float
        The disparities it can report [px], ``u_left - u_right`` as measured.
    fattening : float
        How far it carries a near surface's disparity past its edges [px]: a window that sees a
        near edge at all takes its disparity, so half a block.
    """

    @property
    def fattening(self) -> float:
        """How far a near surface grows past its edges [px]."""
        ...

    @property
    def smallest(self) -> float:
        """The smallest disparity it can report [px]."""
        ...

    @property
    def largest(self) -> float:
        """The largest disparity it can report [px]."""
        ...

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched.

        Parameters
        ----------
        left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
            Rectified pair of one size, colour as BGR.

        Returns
        -------
        ndarray of float32, shape (H, W)
        """
        ...


@dataclass(frozen=True, slots=True)
class SearchRange:
    """Which whole disparities a matcher tries: `count` of them from `smallest` [px]."""

    smallest: int
    count: int

    def __post_init__(self) -> None:
        if self.count < 16 or self.count % 16:
            raise InputError(
                f"{self.count} disparities to search: expected a positive multiple of 16"
            )

    @property
    def largest(self) -> int:
        """The largest disparity tried [px]."""
        return self.smallest + self.count - 1


class SearchingMatcher:
    """What a matcher that tries a range of disparities tells of itself.

    Attributes
    ----------
    smallest, largest : float
        The disparities it can report [px].
    fattening : float
        How far a near surface grows past its edges [px]: half of what is compared.
    """

    def __init__(self, search: SearchRange, *, window: int) -> None:
        self._search = search
        self.smallest: float = search.smallest
        self.largest: float = search.largest
        self.fattening: float = window // 2


class SgbmMatcher(SearchingMatcher):
    """OpenCV's semi-global matcher, three-way variant [1]_.

    Parameters
    ----------
    search : SearchRange
        Disparities to try.
    block_size : int
        Side of the matched block [px], odd.
    uniqueness : int
        Margin of the best over the second best match [%].
    left_right : float
        Largest disagreement of the match from the right image [px], whole pixels.

    References
    ----------
    .. [1] H. Hirschmüller: "Stereo processing by semiglobal matching and mutual information",
       IEEE TPAMI 30(2), 2008. The smoothness penalties 8 b² and 32 b² are those of OpenCV's
       manual for one channel.
    """

    def __init__(
        self,
        search: SearchRange,
        *,
        block_size: int = 5,
        uniqueness: int = 10,
        left_right: float = 1.0,
    ) -> None:
        super().__init__(search, window=block_size)
        self._core = cv2.StereoSGBM.create(
            minDisparity=search.smallest,
            numDisparities=search.count,
            blockSize=block_size | 1,
            P1=8 * block_size**2,
            P2=32 * block_size**2,
            disp12MaxDiff=math.ceil(left_right),
            preFilterCap=0,
            uniquenessRatio=uniqueness,
            speckleWindowSize=0,  # speckles are the gates' business, after the texture's
            mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        )

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched."""
        return _match(self._core, grey(left), grey(right), self._search)


class BmMatcher(SearchingMatcher):
    """OpenCV's block matcher with a left-right check: faster, and sparser on weak texture.

    Parameters
    ----------
    search : SearchRange
        Disparities to try.
    block_size : int
        Side of the matched block [px]; even numbers are raised by one, at least 9.
    uniqueness : int
        Margin of the best over the second best match [%].
    left_right : float
        Largest disagreement of the match from the right image [px].
    """

    def __init__(
        self,
        search: SearchRange,
        *,
        block_size: int = 9,
        uniqueness: int = 10,
        left_right: float = 1.0,
    ) -> None:
        block_size = max(block_size | 1, 9)
        super().__init__(search, window=block_size)
        self._left_right = left_right
        self._core = cv2.StereoBM.create(search.count, block_size)
        self._core.setMinDisparity(search.smallest)
        self._core.setUniquenessRatio(uniqueness)

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched."""
        left, right = grey(left), grey(right)
        forward = _match(self._core, left, right, self._search)
        # Mirrored, the right image is a left one: the same matcher answers for it.
        of_mirrored = _match(self._core, mirrored(right), mirrored(left), self._search)
        backward = np.ascontiguousarray(of_mirrored[:, ::-1])
        return left_right_check(forward, backward, largest_difference=self._left_right)


class CallableMatcher:
    """Any function of (left, right) that returns disparity, held to what matchers promise.

    Parameters
    ----------
    function : callable
        Takes the grey pair, shape (H, W), returns floats of the same shape [px]; NaN or
        infinite where unmatched.
    smallest, largest : float
        The disparities it can report [px].
    fattening : float
        How far it carries a near surface past its edges [px].

    Examples
    --------
    >>> flat = CallableMatcher(lambda left, right: np.full(left.shape, 4.0), smallest=0, largest=8)
    >>> flat(np.zeros((16, 16), np.uint8), np.zeros((16, 16), np.uint8))[0, :5]
    array([nan, nan, nan, nan,  4.], dtype=float32)
    """

    def __init__(
        self,
        function: Callable[[UInt8, UInt8], NDArray[Any]],
        *,
        smallest: float = 0.0,
        largest: float = math.inf,
        fattening: float = 0.0,
    ) -> None:
        self._function = function
        self.smallest = smallest
        self.largest = largest
        self.fattening = fattening

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched.

        Raises
        ------
        InputError
            If the function returns anything but floats of the images' shape.
        """
        answer = as_disparity(self._function(grey(left), grey(right)), name="the matcher's answer")
        if answer.shape != left.shape[:2]:
            raise InputError(
                f"the matcher's answer: expected the images' shape {left.shape[:2]}, "
                f"found {answer.shape}"
            )
        return inside(np.where(np.isfinite(answer), answer, np.float32(np.nan)))


def left_right_check(left: Float32, right: Float32, *, largest_difference: float) -> Float32:
    """Return `left` with NaN where the right image's own match does not point back.

    Parameters
    ----------
    left, right : ndarray of float32, shape (H, W)
        Disparities [px] of the left pixels, and of the right ones; both ``u_left - u_right``.
    largest_difference : float
        Allowed between the two [px].
    """
    there = shifted(right, left, interpolation=cv2.INTER_NEAREST)
    with np.errstate(invalid="ignore"):  # NaN compares false, which is the answer wanted
        agrees = np.abs(left - there) <= largest_difference
    return np.where(agrees, left, np.float32(np.nan))


def _match(core: Any, left: UInt8, right: UInt8, search: SearchRange) -> Float32:
    """Run one of OpenCV's matchers on the pair, its left strip included."""
    before = max(search.smallest + search.count, 0)
    after = max(-search.smallest, 0)
    width = left.shape[1]
    extended = [
        cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE)
        for image in (left, right)
    ]
    steps = core.compute(*extended)[:, before : before + width]
    disparity = steps.astype(np.float32)
    disparity *= 1.0 / _STEPS
    disparity[steps < search.smallest * _STEPS] = np.nan  # OpenCV: (smallest - 1) * 16
    return inside(disparity)


def inside(disparity: Float32) -> Float32:
    """Return `disparity`, changed in place, with NaN where the match is outside the right image.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    """
    width = disparity.shape[1]
    columns = np.arange(width, dtype=np.float32)
    outside = (disparity > columns) | (disparity < columns - (width - 1))
    disparity[outside] = np.nan
    return disparity
