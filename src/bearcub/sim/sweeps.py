"""What a scenario varies: its TOML file as frozen tables of sweeps.

Every number or word of a table is a sweep: one value, a list of values, or for numbers
``{from = 0.4, to = 1.5, step = 0.1}`` with both ends.
"""

import math
from dataclasses import dataclass, field, fields
from typing import Any, get_args

from bearcub.config import require_known
from bearcub.errors import ConfigError
from bearcub.sim.light import PRESETS
from bearcub.sim.materials import SURFACES
from bearcub.sim.objects import KINDS
from bearcub.sim.sensor import Strength

READINGS = ("exact", "good", "biased", "late", "missing")
"""How the tilt sensor may be; see `TiltSweep`."""


def _swept(*default: float, low: float = -math.inf, high: float = math.inf) -> Any:
    return field(default=default, metadata={"low": low, "high": high})


def _chosen(*default: str, among: Any) -> Any:
    return field(default=default, metadata={"among": tuple(among)})


@dataclass(frozen=True, slots=True, kw_only=True)
class RigSweep:
    """The camera and the robot that carries it; images are 640 x 480.

    Attributes
    ----------
    height : camera above the ground [m]
    mount_pitch_deg : camera against the body [deg]
    hfov_deg : horizontal field of view [deg]
    baseline : [m]
    clearance : height of the robot [m]
    """

    height: tuple[float, ...] = _swept(1.2, low=0.1, high=5.0)
    mount_pitch_deg: tuple[float, ...] = _swept(5.9, low=-45, high=45)
    hfov_deg: tuple[float, ...] = _swept(79.0, low=20, high=130)
    baseline: tuple[float, ...] = _swept(0.12, low=0.01, high=2.0)
    clearance: tuple[float, ...] = _swept(2.0, low=0.1, high=10.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BodySweep:
    """The body against gravity, added to how it stands on the ground.

    Attributes
    ----------
    pitch_deg, roll_deg : of each frame, or of the first where the body shakes [deg]
    shake_deg : by how much pitch and roll each change from frame to frame [deg]
    """

    pitch_deg: tuple[float, ...] = _swept(0.0, low=-30, high=30)
    roll_deg: tuple[float, ...] = _swept(0.0, low=-30, high=30)
    shake_deg: tuple[float, ...] = _swept(0.0, low=0, high=10)


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltSweep:
    """The tilt sensor.

    Attributes
    ----------
    reading : "exact", "good" (noise alone), "biased", "late" or "missing"
    noise_deg : 1-sigma of pitch and of roll [deg]; none when "exact"
    bias_deg : how far a biased reading is off, in a direction drawn for each world [deg]
    late_ms : age of a late reading, at 15 frames a second [ms]; it is wrong where the body shakes
    """

    reading: tuple[str, ...] = _chosen("good", among=READINGS)
    noise_deg: tuple[float, ...] = _swept(0.3, low=0, high=10)
    bias_deg: tuple[float, ...] = _swept(5.0, low=0, high=45)
    late_ms: tuple[float, ...] = _swept(50.0, low=0, high=66)


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundSweep:
    """The ground.

    Attributes
    ----------
    surface : one of `bearcub.sim.materials.SURFACES`
    cross_slope_deg : rises to the left [deg]
    start : where a step or slope begins [m]
    step : height of a step there, negative is down [m]
    slope_deg : inclination from there, positive is up [deg]
    rise : after so much the slope is level again [m]
    """

    surface: tuple[str, ...] = _chosen("asphalt", among=SURFACES)
    cross_slope_deg: tuple[float, ...] = _swept(0.0, low=-20, high=20)
    start: tuple[float, ...] = _swept(3.0, low=0.1, high=30)
    step: tuple[float, ...] = _swept(0.0, low=-3, high=3)
    slope_deg: tuple[float, ...] = _swept(0.0, low=-45, high=80)
    rise: tuple[float, ...] = _swept(50.0, low=0.01, high=1000)


@dataclass(frozen=True, slots=True, kw_only=True)
class HoleSweep:
    """One pit in each world; `count` 0 is none.

    Attributes
    ----------
    count : 0 or 1
    range : of the near lip [m]
    y : of its middle, left positive [m]
    width, length, depth : across, along and down [m]
    """

    count: tuple[float, ...] = _swept(1, low=0, high=1)
    range: tuple[float, ...] = _swept(3.0, low=0.3, high=20)
    y: tuple[float, ...] = _swept(0.0, low=-5, high=5)
    width: tuple[float, ...] = _swept(0.6, low=0.05, high=10)
    length: tuple[float, ...] = _swept(0.6, low=0.05, high=10)
    depth: tuple[float, ...] = _swept(0.3, low=0.02, high=5)


@dataclass(frozen=True, slots=True, kw_only=True)
class ThingSweep:
    """What stands about: each in a sector of its own of the field of view.

    Attributes
    ----------
    count : things in a world
    kind : of each, one of `bearcub.sim.objects.KINDS`
    range : of each, to its nearest point [m]
    bearing_deg : where there is one thing only; otherwise drawn, as without it [deg]
    spread : share of the field of view that things are spread over
    """

    count: tuple[float, ...] = _swept(1, low=0, high=8)
    kind: tuple[str, ...] = _chosen("can", among=KINDS)
    range: tuple[float, ...] = _swept(3.0, low=0.5, high=30)
    bearing_deg: tuple[float, ...] = _swept(low=-60, high=60)
    spread: tuple[float, ...] = _swept(0.8, low=0, high=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrassSweep:
    """Standing blades ahead; `height` 0 is none.

    Attributes
    ----------
    height : of the tallest blades [m]
    density : blades per square metre
    """

    height: tuple[float, ...] = _swept(0.0, low=0, high=1)
    density: tuple[float, ...] = _swept(300.0, low=1, high=5000)


TABLES = {
    "rig": RigSweep,
    "body": BodySweep,
    "tilt": TiltSweep,
    "ground": GroundSweep,
    "hole": HoleSweep,
    "things": ThingSweep,
    "grass": GrassSweep,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Everything that a scenario's file says.

    Attributes
    ----------
    about : str
        One sentence.
    seed : int
        Of all that is drawn.
    worlds, frames : int
        Worlds, and frames in each: every world has its own ground, things, rig and light, every
        frame its own attitude.
    quick : int
        How many of the frames belong to the quick suite.
    light, noise : tuple of str
        One is drawn for each world.
    """

    about: str
    seed: int
    worlds: int = 1
    frames: int = 1
    quick: int = 1
    light: tuple[str, ...] = _chosen("noon", among=PRESETS)
    noise: tuple[str, ...] = _chosen("medium", among=get_args(Strength))
    rig: RigSweep = field(default_factory=RigSweep)
    body: BodySweep = field(default_factory=BodySweep)
    tilt: TiltSweep = field(default_factory=TiltSweep)
    ground: GroundSweep = field(default_factory=GroundSweep)
    hole: HoleSweep = field(default_factory=lambda: HoleSweep(count=(0,)))
    things: ThingSweep = field(default_factory=lambda: ThingSweep(count=(0,)))
    grass: GrassSweep = field(default_factory=GrassSweep)

    @classmethod
    def from_toml(cls, tables: dict[str, Any]) -> "Plan":
        """Build the plan from what `tomllib` returns.

        Raises
        ------
        ConfigError
            If a key is unknown (naming the nearest one), a value is of the wrong type or out of
            range, or `about` or `seed` is missing.
        """
        values: dict[str, Any] = {}
        for name, value in tables.items():
            require_known(name, {item.name for item in fields(cls)}, what="key")
            if name in TABLES:
                values[name] = _table(name, value)
            elif name in ("light", "noise"):
                values[name] = _sweep(name, value, _field(cls, name).metadata)
            else:
                values[name] = _plain(name, value, str if name == "about" else int)
        for name in ("about", "seed"):
            if name not in values:
                raise ConfigError(f"the key {name} is missing: every scenario needs one")
        return cls(**values)


def _table(name: str, table: object) -> Any:
    if not isinstance(table, dict):
        raise ConfigError(f"{name} = {table!r}: expected a table [{name}]")
    kind = TABLES[name]
    for key in table:
        require_known(key, {item.name for item in fields(kind)}, what=f"key {name}.")
    return kind(
        **{
            key: _sweep(f"{name}.{key}", value, _field(kind, key).metadata)
            for key, value in table.items()
        }
    )


def _field(kind: type[Any], name: str) -> Any:
    return next(item for item in fields(kind) if item.name == name)


def _plain(name: str, value: object, kind: type) -> object:
    if type(value) is not kind or (kind is int and isinstance(value, int) and value < 0):
        wanted = "a sentence" if kind is str else "a whole number, 0 or more"
        raise ConfigError(f"{name} = {value!r}: expected {wanted}")
    return value


def _sweep(name: str, value: object, allowed: Any) -> tuple[Any, ...]:
    """Return the values of one sweep, checked."""
    values = _steps(name, value) if isinstance(value, dict) else value
    values = values if isinstance(values, list) else [values]
    if not values:
        raise ConfigError(f"{name} = []: expected at least one value")
    for one in values:
        if "among" in allowed:
            if not isinstance(one, str):
                raise ConfigError(f"{name} = {one!r}: expected a word")
            require_known(one, allowed["among"], what=f"{name} =")
        elif type(one) not in (int, float) or not allowed["low"] <= one <= allowed["high"]:
            low, high = allowed["low"], allowed["high"]
            raise ConfigError(f"{name} = {one!r}: expected a number from {low:g} to {high:g}")
    return tuple(values)


def _steps(name: str, value: dict[str, Any]) -> list[float]:
    for key in value:
        require_known(key, ("from", "to", "step"), what=f"key {name}.")
    numbers = [value.get(key) for key in ("from", "to", "step")]
    if any(type(number) not in (int, float) for number in numbers):
        raise ConfigError(f"{name} = {value!r}: expected numbers for from, to and step")
    start, end, step = (float(number) for number in numbers if number is not None)
    if not step > 0 or end < start:
        raise ConfigError(f"{name} = {value!r}: expected from <= to and a positive step")
    count = math.floor((end - start) / step + 1e-9) + 1
    return [round(start + index * step, 9) for index in range(count)]
