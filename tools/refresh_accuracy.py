"""Remake docs/accuracy.md: ``python tools/refresh_accuracy.py FOLDER_OF_RECORDINGS``.

The text before the first table and the sentences on what is missed and why stand here.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]

HEAD = """\
# Accuracy

What was promised, what is reached, and the commands that remake the tables:
`python tools/refresh_accuracy.py ../shared/data`, which runs
`bearcub evaluate real ../shared/data`, `bearcub evaluate sample` and `bearcub evaluate scenes`.
All sets run with the default configuration and the same code; thresholds were chosen once, for
all of them. Each command prints the same numbers as a table, with `--json` as one JSON object,
with `--markdown` as they stand here, and `--save DIR` writes every annotated frame.

## What is missed, and why

* **Disparity to answer takes 25 to 40 ms on one core at 640 x 480, not 8 ms** (`bearcub bench`;
  the machine these numbers come from is a shared virtual one). No single stage is to blame:
  fitting and following the floor take about 10 ms in some two hundred small NumPy calls, and a
  dozen passes over 300,000 pixels take 0.2 to 0.6 ms each, because every pass reads and writes
  memory that a compiled loop would keep in registers. It needs a native core.
* The ground's attitude is a mean with a **ramp that begins closer than about one and a half
  times the nearest floor in view**: the floor before it is too short a piece of the image.
* A **step down of 0.3 m at 2.5 m** can make the lower ground the floor when it covers most of
  the image; the mount's height is then off by the step. State `height_sigma` in the rig to
  prevent it.
* **Reflections** of things about as high as the camera in a mirror-like floor can pass for a pit
  in front of them, and a drop can be called a pit.
* The matcher carries the rim of a top face that is seen from above too near: heights come out
  about 2 % high on the sample.
* Slopes and roughness have no recorded truth here; they are checked on rendered scenes only.

## Real recordings

The recordings were made by other people and are not part of the project; a set whose folder is
absent is skipped. The command takes the folder that holds `inria_road`, `kitti_odometry`,
`pothole` and `sslg`.

"""


def evaluated(*arguments: str) -> str:
    """Return what ``bearcub evaluate ARGUMENTS --markdown`` prints, targets missed or not."""
    program = [sys.executable, "-c", "from bearcub.cli.main import run; run()", "evaluate"]
    done = subprocess.run(  # noqa: S603 (its own commands)
        [*program, *arguments, "--markdown"],
        cwd=ROOT,
        check=False,
        stdout=subprocess.PIPE,
        text=True,
    )
    return done.stdout


def main() -> None:
    """Write docs/accuracy.md."""
    parts = [HEAD, evaluated("real", sys.argv[1]), "\n## Rendered scenes\n\n"]
    parts += [evaluated("sample"), "\n", evaluated("scenes")]
    (ROOT / "docs" / "accuracy.md").write_text("".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
