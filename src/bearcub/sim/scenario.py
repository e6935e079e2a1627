"""The catalogue of worlds: named, seeded scenarios, each a TOML file of this package.

`bearcub.sim.sweeps` says what a file may hold, `bearcub.sim.sampling` how frames are drawn.
"""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from bearcub.config import require_known
from bearcub.errors import ConfigError
from bearcub.sim import sampling
from bearcub.sim.case import Case
from bearcub.sim.sweeps import Plan

__all__ = ["Case", "Scenario", "load", "names", "read"]

_FOLDER = Path(__file__).parent / "scenarios"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A family of frames under one name."""

    name: str
    plan: Plan

    @property
    def about(self) -> str:
        """What it shows, in a sentence."""
        return self.plan.about

    def with_seed(self, seed: int) -> "Scenario":
        """Return the same sweeps with everything drawn anew."""
        return replace(self, plan=replace(self.plan, seed=seed))

    def __len__(self) -> int:
        return self.plan.worlds * self.plan.frames

    def cases(self, *, quick: bool = False) -> Iterator[Case]:
        """Yield its frames, those of one world after each other.

        Parameters
        ----------
        quick : bool
            Only as many as the scenario gives to the quick suite, evenly spread.
        """
        total = len(self)
        wanted = min(self.plan.quick, total) if quick else total
        chosen = [int((k + 0.5) * total / wanted) for k in range(wanted)]
        yield from sampling.cases(self.name, self.plan, chosen)


@cache
def names() -> tuple[str, ...]:
    """Return the names of all scenarios, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def load(name: str) -> Scenario:
    """Return a scenario of the catalogue.

    Raises
    ------
    ConfigError
        If there is none of that name.
    """
    require_known(name, names(), what="scenario")
    return read(_FOLDER / f"{name}.toml")


def read(path: Path) -> Scenario:
    """Return the scenario in a TOML file, under the file's name.

    Raises
    ------
    ConfigError
        If the file cannot be read, a key is unknown or a value is out of range.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: is not TOML: {error}") from error
    try:
        plan = Plan.from_toml(tables)
    except ConfigError as error:
        raise ConfigError(f"{error} (in {path.name})") from error
    return Scenario(name=path.stem, plan=plan)
