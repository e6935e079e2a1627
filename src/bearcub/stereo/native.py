"""The compiled core: rectification, semi-global matching of the census in one sweep, refinement.

``native/README.md`` says how it works. It is part of the package where a C++ compiler was at hand
when that was installed; `reason_missing` tells whether it is.
"""

import math
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.matchers import SearchingMatcher, SearchRange

if TYPE_CHECKING:
    from bearcub.stereo import _native

core: Any = None
"""The compiled module itself, None where there is none; ``_native.pyi`` says what is in it."""

_missing = ""
try:
    core = import_module("bearcub.stereo._native")
except ImportError as _error:  # there was no compiler, or it was built for another Python
    _missing = str(_error)

COMPILED = not _missing
"""The compiled core is there."""
MOST_DISPARITIES = 256
_CENSUS = 5  # side of the census's window [px]
_FATTENING = 1.0  # measured: a pixel less than that of blocks of 5 x 5
_LARGEST_STEP = 60  # sums of three paths, 24 + 60 each, stay below the mark for "outside", 255

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
RawPixels = tuple[NDArray[np.int16], NDArray[np.uint16]]
"""Where rectified pixels lie in the raw image: OpenCV's maps of fixed point, whole and shares."""

_Image = TypeVar("_Image", NDArray[np.uint8], NDArray[np.uint16], Pixels)


def reason_missing() -> str:
    """Return why there is no compiled core; empty where there is one."""
    return _missing


def levels() -> list[str]:
    """Return the instruction sets that this machine runs and the core has, the best first."""
    return [] if _missing else core.levels()


@dataclass(frozen=True, slots=True, kw_only=True)
class Smoothness:
    """What changes of disparity cost along a path, in bits of the census.

    Attributes
    ----------
    small_step : int
        Of a change by one disparity along a row, P1.
    small_drop : int
        Of the same from one row to the next: less, since there a floor's disparity does change.
    large_step : int
        Of any larger change where the image is even, P2; at most 60.
    least_step : int
        The least that P2 becomes where the image changes.
    edge_discount : int
        How much less P2 is per four grey levels of change.
    """

    small_step: int = 12
    small_drop: int = 8
    large_step: int = 60
    least_step: int = 16
    edge_discount: int = 10

    def __post_init__(self) -> None:
        steps = (0, self.small_drop, self.small_step, self.least_step, self.large_step)
        if list(steps) != sorted(steps) or self.large_step > _LARGEST_STEP:
            raise InputError(
                f"{self}: expected 0 <= small_drop <= small_step <= least_step <= large_step "
                f"<= {_LARGEST_STEP}"
            )
        if not 0 <= self.edge_discount <= 255:
            raise InputError(f"{self}: expected an edge_discount from 0 to 255")


class NativeMatcher(SearchingMatcher):
    """Semi-global matching [1]_ of the census [2]_ over three paths, compiled.

    Its answer is the same to the bit on every instruction set and for any number of threads.

    Parameters
    ----------
    search : SearchRange
        Disparities to try, 256 at most.
    uniqueness : int
        Margin of the best over the second best match [%]: of all more than three
        disparities away.
    left_right : float
        Largest disagreement of the match from the right image [px], whole pixels.
    speckle_area : int
        Largest connected patch that is taken back [px].
    texture : float
        Least mean absolute gradient along the row around a pixel [grey levels of 8 bits].
    smoothness : Smoothness
        The penalties P1 and P2.
    bits : int
        Of a grey value in images of uint16, 9 to 16.
    threads : int
        That work at the same time, four at most.
    level : str, optional
        One of `levels`; by itself the best.

    Raises
    ------
    InputError
        If a number is out of range or there is no compiled core.

    References
    ----------
    .. [1] H. Hirschmüller: "Stereo processing by semiglobal matching and mutual information",
       IEEE TPAMI 30(2), 2008.
    .. [2] R. Zabih, J. Woodfill: "Non-parametric local transforms for computing visual
       correspondence", ECCV 1994.
    """

    def __init__(
        self,
        search: SearchRange,
        *,
        uniqueness: int = 10,
        left_right: float = 1.0,
        speckle_area: int = 100,
        texture: float = 0.0,
        smoothness: Smoothness | None = None,
        bits: int = 16,
        threads: int = 1,
        level: str | None = None,
    ) -> None:
        _check_core(threads=threads, level=level)
        if search.count > MOST_DISPARITIES:
            raise InputError(
                f"{search.count} disparities to search: the native matcher tries "
                f"{MOST_DISPARITIES} at most; shrink the images or choose another matcher"
            )
        _check_range("smallest disparity", search.smallest, -(2**13), 2**13)
        _check_range("uniqueness", uniqueness, 0, 100)
        _check_range("bits", bits, 9, 16)
        super().__init__(search, window=_CENSUS)
        self.fattening = _FATTENING
        self._bits = bits
        self._settings = {
            "smallest": search.smallest,
            "disparities": search.count,
            **asdict(smoothness or Smoothness()),
            "uniqueness": uniqueness,
            # Both matches are whole pixels here, and rounding parts them by up to one more.
            "left_right": math.ceil(min(left_right, MOST_DISPARITIES)) + 1,
            "texture": texture,
            "speckle_area": speckle_area,
            "speckle_step": 2.0,
            "threads": threads,
            "level": level,
        }
        self._core: _native.Matcher | None = None
        self._shape: tuple[int, ...] = ()

    def __call__(self, left: Pixels, right: Pixels) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched."""
        return self._match(left, right, None)

    def with_confidence(self, left: Pixels, right: Pixels) -> tuple[Float32, UInt8]:
        """Return the disparity and how sure each match is.

        Parameters
        ----------
        left, right : ndarray of uint8 or uint16, shape (H, W), or of uint8, shape (H, W, 3)
            Rectified pair of one size and type, colour as BGR.

        Returns
        -------
        disparity : ndarray of float32, shape (H, W)
            [px]; NaN where unmatched.
        confidence : ndarray of uint8, shape (H, W)
            255 (1 - best / second best): 0 where another match is as good, or there is none.

        Raises
        ------
        InputError
            If they are not two such images.
        """
        confidence = np.empty(left.shape[:2], dtype=np.uint8)
        return self._match(left, right, confidence), confidence

    @property
    def working_memory(self) -> int:
        """What it holds for images of the last size, beyond input and output [bytes]."""
        return 0 if self._core is None else self._core.bytes

    def _match(self, left: Pixels, right: Pixels, confidence: UInt8 | None) -> Float32:
        left, right = _grey(left, name="left"), _grey(right, name="right")
        if left.shape != right.shape or left.dtype != right.dtype:
            raise InputError(
                f"left is {left.dtype} of shape {left.shape} and right {right.dtype} of shape "
                f"{right.shape}: expected one size and type"
            )
        disparity = np.empty(left.shape, dtype=np.float32)
        self._core_for(left).match(left, right, disparity, confidence)
        return disparity

    def _core_for(self, image: Pixels) -> "_native.Matcher":
        """Return the core for images like this one, kept until another size or type comes."""
        bits = 8 if image.dtype == np.uint8 else self._bits
        shape = (*image.shape, bits)
        if self._core is None or shape != self._shape:
            height, width = image.shape
            self._core = core.Matcher(height=height, width=width, bits=bits, **self._settings)
            self._shape = shape
        return self._core


class _OfOneShape:
    """A stage of the core that turns one disparity map into another, made anew for another size."""

    def __init__(self, stage: str, *, threads: int, level: str | None, **settings: float) -> None:
        _check_core(threads=threads, level=level)
        self._make = partial(getattr(core, stage), threads=threads, level=level, **settings)
        self._core: Any = None
        self._shape: tuple[int, ...] = ()

    def _pass(self, left: UInt8, right: UInt8, disparity: Float32) -> Float32:
        if self._core is None or left.shape != self._shape:
            height, width = self._shape = left.shape
            self._core = self._make(height=height, width=width)
        passed = np.empty(disparity.shape, dtype=np.float32)
        self._core.run(_in_rows(left), _in_rows(right), np.ascontiguousarray(disparity), passed)
        return passed


class NativeRefinement(_OfOneShape):
    """`bearcub.stereo.refine.refine`, compiled: the same to a thousandth of a pixel.

    Its answer is the same to the bit on every instruction set and for any number of threads.

    Parameters
    ----------
    threads : int
        That work at the same time.
    level : str, optional
        One of `levels`; by itself the best.

    Raises
    ------
    InputError
        If a number is out of range or there is no compiled core.
    """

    def __init__(self, *, threads: int = 1, level: str | None = None) -> None:
        super().__init__("Refiner", threads=threads, level=level)

    def __call__(self, left: UInt8, right: UInt8, disparity: Float32) -> Float32:
        """Return the disparity, sharpened; see `bearcub.stereo.refine.refine`."""
        return self._pass(left, right, disparity)


class NativeGate(_OfOneShape):
    """`bearcub.stereo.gates.gate`, compiled: the same to the bit.

    Parameters
    ----------
    agreement, contrast, speckle_area
        As there.
    threads : int
        That work at the same time.
    level : str, optional
        One of `levels`; by itself the best.

    Raises
    ------
    InputError
        If a number is out of range or there is no compiled core.
    """

    def __init__(
        self,
        *,
        agreement: float,
        contrast: float,
        speckle_area: int,
        threads: int = 1,
        level: str | None = None,
    ) -> None:
        super().__init__(
            "Gate",
            threads=threads,
            level=level,
            agreement=agreement,
            least=2 * contrast**2,  # of the squared gradients of both images
            speckle_area=max(speckle_area // 4, 1) - 1,  # that goes, at half the size
        )

    def __call__(self, left: UInt8, right: UInt8, disparity: Float32) -> Float32:
        """Return what of the disparity is to be believed; see `bearcub.stereo.gates.gate`."""
        return self._pass(left, right, disparity)


class NativeRemap:
    """``cv2.remap`` of a grey pair, bilinear and black beyond the border, compiled.

    Its answer is OpenCV's to the bit.

    Parameters
    ----------
    left, right : tuple of ndarray
        Of each image where its pixels lie in the raw one of the same size: columns and rows,
        int16 of shape (H, W, 2), and what to add in thirty-seconds of a pixel, uint16 of shape
        (H, W), the row's above five bits for the column's.
    threads : int
        That work at the same time, two at most.
    level : str, optional
        One of `levels`; by itself the best.

    Raises
    ------
    InputError
        If a number is out of range or there is no compiled core.
    """

    def __init__(
        self, left: RawPixels, right: RawPixels, *, threads: int = 1, level: str | None = None
    ) -> None:
        _check_core(threads=threads, level=level)
        self._core = core.Rectifier(
            left=left[0],
            left_shares=left[1],
            right=right[0],
            right_shares=right[1],
            threads=threads,
            level=level,
        )

    def __call__(self, left: UInt8, right: UInt8) -> tuple[UInt8, UInt8]:
        """Return the rectified pair; all of shape (H, W)."""
        rectified = np.empty(left.shape, np.uint8), np.empty(right.shape, np.uint8)
        self._core.rectify(_in_rows(left), _in_rows(right), *rectified)
        return rectified


def _check_core(*, threads: int, level: str | None) -> None:
    if _missing:
        raise InputError(
            f"the native core is not there ({_missing}): reinstall bearcub where there is a C++ "
            "compiler, or choose what needs none"
        )
    if level is not None and level not in levels():
        raise InputError(f"level {level}: this machine runs {', '.join(levels())}")
    _check_range("threads", threads, 1, 1024)


def _check_range(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise InputError(f"{name} = {value}: must be from {low} to {high}")


def _grey(image: Pixels, *, name: str) -> Pixels:
    """Return a grey image that can be matched."""
    if image.ndim == 3 and image.shape[2] == 3 and image.dtype == np.uint8:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16) or not image.size:
        raise InputError(
            f"{name}: expected an image of uint8 or uint16 of shape (H, W), or of uint8 of shape "
            f"(H, W, 3), found {image.dtype} of shape {image.shape}"
        )
    if image.shape[1] >= 2**15:
        raise InputError(f"{name}: {image.shape[1]} columns: at most {2**15 - 1} can be matched")
    return _in_rows(image)


def _in_rows(image: _Image) -> _Image:
    """Return `image` with contiguous rows, which need not lie side by side."""
    sound = image.strides[1] == image.itemsize and image.strides[0] % image.itemsize == 0
    return image if sound else image.copy()
