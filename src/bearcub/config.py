"""Every number that someone may tune, with its unit, its range and why it has that default.

One frozen dataclass per stage; the TOML file has one table for each. Printing the defaults and
loading them again is the identity.
"""

import difflib
import json
import math
import tomllib
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from bearcub.errors import ConfigError


def setting(default: Any, doc: str, *, low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare one field of a configuration table with its meaning and its range."""
    return field(default=default, metadata={"doc": doc, "low": low, "high": high})


class Table:
    """Checks every field of a configuration table against its declared type and range."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            _check(f"{_table_name(type(self))}.{item.name}", value, item)


def _table_name(table: type) -> str:
    names: dict[Any, str] = {f.default_factory: f.name for f in fields(Config)}
    return names.get(table, table.__name__)


def _check(name: str, value: object, item: "Field[Any]") -> None:
    expected = type(item.default)
    fits = isinstance(value, expected) or (expected is float and type(value) is int)
    if not fits or (isinstance(value, bool) and expected is not bool):
        raise ConfigError(f"{name} = {value!r}: expected {expected.__name__}")
    low, high = item.metadata["low"], item.metadata["high"]
    if isinstance(value, int | float) and not low <= value <= high:
        raise ConfigError(f"{name} = {value!r}: must be from {low:g} to {high:g}")
    choices = item.metadata.get("choices")
    if choices and value not in choices:
        raise ConfigError(f"{name} = {value!r}: must be one of {', '.join(choices)}")


def choice(default: str, doc: str, *choices: str) -> Any:
    """Declare one field that takes one of a few words."""
    metadata = {"doc": doc, "low": -math.inf, "high": math.inf, "choices": choices}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True, slots=True, kw_only=True)
class Matching(Table):
    """From two images to one disparity map."""

    matcher: str = choice(
        "native",
        "which matcher; sgbm stands in for native where that was not compiled",
        "native",
        "sgbm",
        "bm",
        "onnx",
    )
    model: str = setting(
        "", "ONNX file of the onnx matcher; in a configuration file, from that file's folder"
    )
    model_white: float = setting(
        255.0, "what that model takes for white: 255, or 1", low=0.001, high=65535.0
    )
    threads: int = setting(
        1,
        "threads of native and onnx; the answer of native is the same for any number",
        low=1,
        high=64,
    )
    half_resolution: bool = setting(
        False, "match at half the size with half the disparities, then sharpen at the full size"
    )
    region_of_interest: bool = setting(
        False, "leave out the rows where all is higher than detection.clearance, or too far"
    )
    nearest: float = setting(
        0.0,
        "nearest range to search [m]; 0: the nearest floor in view, a quarter of the width at most",
        low=0.0,
        high=100.0,
    )
    block_size: int = setting(
        5,
        "side of the matched block [px]; bm uses at least 9, native always 5, onnx none",
        low=1,
        high=31,
    )
    uniqueness: int = setting(
        10, "margin of the best over the second best match [%]; not of onnx", low=0, high=100
    )
    left_right: float = setting(
        1.0,
        "largest left-right disagreement [px]; at 100 onnx does not check and takes half the time",
        low=0.0,
        high=100.0,
    )
    speckle_area: int = setting(
        100, "smallest connected patch that is kept [px]", low=0, high=100000
    )
    agreement: float = setting(
        0.65,
        "share of a patch's texture on which left and right may disagree; noise: 0.75 and more",
        low=0.0,
        high=2.0,
    )
    contrast: float = setting(
        0.5,
        "least contrast that can be matched [grey levels, RMS]; below is the rounding of 8 bits",
        low=0.0,
        high=255.0,
    )
    sharpen: bool = setting(
        True, "register every window once more for an unbiased fraction of a pixel"
    )
    align: bool = setting(
        True, "measure how the rows of the pair are off, and put the right image's right"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundSearch(Table):
    """From a disparity map to the floor."""

    height_factor: float = setting(
        2.2, "a floor may lie this factor above or below the mount's height", low=1.01, high=5.0
    )
    pitch_deg: float = setting(
        18.0, "largest pitch of the floor against the expected one [deg]", low=1.0, high=45.0
    )
    roll_deg: float = setting(
        22.0, "largest roll of the floor against the expected one [deg]", low=1.0, high=45.0
    )
    sigma_height_share: float = setting(
        0.1,
        "1-sigma of the mount's height where the rig states none, share of it",
        low=0.001,
        high=1.0,
    )
    sigma_mount_deg: float = setting(
        5.0, "1-sigma of roll and pitch without a tilt reading [deg]", low=0.01, high=45.0
    )
    sigma_tilt_deg: float = setting(
        1.5, "1-sigma of roll and pitch with a tilt reading [deg]", low=0.01, high=45.0
    )
    tilt_noise_deg: float = setting(
        0.2, "1-sigma of the tilt reading against gravity itself [deg]", low=0.0, high=45.0
    )
    unevenness: float = setting(0.01, "height of bumps that are still floor [m]", low=0.0, high=0.5)
    steepest_deg: float = setting(
        20.0, "steepest ground that is still a way, not an obstacle [deg]", low=1.0, high=45.0
    )
    least_support: float = setting(
        0.3,
        "share of the pixels that could be floor which must be, or no floor is seen",
        low=0.0,
        high=1.0,
    )
    least_share: float = setting(
        0.01,
        "share of the image that the floor must cover, or no floor is seen",
        low=0.0,
        high=1.0,
    )
    noise: float = setting(
        0.5, "1-sigma of disparity where no floor tells it [px]", low=0.01, high=5.0
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection(Table):
    """From disparity and floor to obstacles, holes, terrain and the free way."""

    least_height: float = setting(
        0.09,
        "lowest thing that is reported: a 10 cm box less the error of its height [m]",
        low=0.01,
        high=1.0,
    )
    least_area: float = setting(
        0.003,
        "smallest outline that is reported [m²]: 3 cm by 10 cm stays, a blade of grass does not",
        low=0.0,
        high=1.0,
    )
    low_height: float = setting(
        0.35,
        "what does not rise above this (kerbs, banks) does not join what does [m]",
        low=0.0,
        high=5.0,
    )
    least_pixels: int = setting(50, "smallest thing that is reported [px]", low=3, high=10000)
    least_fill: float = setting(
        0.25, "share of its outline that a thing's pixels must cover", low=0.0, high=1.0
    )
    farthest: float = setting(20.0, "how far to look [m]", low=1.0, high=200.0)
    clearance: float = setting(
        2.0, "what hangs higher than this does not block the way [m]", low=0.1, high=10.0
    )
    sigmas: float = setting(
        3.0,
        "how many sigmas off the floor a pixel must be to stand on it or lie below it",
        low=1.0,
        high=10.0,
    )
    bias: float = setting(
        0.15,
        "1-sigma of the disparity error that all pixels of a thing share [px]",
        low=0.0,
        high=2.0,
    )
    bearing_step_deg: float = setting(
        2.0, "step between the directions of the free range [deg]", low=0.1, high=15.0
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """The whole configuration."""

    matching: Matching = field(default_factory=Matching)
    ground: GroundSearch = field(default_factory=GroundSearch)
    detection: Detection = field(default_factory=Detection)

    @classmethod
    def load(cls, path: Path) -> "Config":
        """Read a TOML file; keys it does not name keep their defaults.

        The path of a model is taken from the file's folder.

        Raises
        ------
        ConfigError
            If the file cannot be read, a key is unknown or a value is out of range.
        """
        try:
            tables = tomllib.loads(path.read_text(encoding="utf-8"))
            tables.pop("devices", None)  # what is plugged in: runtime/devices.py reads that
        except OSError as error:
            raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ConfigError(f"{path}: is not TOML: {error}") from error
        try:
            return _with_model_from(path.parent, cls.from_tables(tables))
        except ConfigError as error:
            raise ConfigError(f"{error} (in {path})") from error

    @classmethod
    def from_tables(cls, tables: dict[str, Any]) -> "Config":
        """Build the configuration from nested dictionaries, as TOML gives them."""
        known = {f.name: f.default_factory for f in fields(cls)}
        values = {}
        for name, table in tables.items():
            require_known(name, known, what="table")
            kind: Any = known[name]
            if not isinstance(table, dict):
                raise ConfigError(f"{name} = {table!r}: expected a table [{name}]")
            for key in table:
                require_known(key, {f.name for f in fields(kind)}, what=f"key {name}.")
            values[name] = kind(**table)
        return cls(**values)

    def to_toml(self) -> str:
        """Return the configuration as TOML with the meaning of each number as a comment."""
        lines = []
        for table in fields(self):
            stage = getattr(self, table.name)
            lines += [f"# {(type(stage).__doc__ or '').splitlines()[0]}", f"[{table.name}]"]
            for item in fields(stage):
                lines.append(f"# {item.metadata['doc']}")
                lines.append(f"{item.name} = {_toml(getattr(stage, item.name))}")
            lines.append("")
        return "\n".join(lines)


def _with_model_from(folder: Path, config: Config) -> Config:
    """Return `config` with a relative path of its model taken from `folder`."""
    matching = config.matching
    if not matching.model:
        return config
    return replace(config, matching=replace(matching, model=str(folder / matching.model)))


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    # What JSON escapes in a text, TOML escapes alike.
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def require_known(name: str, known: Any, *, what: str) -> None:
    """Raise `ConfigError` naming the nearest valid word when `name` is not in `known`.

    Examples
    --------
    >>> require_known("heigth", ["height", "width"], what="key mount.")
    Traceback (most recent call last):
    bearcub.errors.ConfigError: unknown key mount.heigth: did you mean height?
    """
    if name in known:
        return
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}?" if near else f"valid are {', '.join(sorted(known))}"
    space = "" if what.endswith(".") else " "
    raise ConfigError(f"unknown {what}{space}{name}: {hint}")
