"""A file that is no calibration, or a damaged one, gives one sentence and never a traceback."""

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bearcub.errors import BearcubError, CalibrationError, ConfigError, FormatError
from bearcub.rig import Rig

SAMPLES = Path(__file__).parent / "samples"


def sample(name: str) -> str:
    """Return the text of a sample file."""
    return (SAMPLES / name).read_text(encoding="utf-8")


KITTI = sample("kitti/calib.txt")
KITTI_BARE = sample("kitti_bare/calib.txt")
MIDDLEBURY = sample("middlebury/calib.txt")
ROS = sample("ros/left.yaml")
ROS_RIGHT = sample("ros/right.yaml")
OPENCV_INTRINSICS = sample("opencv/intrinsics.yml")
OPENCV_EXTRINSICS = sample("opencv/extrinsics.yml")
Q_ONLY = sample("opencv_q/stereo.yml")
KALIBR = sample("kalibr/camchain.yaml")


def save(folder: Path, files: dict[str, str]) -> Path:
    """Write the files and return the first."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / next(iter(files))


REFUSED: list[tuple[str, dict[str, str], type[BearcubError], str]] = [
    ("poses", {"p.txt": (KITTI_BARE.splitlines()[0] + "\n") * 9}, FormatError, "file of poses"),
    (
        "KITTI swapped",
        {"c.txt": KITTI_BARE.replace("-3.798", "3.798")},
        ConfigError,
        "-0.537.* swapped",
    ),
    ("KITTI short", {"c.txt": KITTI_BARE[:-4]}, FormatError, "P1: expected 12 numbers, found 10"),
    ("KITTI lone", {"c.txt": KITTI.splitlines()[0]}, CalibrationError, "P1 is missing"),
    ("two f", {"c.txt": KITTI_BARE.replace("7.07", "9.07", 1)}, CalibrationError, "fx = 907.*707"),
    (
        "Middlebury doffs",
        {"c.txt": MIDDLEBURY.replace("doffs=31", "doffs=3")},
        CalibrationError,
        "doffs",
    ),
    (
        "Middlebury key",
        {"c.txt": MIDDLEBURY.replace("baseline", "basline")},
        CalibrationError,
        "basline",
    ),
    ("one ROS camera", {"front.yaml": ROS}, CalibrationError, "--right"),
    ("ROS swapped", {"left.yaml": ROS_RIGHT, "right.yaml": ROS}, ConfigError, "swapped"),
    ("ROS single", {"left.yaml": ROS, "right.yaml": ROS}, CalibrationError, "single cameras"),
    (
        "ROS sizes",
        {"left.yaml": ROS, "right.yaml": ROS_RIGHT.replace("1280", "640")},
        CalibrationError,
        "1280 x 1024 px, the right one 640 x 1024",
    ),
    (
        "ROS key",
        {"left.yaml": ROS, "right.yaml": ROS_RIGHT.replace("projection_matrix", "projection")},
        CalibrationError,
        r"projection_matrix is missing.*right\.yaml",
    ),
    (
        "ROS model",
        {"left.yaml": ROS.replace("plumb_bob", "fov"), "right.yaml": ROS_RIGHT},
        FormatError,
        r"'fov'.*left\.yaml",
    ),
    (
        "ROS nan",
        {"left.yaml": ROS.replace("520.3", ".nan"), "right.yaml": ROS},
        FormatError,
        "finite",
    ),
    (
        "vertical",
        {
            "stereo.yml": OPENCV_EXTRINSICS.replace(
                "334., -1670., 0., 500., 240., 0.", "330., 0., 0., 500., 240., -60."
            )
            .replace("R1", "X1")
            .replace("R2", "X2")
        },
        CalibrationError,
        "one above",
    ),
    (
        "OpenCV half",
        {"intrinsics.yml": OPENCV_INTRINSICS},
        CalibrationError,
        "P1 and P2 are missing",
    ),
    (
        "OpenCV in mm",
        {"q.yml": Q_ONLY.replace("8., -32", "0.008, -32")},
        ConfigError,
        "millimetres",
    ),
    (
        "OpenCV no R1",
        {
            "s.yml": (
                OPENCV_INTRINSICS
                + OPENCV_EXTRINSICS.replace("%YAML:1.0\n---", "").replace("R1", "X")
            )
        },
        CalibrationError,
        "R1 is missing",
    ),
    (
        "Kalibr omni",
        {"c.yaml": KALIBR.replace("pinhole", "omni")},
        CalibrationError,
        "'omni'.*pinhole",
    ),
    ("Kalibr fov", {"c.yaml": KALIBR.replace("radtan", "fov")}, FormatError, "'fov'"),
    (
        "Kalibr no rotation",
        {"c.yaml": KALIBR.replace("0.9999972", "0.5")},
        CalibrationError,
        "rotation",
    ),
    (
        "Kalibr lone",
        {"c.yaml": KALIBR[: KALIBR.index("cam1")]},
        CalibrationError,
        "cam1 is missing",
    ),
    ("prose", {"notes.txt": "The camera is 1.2 m up.\n"}, FormatError, "Kalibr camchain"),
    ("other YAML", {"params.yaml": "gain: 3\nexposure: 10\n"}, FormatError, "'exposure', 'gain'"),
    ("broken YAML", {"left.yaml": ROS + "x: [1, 2\n"}, FormatError, "line"),
    ("deep YAML", {"left.yaml": "P: " + "[" * 1000}, FormatError, "not valid"),
    ("empty", {"rig.toml": "  \n"}, FormatError, "is empty"),
]


@pytest.mark.parametrize(
    ("files", "error", "words"), [c[1:] for c in REFUSED], ids=[c[0] for c in REFUSED]
)
def test_refuses_with_one_sentence_naming_the_file(
    tmp_path: Path, files: dict[str, str], error: type[BearcubError], words: str
) -> None:
    path = save(tmp_path, files)
    with pytest.raises(error, match=words) as caught:
        Rig.load(path, height=1.0)
    assert path.name in str(caught.value) or list(files)[1] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_refuses_what_is_no_text_file(tmp_path: Path) -> None:
    image = tmp_path / "left.png"
    image.write_bytes(b"\x89PNG\r\n\x1a\n\x00")
    with pytest.raises(FormatError, match=r"left\.png: byte 0 is not text"):
        Rig.load(image, height=1.0)
    image.write_bytes(b"a" * 300_000)
    with pytest.raises(FormatError, match="more than 262144 bytes"):
        Rig.load(image, height=1.0)
    with pytest.raises(ConfigError, match=r"none\.toml: cannot be read: No such file"):
        Rig.load(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="folder without a calibration"):
        Rig.load(tmp_path)
    with pytest.raises(ConfigError, match="cannot be read: embedded null"):
        Rig.load("rig\0.toml")


def test_refuses_options_without_a_meaning() -> None:
    path = SAMPLES / "toml" / "rig.toml"
    with pytest.raises(ConfigError, match="in metres, takes no --unit"):
        Rig.load(path, unit=0.001)
    with pytest.raises(ConfigError, match="takes no --right"):
        Rig.load(path, right=path)
    with pytest.raises(ConfigError, match="unit = -1"):
        Rig.load(path, unit=-1.0)
    with pytest.raises(ConfigError, match="size = 0 x 480"):
        Rig.load(path, size=(0, 480))
    with pytest.raises(ConfigError, match="cameras = 1, 1"):
        Rig.load(path, cameras=(1, 1))


NASTY = (
    "nan",
    "-inf",
    "1e999",
    "0",
    "-1",
    "1e-320",
    "''",
    "[]",
    "{}",
    "null",
    "&a [*a]",
    "9" * 400,
)
FUZZ = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@pytest.fixture(scope="session")
def fuzz_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


def load_or_refuse(path: Path) -> None:
    """Load; only the project's errors may come out."""
    try:
        Rig.load(path, height=1.0, size=(640, 480)).to_toml()
    except BearcubError as error:
        assert "\n" not in str(error)  # noqa: PT017 (most inputs raise, some do not)
        assert len(str(error)) < 1500  # noqa: PT017


@FUZZ
@given(text=st.text(max_size=200), name=st.sampled_from(["rig.toml", "calib.txt", "left.yaml"]))
def test_random_text_never_gives_a_traceback(fuzz_folder: Path, text: str, name: str) -> None:
    (fuzz_folder / name).write_bytes(text.encode("utf-8", "surrogatepass"))
    load_or_refuse(fuzz_folder / name)


@FUZZ
@given(data=st.data(), folder=st.sampled_from(sorted(SAMPLES.iterdir())))
def test_damaged_calibrations_never_give_a_traceback(
    fuzz_folder: Path, data: st.DataObject, folder: Path
) -> None:
    files = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.iterdir())}
    victim = data.draw(st.sampled_from(sorted(files)))
    text = files[victim]
    for _ in range(data.draw(st.integers(1, 3))):
        spans = [match.span() for match in re.finditer(r"[-\d.e+]+|\w+|\n", text)]
        start, end = data.draw(st.sampled_from(spans or [(0, 0)]))
        new = data.draw(st.sampled_from(NASTY) | st.text(max_size=5) | st.just(text[:start]))
        text = text[:start] + new + text[end:]
    load_or_refuse(save(fuzz_folder, {**files, victim: text}))


@pytest.mark.parametrize("filler", ["\n", " ", "\t\n", "cam0 = ", "P0: 1 ", "[camera"])
def test_a_large_file_of_nothing_is_refused_at_once(tmp_path: Path, filler: str) -> None:
    """The search for the format takes time in proportion to the file, not to its square."""
    path = tmp_path / "calib.txt"
    path.write_text((filler * 262_000)[:262_000] + "x", encoding="utf-8")
    with pytest.raises(BearcubError):
        Rig.load(path, height=1.0)
