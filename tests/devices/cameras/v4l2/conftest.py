"""Runs the tests of this folder in a process of their own, in which /dev/video0 is emulated.

A library that answers system calls in the kernel's stead has to be there before Python is. So the
tests' process starts a second pytest with `emulated_v4l2.c` preloaded, which runs this folder's
tests; in the first one each of them only tells how it ended there.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
REPORTS = "EMULATED_V4L2_REPORTS"  # in the second process: the file for its reports
COMPILE = ["cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC"]


class _Failed(Exception):  # noqa: N818 (a test's, no error)
    """The text says how it failed in the other process."""


class _Elsewhere(pytest.Item):
    """A test that runs in the second process."""

    def __init__(self, *, there: pytest.Item, run: "_Run", **node: Any) -> None:
        super().__init__(**node)
        self._there = there
        self._run = run

    def runtest(self) -> None:
        for report in self._run.reports(self.nodeid):
            if report["outcome"] == "skipped":
                pytest.skip(report["text"])
            if report["outcome"] == "failed":
                raise _Failed(report["text"])

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, _Failed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        return self._there.reportinfo()


class _Run:
    """The second process; it is started when the first test wants to know."""

    def __init__(self, config: pytest.Config, names: list[str]) -> None:
        self._config = config
        self._names = names
        self._reports: dict[str, list[dict[str, str]]] | None = None
        self._said = ""

    def reports(self, name: str) -> list[dict[str, str]]:
        """How setup, call and teardown of a test ended; what has no teardown has failed."""
        if self._reports is None:
            self._reports = defaultdict(list)
            for report in self._start():
                self._reports[report["name"]].append(report)
        found = self._reports[name]
        if not any(report["when"] == "teardown" for report in found):
            found.append({"outcome": "failed", "text": self._said, "when": "teardown"})
        return found

    def _start(self) -> list[dict[str, str]]:
        with tempfile.TemporaryDirectory() as folder:
            return self._start_in(Path(folder))

    def _start_in(self, folder: Path) -> list[dict[str, str]]:
        library, reports = folder / "emulated_v4l2.so", folder / "reports"
        reports.touch()
        self._call([*COMPILE, "-o", str(library), str(HERE / "emulated_v4l2.c"), "-ldl"])
        if library.exists():
            preload = " ".join(filter(None, (str(library), os.environ.get("LD_PRELOAD"))))
            options = ["-c", str(self._config.inipath), "-m", "", "-p", "no:cacheprovider"]
            self._call(
                [sys.executable, "-m", "pytest", *options, *self._names],
                **{"LD_PRELOAD": preload, REPORTS: str(reports)},
            )
        return [json.loads(line) for line in reports.read_text(encoding="utf-8").splitlines()]

    def _call(self, command: list[str], **environment: str) -> None:
        done = subprocess.run(
            command,
            cwd=self._config.rootpath,
            env=os.environ | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        self._said += done.stdout + done.stderr


@pytest.hookimpl(trylast=True)  # after others have left some out
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    ours = [item for item in items if item.path.is_relative_to(HERE)]
    if REPORTS in os.environ or not ours:
        return
    run = _Run(config, [item.nodeid for item in ours])
    for at, item in enumerate(items):
        if item in ours and item.parent:
            items[at] = _Elsewhere.from_parent(item.parent, name=item.name, there=item, run=run)
            if sys.platform != "linux" or not shutil.which("cc"):
                missing = "V4L2 is emulated on Linux, with a C compiler (cc)"
                items[at].add_marker(pytest.mark.skip(reason=missing))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """In the second process: write down how it ended."""
    if REPORTS not in os.environ:
        return
    parts = {"name": report.nodeid, "when": str(report.when), "outcome": report.outcome}
    text = "\n".join([report.longreprtext, *(content for _, content in report.sections)])
    with Path(os.environ[REPORTS]).open("a", encoding="utf-8") as file:
        file.write(json.dumps({**parts, "text": text}) + "\n")
