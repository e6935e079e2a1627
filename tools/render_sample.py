"""Render the embedded sample anew: ``python tools/render_sample.py [FOLDER]``.

The paper's own scene with the rig that its constants imply, the body rolled by 12 deg. The truth
holds everything needed to render the same images again.
"""

import json
import math
import sys
from pathlib import Path
from typing import Final

import cv2

import bearcub.sample
from bearcub.geometry import Attitude
from bearcub.sim import render, scenes

NOISE: Final = "medium"
SEED: Final = 2005
BODY = Attitude(roll=math.radians(12.0), pitch=0.0)


def main(folder: Path) -> None:
    """Write left.png, right.png, rig.toml and truth.json into `folder`."""
    rig = scenes.paper_rig()
    rendered = render(scenes.garbage_can(), rig, body=BODY, noise=NOISE, seed=SEED)
    # the smaller of the encoder's strategies for noisy images
    options = [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, 0]
    folder.mkdir(parents=True, exist_ok=True)
    for name, image in (("left", rendered.left), ("right", rendered.right)):
        path = folder / f"{name}.png"
        if not cv2.imwrite(str(path), image, options):
            sys.exit(f"{path}: cannot be written")
    (folder / "rig.toml").write_text(rig.to_toml(), encoding="utf-8")
    truth = {**rendered.truth, "noise": NOISE, "seed": SEED}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(bearcub.sample.__file__).parent)
