"""What surfaces look like: band-limited noise and simple patterns fixed to the surface.

A surface point has the same albedo in both cameras. Every octave of noise fades out where the
distance between two rays on the surface comes near its wavelength, so nothing aliases.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Float32

Reals = NDArray[np.floating[Any]]
Colour = tuple[float, float, float]

_TILE = 512  # side of the noise tile [texels]
_WAVE = 8.0  # texels per wavelength


class Texture(Protocol):
    """Gives the albedo of surface points."""

    def albedo(self, s: Float32, t: Float32, footprint: Float32) -> Float32:
        """Return linear albedo (blue, green, red), shape (3, N).

        Parameters
        ----------
        s, t : ndarray of float32, shape (N,)
            Coordinates on the surface [m].
        footprint : ndarray of float32, shape (N,)
            Distance between neighbouring rays on the surface [m].
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Noise between two colours, with optional ribs, joints and bands.

    Attributes
    ----------
    dark, light : tuple of float
        Linear albedo (blue, green, red) between which the noise moves.
    octaves : tuple of (float, float)
        Wavelength [m] and amplitude of each octave; an amplitude of 1 spans `dark` to `light`.
    ribs : tuple of float or None
        Period along `s` [m] and relative depth of a smooth ripple.
    joints : tuple of float or None
        Period along `s` and `t` [m], width [m] and relative darkness of straight lines.
    bands : tuple of (float, float, Colour)
        From, to (along `t`, [m]) and colour of painted bands.
    seed : int
        Shifts the noise, so that two things of one material differ.
    """

    dark: Colour
    light: Colour
    octaves: tuple[tuple[float, float], ...] = ()
    ribs: tuple[float, float] | None = None
    joints: tuple[float, float, float] | None = None
    bands: tuple[tuple[float, float, Colour], ...] = ()
    seed: int = 0

    def albedo(self, s: Float32, t: Float32, footprint: Float32) -> Float32:
        """Return linear albedo, shape (3, N)."""
        mix = np.full_like(s, 0.5)
        for index, (wavelength, amplitude) in enumerate(self.octaves):
            fade = resolved(wavelength, footprint)
            if fade.any():
                mix += 0.5 * amplitude * fade * noise(s, t, wavelength, index + 16 * self.seed)
        np.clip(mix, 0.0, 1.0, out=mix)
        dark, light = _column(self.dark), _column(self.light)
        colour: Float32 = dark + (light - dark) * mix
        for low, high, paint in self.bands:
            colour = np.where((t >= low) & (t < high), _column(paint), colour)
        return colour * self._relief(s, t, footprint)

    def _relief(self, s: Float32, t: Float32, footprint: Float32) -> Float32:
        """Return the factor by which ribs and joints change the albedo."""
        factor = np.ones_like(s)
        if self.ribs is not None:
            period, depth = self.ribs
            factor += depth * resolved(period, footprint) * np.sin(s * (2 * np.pi / period))
        if self.joints is not None:
            period, width, darkness = self.joints
            for along in (s, t):
                off = np.abs(along - period * np.round(along / period))
                # a line narrower than the footprint is as wide as that, and paler
                wide = np.maximum(width, footprint)
                factor *= 1 - darkness * (width / wide) * np.clip(
                    1.5 - 2 * off / wide, 0, 1
                ) * resolved(period, footprint)
        return factor


@dataclass(frozen=True, slots=True, kw_only=True)
class Lane:
    """One material between ``right < t < left`` and another outside, with an uneven edge."""

    inside: Texture
    outside: Texture
    left: float
    right: float
    wobble: float = 0.05

    def albedo(self, s: Float32, t: Float32, footprint: Float32) -> Float32:
        """Return linear albedo, shape (3, N)."""
        edge = np.zeros_like(t)
        for index, wavelength in enumerate((1.6, 0.5, 0.15, 0.06)):
            rough = noise(s, t, wavelength, index + 7)
            edge += self.wobble * 0.6**index * resolved(wavelength, footprint) * rough
        depth = np.minimum(self.left - t, t - self.right) + edge
        share = np.clip(0.5 + depth / np.maximum(0.03, 2 * footprint), 0, 1)
        within = self.inside.albedo(s, t, footprint)
        beyond = self.outside.albedo(s, t, footprint)
        mixed: Float32 = beyond + (within - beyond) * share
        return mixed


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A painted line of some width [m] with round ends; a disc where it ends at its start."""

    start: tuple[float, float]
    end: tuple[float, float]
    width: float

    def depth(self, s: Float32, t: Float32) -> Float32:
        """Return how far inside the paint's edge points are [m]; negative outside."""
        along_s, along_t = self.end[0] - self.start[0], self.end[1] - self.start[1]
        off_s, off_t = s - np.float32(self.start[0]), t - np.float32(self.start[1])
        length = max(along_s**2 + along_t**2, 1e-12)
        share = np.clip((off_s * along_s + off_t * along_t) / length, 0.0, 1.0)
        apart = np.hypot(off_s - share * along_s, off_t - share * along_t)
        inside: Float32 = (0.5 * self.width - apart).astype(np.float32)
        return inside


@dataclass(frozen=True, slots=True, kw_only=True)
class Painted:
    """A floor with painted lines: no things, only another colour."""

    ground: Texture
    strokes: tuple[Stroke, ...]
    paint: Colour

    def albedo(self, s: Float32, t: Float32, footprint: Float32) -> Float32:
        """Return linear albedo, shape (3, N)."""
        depth = np.max([stroke.depth(s, t) for stroke in self.strokes], axis=0)
        share = np.clip(0.5 + depth / np.maximum(0.01, footprint), 0, 1)
        worn = share * np.clip(0.85 + 0.1 * noise(s, t, 0.08, 99) * resolved(0.08, footprint), 0, 1)
        bare = self.ground.albedo(s, t, footprint)
        mixed: Float32 = bare + (_column(self.paint) - bare) * worn
        return mixed


def _column(colour: Colour) -> Float32:
    return np.array(colour, dtype=np.float32)[:, None]


def resolved(wavelength: float, footprint: Float32) -> Float32:
    """Return how much of a wave rays `footprint` apart can carry: 0 at two per wave, 1 at four."""
    with np.errstate(divide="ignore", over="ignore"):
        share: Float32 = np.clip(0.5 * wavelength / footprint - 1.0, 0.0, 1.0).astype(np.float32)
    return share


def noise(s: Float32, t: Float32, wavelength: float, index: int) -> Float32:
    """Return smooth noise of zero mean, unit deviation and one wavelength, shape (N,).

    Every `index` is turned and shifted differently, so that the tile's period does not show.
    """
    turn = 2.4 * index + 0.3
    scale = _WAVE / wavelength
    c, d = float(np.cos(turn) * scale), float(np.sin(turn) * scale)
    x = c * s - d * t + 37.7 * index
    y = d * s + c * t + 91.3 * index
    return _sample(x - _TILE * np.floor(x / _TILE), y - _TILE * np.floor(y / _TILE))


def _sample(x: Reals, y: Reals) -> Float32:
    """Look the tile up bilinearly; OpenCV wants maps of less than 32768 rows and columns."""
    columns = 4096
    rows = -(-x.size // columns)
    maps = np.zeros((2, rows * columns), np.float32)
    maps[0, : x.size], maps[1, : y.size] = x, y
    grid = maps.reshape(2, rows, columns)
    picked = cv2.remap(_tile(), grid[0], grid[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(picked, dtype=np.float32).reshape(-1)[: x.size]


@lru_cache(maxsize=1)
def _tile() -> Float32:
    """Make a periodic tile of noise whose power lies within half an octave of `_WAVE`."""
    white = np.random.default_rng(2005).random((_TILE, _TILE)) - 0.5
    f = np.hypot(np.fft.fftfreq(_TILE)[:, None], np.fft.rfftfreq(_TILE)[None, :]) * _WAVE
    with np.errstate(divide="ignore"):
        band = np.exp(-0.5 * (np.log2(f) / 0.4) ** 2)
    tile = np.fft.irfft2(np.fft.rfft2(white) * band, (_TILE, _TILE))
    return np.ascontiguousarray(tile / tile.std(), dtype=np.float32)
