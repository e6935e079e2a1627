"""Where the camera sits on the body."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bearcub.errors import ConfigError
from bearcub.geometry import Attitude


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Where the left camera sits on the body, with how well that is known (1-sigma).

    Attributes
    ----------
    height : float
        Above the ground under it [m].
    pitch, roll : float
        Against the body, REP-103 [rad].
    x, y : float
        In ``base_link`` [m]; 0 puts the origin on the ground under the camera.
    sigma_height : float
        [m]; NaN means the configured share of `height`.
    sigma_pitch, sigma_roll : float
        [rad]; NaN means the configured default.
    """

    height: float
    pitch: float = 0.0
    roll: float = 0.0
    x: float = 0.0
    y: float = 0.0
    sigma_height: float = float("nan")
    sigma_pitch: float = float("nan")
    sigma_roll: float = float("nan")

    @classmethod
    def from_table(cls, table: Mapping[str, float]) -> "Mount":
        """Return the mount of a ``[mount]`` table, whose keys are `MOUNT_KEYS` [m], [deg].

        Raises
        ------
        ConfigError
            If it has no height: nothing else can tell the scale of a guess.
        """
        if "height" not in table:
            raise ConfigError(
                "where the camera sits is not known: give its height above the ground in metres, "
                "with --height or as mount.height in a rig TOML"
            )
        return cls(
            **{
                MOUNT_KEYS[key]: math.radians(value) if key.endswith("_deg") else value
                for key, value in table.items()
            }
        )

    def to_table(self) -> dict[str, float]:
        """Return the ``[mount]`` table, without what is not known.

        Degrees are rounded to 1e-12, so that printing what was loaded gives the same digits.
        """
        values = {key: getattr(self, name) for key, name in MOUNT_KEYS.items()}
        return {
            key: round(math.degrees(value), 12) if key.endswith("_deg") else value
            for key, value in values.items()
            if not math.isnan(value)
        }

    @property
    def attitude(self) -> Attitude:
        """Roll and pitch as one value."""
        return Attitude(roll=self.roll, pitch=self.pitch)


MOUNT_KEYS = {
    "height": "height",
    "pitch_deg": "pitch",
    "roll_deg": "roll",
    "x": "x",
    "y": "y",
    "height_sigma": "sigma_height",
    "pitch_sigma_deg": "sigma_pitch",
    "roll_sigma_deg": "sigma_roll",
}
"""The keys of a ``[mount]`` table and the fields of `Mount` they set."""
