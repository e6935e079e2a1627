"""The command line run inside the test's process, on a small rendered scene."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import pytest

from bearcub.cli.main import main
from bearcub.sim.render import Rendered, render
from bearcub.sim.scenes import garbage_can, paper_rig
from bearcub.stereo import write_disparity

WIDTH, HEIGHT = 320, 240


@dataclass(frozen=True)
class Files:
    """A rendered pair with its rig and its exact disparity, as files."""

    folder: Path
    rendered: Rendered

    @property
    def left(self) -> str:
        return str(self.folder / "left.png")

    @property
    def right(self) -> str:
        return str(self.folder / "right.png")

    @property
    def rig(self) -> str:
        return str(self.folder / "rig.toml")

    @property
    def disparity(self) -> str:
        """Point Grey's 16-bit PGM."""
        return str(self.folder / "disparity.pgm")


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    """The garbage can 3.05 m ahead, 2 deg left, 0.45 m wide and 0.70 m high; level robot."""
    folder = tmp_path_factory.mktemp("scene")
    rig = paper_rig(width=WIDTH, height=HEIGHT)
    rendered = render(garbage_can(), rig, noise="weak", supersample=1)
    cv2.imwrite(str(folder / "left.png"), rendered.left)
    cv2.imwrite(str(folder / "right.png"), rendered.right)
    (folder / "rig.toml").write_text(rig.to_toml())
    write_disparity(folder / "disparity.pgm", rendered.disparity, encoding="pointgrey16")
    return Files(folder, rendered)


@dataclass(frozen=True)
class Outcome:
    """What a command left behind."""

    code: int
    out: str
    err: str


Bearcub = Callable[..., Outcome]


@pytest.fixture
def bearcub(capsys: pytest.CaptureFixture[str]) -> Bearcub:
    """Run ``bearcub`` with these arguments."""

    def run(*argv: object) -> Outcome:
        capsys.readouterr()
        code = main([str(word) for word in argv])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return run
