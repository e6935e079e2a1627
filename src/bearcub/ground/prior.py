"""What is known of the floor before looking: the mount, and the tilt sensor's reading."""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.geometry import Attitude, Float64, camera_attitude
from bearcub.messages import Tilt
from bearcub.rig.model import Mount


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """The camera above and against the floor as expected, with one standard deviation each.

    Attributes
    ----------
    height, pitch, roll : float
        [m], [rad].
    sigma : ndarray of float64, shape (3,)
        Of height [m], pitch and roll [rad].
    tilted : bool
        A tilt reading went into it.
    """

    height: float
    pitch: float
    roll: float
    sigma: Float64
    tilted: bool

    @property
    def values(self) -> Float64:
        """Height, pitch and roll as one array."""
        return np.array([self.height, self.pitch, self.roll])

    @property
    def attitude(self) -> Attitude:
        """Roll and pitch as one value."""
        return Attitude(roll=self.roll, pitch=self.pitch)


def expect(
    mount: Mount,
    tilt: Tilt | None,
    *,
    sigma_height_share: float,
    sigma_mount: float,
    sigma_tilt: float,
) -> Prior:
    """Combine mount and tilt reading into what the floor should look like.

    The body's tilt turns the mounted camera; the floor is taken to be level. Sigmas that the
    mount states itself win over the configured ones.

    Parameters
    ----------
    mount : Mount
    tilt : Tilt or None
        None leaves the mount alone, with the body's unknown attitude in `sigma_mount`.
    sigma_height_share : float
        Of the mount's height.
    sigma_mount : float
        Of pitch and roll without a tilt reading [rad].
    sigma_tilt : float
        Of pitch and roll with one [rad].
    """
    body = (
        Attitude(roll=0.0, pitch=0.0)
        if tilt is None
        else Attitude(roll=tilt.roll, pitch=tilt.pitch)
    )
    camera = camera_attitude(body=body, mount=mount.attitude)
    angle = sigma_mount if tilt is None else sigma_tilt
    sigma = np.array(
        [
            _known(mount.sigma_height, sigma_height_share * mount.height),
            _known(mount.sigma_pitch, angle),
            _known(mount.sigma_roll, angle),
        ]
    )
    return Prior(
        height=mount.height,
        pitch=camera.pitch,
        roll=camera.roll,
        sigma=sigma,
        tilted=tilt is not None,
    )


def _known(stated: float, default: float) -> float:
    return default if math.isnan(stated) else stated
