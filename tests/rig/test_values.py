"""A rig whose numbers cannot be right is refused by name, value and hint."""

from dataclasses import replace
from pathlib import Path

import pytest

from bearcub.errors import BearcubError, CalibrationError, ConfigError, FormatError
from bearcub.rig import Camera, Mount, Rig

GOOD = {
    "camera": {
        "width": "640",
        "height": "480",
        "fx": "386.0",
        "fy": "386.0",
        "cx": "319.5",
        "cy": "239.5",
        "baseline": "0.12",
    },
    "mount": {"height": "1.2", "pitch_deg": "5.9"},
}


def write(path: Path, tables: dict[str, dict[str, str]]) -> Path:
    """Write the tables as a rig TOML."""
    lines = []
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {value}" for key, value in table.items())]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def changed(table: str, key: str, value: str) -> dict[str, dict[str, str]]:
    """Return the good tables with one value set."""
    return {**GOOD, table: {**GOOD[table], key: value}}


BAD: list[tuple[str, str, str, type[BearcubError], str]] = [
    ("camera", "baseline", "-0.12", ConfigError, r"baseline = -0\.12 m is negative.*swapped"),
    ("camera", "baseline", "0", ConfigError, "baseline = 0 m"),
    ("camera", "baseline", "120.0", ConfigError, "baseline = 120 m.*looks like millimetres"),
    ("camera", "baseline", "0.00012", ConfigError, "at least 1 mm"),
    ("camera", "baseline", '"0.12"', FormatError, "finite number"),
    ("camera", "fx", "0.0", ConfigError, "fx = 0: expected a positive focal length"),
    ("camera", "fx", "0.6", ConfigError, r"fx = 0\.6: expected a focal length of 64 to 32000 px"),
    ("camera", "fy", "-386", ConfigError, "fy = -386"),
    ("camera", "fy", "100", ConfigError, "factor of 2"),
    ("camera", "fx", "nan", FormatError, "fx = .*finite"),
    ("camera", "fx", "true", FormatError, "fx = .*finite"),
    ("camera", "cx", "700.0", ConfigError, "cx = 700: the principal point lies outside.*640 px"),
    ("camera", "cy", "-3", ConfigError, "cy = -3"),
    ("camera", "width", "640.5", FormatError, r"width = 640\.5: expected a whole number"),
    ("camera", "width", "0", ConfigError, "camera.width = 0, camera.height = 480"),
    ("camera", "height", "2000000", ConfigError, "16 to 32767 px"),
    ("camera", "doffs", "700", ConfigError, "doffs = 700"),
    ("camera", "basline", "0.12", ConfigError, "unknown key camera.basline: did you mean baseline"),
    ("mount", "heigth", "1", ConfigError, "unknown key mount.heigth: did you mean height"),
    ("mount", "height", "0", ConfigError, "height = 0 m: expected the camera's height"),
    ("mount", "height", "-1.2", ConfigError, r"height = -1\.2 m"),
    ("mount", "height", "25", ConfigError, "at most 20 m"),
    ("mount", "height", "1200", ConfigError, "height = 1200 m.*looks like millimetres"),
    ("mount", "height", "inf", FormatError, "mount.height = inf"),
    ("mount", "pitch_deg", "95", ConfigError, "pitch_deg = 95: expected degrees between -90"),
    ("mount", "roll_deg", "-180", ConfigError, "roll_deg = -180"),
    ("mount", "x", "300", ConfigError, "x = 300 m.*millimetres"),
    ("mount", "height_sigma", "0", ConfigError, "height_sigma: expected a positive"),
]


@pytest.mark.parametrize(("table", "key", "value", "error", "words"), BAD)
def test_refuses_a_value_that_cannot_be_right(
    tmp_path: Path, table: str, key: str, value: str, error: type[BearcubError], words: str
) -> None:
    path = write(tmp_path / "rig.toml", changed(table, key, value))
    with pytest.raises(error, match=words + r".* \(in .*rig\.toml\)$"):
        Rig.load(path)


@pytest.mark.parametrize("key", GOOD["camera"])
def test_names_the_key_that_is_missing(tmp_path: Path, key: str) -> None:
    camera = {name: value for name, value in GOOD["camera"].items() if name != key}
    path = write(tmp_path / "rig.toml", {**GOOD, "camera": camera})
    with pytest.raises(CalibrationError, match=rf"camera\.{key} is missing"):
        Rig.load(path)


def test_refuses_unknown_and_missing_tables(tmp_path: Path) -> None:
    path = write(tmp_path / "rig.toml", {"camra": GOOD["camera"], "mount": GOOD["mount"]})
    with pytest.raises(ConfigError, match="unknown table camra: did you mean camera"):
        Rig.load(path)
    path = write(tmp_path / "rig.toml", {"mount": GOOD["mount"]})
    with pytest.raises(CalibrationError, match="camera is missing"):
        Rig.load(path)
    path = write(tmp_path / "rig.toml", {"camera": GOOD["camera"]})
    with pytest.raises(ConfigError, match="--height"):
        Rig.load(path)
    path.write_text("mount = 3\n[camera]\n", encoding="utf-8")
    with pytest.raises(FormatError, match="mount = 3: expected a table"):
        Rig.load(path)


def test_options_are_checked_like_the_file(tmp_path: Path) -> None:
    path = write(tmp_path / "rig.toml", GOOD)
    with pytest.raises(ConfigError, match="millimetres"):
        Rig.load(path, height=1650.0)
    with pytest.raises(FormatError, match=r"mount\.pitch_deg = nan"):
        Rig.load(path, pitch_deg=float("nan"))


def test_a_rig_made_in_python_can_be_checked() -> None:
    camera = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    rig = Rig(camera=camera, mount=Mount(height=1.2))
    rig.check()
    with pytest.raises(ConfigError, match=r"^camera\.baseline"):
        replace(rig, camera=replace(camera, baseline=-0.12)).check()
    with pytest.raises(ConfigError, match=r"^mount\.pitch_deg = nan"):
        replace(rig, mount=Mount(height=1.2, pitch=float("nan"))).check()
