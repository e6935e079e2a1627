import math
from pathlib import Path

import pytest

from bearcub.devices.tilt_csv import HEADER, format_tilt, read_tilts
from bearcub.errors import InputError
from bearcub.messages import Tilt


def test_readings_survive_the_file(tmp_path: Path) -> None:
    path = tmp_path / "tilt.csv"
    tilts = [Tilt(pitch=math.radians(-1.25), roll=math.radians(12)), None]
    path.write_text("\n".join([HEADER, *map(format_tilt, tilts)]))
    first, second = read_tilts(path)
    assert first is not None
    assert (first.pitch, first.roll) == pytest.approx((math.radians(-1.25), math.radians(12)))
    assert second is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2\n3\n", "line 2: '3': expected 'pitch,roll'"),
        ("1,2\n\n# note\n3,nose\n", "line 4: 'nose'"),
        ("100,0\n", "100: expected degrees between -90 and 90"),
        ("pitch,roll\n", "found none"),
    ],
)
def test_wrong_line_is_named(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "tilt.csv"
    path.write_text(text)
    with pytest.raises(InputError) as raised:
        read_tilts(path)
    assert words in str(raised.value)
