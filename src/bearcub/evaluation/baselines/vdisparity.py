"""The textbook method: the floor is a line of the v-disparity image, things are lines upright [1]_.

Rows are counted along lines of equal disparity, so that the roll that mount and tilt reading tell
does not blur the line; bins of disparity are half a pixel. The line is found by a Hough transform:
every bin votes with the logarithm of its count for the lines through it, from half to twice the
mount's height and within 20 deg of the expected pitch. Pixels more than 0.1 m and a pixel of
disparity above it are counted per column and disparity [2]_ (u-disparity); cells with as many rows
as a thing of 0.1 m covers there are joined with their neighbours to things. No holes.

References
----------
.. [1] Labayrade, Aubert and Tarel, "Real time obstacle detection in stereovision on non flat road
   geometry through v-disparity representation", IV 2002.
.. [2] Hu and Uchimura, "U-V-disparity: an efficient algorithm for stereovision based scene
   analysis", IV 2005.
"""

import math

import cv2
import numpy as np

from bearcub.evaluation.baselines.clusters import numbered
from bearcub.evaluation.baselines.frame import FARTHEST, LEAST_HEIGHT, Frame, measured
from bearcub.evaluation.report import Report
from bearcub.messages import Bool, Float64, Int32

_BIN = 0.5  # of disparity [px]
_HEIGHTS = np.geomspace(0.5, 2.0, 81)
_PITCHES = np.radians(np.linspace(-20.0, 20.0, 161))
_HIGHEST = 2.0  # [m]


def answer(frame: Frame) -> Report:
    """Answer one frame."""
    plane = _floor(frame)
    height, down = frame.rig.camera.projection.floor(plane)
    points = frame.points(down=down, height=height)
    rows, columns = frame.disparity.shape
    v, u = np.mgrid[:rows, :columns]
    floor = plane[0] * u + plane[1] * v + plane[2]
    with np.errstate(invalid="ignore"):
        standing = (points[..., 2] > LEAST_HEIGHT) & (points[..., 2] < _HIGHEST)
        standing &= frame.disparity - floor > 1.0
    labels = _upright(frame, standing)
    return frame.report(measured(points[standing], labels[standing]), height=height, down=down)


def _floor(frame: Frame) -> Float64:
    """Return (a, b, c) of the line with most votes, as a plane in disparity space."""
    d, expected = frame.disparity, frame.expected
    rows, columns = d.shape
    v, u = np.mgrid[:rows, :columns]
    lean = math.tan(expected.roll)
    camera = frame.rig.camera
    row = np.rint(v + lean * (u - camera.cx)).astype(np.int64)
    seen = (d > _BIN) & (row >= 0) & (row < rows)
    bins = int(np.nanmax(d, initial=0.0) / _BIN) + 2
    level = (d[seen] / _BIN).astype(np.int64)
    counts = np.bincount(row[seen] * bins + level, minlength=rows * bins).reshape(rows, bins)
    votes = np.log1p(counts)
    best, most = camera.projection.plane(height=frame.rig.mount.height, down=expected.down()), -1.0
    for share in _HEIGHTS:
        slopes, crossings = _lines(frame, share)
        levels = (slopes[:, None] * (np.arange(rows) - crossings[:, None]) / _BIN).astype(np.int64)
        inside = (levels > 0) & (levels < bins)
        totals = np.where(inside, votes[np.arange(rows), np.clip(levels, 0, bins - 1)], 0.0)
        sums = totals.sum(axis=1)
        k = int(sums.argmax())
        if sums[k] > most:
            most, b, crossing = float(sums[k]), slopes[k], crossings[k]
            best = np.array([b * lean, b, -b * (crossing + lean * camera.cx)])
    return np.asarray(best, dtype=np.float64)


def _lines(frame: Frame, share: float) -> tuple[Float64, Float64]:
    """Return disparity per row and horizon row of floors of every pitch, at a share of height."""
    camera, expected = frame.rig.camera, frame.expected
    pitch = expected.pitch + _PITCHES
    scale = camera.baseline / (share * frame.rig.mount.height)
    slopes = scale * math.cos(expected.roll) * np.cos(pitch) * camera.fx / camera.fy
    crossings = camera.cy - camera.fy * np.tan(pitch) / math.cos(expected.roll)
    return slopes, crossings


def _upright(frame: Frame, standing: Bool) -> Int32:
    """Return the thing that every pixel belongs to, shape (H, W); 0 for none."""
    d, camera = frame.disparity, frame.rig.camera
    columns = d.shape[1]
    level = np.where(standing, d, 0.0).astype(np.int64)  # a pixel a bin: things, not their relief
    bins = int(level.max(initial=0)) + 1
    cell = level * columns + np.arange(columns)
    counts = np.bincount(cell[standing], minlength=bins * columns).reshape(bins, columns)
    nearest = camera.fx * camera.baseline / FARTHEST
    rows = LEAST_HEIGHT * np.maximum(np.arange(bins), nearest) / camera.baseline
    _, grid = cv2.connectedComponents(
        (counts >= np.maximum(rows, 2.0)[:, None]).astype(np.uint8), connectivity=8
    )
    labels = np.where(standing, np.asarray(grid, dtype=np.int32).reshape(-1)[cell], 0)
    return numbered(labels.astype(np.int32))
