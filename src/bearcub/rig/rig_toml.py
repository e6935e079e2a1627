"""The project's rig file: TOML with ``[camera]``, ``[mount]`` and, for raw pairs, ``[lens]``."""

import reprlib
import tomllib
from collections.abc import Collection, Iterator
from dataclasses import fields
from typing import Any

from bearcub.config import require_known
from bearcub.errors import FormatError
from bearcub.rig.camera import Camera, Lens
from bearcub.rig.mount import MOUNT_KEYS, Mount
from bearcub.rig.values import Calibration, distortion, lookup, number, rotation, whole

_CAMERA_KEYS = tuple(item.name for item in fields(Camera))
_LENS_KEYS = tuple(item.name for item in fields(Lens))


def read_toml(text: str) -> Calibration:
    """Read a rig TOML.

    Raises
    ------
    BearcubError
        If it is no TOML, a key is missing or unknown, or a value is not of its type.
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"is not TOML: {error}") from None
    root = _Table(tables, "", ("camera", "mount", "lens"))
    lenses = root.table("lens", ("left", "right")) if "lens" in tables else None
    mount = root.table("mount", MOUNT_KEYS) if "mount" in tables else None
    return Calibration(
        camera=_camera(root.table("camera", _CAMERA_KEYS)),
        mount={key: mount.number(key) for key in mount} if mount else {},
        lenses=(_lens(lenses, "left"), _lens(lenses, "right")) if lenses else None,
    )


class _Table:
    """A table of the file, whose messages name the full key."""

    def __init__(self, values: Any, path: str, known: Collection[str]) -> None:
        if not isinstance(values, dict):
            raise FormatError(f"{path[:-1]} = {reprlib.repr(values)}: expected a table")
        for key in values:
            require_known(key, known, what=f"key {path}" if path else "table")
        self._path = path
        self._values = {path + key: value for key, value in values.items()}

    def __iter__(self) -> Iterator[str]:
        return (name.removeprefix(self._path) for name in self._values)

    def get(self, key: str) -> Any:
        return lookup(self._values, self._path + key)

    def table(self, key: str, known: Collection[str]) -> "_Table":
        return _Table(self.get(key), f"{self._path}{key}.", known)

    def number(self, key: str) -> float:
        value = self.get(key)
        # Text that reads like a number is one in YAML, but not in TOML.
        return number(None if isinstance(value, str) else value, self._path + key)


def _camera(table: _Table) -> Camera:
    return Camera(
        width=whole(table.get("width"), "camera.width"),
        height=whole(table.get("height"), "camera.height"),
        fx=table.number("fx"),
        fy=table.number("fy"),
        cx=table.number("cx"),
        cy=table.number("cy"),
        baseline=table.number("baseline"),
        doffs=table.number("doffs") if "doffs" in table else 0.0,
    )


def _lens(lenses: _Table, side: str) -> Lens:
    table = lenses.table(side, _LENS_KEYS)
    where = f"lens.{side}."
    model, coefficients = distortion(
        table.get("distortion"), table.get("model"), f"{where}distortion"
    )
    return Lens(
        fx=table.number("fx"),
        fy=table.number("fy"),
        cx=table.number("cx"),
        cy=table.number("cy"),
        model=model,
        distortion=coefficients,
        rotation=rotation(table.get("rotation"), f"{where}rotation"),
    )


def write_toml(camera: Camera, mount: Mount, lenses: tuple[Lens, Lens] | None) -> str:
    """Return the rig TOML of these values."""
    lines = ["# the rectified pair: px, px, m", "[camera]"]
    lines += [f"{name} = {_toml(getattr(camera, name))}" for name in _CAMERA_KEYS]
    lines += ["", "# the left camera on the body: m, deg", "[mount]"]
    lines += [f"{name} = {float(value)!r}" for name, value in mount.to_table().items()]
    for side, lens in zip(("left", "right"), lenses or (), strict=False):
        lines += ["", "# before rectification: px, rows of rectified_from_raw", f"[lens.{side}]"]
        lines += [f"{name} = {_toml(getattr(lens, name))}" for name in _LENS_KEYS]
    return "\n".join([*lines, ""])


def _toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(repr(item) for item in value)}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)
