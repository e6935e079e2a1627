"""README.md and docs/: their examples run, their output is the real one, their links lead on."""

import contextlib
import doctest
import io
import json
import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import bearcub.sample
from bearcub import Pipeline, Rig
from bearcub.cli.main import COMMANDS, build_parser, main
from bearcub.clock import MonotonicClock
from bearcub.emulators import PtyHost
from bearcub.emulators.kinds import KINDS
from bearcub.messages import Answer, Hole
from bearcub.stereo import write_disparity
from bearcub.stereo.native import reason_missing

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!\w+:)([^)#]*)(?:#([^)]*))?\)")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def blocks(page: Path, language: str) -> list[str]:
    found = BLOCK.findall(page.read_text(encoding="utf-8"))
    return [text for kind, text in found if kind == language]


def pages_with(language: str) -> list[Any]:
    return [pytest.param(page, id=page.name) for page in PAGES if blocks(page, language)]


def commands() -> list[Any]:
    """Every ``bearcub`` line of the pages but those that take minutes, which have own tests."""
    lines = [
        (page.name, line.partition(" #")[0].strip())
        for page in PAGES
        for block in blocks(page, "sh")
        for line in block.splitlines()
        if line.startswith("bearcub ") and line.split()[1] not in ("bench", "evaluate")
    ]
    return [pytest.param(line, id=f"{name}: {line}") for name, line in lines]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a reader stands: with the files that the examples name, made of the sample."""
    sample = bearcub.sample.load()
    for source in (sample.left, sample.right, sample.rig):
        shutil.copy(source, tmp_path / source.name)
    for side, picture in (("left", sample.left), ("right", sample.right)):
        (tmp_path / "drive" / side).mkdir(parents=True)
        for frame in ("1.png", "2.png"):
            shutil.copy(picture, tmp_path / "drive" / side / frame)
    (tmp_path / "calib.txt").write_text(
        "P0: 386 0 319.5 0 0 386 239.5 0 0 0 1 0\nP1: 386 0 319.5 -46.32 0 386 239.5 0 0 0 1 0\n"
    )
    (tmp_path / "robot.toml").write_text(blocks(ROOT / "README.md", "toml")[1])
    (tmp_path / "mine.toml").write_text("[matching]\nuniqueness = 12\n")
    u, v = np.arange(640), np.arange(480)[:, np.newaxis]
    floor = np.maximum(0.1 * v - 20 + 0 * u, 0).astype(np.float32)  # the paper's: row = 200 + 10 d
    write_disparity(tmp_path / "depth.pgm", floor, encoding="pointgrey16")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def scene(folder: Path) -> None:
    """What ``bearcub simulate`` saves, as far as it is read again."""
    shutil.copytree(folder / "drive", folder / "scene")
    shutil.copy(folder / "rig.toml", folder / "scene")
    (folder / "scene" / "tilt.csv").write_text("pitch_deg,roll_deg\n0,12\n,\n")


@pytest.fixture
def tilt_sensor(folder: Path) -> Iterator[None]:
    """What robot.toml says is plugged in."""
    device = KINDS["cxtilt"].emulator()
    with PtyHost(device, clock=MonotonicClock(), link=folder / "tilt"):
        yield


@pytest.fixture
def answer() -> Answer:
    """The sample's, with a hole put in, so that every key is there."""
    sample = bearcub.sample.load()
    left, right = (cv2.imread(str(path)) for path in (sample.left, sample.right))
    values: dict[str, Any] = dict.fromkeys((item.name for item in fields(Hole)), 1.0)
    found = Pipeline(Rig.load(sample.rig))(np.asarray(left), np.asarray(right), roll_deg=12)
    return replace(found, holes=(Hole(**values),))


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("page", pages_with("python"))
def test_python_examples_run(page: Path) -> None:
    names: dict[str, Any] = {"__name__": page.stem}
    for text in blocks(page, "python"):
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(text, str(page), "exec"), names)  # noqa: S102 (our own pages)
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    for name, value in list(names.items()):
        if getattr(value, "__module__", "") == page.stem and value.__doc__:
            runner.run(parser.get_doctest(value.__doc__, names, name, str(page), 0))
    assert runner.summarize().failed == 0


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("command", commands())
def test_commands_run(
    command: str, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    words = shlex.split(command.partition(" > ")[0])[1:]
    if words[0] == "simulate" and "--list" not in words:
        request.getfixturevalue("opengl")
    if "scene/left" in words:
        request.getfixturevalue("scene")
    if words[0] == "doctor":
        request.getfixturevalue("tilt_sensor")
        words += ["--no-bench"]  # which has its own test
    if words[0] == "emulate":
        words += ["--seconds", "0.1"]  # a reader ends it with Ctrl-C
    code, out = main(words), capsys.readouterr().out
    # the doctor looks at real time, in which a busy computer may keep a device waiting
    assert code == 0 or (words[0] == "doctor" and code == 1 and "tilt (tilt), cxtilt: " in out)
    assert out


def test_the_readme_names_every_command() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"bearcub {name}" not in readme] == []


def test_every_option_in_the_examples_of_evaluate_exists() -> None:
    """They take minutes, so they are only read."""
    lines = [line for block in blocks(ROOT / "README.md", "sh") for line in block.splitlines()]
    shown = [shlex.split(line)[1:] for line in lines if line.startswith("bearcub evaluate")]
    assert {words[1] for words in shown} == {"sim", "folder", "drive", "real"}
    for words in shown:
        build_parser(words).parse_args(words)


def test_the_readme_shows_the_rig_of_the_sample(tmp_path: Path) -> None:
    text, _ = blocks(ROOT / "README.md", "toml")
    (tmp_path / "rig.toml").write_text(text)
    assert Rig.load(tmp_path / "rig.toml") == Rig.load(bearcub.sample.load().rig)


@pytest.mark.skipif(bool(reason_missing()), reason="the README shows the native matcher's answer")
def test_the_readme_shows_what_detect_prints(capsys: pytest.CaptureFixture[str]) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- begin bearcub detect -->\n```text\n(.*?)```", readme, re.DOTALL)
    assert found
    assert main(["detect"]) == 0
    shown, real = _comparable(found[1]), _comparable(capsys.readouterr().out)
    refresh = "run tools/refresh_readme.py"
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", real), refresh
    for mine, its in zip(NUMBER.findall(shown), NUMBER.findall(real), strict=True):
        assert abs(float(mine) - float(its)) <= _slack(mine), f"{mine}, now {its}: {refresh}"


def _comparable(text: str) -> str:
    """Leave out the timing, and where it is farthest: several directions are, by a hair."""
    lines = [line for line in text.splitlines() if not line.startswith("Time")]
    return re.sub(r" +", " ", re.sub("; farthest .*", "", "\n".join(lines)))


def _slack(number: str) -> float:
    """Return five of the last digit: versions of OpenCV differ by that much in single pixels."""
    return 5.01 * 10.0 ** -len(number.partition(".")[2])


def test_the_readme_names_the_commands_that_do_everything() -> None:
    shell = "".join(blocks(ROOT / "README.md", "sh"))
    assert "pip install . && bearcub detect\n" in shell
    assert "pip install '.[dev]' && pytest\n" in shell
    assert "pip install '.[dev]' && pytest" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_conventions_show_the_layers_that_are_enforced() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = project["tool"]["importlinter"]["contracts"][0]["layers"]
    page = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```\n(cli > .*?)```", page, re.MULTILINE | re.DOTALL)
    assert " ".join(shown.split()).split(" > ") == layers
    for name in re.findall(r"\w+", shown):
        assert re.search(rf"^\|[^|]*`{name}`", page, re.MULTILINE), name


def test_the_picture_of_the_readme_is_the_annotated_sample() -> None:
    picture = cv2.imread(str(ROOT / "docs" / "images" / "sample.jpg"))
    assert picture is not None
    left = cv2.imread(str(bearcub.sample.load().left))
    assert left is not None
    sky = np.s_[: left.shape[0] // 8, : left.shape[1] // 2]
    assert np.abs(picture[sky].astype(float) - left[sky]).mean() < 10.0


def test_the_answer_page_shows_every_key_of_the_json(answer: Answer) -> None:
    page = ROOT / "docs" / "answer.md"
    (text,) = blocks(page, "json")
    assert _keys(json.loads(text)) == _keys(answer.to_dict())
    prose = BLOCK.sub("", page.read_text(encoding="utf-8"))
    for key in _keys(json.loads(text)):
        assert f"`{key.rpartition('.')[2].removesuffix('[]')}" in prose, key


def _keys(value: Any, path: str = "") -> set[str]:
    if isinstance(value, list):
        return set().union(*(_keys(item, f"{path}[]") for item in value)) if value else set()
    if not isinstance(value, dict):
        return set()
    below = {f"{path}.{key}".lstrip(".") for key in value}
    return below.union(*(_keys(item, f"{path}.{key}".lstrip(".")) for key, item in value.items()))


@pytest.mark.parametrize("page", [pytest.param(page, id=page.name) for page in PAGES])
def test_links_lead_somewhere(page: Path) -> None:
    for target, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        path = (page.parent / target) if target else page
        assert path.exists(), target
        assert not anchor or anchor in _anchors(path), f"{target}#{anchor}"


def _anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
