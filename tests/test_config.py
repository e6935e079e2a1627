"""The configuration file: what it accepts, what it refuses and in which words."""

import re
import tomllib
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest

import bearcub
from bearcub.config import Config, Detection, GroundSearch, Matching
from bearcub.errors import BearcubError, ConfigError


def stored(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_printing_the_defaults_and_loading_them_is_the_identity(tmp_path: Path) -> None:
    printed = Config().to_toml()
    assert Config.load(stored(tmp_path, printed)) == Config()
    assert Config.load(stored(tmp_path, printed)).to_toml() == printed


def test_changed_values_survive_printing_and_loading(tmp_path: Path) -> None:
    config = Config(
        matching=Matching(matcher="bm", block_size=15, sharpen=False),
        ground=GroundSearch(noise=0.123456789),
        detection=Detection(farthest=1e2, least_height=0.1),
    )
    assert Config.load(stored(tmp_path, config.to_toml())) == config


def test_every_printed_number_has_its_meaning_above_it() -> None:
    lines = Config().to_toml().splitlines()
    values = [number for number, line in enumerate(lines) if " = " in line and line[0] != "#"]
    assert len(values) == sum(len(fields(getattr(Config(), t.name))) for t in fields(Config))
    assert all(re.match(r"# \w.{8,}", lines[number - 1]) for number in values)


def test_file_that_names_one_key_keeps_every_other_default(tmp_path: Path) -> None:
    config = Config.load(stored(tmp_path, "[detection]\nfarthest = 7.5\n"))
    assert config == Config(detection=Detection(farthest=7.5))
    assert config.detection.least_height == Detection().least_height


def test_empty_file_is_the_default(tmp_path: Path) -> None:
    assert Config.load(stored(tmp_path, "")) == Config()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[detection]\nfarhtest = 7\n", "unknown key detection.farhtest: did you mean farthest?"),
        ("[detektion]\nfarthest = 7\n", "unknown table detektion: did you mean detection?"),
        ("[zzzz]\n", "unknown table zzzz: valid are detection, ground, matching"),
        ("detection = 3\n", "detection = 3: expected a table [detection]"),
        ("[detection]\nfarthest = 0.5\n", "detection.farthest = 0.5: must be from 1 to 200"),
        ("[detection]\nfarthest = nan\n", "detection.farthest = nan: must be from 1 to 200"),
        ("[detection]\nfarthest = inf\n", "detection.farthest = inf: must be from 1 to 200"),
        ("[detection]\nfarthest = '7'\n", "detection.farthest = '7': expected float"),
        ("[detection]\nleast_pixels = true\n", "detection.least_pixels = True: expected int"),
        ("[detection]\nleast_pixels = 30.0\n", "detection.least_pixels = 30.0: expected int"),
        ("[detection]\nfarthest = true\n", "detection.farthest = True: expected float"),
        ("[matching]\nsharpen = 1\n", "matching.sharpen = 1: expected bool"),
        (
            "[matching]\nmatcher = 'sgmb'\n",
            "matching.matcher = 'sgmb': must be one of native, sgbm, bm",
        ),
        ("[matching\n", "is not TOML"),
    ],
)
def test_what_is_wrong_is_named_with_what_is_allowed_and_the_file(
    tmp_path: Path, text: str, words: str
) -> None:
    path = stored(tmp_path, text)
    with pytest.raises(ConfigError) as error:
        Config.load(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_whole_number_is_accepted_where_a_fraction_is_expected(tmp_path: Path) -> None:
    config = Config.load(stored(tmp_path, "[detection]\nfarthest = 30\n"))
    assert config.detection.farthest == 30


def test_file_that_is_absent_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.toml: cannot be read"):
        Config.load(tmp_path / "nowhere.toml")


def test_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_bytes(b"\xff\xfe\x00[detection]")
    with pytest.raises(ConfigError, match="is not TOML"):
        Config.load(path)


def test_values_are_checked_without_a_file_too() -> None:
    with pytest.raises(ConfigError, match=r"ground\.steepest_deg = 90: must be from 1 to 45"):
        GroundSearch(steepest_deg=90)


def test_errors_are_value_errors_for_who_does_not_know_them() -> None:
    assert issubclass(ConfigError, ValueError)
    assert issubclass(ConfigError, BearcubError)


def test_configuration_cannot_be_changed_after_the_check() -> None:
    with pytest.raises(FrozenInstanceError):
        Config().detection.farthest = -1  # type: ignore[misc]


def test_every_default_lies_in_its_range_and_is_printed_as_toml() -> None:
    tables = tomllib.loads(Config().to_toml())
    assert Config.from_tables(tables) == Config()
    assert set(tables) == {"matching", "ground", "detection"}


def test_every_key_is_used_outside_the_configuration() -> None:
    package = Path(bearcub.__file__).parent
    code = "\n".join(
        path.read_text(encoding="utf-8")
        for path in package.rglob("*.py")
        if path.name != "config.py"
    )
    unused = [
        f"{table.name}.{item.name}"
        for table in fields(Config)
        for item in fields(getattr(Config(), table.name))
        if not re.search(rf"\b(matching|ground|detection)\.{item.name}\b", code)
    ]
    assert unused == []
