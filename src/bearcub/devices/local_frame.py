"""A local metric frame on the WGS 84 ellipsoid: east, north and up of an origin [m] (ENU).

References
----------
.. [1] National Geospatial-Intelligence Agency: "World Geodetic System 1984", NGA.STND.0036, 2014,
   sections 3 and 4.
"""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Fix, Float64

_SEMI_MAJOR = 6378137.0  # m
_FLATTENING = 1 / 298.257223563
_ECCENTRICITY_SQUARED = _FLATTENING * (2 - _FLATTENING)


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalFrame:
    """East, north and up of a point: REP-105's `map`, tied to the earth.

    Attributes
    ----------
    latitude_deg, longitude_deg : float
        The origin, WGS 84 [deg].
    altitude : float
        Of the origin [m].
    """

    latitude_deg: float
    longitude_deg: float
    altitude: float = 0.0

    def __post_init__(self) -> None:
        if not (abs(self.latitude_deg) <= 90 and abs(self.longitude_deg) <= 180):
            raise InputError(
                f"origin {self.latitude_deg}, {self.longitude_deg}: expected a latitude within "
                "±90° and a longitude within ±180°"
            )

    def position(self, fix: Fix) -> Float64:
        """Return east, north and up [m] of a fix, shape (3,); NaN without a position.

            A fix without an altitude is taken to lie at the origin's.

        Examples
        --------
            A thousandth of a degree to the north and to the east of Cincinnati:

            >>> from bearcub.messages import FixQuality
        >>> frame = LocalFrame(latitude_deg=39.13, longitude_deg=-84.51)
            >>> fix = Fix(latitude_deg=39.131, longitude_deg=-84.509, quality=FixQuality.GPS)
            >>> frame.position(fix)[:2].round(2)
            array([ 86.47, 111.02])
        """
        altitude = self.altitude if math.isnan(fix.altitude) else fix.altitude
        there = _ecef(fix.latitude_deg, fix.longitude_deg, altitude)
        here = _ecef(self.latitude_deg, self.longitude_deg, self.altitude)
        enu: Float64 = self._enu_from_ecef() @ (there - here)
        return enu

    def _enu_from_ecef(self) -> Float64:
        latitude, longitude = math.radians(self.latitude_deg), math.radians(self.longitude_deg)
        sl, cl, so, co = (
            math.sin(latitude),
            math.cos(latitude),
            math.sin(longitude),
            math.cos(longitude),
        )
        return np.array([[-so, co, 0.0], [-sl * co, -sl * so, cl], [cl * co, cl * so, sl]])


def _ecef(latitude_deg: float, longitude_deg: float, altitude: float) -> Float64:
    """Return earth-centred, earth-fixed coordinates [m]."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    normal = _SEMI_MAJOR / math.sqrt(1 - _ECCENTRICITY_SQUARED * math.sin(latitude) ** 2)
    equatorial = (normal + altitude) * math.cos(latitude)
    return np.array(
        [
            equatorial * math.cos(longitude),
            equatorial * math.sin(longitude),
            (normal * (1 - _ECCENTRICITY_SQUARED) + altitude) * math.sin(latitude),
        ]
    )
