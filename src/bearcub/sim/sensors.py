"""What a robot's sensors make of the truth: late, noisy, biased and with gaps, all from a seed.

The figures are engineering choices for the sensors of a small ground robot, not calibrations.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from bearcub.devices.local_frame import LocalFrame
from bearcub.geometry import Attitude
from bearcub.messages import Fix, FixQuality, Float64, Scan, Tilt, WheelState

_CAMPUS = LocalFrame(latitude_deg=39.1329, longitude_deg=-84.515)  # Cincinnati


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltModel:
    """An inclinometer.

    Attributes
    ----------
    rate_hz : float
        Readings per second.
    lag : float
        How old what it says is [s].
    noise : float
        Of each reading, one standard deviation [rad].
    bias : float
        Largest constant error of pitch and of roll, drawn once [rad].
    """

    rate_hz: float = 50.0
    lag: float = 0.03
    noise: float = math.radians(0.3)
    bias: float = math.radians(0.3)


class TiltSensor:
    """An inclinometer that is told the truth and reads it later.

    Parameters
    ----------
    model : TiltModel
    seed : int

    Examples
    --------
    Without noise and bias only the lag of 30 ms is left:

    >>> sensor = TiltSensor(TiltModel(noise=0.0, bias=0.0), seed=1)
    >>> for step in range(11):
    ...     sensor.feel(0.01 * step, Attitude(roll=0.0, pitch=0.1 * step))
    >>> print(f"{sensor.read(0.1).pitch:.2f}")
    0.70
    """

    def __init__(self, model: TiltModel, *, seed: int) -> None:
        self._model = model
        self._rng = np.random.default_rng((seed, 1))
        self._bias = model.bias * self._rng.uniform(-1.0, 1.0, 2)
        self._felt: deque[tuple[float, float, float]] = deque()

    def feel(self, time: float, attitude: Attitude) -> None:
        """Tell it the body's true attitude at a time [s], in the order of time."""
        self._felt.append((time, attitude.pitch, attitude.roll))
        while len(self._felt) > 2 and self._felt[1][0] <= time - self._model.lag:
            self._felt.popleft()

    def read(self, time: float) -> Tilt:
        """Return its reading at a time [s]: the attitude of `lag` before, disturbed."""
        times, pitches, rolls = (list(column) for column in zip(*self._felt, strict=True))
        then = time - self._model.lag
        off = self._bias + self._model.noise * self._rng.standard_normal(2)
        return Tilt(
            pitch=float(np.interp(then, times, pitches) + off[0]),
            roll=float(np.interp(then, times, rolls) + off[1]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LadarModel:
    """A planar scanner, by default as good as a SICK LMS2xx.

    Attributes
    ----------
    rate_hz : float
        Sweeps per second.
    sigma, quantum : float
        Noise and step of its ranges [m].
    nearest, farthest : float
        Between which it measures [m].
    lost : float
        Share of beams whose echo is lost.
    """

    rate_hz: float = 10.0
    sigma: float = 0.01
    quantum: float = 0.01
    nearest: float = 0.05
    farthest: float = 8.0
    lost: float = 0.002

    def measured(self, ranges: Float64, angles: Float64, rng: np.random.Generator) -> Scan:
        """Return what it reports of true ranges (REP-117).

        Parameters
        ----------
        ranges : ndarray of float64, shape (N,)
            True [m]; inf where a beam meets nothing.
        angles : ndarray of float64, shape (N,)
            Ascending [rad].
        rng : Generator
        """
        noisy = ranges + self.sigma * rng.standard_normal(ranges.shape)
        step = self.quantum
        noisy = np.where(np.isfinite(ranges), step * np.rint(noisy / step), np.inf)
        noisy = np.where(noisy > self.farthest, np.inf, noisy)
        noisy = np.where(noisy < self.nearest, -np.inf, noisy)
        noisy[rng.random(ranges.shape) < self.lost] = np.nan
        return Scan(
            ranges=noisy.astype(np.float32),
            angles=angles,
            nearest=self.nearest,
            farthest=self.farthest,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelModel:
    """Encoders on both wheels.

    Attributes
    ----------
    rate_hz : float
        Readings per second.
    counts_per_metre : float
    scale : float
        Largest error of each wheel's assumed radius, relative, drawn once.
    """

    rate_hz: float = 50.0
    counts_per_metre: float = 2000.0
    scale: float = 0.005


class WheelSensor:
    """Encoders that count how far the wheels rolled, and are wrong by the wheels' radii."""

    def __init__(self, model: WheelModel, *, track: float, seed: int) -> None:
        self._model, self._track = model, track
        self._scale = 1.0 + model.scale * np.random.default_rng((seed, 2)).uniform(-1.0, 1.0, 2)
        self._last: tuple[float, float, float] | None = None

    def read(self, time: float, left: float, right: float) -> WheelState:
        """Return what it says when the wheels have rolled `left` and `right` [m] in all."""
        step = 1.0 / self._model.counts_per_metre
        ways = step * np.rint(self._scale * np.array([left, right]) / step)
        before = self._last or (time, float(ways[0]), float(ways[1]))
        self._last = (time, float(ways[0]), float(ways[1]))
        passed = time - before[0]
        rates = (ways - np.array(before[1:])) / passed if passed > 0 else np.zeros(2)
        return WheelState(
            left=float(ways[0]),
            right=float(ways[1]),
            speed=float(rates.mean()),
            turn_rate=float(rates[1] - rates[0]) / self._track,
            enabled=True,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsModel:
    """A receiver with corrections, by default of about a metre.

    Attributes
    ----------
    rate_hz : float
        Fixes per second.
    noise : float
        Of each fix, east and north, one standard deviation [m].
    wander : float
        Of the error that changes slowly [m], one standard deviation.
    correlation : float
        Time in which that error forgets itself [s].
    origin : LocalFrame
        Where on earth the world's origin is; x is east, y north.
    """

    rate_hz: float = 5.0
    noise: float = 0.05
    wander: float = 0.7
    correlation: float = 60.0
    origin: LocalFrame = _CAMPUS


class GpsSensor:
    """A receiver whose error is white noise on a slow wander (Gauss-Markov)."""

    def __init__(self, model: GpsModel, *, seed: int) -> None:
        self._model = model
        self._rng = np.random.default_rng((seed, 3))
        self._wander = model.wander * self._rng.standard_normal(2)
        self._time: float | None = None

    def read(self, time: float, east: float, north: float) -> Fix:
        """Return its fix at a time [s] and a true place [m]."""
        model = self._model
        if self._time is not None:
            kept = math.exp(-(time - self._time) / model.correlation)
            fresh = model.wander * math.sqrt(1.0 - kept**2)
            self._wander = kept * self._wander + fresh * self._rng.standard_normal(2)
        self._time = time
        off = self._wander + model.noise * self._rng.standard_normal(2)
        latitude, longitude = _degrees(model.origin, east + float(off[0]), north + float(off[1]))
        return Fix(
            latitude_deg=latitude,
            longitude_deg=longitude,
            altitude=model.origin.altitude,
            quality=FixQuality.DGPS,
            sigma=math.hypot(model.noise, model.wander),
        )


def _degrees(origin: LocalFrame, east: float, north: float) -> tuple[float, float]:
    """Return latitude and longitude [deg] of a place, by Newton's method on `LocalFrame`."""
    latitude, longitude = origin.latitude_deg, origin.longitude_deg
    per_degree = 111_320.0  # metres of a degree of latitude, near enough to converge
    for _ in range(6):
        fix = Fix(latitude_deg=latitude, longitude_deg=longitude, quality=FixQuality.GPS)
        x, y, _ = origin.position(fix)
        latitude += (north - float(y)) / per_degree
        longitude += (east - float(x)) / (per_degree * math.cos(math.radians(latitude)))
    return latitude, longitude
