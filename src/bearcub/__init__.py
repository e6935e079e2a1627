"""Stereo obstacle perception and avoidance for ground robots, on a CPU.

``Pipeline(Rig.load("rig.toml"))(left, right)`` answers one frame.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bearcub.pipeline import Pipeline
    from bearcub.rig.model import Rig

__all__ = ["Pipeline", "Rig"]

if not TYPE_CHECKING:  # type checkers see the imports above, and that there is nothing else
    _HOMES = {"Pipeline": "bearcub.pipeline", "Rig": "bearcub.rig.model"}

    def __getattr__(name: str) -> object:
        """Import a public name when it is first asked for: ``bearcub --help`` needs no OpenCV."""
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(_HOMES[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        """List the public names, whether imported yet or not."""
        return sorted({*globals(), *__all__})
