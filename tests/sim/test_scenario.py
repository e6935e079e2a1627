import itertools
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bearcub.errors import ConfigError
from bearcub.geometry import Attitude
from bearcub.messages import Tilt
from bearcub.sim import scenario
from bearcub.sim.materials import SURFACES
from bearcub.sim.scenario import Case, Scenario
from bearcub.sim.scenes import garbage_can

VARIED = ("height", "hfov_deg", "baseline", "tilt", "light", "surface")
HEAD = 'about = "A test."\nseed = 7\n'


def write(folder: Path, text: str) -> Scenario:
    path = folder / "mine.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return scenario.read(path)


def degrees(*, of: Attitude | Tilt | None) -> tuple[float, float]:
    assert of is not None
    return math.degrees(of.pitch), math.degrees(of.roll)


@pytest.fixture(scope="module")
def suite() -> list[Case]:
    return [case for name in scenario.names() for case in scenario.load(name).cases()]


def test_suite_has_the_weight_that_its_figures_need(suite: list[Case]) -> None:
    empty = [case for case in suite if case.tags.get("empty")]
    apart = [case for case in empty if case.tags["surface"] in ("gravel", "tall-grass")]
    assert 2500 <= len(suite) <= 3500
    assert len(empty) - len(apart) >= 1000
    assert len(apart) >= 150
    kinds = Counter(str(case.tags.get("kind", "")) for case in suite)
    specials = ("small box", "thin post", "standing test piece", "bank")
    assert {kind: kinds[kind] for kind in specials} == dict.fromkeys(specials, 40)
    assert kinds["pit"] == 300
    assert kinds["ramp"] + kinds["cross slope"] + kinds["step"] + kinds["drop"] >= 200
    assert sum(len(case.scene.things) > 0 for case in suite) >= 1000


def test_names_and_seeds_are_unique(suite: list[Case]) -> None:
    assert len({case.name for case in suite}) == len(suite)
    assert len({case.seed for case in suite}) == len(suite)


def test_sweeps_cover_what_they_promise(suite: list[Case]) -> None:
    pitch, roll = np.array([degrees(of=case.body) for case in suite if case.tags.get("empty")]).T
    assert (pitch.min(), pitch.max()) == (pytest.approx(-10), pytest.approx(10))
    assert (roll.min(), roll.max()) == (pytest.approx(-15), pytest.approx(15))
    drawn = {key: {case.tags[key] for case in suite} for key in VARIED}
    heights = {float(height) for height in drawn["height"]}
    assert {0.4, 1.5} <= heights
    assert {66, 79, 97} <= drawn["hfov_deg"]
    assert {0.06, 0.24} <= drawn["baseline"]
    assert drawn["tilt"] >= {"good", "biased", "late", "missing"}
    assert drawn["light"] == {"overcast", "noon", "low_sun", "dusk", "indoor"}
    assert drawn["surface"] >= set(SURFACES) | {"tall-grass"}


def test_quick_suite_is_an_even_part_of_the_full_one(suite: list[Case]) -> None:
    quick = [case for name in scenario.names() for case in scenario.load(name).cases(quick=True)]
    assert 100 <= len(quick) <= 140
    full = {case.name: case for case in suite}
    assert all(full[case.name] == case for case in quick)
    floors = [int(case.name[6:9]) for case in quick if case.scenario == "floor"]
    assert np.diff(floors).max() - np.diff(floors).min() <= 1


def test_garbage_can_is_the_scene_of_the_paper() -> None:
    (case,) = scenario.load("garbage-can").cases()
    assert case.scene.things == garbage_can().things
    assert case.scene.ground == garbage_can().ground
    assert case.rig.camera.fx == pytest.approx(386, abs=1e-4)
    assert degrees(of=case.body) == degrees(of=case.tilt) == pytest.approx((0, 12))
    assert (case.tags["kind"], case.tags["range"]) == ("can", 3.05)


def test_a_scenario_is_the_same_every_time_and_another_with_another_seed() -> None:
    found = scenario.load("obstacles")
    one, same, other = (
        list(itertools.islice(s.cases(), 12)) for s in (found, found, found.with_seed(99))
    )
    assert one == same
    assert [case.scene for case in one] != [case.scene for case in other]


def test_frames_of_a_world_share_it() -> None:
    cases = list(itertools.islice(scenario.load("obstacles").cases(), 10))
    worlds = [list(group) for _, group in itertools.groupby(cases, key=lambda c: id(c.scene))]
    assert [len(world) for world in worlds] == [5, 5]
    for world in worlds:
        assert len({id(case.rig) for case in world} | {id(case.light) for case in world}) == 2
        assert len({degrees(of=case.body) for case in world}) == 5


def test_every_value_of_a_sweep_gets_its_share(tmp_path: Path) -> None:
    found = write(
        tmp_path,
        "worlds = 12\nframes = 2\n[rig]\nheight = { from = 0.4, to = 0.6, step = 0.1 }\n"
        "[body]\nroll_deg = [-3, 0, 3]\n",
    )
    cases = list(found.cases())
    assert Counter(case.tags["height"] for case in cases) == {0.4: 8, 0.5: 8, 0.6: 8}
    assert Counter(case.tags["roll_deg"] for case in cases) == {-3: 8, 0: 8, 3: 8}


def test_body_shakes_by_its_step_and_a_late_reading_lags_behind(tmp_path: Path) -> None:
    found = write(
        tmp_path,
        "frames = 6\n[body]\nshake_deg = 2\n"
        '[tilt]\nreading = "late"\nnoise_deg = 0\nlate_ms = 50\n',
    )
    cases = list(found.cases())
    body, read = (
        np.array([degrees(of=of) for of in column])
        for column in ([case.body for case in cases], [case.tilt for case in cases])
    )
    np.testing.assert_allclose(np.abs(np.diff(body, axis=0)), 2.0)
    # 50 ms of the 66.7 ms between two frames
    np.testing.assert_allclose(read[1:], body[1:] - 0.75 * np.diff(body, axis=0))


def test_late_reading_of_a_body_that_stands_still_is_right(tmp_path: Path) -> None:
    found = write(
        tmp_path,
        'frames = 4\n[body]\nroll_deg = [-8, 8]\n[tilt]\nreading = "late"\nnoise_deg = 0\n',
    )
    for case in found.cases():
        assert degrees(of=case.tilt) == pytest.approx(degrees(of=case.body))


def test_biased_reading_is_off_by_the_bias_in_one_direction(tmp_path: Path) -> None:
    found = write(
        tmp_path,
        'frames = 3\n[body]\nroll_deg = [4, 8]\n[tilt]\nreading = "biased"\nnoise_deg = 0\n',
    )
    off = np.array(
        [np.subtract(degrees(of=case.tilt), degrees(of=case.body)) for case in found.cases()]
    )
    np.testing.assert_allclose(np.hypot(*off.T), 5.0)
    np.testing.assert_allclose(off, off[[0, 0, 0]])


def test_good_reading_has_the_noise_of_a_sensor(tmp_path: Path) -> None:
    found = write(tmp_path, "worlds = 100\nframes = 4\n[tilt]\nnoise_deg = 0.5\n")
    off = np.array([degrees(of=case.tilt) for case in found.cases()])
    np.testing.assert_allclose(off.std(axis=0), 0.5, rtol=0.15)  # 3 sigma of 400 readings


def test_missing_reading_is_none(tmp_path: Path) -> None:
    (case,) = write(tmp_path, '[tilt]\nreading = "missing"\n').cases()
    assert case.tilt is None


def test_things_keep_apart_and_inside_the_field_of_view() -> None:
    for case in scenario.load("obstacles").cases(quick=True):
        half = 0.5 * math.radians(float(case.tags["hfov_deg"]))
        feet = np.array([thing.foot for thing in case.scene.things])
        assert (np.abs(np.arctan2(feet[:, 1], feet[:, 0])) < half).all()
        for one, other in itertools.combinations(feet, 2):
            assert float(np.linalg.norm(one - other)) > 0.2


def test_robot_stands_on_the_ground_it_is_given(tmp_path: Path) -> None:
    (case,) = write(tmp_path, "[ground]\ncross_slope_deg = 8\n[body]\nroll_deg = 1\n").cases()
    assert degrees(of=case.body) == pytest.approx((0, 9))
    assert case.tags["kind"] == "cross slope"
    assert "empty" not in case.tags


def test_slope_ends_after_its_rise(tmp_path: Path) -> None:
    (case,) = write(tmp_path, "[ground]\nstart = 2\nslope_deg = 45\nrise = 0.5\n").cases()
    ground = case.scene.ground
    assert [ground.at(x, 0.0) for x in (2.0, 2.25, 9.0)] == pytest.approx([0.0, 0.25, 0.5])
    assert (case.tags["kind"], case.tags["range"]) == ("bank", 2)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sede = 1\n", "unknown key sede: did you mean seed?"),
        ("[rig]\nheigth = 1\n", "unknown key rig.heigth: did you mean height?"),
        ("[rig]\nheight = 12\n", "rig.height = 12: expected a number from 0.1 to 5"),
        ('[rig]\nheight = "tall"\n', "rig.height = 'tall': expected a number"),
        ("[rig]\nheight = []\n", "rig.height = []: expected at least one value"),
        ("rig = 3\n", "rig = 3: expected a table [rig]"),
        ("[rig]\nheight = { from = 1, to = 2 }\n", "expected numbers for from, to and step"),
        ("[rig]\nheight = { from = 2, to = 1, step = 1 }\n", "expected from <= to"),
        ("[rig]\nheight = { form = 2 }\n", "unknown key rig.height.form: did you mean from?"),
        ('[ground]\nsurface = "grvel"\n', "ground.surface = grvel: did you mean gravel?"),
        ('[things]\nkind = "can"\nrange = true\n', "things.range = True: expected a number"),
        ('light = "nooon"\n', "did you mean noon?"),
        ("worlds = 2.5\n", "worlds = 2.5: expected a whole number"),
        ("[ground\n", "is not TOML"),
    ],
)
def test_mistakes_in_a_file_are_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError) as raised:
        write(tmp_path, text)
    assert message in str(raised.value)
    assert "mine.toml" in str(raised.value)


def test_every_scenario_needs_a_seed(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('about = "x"\n')
    with pytest.raises(ConfigError, match="the key seed is missing"):
        scenario.read(path)


def test_unknown_scenario_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="unknown scenario garbage-cna: did you mean garbage-can"):
        scenario.load("garbage-cna")
