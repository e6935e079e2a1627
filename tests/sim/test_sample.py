import json
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub import sample
from bearcub.geometry import Attitude
from bearcub.rig import Rig
from bearcub.sample import Sample
from bearcub.sim import render, scenes


@pytest.fixture(scope="module")
def stored() -> Sample:
    return sample.load()


@pytest.fixture(scope="module")
def truth(stored: Sample) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(stored.truth.read_text(encoding="utf-8"))
    return found


def test_sample_is_rendered_by_the_code_that_is_here(stored: Sample, truth: dict[str, Any]) -> None:
    body = Attitude(roll=stored.tilt.roll, pitch=stored.tilt.pitch)
    again = render(
        scenes.garbage_can(),
        Rig.load(stored.rig),
        body=body,
        noise=truth["noise"],
        seed=truth["seed"],
    )
    for path, image in ((stored.left, again.left), (stored.right, again.right)):
        kept = np.asarray(cv2.imread(str(path)), dtype=np.int64)
        # other processors round otherwise: a ray on an edge may fall to the other side
        assert (np.abs(kept - image) > 1).mean() < 1e-3
    assert {**again.truth, "noise": "medium", "seed": truth["seed"]} == truth


def test_sample_is_the_papers_scene(stored: Sample, truth: dict[str, Any]) -> None:
    rig = Rig.load(stored.rig)
    assert (rig.camera.fx, rig.camera.baseline, rig.mount.height) == (386, 0.12, 1.2)
    assert np.degrees([rig.mount.pitch, stored.tilt.roll]) == pytest.approx([5.9, 12.0])
    (can,) = truth["obstacles"]
    assert can["distance"] == pytest.approx(3.05)
    assert truth["holes"] == []


def test_sample_is_small(stored: Sample) -> None:
    assert stored.left.stat().st_size + stored.right.stat().st_size < 700_000
