from typing import Any

import numpy as np
import pytest

from bearcub.rig import Rig
from bearcub.viewer import annotate, side_by_side
from bearcub.viewer.overlay import overlay


@pytest.mark.parametrize(("height", "width"), [(31, 41), (30, 40), (31, 40), (30, 41)])
def test_rows_and_columns_are_even_for_video_codecs(height: int, width: int) -> None:
    left = np.full((height, width, 3), 7, dtype=np.uint8)
    both = side_by_side(left, np.full((60, 60, 3), 9, dtype=np.uint8))
    assert both.shape[0] % 2 == 0
    assert both.shape[1] % 2 == 0
    assert (both[:height, :width] == 7).all()
    assert (both[5, -5] == 9).all()


def test_annotated_frame_begins_with_the_overlay(world: Any, rig: Rig, box: Any) -> None:
    answer = world(obstacles=(box(),)).answer()
    picture = overlay(answer, None, rig.camera.projection)
    frame = annotate(answer, None, rig)
    assert (frame[: picture.shape[0], :320] == picture).all()
    assert frame.shape[1] > 320 + 300


def test_frame_size_stays_the_same_over_a_sequence(
    world: Any, rig: Rig, box: Any, pit: Any
) -> None:
    empty = annotate(world().answer(), None, rig)
    full = annotate(
        world(obstacles=(box(distance=30.0),), holes=(pit(),), notes=("a", "b")).answer(), None, rig
    )
    assert empty.shape == full.shape
