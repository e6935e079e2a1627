"""The rules of docs/conventions.md that a machine can check and no linter does."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from pathlib import Path
from types import FunctionType

import pytest

from bearcub.config import Config

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "bearcub"
LONGEST_FILE = 500  # lines that are not blank

FILES = {str(path.relative_to(SOURCE)): path for path in sorted(SOURCE.rglob("*.py"))}
KEYS = [
    (table.name, item.name)
    for table in fields(Config)
    for item in fields(getattr(Config(), table.name))
]


@cache
def nodes(name: str) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(ast.parse(FILES[name].read_text(encoding="utf-8"))))


def imports(name: str) -> set[str]:
    """Return the modules that a file imports from elsewhere."""
    found = set()
    for node in nodes(name):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def public_functions() -> Iterator[tuple[FunctionType, str]]:
    """Yield what the packages offer in their ``__all__``, methods with their class's docstring."""
    packages = [
        "bearcub",
        *(f"bearcub.{path.parent.name}" for path in SOURCE.glob("*/__init__.py")),
    ]
    for package in map(importlib.import_module, packages):
        for thing in (getattr(package, name) for name in getattr(package, "__all__", ())):
            members = vars(thing).values() if inspect.isclass(thing) else (thing,)
            for function in (getattr(member, "__func__", member) for member in members):
                if inspect.isfunction(function) and not function.__name__.startswith("_"):
                    docs = {inspect.getdoc(thing) or "", inspect.getdoc(function) or ""}
                    yield function, "\n".join(docs)


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_short_enough_to_be_read(name: str) -> None:
    lines = FILES[name].read_text(encoding="utf-8").splitlines()
    assert sum(1 for line in lines if line.strip()) <= LONGEST_FILE


def test_only_the_command_line_prints() -> None:
    calls = {
        name
        for name in FILES
        for node in nodes(name)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "print"
    }
    assert calls
    assert {name.split("/")[0] for name in calls} == {"cli"}


def test_only_the_clock_asks_for_the_time() -> None:
    assert {name for name in FILES if imports(name) & {"time", "datetime"}} == {"clock.py"}


def test_nothing_depends_on_environment_variables() -> None:
    """But MuJoCo, and FFmpeg and V4L2 in OpenCV, which can be told in no other way, once each."""
    told = {"sim/mujoco/library.py", "devices/images.py", "devices/cameras/opencv.py"}
    for name in FILES.keys() - told:
        names = {getattr(node, "attr", getattr(node, "id", "")) for node in nodes(name)}
        assert not names & {"environ", "getenv", "putenv"}, name


def test_every_parameter_of_a_public_function_is_explained() -> None:
    explained = 0
    for function, doc in public_functions():
        names = inspect.signature(function).parameters.keys() - {"self", "cls"}
        if len(names) > 2:  # of fewer, the first line may say it all
            assert [name for name in names if not re.search(rf"\b{name}\b", doc)] == [], function
            explained += 1
    assert explained > 8


def test_a_parameters_section_names_every_parameter() -> None:
    sections = 0
    for name in FILES:
        for node in nodes(name):
            if not isinstance(node, ast.FunctionDef):
                continue
            _, found, section = (ast.get_docstring(node) or "").partition("Parameters\n---")
            given = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
            missing = {arg.arg for arg in given if not re.search(rf"\b{arg.arg}\b", section)}
            assert not found or missing <= {"self", "cls"}, f"{name}: {node.name}: {missing}"
            sections += bool(found)
    assert sections > 50


@pytest.mark.parametrize(("table", "key"), KEYS)
def test_every_key_of_the_configuration_is_used_and_explained(table: str, key: str) -> None:
    uses = re.compile(rf"\b{table}\.{key}\b")
    assert [name for name, path in FILES.items() if uses.search(path.read_text(encoding="utf-8"))]
    tuning = (ROOT / "docs" / "tuning.md").read_text(encoding="utf-8")
    section = tuning.partition(f"## `[{table}]`")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (`.*?) \|", section, re.MULTILINE)
    assert f"`{key}`" in ", ".join(rows)


def test_the_tuning_page_explains_no_key_that_is_not_there() -> None:
    tuning = (ROOT / "docs" / "tuning.md").read_text(encoding="utf-8")
    for section in re.split(r"^## ", tuning, flags=re.MULTILINE)[1:]:
        table = re.match(r"`\[(\w+)\]`", section)
        for row in re.findall(r"^\| (`.*?) \|", section, re.MULTILINE) if table else []:
            for key in re.findall(r"`(\w+)`", row):
                assert table
                assert (table[1], key) in KEYS
