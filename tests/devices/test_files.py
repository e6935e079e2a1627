"""Frames from pairs, folders, videos, side-by-side pictures and disparity files."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.devices import Frame, FrameSource, open_frames
from bearcub.devices.video import VideoFile
from bearcub.errors import DeviceError, FormatError, InputError

REAL = Path(__file__).parents[2] / ".." / "shared" / "data"


def grey(value: int, *, width: int = 32, height: int = 24) -> np.ndarray:
    return np.full((height, width), value, dtype=np.uint8)


def image_file(path: Path, image: np.ndarray) -> Path:
    path.parent.mkdir(exist_ok=True)
    assert cv2.imwrite(str(path), image)
    return path


def image_folder(folder: Path, values: dict[str, int]) -> Path:
    for name, value in values.items():
        image_file(folder / name, grey(value))
    return folder


def video_file(path: Path, values: list[int], *, rate_hz: float = 10, width: int = 32) -> Path:
    codec = {".mp4": "mp4v", ".avi": "MJPG"}[path.suffix]
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*codec), rate_hz, (width, 24), isColor=True
    )
    for value in values:
        writer.write(cv2.cvtColor(grey(value, width=width), cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def brightness(image: np.ndarray | None) -> float:
    assert image is not None
    return float(image.mean())


def shape(image: np.ndarray | None) -> tuple[int, ...]:
    assert image is not None
    return image.shape


def frames_before_error(source: FrameSource, error: type[Exception]) -> tuple[list[Frame], str]:
    """What is given out before the source raises, and the sentence."""
    seen: list[Frame] = []
    with pytest.raises(error) as raised:
        seen.extend(source)  # keeps what came before
    return seen, str(raised.value)


def test_pair_of_images_is_one_frame(tmp_path: Path) -> None:
    left = image_file(tmp_path / "l.png", grey(10))
    right = image_file(tmp_path / "r.png", grey(20))
    with open_frames(left, right) as source:
        assert (source.count, source.rate_hz) == (1, None)
        (frame,) = source
    assert (frame.name, frame.index, frame.stamp_ns) == ("l", 0, 0)
    assert (brightness(frame.left), brightness(frame.right)) == (10, 20)
    assert frame.disparity_path is None


def test_folders_are_paired_by_name_where_names_match(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "left", {"a.png": 1, "b.png": 2})
    right = image_folder(tmp_path / "right", {"b.pgm": 12, "a.pgm": 11})
    frames = list(open_frames(left, right, rate_hz=4))
    assert [f.name for f in frames] == ["a", "b"]
    assert [brightness(f.right) - brightness(f.left) for f in frames] == [10, 10]
    assert [f.stamp_ns for f in frames] == [0, 250_000_000]


def test_folders_with_other_names_are_paired_in_numerical_order(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "left", {"l_10.png": 110, "l_2.png": 102})
    right = image_folder(tmp_path / "right", {"r_10.png": 210, "r_2.png": 202})
    frames = list(open_frames(left, right))
    assert [(brightness(f.left), brightness(f.right)) for f in frames] == [(102, 202), (110, 210)]


def test_folders_of_unequal_length_are_refused_naming_counts_and_file(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "left", {"l1.png": 1, "l2.png": 2, "l3.png": 3})
    right = image_folder(tmp_path / "right", {"r1.png": 1})
    with pytest.raises(InputError, match=r"left holds 3 frames and .*right 1: .*l2\.png has no"):
        open_frames(left, right)


def test_one_missing_frame_does_not_shift_the_pairs_after_it(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "left", {"1.png": 1, "2.png": 2, "3.png": 3})
    right = image_folder(tmp_path / "right", {"1.png": 1, "3.png": 3, "4.png": 4})
    with pytest.raises(InputError, match=r"3 frames and .*right 3: .*2\.png has no partner"):
        open_frames(left, right)


@pytest.mark.parametrize("suffix", [".avi", ".mp4"])
def test_two_videos_give_stamps_from_their_rate(tmp_path: Path, suffix: str) -> None:
    left = video_file(tmp_path / f"left{suffix}", [50, 60, 70], rate_hz=8)
    right = video_file(tmp_path / f"right{suffix}", [150, 160, 170], rate_hz=8)
    with open_frames(left, right) as source:
        assert (source.count, source.rate_hz) == (3, 8)
        frames = list(source)
    assert [f.stamp_ns for f in frames] == [0, 125_000_000, 250_000_000]
    assert [f.name for f in frames] == ["left_000000", "left_000001", "left_000002"]
    for frame, value in zip(frames, (50, 60, 70), strict=True):
        assert brightness(frame.left) == pytest.approx(value, abs=4)  # lossy codecs
        assert brightness(frame.right) == pytest.approx(value + 100, abs=4)


def test_given_rate_replaces_that_of_the_video(tmp_path: Path) -> None:
    left = video_file(tmp_path / "l.avi", [50, 60])
    right = video_file(tmp_path / "r.avi", [50, 60])
    assert [f.stamp_ns for f in open_frames(left, right, rate_hz=2)] == [0, 500_000_000]


def test_shorter_video_is_named_after_the_common_frames_were_given_out(tmp_path: Path) -> None:
    left = video_file(tmp_path / "left.avi", [50] * 6)
    right = video_file(tmp_path / "right.avi", [50] * 4)
    with open_frames(left, right) as source:
        assert source.count == 4
        seen, sentence = frames_before_error(source, DeviceError)
    assert len(seen) == 4
    assert "right.avi: the video ended after frame 4 of 6" in sentence


def test_video_that_was_cut_off_gives_its_frames_and_says_how_many_lack(tmp_path: Path) -> None:
    both = video_file(tmp_path / "both.avi", [50] * 20, width=640)
    data = both.read_bytes()
    cut = data.index(b"movi")
    for _ in range(13):
        cut = data.index(b"00dc", cut + 1)  # the head of each frame's chunk
    both.write_bytes(data[:cut])
    seen, sentence = frames_before_error(open_frames(both, side_by_side=True), DeviceError)
    assert [frame.index for frame in seen] == list(range(12))
    assert "both.avi: the video ended after frame 12 of 20" in sentence


def test_video_without_a_single_frame_is_no_silent_success(tmp_path: Path) -> None:
    both = video_file(tmp_path / "both.avi", [50], width=640)
    data = both.read_bytes()
    both.write_bytes(data[: data.index(b"00dc", data.index(b"movi"))])
    with pytest.raises((DeviceError, FormatError), match=r"both\.avi: (the video ended|cannot)"):
        list(open_frames(both, side_by_side=True))


def test_recording_without_its_index_is_refused_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    cut = video_file(tmp_path / "cut.mp4", [50] * 20)
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
    with pytest.raises(FormatError, match=r"cut\.mp4: has no complete index"):
        open_frames(cut, side_by_side=True)
    assert capfd.readouterr() == ("", "")


def test_video_of_nonsense_is_refused(tmp_path: Path) -> None:
    (tmp_path / "junk.avi").write_bytes(b"nonsense" * 50)
    with pytest.raises(FormatError, match=r"junk\.avi: cannot be decoded; expected a video"):
        open_frames(tmp_path / "junk.avi", side_by_side=True)


def test_videos_of_different_rates_are_refused(tmp_path: Path) -> None:
    left = video_file(tmp_path / "l.avi", [50], rate_hz=15)
    right = video_file(tmp_path / "r.avi", [50], rate_hz=30)
    with pytest.raises(InputError, match=r"r\.avi: 30 frames per second, expected 15"):
        open_frames(left, right)


def test_side_by_side_image_is_cut_in_the_middle(tmp_path: Path) -> None:
    both = image_file(tmp_path / "both.png", np.hstack([grey(10), grey(20)]))
    (frame,) = open_frames(both, side_by_side=True)
    assert frame.left is not None
    assert frame.left.shape == (24, 32)
    assert frame.left.flags.c_contiguous
    assert (brightness(frame.left), brightness(frame.right)) == (10, 20)


def test_side_by_side_folder_and_video(tmp_path: Path) -> None:
    both = np.hstack([grey(10), grey(20)])
    for name in ("1.png", "2.png"):
        image_file(tmp_path / "both" / name, both)
    assert [brightness(f.right) for f in open_frames(tmp_path / "both", side_by_side=True)] == [
        20,
        20,
    ]
    video = video_file(tmp_path / "both.mp4", [90, 90], width=64)
    assert [shape(f.right) for f in open_frames(video, side_by_side=True)] == [(24, 32, 3)] * 2


def test_odd_width_cannot_be_two_halves(tmp_path: Path) -> None:
    both = image_file(tmp_path / "both.png", grey(1, width=33))
    with pytest.raises(InputError, match=r"both\.png: 33 columns, expected an even number"):
        list(open_frames(both, side_by_side=True))


def test_disparity_files_are_passed_on_unread_with_or_without_left_images(tmp_path: Path) -> None:
    maps = image_folder(tmp_path / "maps", {"1.pgm": 0, "2.pgm": 0})
    (maps / "2.pgm").write_bytes(b"not looked at")
    left = image_folder(tmp_path / "left", {"1.png": 5, "2.png": 6})
    alone = list(open_frames(disparity=maps))
    assert [(f.name, f.left, f.right) for f in alone] == [("1", None, None), ("2", None, None)]
    with_left = list(open_frames(left, disparity=maps))
    assert [f.disparity_path for f in with_left] == [maps / "1.pgm", maps / "2.pgm"]
    assert [brightness(f.left) for f in with_left] == [5, 6]


def test_one_disparity_file_of_any_ending_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "map.raw").write_bytes(b"x")
    (frame,) = open_frames(disparity=tmp_path / "map.raw")
    assert (frame.name, frame.disparity_path) == ("map", tmp_path / "map.raw")


def test_sizes_that_differ_between_left_and_right_are_refused(tmp_path: Path) -> None:
    left = image_file(tmp_path / "l.png", grey(1))
    right = image_file(tmp_path / "r.png", grey(1, width=30))
    with pytest.raises(
        InputError, match=r"r\.png: 30 x 24 pixels, expected 32 x 24 as in .*l\.png"
    ):
        list(open_frames(left, right))


def test_size_that_changes_is_refused_after_the_frames_before_it(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "l", {"1.png": 1, "2.png": 2})
    right = image_folder(tmp_path / "r", {"1.png": 1, "2.png": 2})
    image_file(left / "2.png", grey(2, height=20))
    seen, sentence = frames_before_error(open_frames(left, right), InputError)
    assert [f.name for f in seen] == ["1"]
    assert "2.png: 32 x 20 pixels, expected 32 x 24" in sentence


def test_files_are_read_only_when_their_frame_is_asked_for(tmp_path: Path) -> None:
    left = image_folder(tmp_path / "l", {"1.png": 1, "2.png": 2})
    right = image_folder(tmp_path / "r", {"1.png": 1, "2.png": 2})
    frames = iter(open_frames(left, right))
    next(frames)
    (left / "2.png").write_bytes(b"damaged later")
    with pytest.raises(FormatError, match=r"2\.png: 13 bytes"):
        next(frames)


# Left uses 12 bits, right 10: both are shifted by 4 or the matcher would see two brightnesses.
def test_16_bit_pair_is_scaled_alike(tmp_path: Path) -> None:
    left = image_file(tmp_path / "l.png", np.full((16, 16), 3200, dtype=np.uint16))
    right = image_file(tmp_path / "r.png", np.full((16, 16), 800, dtype=np.uint16))
    (frame,) = open_frames(left, right)
    assert (brightness(frame.left), brightness(frame.right)) == (200, 50)


def test_dark_16_bit_frame_after_a_bright_one_stays_dark(tmp_path: Path) -> None:
    for name, value in (("1.png", 4000), ("2.png", 400)):
        image_file(tmp_path / "both" / name, np.full((16, 32), value, dtype=np.uint16))
    frames = list(open_frames(tmp_path / "both", side_by_side=True))
    assert [brightness(f.left) for f in frames] == [250, 25]


Bad = Callable[[Path], object]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda t: open_frames(), "no input: expected a left image"),
        (lambda t: open_frames(t / "l.png"), r"l\.png: expected a right image"),
        (lambda t: open_frames(t / "gone.png", t / "l.png"), r"gone\.png: no such file"),
        (lambda t: open_frames(t / "l.png", t), r"l\.png is a file but .* is a folder"),
        (lambda t: open_frames(t / "l.png", t / "l.png"), r"l\.png: given twice"),
        (
            lambda t: open_frames(t / "l.png", t / "r.png", disparity=t / "d.pgm"),
            "a disparity replaces the right image",
        ),
        (
            lambda t: open_frames(t / "l.png", t / "r.png", side_by_side=True),
            r"r\.png: a side-by-side picture holds",
        ),
        (lambda t: open_frames(disparity=t / "v.avi"), r"v\.avi: a video cannot hold disparities"),
        (lambda t: open_frames(t / "l.png", t / "r.png", rate_hz=0), "rate_hz = 0: expected more"),
    ],
)
def test_combination_that_makes_no_frames_is_refused(
    tmp_path: Path, call: Bad, sentence: str
) -> None:
    image_file(tmp_path / "l.png", grey(1))
    image_file(tmp_path / "r.png", grey(1))
    video_file(tmp_path / "v.avi", [1])
    with pytest.raises(InputError, match=sentence):
        call(tmp_path)


def test_empty_video_and_empty_disparity_are_refused(tmp_path: Path) -> None:
    for name in ("v.mp4", "d.pgm"):
        (tmp_path / name).touch()
    with pytest.raises(FormatError, match=r"v\.mp4: is empty"):
        open_frames(tmp_path / "v.mp4", side_by_side=True)
    with pytest.raises(FormatError, match=r"d\.pgm: is empty"):
        open_frames(disparity=tmp_path / "d.pgm")


def test_closed_video_gives_no_more_frames(tmp_path: Path) -> None:
    video = VideoFile(video_file(tmp_path / "v.avi", [1, 2]))
    assert video.read() is not None
    video.close()
    video.close()
    assert video.read() is None


def test_kitti_folders_are_paired() -> None:
    drive = REAL / "kitti_odometry"
    if not drive.is_dir():
        pytest.skip("the recording kitti_odometry is not beside the repository")
    with open_frames(drive / "image_l", drive / "image_r", rate_hz=10) as source:
        assert source.count == 51
        frame = next(iter(source))
    assert frame.name == "000000"
    assert shape(frame.left) == shape(frame.right) == (370, 1226)
