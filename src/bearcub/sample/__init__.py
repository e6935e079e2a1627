"""The embedded sample: the paper's garbage can, 10 ft ahead of a robot rolled by 12 deg.

Rendered by ``tools/render_sample.py`` with the simulator's medium sensor model.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from bearcub.messages import Tilt


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Where the files of the sample are, and what the tilt sensor read.

    Attributes
    ----------
    left, right : Path
        The rectified pair, colour PNG.
    rig : Path
        Its rig, TOML.
    truth : Path
        JSON of the truth; see `bearcub.sim.truth.describe`.
    tilt : Tilt
        Of the body against gravity [rad].
    """

    left: Path
    right: Path
    rig: Path
    truth: Path
    tilt: Tilt


def load() -> Sample:
    """Find the sample's files.

    Examples
    --------
    >>> sample = load()
    >>> sample.left.name, f"{sample.tilt.roll:.3f}"
    ('left.png', '0.209')
    """
    folder = Path(__file__).parent
    truth = folder / "truth.json"
    reading = json.loads(truth.read_text(encoding="utf-8"))["tilt"]
    return Sample(
        left=folder / "left.png",
        right=folder / "right.png",
        rig=folder / "rig.toml",
        truth=truth,
        tilt=Tilt(pitch=math.radians(reading["pitch_deg"]), roll=math.radians(reading["roll_deg"])),
    )
