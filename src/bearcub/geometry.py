"""The camera against the ground: attitudes, frames and the floor's plane in disparity space.

Frames are REP-103: ``base_link`` x ahead, y left, z up; optical x right, y down, z ahead. Roll is
positive right side down, pitch positive nose down, about fixed axes (``R = Ry(pitch) Rx(roll)``).

The floor seen by a rectified pair is a plane in disparity space [1]_. With ``n`` the unit vector
pointing down to the floor in optical axes and ``h`` the camera's height above it,

    d(u, v) = (B / h) (n_x (u - cx) + n_y (fx / fy) (v - cy) + n_z fx) = a u + b v + c .

References
----------
.. [1] R. Labayrade, D. Aubert, J.-P. Tarel: "Real time obstacle detection in stereovision on non
   flat road geometry through v-disparity representation", IEEE IV 2002, is the case roll = 0.
"""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
_N = TypeVar("_N", float, NDArray[np.float64])

OPTICAL_FROM_BODY: Float64 = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
OPTICAL_FROM_BODY.flags.writeable = False


def rotation(*, roll: float, pitch: float) -> Float64:
    """Return the matrix that turns body coordinates into level coordinates of the same heading.

    Parameters
    ----------
    roll, pitch : float
        REP-103 attitude [rad]: right side down and nose down are positive.

    Returns
    -------
    level_from_body : ndarray of float64, shape (3, 3)

    Examples
    --------
    >>> nose_down = rotation(roll=0.0, pitch=np.radians(90))
    >>> (nose_down @ [1, 0, 0]).round(6) + 0.0
    array([ 0.,  0., -1.])
    """
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def down_vector(*, roll: float | Float64, pitch: float | Float64) -> Float64:
    """Return the unit vector to the ground in the optical axes of a camera so inclined.

    Parameters
    ----------
    roll, pitch : float or ndarray of float64, shape (N,)
        REP-103 [rad].

    Returns
    -------
    ndarray of float64, shape (3,) or (3, N)
    """
    cp = np.cos(pitch)
    return np.array([np.sin(roll) * cp, np.cos(roll) * cp, np.sin(pitch)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Attitude:
    """Roll and pitch of a thing against the level, REP-103 [rad]."""

    roll: float
    pitch: float

    def down(self) -> Float64:
        """Return the unit vector to the ground in the optical axes of a camera so inclined."""
        return down_vector(roll=self.roll, pitch=self.pitch)

    @classmethod
    def from_down(cls, down: Float64) -> "Attitude":
        """Return the attitude of a camera that sees the ground in direction `down` (optical)."""
        x, y, z = down.tolist()
        return cls(roll=math.atan2(x, y), pitch=math.atan2(z, math.hypot(x, y)))


def camera_attitude(*, body: Attitude, mount: Attitude) -> Attitude:
    """Return the camera's attitude when the body it is mounted on is inclined.

    The rotations do not commute: a body rolled by 12 deg with a camera mounted 5.9 deg down
    gives a camera 5.77 deg down.

    Examples
    --------
    >>> body = Attitude(roll=np.radians(12), pitch=0.0)
    >>> camera = camera_attitude(body=body, mount=Attitude(roll=0.0, pitch=np.radians(5.9)))
    >>> print(f"{np.degrees(camera.pitch):.2f} {np.degrees(camera.roll):.2f}")
    5.77 12.06
    """
    (sr, cr), (sp, cp) = _sine_cosine(body.roll), _sine_cosine(body.pitch)
    a, b, c = -sp, cp * sr, cp * cr  # up, in the axes of the body
    (sr, cr), (sp, cp) = _sine_cosine(mount.roll), _sine_cosine(mount.pitch)
    # down in the camera's optical axes: up in its body axes, each with another sign and place
    along = a * sp + c * cp
    x, y, z = along * sr + b * cr, along * cr - b * sr, c * sp - a * cp
    return Attitude(roll=math.atan2(x, y), pitch=math.atan2(z, math.hypot(x, y)))


def _sine_cosine(angle: float) -> tuple[float, float]:
    return math.sin(angle), math.cos(angle)


def forward_in_camera(mount: Attitude) -> Float64:
    """Return the body's x axis (straight ahead) in the optical axes of a camera so mounted."""
    (sr, cr), (sp, cp) = _sine_cosine(mount.roll), _sine_cosine(mount.pitch)
    return np.array([-sp * sr, -sp * cr, cp])


def base_from_optical(down: Float64, forward: Float64) -> Float64:
    """Return the rotation from optical axes to a level frame heading along `forward`.

    Parameters
    ----------
    down : ndarray of float64, shape (3,)
        Unit vector to the ground (or of gravity), optical.
    forward : ndarray of float64, shape (3,)
        Direction of the body's x axis, optical; its horizontal part becomes x.

    Returns
    -------
    ndarray of float64, shape (3, 3)
        Rows are x ahead, y left and z up of the level frame in optical axes.
    """
    a, b, c = _unit(*(-down).tolist())
    x, y, z = forward.tolist()
    along = a * x + b * y + c * z
    x, y, z = _unit(x - along * a, y - along * b, z - along * c)
    left = (b * z - c * y, c * x - a * z, a * y - b * x)  # up x ahead
    return np.array([(x, y, z), left, (a, b, c)])


def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


def inverse(matrix: Float64) -> Float64:
    """Return the inverse of a 3 x 3 matrix, by its adjugate: NumPy's takes five times as long.

    Raises
    ------
    ZeroDivisionError
        If it has none.

    Examples
    --------
    >>> inverse(np.diag([1.0, 2.0, 4.0]))
    array([[1.  , 0.  , 0.  ],
           [0.  , 0.5 , 0.  ],
           [0.  , 0.  , 0.25]])
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    first = (e * i - f * h, c * h - b * i, b * f - c * e)
    by = 1.0 / (a * first[0] + d * first[1] + g * first[2])
    second = (f * g - d * i, a * i - c * g, c * d - a * f)
    third = (d * h - e * g, b * g - a * h, a * e - b * d)
    return np.array([[each * by for each in row] for row in (first, second, third)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """What of a rectified pair turns pixels and disparities into metres.

    Disparity is always ``u_left - u_right`` adjusted for the principal points, so that depth is
    ``fx B / d`` without an offset.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    baseline: float

    @property
    def numbers(self) -> tuple[float, float, float, float, float]:
        """Everything in one tuple: fx, fy, cx, cy, baseline."""
        return self.fx, self.fy, self.cx, self.cy, self.baseline

    def plane(self, *, height: float, down: Float64) -> Float64:
        """Return (a, b, c) of the floor's disparity ``a u + b v + c`` [px].

        Examples
        --------
        The rig of the paper: ten rows per level, horizon at row 200.

        >>> rig = Projection(fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
        >>> a, b, c = rig.plane(height=1.2, down=Attitude(roll=0.0, pitch=np.radians(5.9)).down())
        >>> print(f"{1 / b:.1f} {-c / b:.1f}")
        10.1 199.6
        """
        # of one direction plain floats: NumPy takes several times as long for its own
        return np.array(self.coefficients(height, *(down.tolist() if down.ndim == 1 else down)))

    def coefficients(self, height: float, x: _N, y: _N, z: _N) -> tuple[_N, _N, _N]:
        """Return what `plane` does as plain numbers, of the direction (x, y, z) down."""
        scale = self.baseline / height
        a, b = scale * x, scale * y * self.fx / self.fy
        return a, b, scale * z * self.fx - a * self.cx - b * self.cy

    def floor(self, plane: Float64) -> tuple[float, Float64]:
        """Return (height [m], down) of the camera above the floor ``d = a u + b v + c``.

        The inverse of `plane`. The height is NaN where the plane is no floor (all zero).
        """
        a, b, c = plane.tolist()
        y, z = b * self.fy / self.fx, (c + a * self.cx + b * self.cy) / self.fx
        norm = math.hypot(a, y, z)
        if norm == 0.0:
            return math.nan, np.array([0.0, 1.0, 0.0])
        return self.baseline / norm, np.array([a / norm, y / norm, z / norm])

    def points(self, u: Float64, v: Float64, disparity: Float64) -> Float64:
        """Return optical coordinates [m] of pixels; disparity 0 gives inf, NaN gives NaN.

        Parameters
        ----------
        u, v, disparity : ndarray of float64, shape (N,)
            Column, row and adjusted disparity [px].

        Returns
        -------
        ndarray of float64, shape (N, 3)
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            z = self.fx * self.baseline / np.asarray(disparity, dtype=np.float64)
            return np.stack([(u - self.cx) / self.fx * z, (v - self.cy) / self.fy * z, z], axis=-1)
