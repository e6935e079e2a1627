"""Rows of a pair put on each other: what a rectification leaves is measured and undone.

Real calibrations leave a fifth of a row between the images, more when a lens warms or a mount
bends. Matchers hardly mind, but on an edge nearly along the row, as that of a shadow or a painted
line, it looks like pixels of disparity. What the right image `R` shows at a match is what the left
one `L` shows ``e`` rows farther up, so that with the gradients ``g_u`` and ``g_v`` along row and
column the two differ by ``D = R - L = -e g_v - h g_u`` to first order [1]_, ``h`` being what the
disparity is off. Over a cell in which both are the same, least squares give

    ``e = -(S_vD S_uu - S_uD S_uv) / (S_vv S_uu - S_uv^2)``.

Products of gradients are those of one image with the other, whose noises do not know of each
other: noise alone adds nothing to them. A bilinear surface through the cells is what is undone.

References
----------
.. [1] B. D. Lucas, T. Kanade: "An iterative image registration technique with an application to
   stereo vision", IJCAI 1981.
.. [2] R. G. Keys: "Cubic convolution interpolation for digital image processing", IEEE Transactions
   on Acoustics, Speech, and Signal Processing 29, 1981.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Bool, DisparityMap, Float32, UInt8
from bearcub.robust import median
from bearcub.stereo.epipolar import epipolar_offset
from bearcub.stereo.native import COMPILED, core

_CELL = (16, 8)  # columns and rows that are off alike [px]
_MARGIN = 5  # rows above and below a cell that its gradients need [px]
_BLUR = 1.0  # deviation: differences are gradients in smooth images alone [px]
_SLOPE = np.array([1, -8, 0, 8, -1], dtype=np.float32) / 12  # exact for polynomials of degree 4
_AT_FIRST, _LATER = 720, 110  # cells that are looked at, about
_FEWEST = 20  # cells that say something together
_KNOWN = 0.5  # share of a cell that must be matched
_ACROSS = 0.5  # mean square gradient along the row below which it explains nothing [grey levels^2]
_FLAT = 0.1  # ... across it that rounding leaves
_OUTLIER = 4.0  # deviations of the difference beyond which it says no more
_TOGETHER = 5.0  # how much larger errors are than cells of independent errors would make them
_PRIOR = np.diag([1.0, 2.0, 4.0, 4.0])  # information: the terms are seldom 1, 0.7, 0.5, 0.5 px
_KEPT = 0.98  # of what earlier frames said, with every frame
_LEAST = 1e-3 * np.eye(4)  # of what is solved for, so that it has a solution
_STEPS = 5
TRIES = 3  # matches of one pair at most after the first until its rows fit
_FITS = 0.02  # what is not undone with the first pair [px]
_NEGLIGIBLE = 0.05  # ... when more is learnt with later ones
_BENT = 1.0  # squared standard errors by which something has bent; steady cameras reach 0.6
_COARSE = 0.5  # what gradients cannot tell any more [px]

Values = NDArray[np.float64]
Index = NDArray[np.int64]
_Image = TypeVar("_Image", Float32, Bool)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """By how many rows the right image lies lower than the left one.

    With x and y from -1 to 1 across and down the image, by ``shift + turn x + stretch y + twist x
    y``: to first order what is left of a camera's pitch, of its roll, of its focal length and of
    its yaw.

    Attributes
    ----------
    shift, turn, stretch, twist : float
        [px].
    """

    shift: float = 0.0
    turn: float = 0.0
    stretch: float = 0.0
    twist: float = 0.0

    def terms(self) -> Values:
        """Return the four [px]."""
        return np.array([self.shift, self.turn, self.stretch, self.twist])

    def beside(self, other: "Rows") -> float:
        """Return by how much these rows differ from others at most [px]."""
        return float(np.abs(self.terms() - other.terms()).sum())

    def undone(self, right: UInt8, *, compiled: bool = COMPILED) -> UInt8:
        """Return a right image with its rows where the left image has them.

        Parameters
        ----------
        right : ndarray of uint8, shape (H, W)
            Grey; what it shows is interpolated by cubic convolution [2]_.
        compiled : bool
            By the native core, ``native/src/rectify_kernels.cpp``; else by OpenCV, which rounds
            rows to thirty-seconds.
        """
        if self == Rows():
            return right
        height, width = right.shape
        if not compiled:
            u, v = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
            x, y = _centred(u, width), _centred(v, height)[:, None]
            rows = v[:, None] + self.shift + self.turn * x + (self.stretch + self.twist * x) * y
            row, column = rows.astype(np.float32), np.broadcast_to(u, right.shape)
            border = cv2.BORDER_REPLICATE
            seen = cv2.remap(right, column, row, cv2.INTER_CUBIC, borderMode=border)
            return np.asarray(seen, dtype=np.uint8)
        middle_u, middle_v = 0.5 * (width - 1), 0.5 * (height - 1)
        twist = 4 * self.twist / (width * height)
        across = 2 * self.turn / width - twist * middle_v
        down = 2 * self.stretch / height - twist * middle_u
        first = self.shift - across * middle_u - down * middle_v - twist * middle_u * middle_v
        slid = np.empty_like(right, order="C")
        core.slide_rows(right, first=first, across=across, down=down, twist=twist, answer=slid)
        return slid


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bands:
    """Rows of cells with their margins: both images, `at` which column of the right one, `known`.

    `other` is the right image, smoothed like `one` and as its matches see it.
    """

    one: Float32
    other: Float32
    at: Float32
    known: Bool


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cells:
    """What cells say: `moment` is `slope` times the rows that they are off, with noise of `spread`.

    `basis` holds 1, x, y and x y of each cell, x and y from -1 to 1. Arrays of shape (N,), (N, 4).
    """

    moment: Values
    slope: Values
    spread: Values
    basis: Values


class RowTracker:
    """Measures the rows of pairs from one camera, better with every frame.

    Attributes
    ----------
    rows : Rows
        What is to be undone. It stays as it is while what is measured differs by no more than
        can be neglected, so that equal pairs are answered alike.
    offset : float
        How much lower the right image lies in its middle [px]; NaN until it was measured.
    """

    def __init__(self) -> None:
        self.offset = math.nan
        self._frame = 0
        self._tries = 0
        self._begin(Rows())

    def learn(self, matched: DisparityMap) -> bool:
        """Learn from one matched pair; tells whether it should be matched again.

        So it should where rows turn out to be off by more than is known of them: with the first
        pair, or when something has bent.

        Parameters
        ----------
        matched : DisparityMap
            With its images, the right one's rows put right by `rows`.
        """
        if matched.left is None or matched.right is None:
            return False
        if self._known and self._look(matched.left, matched.right, matched):
            return False
        coarse = math.nan
        if self._known or not self._fine:
            raw = matched.disparity - np.float32(matched.offset)
            coarse = epipolar_offset(matched.left, matched.right, raw, largest=matched.largest)
        if abs(coarse) > _COARSE:
            self.offset = self.rows.shift + coarse
            self._begin(Rows(shift=self.offset))
            return True
        before = self.rows
        if not self._known and self._look(matched.left, matched.right, matched):
            again = self.rows != before
            self._tries = self._tries + 1 if again else 0
            if self._tries == TRIES:
                self._tries = 0  # as well as it is known
            elif again:
                self._begin(self.rows, fine=True)  # from this pair, which will say it better
            return again
        if not math.isnan(coarse):
            self.offset = before.shift + coarse
        return False

    def _begin(self, rows: Rows, *, fine: bool = False) -> None:
        """Take these rows for a first guess, fine or rough, and forget what was measured."""
        self.rows = rows
        self._fine = fine
        self._known = False
        self._information = np.zeros((4, 4))
        self._weighed = np.zeros(4)

    def _look(self, left: UInt8, right: UInt8, matched: DisparityMap) -> bool:
        """Measure one pair by its cells; tells whether they say anything."""
        wanted = _LATER if self._known else _AT_FIRST
        step = max(1, left.size // (wanted * _CELL[0] * _CELL[1]))
        cells = _cells(left, right, matched, first=self._frame % step, step=step)
        self._frame += 1
        if cells is None:
            return False
        information, terms = _fit(cells)
        if self._known:
            left_over = np.linalg.solve(information + _PRIOR, information @ terms)
            sure = float(left_over @ information @ left_over)
            if sure > _BENT and np.abs(left_over).sum() > _NEGLIGIBLE:
                self._begin(self.rows, fine=abs(float(left_over[0])) < _COARSE)
                return False
        self._information = _KEPT * self._information + information
        self._weighed = _KEPT * self._weighed + information @ (self.rows.terms() + terms)
        shift, turn, stretch, twist = np.linalg.solve(self._information + _PRIOR, self._weighed)
        rows = Rows(
            shift=float(shift), turn=float(turn), stretch=float(stretch), twist=float(twist)
        )
        moved = rows.beside(self.rows) > (_NEGLIGIBLE if self._known else _FITS)
        if moved or not self._known:
            self.offset = rows.shift
        if moved:
            self.rows = rows
        self._known = True
        return True


def _fit(cells: _Cells) -> tuple[Values, Values]:
    """Return the information about the terms of `Rows`, and their M-estimates."""
    basis, spread = cells.basis, np.sqrt(cells.spread)
    weight: Values = np.ones(len(spread))
    terms = np.zeros(4)
    for _ in range(_STEPS):
        slopes = basis.T @ (basis * (weight * cells.slope)[:, None])
        seen = basis.T @ (weight * cells.moment)
        terms = np.asarray(np.linalg.solve(slopes + _LEAST, seen), dtype=np.float64)
        miss = np.abs(cells.moment - cells.slope * (basis @ terms)) / spread
        scale = 1.4826 * median(miss) + 1e-6
        weight = np.minimum(1.0, 1.5 * scale / np.maximum(miss, 1e-9))
        weight[miss > 5 * scale] = 0.0
    noise = basis.T @ (basis * (weight * spread * scale * _TOGETHER)[:, None] ** 2)
    return slopes @ np.linalg.solve(noise + _LEAST, slopes), terms


def _bands(left: UInt8, right: UInt8, matched: DisparityMap, top: Index) -> _Bands | None:
    """Return the right image at the matches of rows of cells that begin at the rows `top`.

    None where too little is matched.
    """
    rows = (top[:, None] + np.arange(-_MARGIN, _CELL[1] + _MARGIN)).ravel()
    columns = left.shape[1] // _CELL[0] * _CELL[0]
    disparity = matched.disparity[rows, :columns] - np.float32(matched.offset)
    known = np.isfinite(disparity)
    np.copyto(disparity, 0, where=~known)
    at = np.arange(columns, dtype=np.float32) - disparity
    known &= (at >= 1) & (at < left.shape[1] - 2)
    if np.count_nonzero(known) < _FEWEST * _CELL[0] * _CELL[1]:
        return None
    one, other = (_smoothed(image[rows]) for image in (left, right))
    line = np.broadcast_to(np.arange(len(rows), dtype=np.float32)[:, None], at.shape)
    other = np.asarray(cv2.remap(other, at, line, cv2.INTER_LINEAR), dtype=np.float32)
    return _Bands(one=one[:, :columns], other=other, at=at, known=known)


def _cells(
    left: UInt8, right: UInt8, matched: DisparityMap, *, first: int, step: int
) -> _Cells | None:
    """Ask one row of cells in `step`, from the one `first` on; None where too few answer."""
    height, width = left.shape
    top = np.arange(_MARGIN + _CELL[1] * first, height - _CELL[1] - _MARGIN + 1, _CELL[1] * step)
    bands = _bands(left, right, matched, top)
    if bands is None:
        return None
    narrow = partial(_without, rows=_MARGIN, of=len(top))
    of_cells = partial(_means, known=narrow(bands.known), rows=len(top))
    all_ones = np.ones(1, dtype=np.float32)
    share, one, other, at = of_cells([all_ones, *map(narrow, (bands.one, bands.other, bands.at))])
    difference = narrow(_difference(bands, (one + np.float32(1)) / (other + np.float32(1))))
    u_d, v_d, uu, uv, vv, spread = of_cells(_products(bands, difference, of=len(top)))
    uu, uv = np.maximum(uu, np.float32(_ACROSS)), 0.5 * uv
    told = share > _KNOWN
    if np.count_nonzero(told) < _FEWEST:
        return None
    x = _centred(at[told] / share[told], width)
    middle = np.broadcast_to(top[:, None] + 0.5 * (_CELL[1] - 1), told.shape)
    y = _centred(middle[told], height)
    return _Cells(
        moment=(u_d * uv / uu - v_d)[told].astype(np.float64),
        slope=(vv - uv * uv / uu)[told].astype(np.float64),
        spread=0.5 * spread[told].astype(np.float64) + _FLAT,
        basis=np.stack([np.ones_like(x), x, y, x * y], axis=1),
    )


def _difference(bands: _Bands, gain: Float32) -> Float32:
    """Return the right image less the left one, by the cells' gain as bright, without outliers."""
    rows = len(bands.one) // len(gain)
    difference = bands.other * gain.repeat(_CELL[0], axis=1).repeat(rows, axis=0)
    difference -= bands.one
    limit = _OUTLIER * max(1.4826 * median(np.abs(difference[bands.known])), 0.5)
    return np.clip(difference, -limit, limit, out=difference)


def _products(bands: _Bands, difference: Float32, *, of: int) -> list[Float32]:
    """Return products of gradients, of two images' with their difference and of each other's."""
    needed = len(_SLOPE) // 2  # rows
    bare, inner = (partial(_without, rows=rows, of=of) for rows in (_MARGIN - needed, needed))
    u_one, v_one = map(inner, _gradients(bare(bands.one)))
    u_other, v_other = map(inner, _gradients(bare(bands.other)))
    return [
        0.5 * (u_one + u_other) * difference,
        0.5 * (v_one + v_other) * difference,
        u_one * u_other,
        u_one * v_other + v_one * u_other,
        v_one * v_other,
        v_one * v_one + v_other * v_other,
    ]


def _without(image: _Image, *, rows: int, of: int) -> _Image:
    """Return stacked bands, so many `of` them, without their first and last `rows`."""
    width = image.shape[1]
    return image.reshape(of, -1, width)[:, rows:-rows].reshape(-1, width)


def _means(images: list[Float32], *, known: Bool, rows: int) -> Float32:
    """Return the means of images over cells, in so many rows, of what is known."""
    inner, weight = np.empty((len(images), *known.shape), np.float32), known.astype(np.float32)
    for image, of_known in zip(images, inner, strict=True):
        np.multiply(image, weight, out=of_known)
    size = known.shape[1] // _CELL[0], len(images) * rows
    flat = inner.reshape(-1, known.shape[1])
    means = np.asarray(cv2.resize(flat, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    return means.reshape(len(images), rows, -1)


def _smoothed(image: UInt8) -> Float32:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), _BLUR), dtype=np.float32)


def _gradients(image: Float32) -> tuple[Float32, Float32]:
    """Return the gradients along row and column."""
    none = np.ones(1, dtype=np.float32)
    u, v = (cv2.sepFilter2D(image, -1, *axes) for axes in ((_SLOPE, none), (none, _SLOPE)))
    return np.asarray(u, dtype=np.float32), np.asarray(v, dtype=np.float32)


def _centred(place: NDArray[np.floating], size: int) -> Values:
    """Return places in an image, in half its size from its middle."""
    centred: Values = (2 * place.astype(np.float64) - (size - 1)) / size
    return centred
