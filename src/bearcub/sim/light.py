"""The light of a scene: sun, sky, haze, and named kinds of weather.

All light is linear, ``(blue, green, red)``, with 1 the white of the image.
"""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.messages import Float32, Float64
from bearcub.sim.texture import Reals

ZENITH = np.array([[0.72], [0.36], [0.15]], dtype=np.float32)
HAZE = np.array([[0.84], [0.74], [0.64]], dtype=np.float32)
SUNLIGHT = np.array([[1.15], [1.32], [1.45]], dtype=np.float32)
SKYLIGHT = np.array([[0.46], [0.40], [0.36]], dtype=np.float32)
SIGHT = 220.0  # distance at which haze has swallowed 63 % of a colour [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """What lights a scene; the default is the scene's own sun in a clear sky.

    Attributes
    ----------
    azimuth, elevation : float
        Direction to the sun [rad]: azimuth from x ahead to the left, elevation above the level.
        NaN leaves it where the scene has it.
    strength : float
        Light of the sun, 1 for a clear day, 0 for none.
    ambient : float
        Light of the sky, 1 for a clear day.
    cloud : float
        Share of the sky's blue that clouds make grey, 0 to 1.
    shadows : bool
        Whether the sun casts (hard) shadows; a scene without shadows has none either way.
    exposure : float
        Factor on all light before it becomes an image.
    """

    azimuth: float = math.nan
    elevation: float = math.nan
    strength: float = 1.0
    ambient: float = 1.0
    cloud: float = 0.0
    shadows: bool = True
    exposure: float = 1.0

    def towards_sun(self, scene_sun: tuple[float, float, float]) -> Float64:
        """Return the unit vector to the sun, shape (3,)."""
        if not (math.isnan(self.azimuth) or math.isnan(self.elevation)):
            flat = math.cos(self.elevation)
            return np.array(
                [
                    flat * math.cos(self.azimuth),
                    flat * math.sin(self.azimuth),
                    math.sin(self.elevation),
                ]
            )
        return np.array(scene_sun) / float(np.linalg.norm(scene_sun))

    def falling(self, sunny: Reals, skyward: Reals) -> Float32:
        """Return the light that falls on surface points, shape (3, N).

        Parameters
        ----------
        sunny : ndarray, shape (N,)
            Cosine of the sun's incidence; 0 in shadow.
        skyward : ndarray, shape (N,)
            Share of the sky's light, 1 for level ground in the open.
        """
        sun = SUNLIGHT * np.float32(self.strength * self.exposure)
        return (sun * sunny + self._of_sky(SKYLIGHT, clouds=SKYLIGHT) * skyward).astype(np.float32)

    def sky(self, upward: Reals) -> Float32:
        """Return the sky's light in directions of the sine `upward` of elevation, shape (3, N)."""
        share = np.sqrt(np.clip(upward, 0, 1))
        horizon, zenith = (self._of_sky(colour, clouds=HAZE) for colour in (HAZE, ZENITH))
        return (horizon + (zenith - horizon) * share).astype(np.float32)

    def _of_sky(self, clear: Float32, *, clouds: Float32) -> Float32:
        """Return a colour of the clear sky, shape (3, 1), in this sky: greyed as clouds are."""
        mixed = clear + np.float32(self.cloud) * (clouds.mean() - clear)
        light: Float32 = (mixed * np.float32(self.ambient * self.exposure)).astype(np.float32)
        return light

    def through_haze(self, colour: Reals, away: Reals) -> Float32:
        """Return surface colours as they look from afar.

        Parameters
        ----------
        colour : ndarray, shape (3, N)
        away : ndarray, shape (3, N)
            From the eye to the surface [m], level.
        """
        distance = np.sqrt((away**2).sum(axis=0))
        clear = np.exp(-distance / SIGHT)
        behind = self.sky(away[2] / np.maximum(distance, 1e-9))
        seen: Float32 = (colour * clear + behind * (1 - clear)).astype(np.float32)
        return seen


PRESETS = {
    "overcast": Light(strength=0.0, ambient=1.35, cloud=0.9, shadows=False),
    "noon": Light(azimuth=math.radians(140), elevation=math.radians(65)),
    "low_sun": Light(
        azimuth=math.radians(155), elevation=math.radians(14), ambient=0.8, exposure=1.2
    ),
    "dusk": Light(
        azimuth=math.radians(-60), elevation=math.radians(4), strength=0.15, ambient=0.22
    ),
    "indoor": Light(
        azimuth=math.radians(90), elevation=math.radians(80), strength=0.3, ambient=1.1
    ),
}
"""Lights by name."""
