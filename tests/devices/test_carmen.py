"""CARMEN logs: hand-made lines with known values, and two recorded logs whole."""

import bz2
import contextlib
import math
import random
from pathlib import Path

import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.devices.carmen import open_carmen, read_carmen
from bearcub.errors import BearcubError, FormatError, InputError

LOGS = Path(__file__).parents[2] / ".." / "shared" / "data" / "radish_ladar"
POSE = "0.1 0.2 0.3 0.1 0.2 0.3"


def flaser(ranges: list[float], *, stamp: float = 976052857.33753) -> str:
    numbers = " ".join(f"{value:.2f}" for value in ranges)
    return f"FLASER {len(ranges)} {numbers} {POSE} {stamp:.6f} nohost 0.000246\n"


def written(folder: Path, text: str, name: str = "robot.clf") -> Path:
    path = folder / name
    path.write_bytes(bz2.compress(text.encode()) if name.endswith("bz2") else text.encode())
    return path


@pytest.mark.parametrize("name", ["robot.clf", "robot.clf.bz2"])
def test_ranges_angles_and_stamps_are_those_of_the_line(tmp_path: Path, name: str) -> None:
    text = (
        f"# comment\nPARAM a b c 0\nODOM 1 2 3 4 5 6 7.0 host 7.0\n{flaser([1.5] * 179 + [7.25])}"
    )
    ((stamp, scan),) = read_carmen(written(tmp_path, text, name))
    assert stamp == pytest.approx(976052857.33753)
    assert scan.ranges[[0, -1]].tolist() == [1.5, 7.25]
    # 180 beams of a scanner that has 181: the last, at +90 deg, was left out.
    assert np.rad2deg(scan.angles[[0, 90, 179]]) == pytest.approx([-90.0, 0.0, 89.0])


@pytest.mark.parametrize(
    ("count", "first_deg", "last_deg"),
    [(181, -90, 90), (360, -90, 89.5), (361, -90, 90), (401, -50, 50), (101, -50, 50)],
)
def test_the_number_of_beams_tells_where_they_point(
    tmp_path: Path, count: int, first_deg: float, last_deg: float
) -> None:
    ((_, scan),) = read_carmen(written(tmp_path, flaser([2.0] * count)))
    assert np.rad2deg(scan.angles[[0, -1]]) == pytest.approx([first_deg, last_deg])


def test_codes_for_nothing_in_reach_become_inf(tmp_path: Path) -> None:
    special = [81.83, 81.90, 81.91, 81.92, 50.0, 49.99, 81.82, 0.0, -1.0]
    path = written(tmp_path, flaser(special + [3.0] * 171))
    ((_, scan),) = read_carmen(path)
    inf = math.inf
    expected = [inf, inf, inf, inf, inf, 49.99, 81.82, -inf, math.nan]
    assert scan.ranges[:9].tolist() == pytest.approx(expected, nan_ok=True)
    ((_, other),) = read_carmen(path, no_return=3.0)
    assert other.ranges[4] == 50.0
    assert np.isposinf(other.ranges[9:]).all()


@pytest.mark.parametrize("kind", ["RAWLASER1", "ROBOTLASER1"])
def test_messages_that_describe_their_scanner_are_believed(tmp_path: Path, kind: str) -> None:
    poses = "0 0 0 0 0 0 0 0 0 0 0 " if kind == "ROBOTLASER1" else ""
    text = f"{kind} 0 -1.0 2.0 0.5 10.0 0.01 0 5 1.0 2.0 10.0 12.0 9.9 2 7 8 {poses}12.5 host 1.0\n"
    ((stamp, scan),) = read_carmen(written(tmp_path, text))
    assert stamp == 12.5
    assert scan.angles == pytest.approx([-1.0, -0.5, 0.0, 0.5, 1.0])
    assert scan.ranges.tolist() == pytest.approx([1.0, 2.0, math.inf, math.inf, 9.9])
    assert scan.farthest == 10.0


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("FLASER 180 1.0 2.0\n", "3 values, expected 190"),
        ("FLASER many\n", "invalid literal"),
        ("FLASER\n", "no whole FLASER message"),
        (flaser([1.0] * 7), "7 readings, expected one of 101, 180"),
        (flaser([1.0] * 180).replace("1.00", "1.0x", 1), "could not convert"),
        ("RAWLASER1 0 -1.0 2.0 0.5 10.0 0.01 0 5 1.0\n", "no whole RAWLASER1 message"),
        ("RAWLASER1 0 0 2.0 0.0 10.0 0.01 0 2 1.0 1.0 0 1 h 1\n", "do not ascend"),
    ],
)
def test_a_line_that_is_not_whole_is_named_with_its_number(
    tmp_path: Path, line: str, reason: str
) -> None:
    path = written(tmp_path, flaser([1.0] * 180) + line)
    with pytest.raises(FormatError) as error:
        list(read_carmen(path))
    assert f"{path}, line 2" in str(error.value)
    assert reason in str(error.value)


def test_a_file_that_is_missing_cut_off_or_without_scans_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        list(read_carmen(tmp_path / "none.clf"))
    cut = tmp_path / "cut.clf.bz2"
    cut.write_bytes(bz2.compress(flaser([1.0] * 180).encode() * 50)[:-20])
    with pytest.raises(FormatError, match=r"cut\.clf\.bz2: cannot be unpacked"):
        list(read_carmen(cut))
    plain = written(tmp_path, "ODOM 1 2 3\n")
    with pytest.raises(FormatError, match="holds no scan; expected FLASER"):
        open_carmen(plain, clock=ManualClock())


def test_as_a_source_each_scan_comes_when_its_time_has_come(tmp_path: Path) -> None:
    lines = [flaser([1.0 + at] * 180, stamp=100 + at / 5) for at in (0, 2, 1, 3)]  # out of order
    clock = ManualClock(7)
    with open_carmen(written(tmp_path, "".join(lines)), clock=clock) as source:
        seen = []
        clock.advance(0.01)
        for _ in range(4):
            reading = source.latest()
            assert reading is not None
            seen.append(float(reading.value.ranges[0]))
            clock.advance(0.2)
        assert seen == [1.0, 2.0, 3.0, 4.0]
        clock.advance(2.0)
        assert source.health().problem.endswith("the recording is at its end")


@pytest.mark.parametrize(
    ("name", "count", "no_returns", "largest"),
    [("intel", 13_631, 68_313, 26.37), ("aces", 7_374, 11_139, 49.91)],
)
def test_a_recorded_log_is_loaded_whole(
    name: str, count: int, no_returns: int, largest: float
) -> None:
    path = LOGS / f"{name}.clf.bz2"
    if not path.exists():
        pytest.skip(f"needs the recorded log {path.name}")
    ranges = np.stack([scan.ranges for _, scan in read_carmen(path)])
    assert ranges.shape == (count, 180)
    assert np.count_nonzero(np.isposinf(ranges)) == no_returns
    finite = ranges[np.isfinite(ranges)]
    assert len(finite) + no_returns == ranges.size
    assert finite.max() == pytest.approx(largest)


def fuzz(path: Path, count: int) -> None:
    """Damage lines; each is read, or refused with the number of the line."""
    dice = random.Random(1)  # noqa: S311 (the same damage every time)
    tail = "0 0 0 0 0 0 1.0 robot 1.0\n"
    whole = [
        f"FLASER 181 {' '.join(['1.5'] * 181)} {tail}",
        f"RAWLASER1 0 -1.57 3.14 0.0175 80 0.01 0 3 1.0 2.0 3.0 0 {tail}",
        f"ROBOTLASER1 0 -1.57 3.14 0.0175 80 0.01 0 3 1.0 2.0 3.0 2 7 8 {tail}",
    ]
    words = ["", "-1", "0", "nan", "inf", "1e400", "9" * 30, "x", "1_0", "3.5", "181", "-0.0175"]
    read = 0
    for _ in range(count):
        line = dice.choice(whole).split(" ")
        for _ in range(dice.randint(0, 2)):
            reach = len(line) if dice.random() < 0.3 else min(len(line), 12)
            place = dice.randrange(reach)
            line[place : place + dice.randint(0, 2)] = [dice.choice(words)]
        path.write_text(" ".join(line))
        with contextlib.suppress(BearcubError):
            read += len(list(read_carmen(path)))
    assert 0.2 * count < read < 0.98 * count


def test_damaged_lines_are_refused_with_our_own_errors(tmp_path: Path) -> None:
    fuzz(tmp_path / "damaged.clf", 500)


@pytest.mark.slow
def test_a_million_damaged_lines_are_refused_with_our_own_errors(tmp_path: Path) -> None:
    fuzz(tmp_path / "damaged.clf", 1_000_000)
