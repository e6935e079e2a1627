"""Pictures into videos, single files and folders; what is written survives the program."""

from pathlib import Path

import numpy as np
import pytest

from bearcub.devices import FrameSink, ImageSink, VideoSink, open_frames, open_sink
from bearcub.devices.images import read_image
from bearcub.devices.video import VideoFile
from bearcub.errors import DeviceError, InputError

PICTURE = np.full((24, 32, 3), (40, 90, 160), dtype=np.uint8)


def readable_frames(path: Path) -> int:
    video = VideoFile(path)
    count = 0
    while video.read() is not None:
        count += 1
    video.close()
    return count


def fill(sink: FrameSink, count: int) -> None:
    with sink:
        for index in range(count):
            sink.write(PICTURE, name=f"{index:03d}")


@pytest.mark.parametrize("name", ["out.mp4", "out.avi", "out.MP4"])
def test_video_has_its_pictures_rate_and_colours(tmp_path: Path, name: str) -> None:
    fill(VideoSink(tmp_path / name, rate_hz=12.5), 5)
    video = VideoFile(tmp_path / name)
    assert (video.count, video.rate_hz) == (5, 12.5)
    reading = video.read()
    assert reading is not None
    assert reading.image is not None
    assert np.abs(reading.image.mean(axis=(0, 1)) - (40, 90, 160)).max() < 6  # lossy
    video.close()


@pytest.mark.parametrize("name", ["out.mp4", "out.avi"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_video_is_complete_after_an_interruption(
    tmp_path: Path, name: str, error: type[BaseException]
) -> None:
    def interrupted() -> None:
        with VideoSink(tmp_path / name, rate_hz=10) as sink:
            for _ in range(3):
                sink.write(PICTURE, name="x")
            raise error

    with pytest.raises(error):
        interrupted()
    assert readable_frames(tmp_path / name) == 3


def test_grey_pictures_become_video_too(tmp_path: Path) -> None:
    with VideoSink(tmp_path / "out.avi", rate_hz=10) as sink:
        sink.write(PICTURE[..., 0], name="0")
    assert readable_frames(tmp_path / "out.avi") == 1


def test_picture_of_another_size_is_refused_and_the_video_stays_good(tmp_path: Path) -> None:
    with VideoSink(tmp_path / "out.mp4", rate_hz=10) as sink:
        sink.write(PICTURE, name="6")
        with pytest.raises(InputError, match=r"picture 7 is 30 x 24 pixels, expected 32 x 24"):
            sink.write(PICTURE[:, :30], name="7")
    assert readable_frames(tmp_path / "out.mp4") == 1


def test_no_picture_leaves_no_video(tmp_path: Path) -> None:
    fill(VideoSink(tmp_path / "out.mp4", rate_hz=10), 0)
    assert list(tmp_path.iterdir()) == []


def test_video_of_a_sequence_can_be_read_back_as_frames(tmp_path: Path) -> None:
    fill(open_sink(tmp_path / "out.mp4"), 4)
    source = open_frames(tmp_path / "out.mp4", side_by_side=True)
    assert (source.count, source.rate_hz) == (4, 10)  # the rate when none is given
    assert len(list(source)) == 4


@pytest.mark.parametrize("name", ["out.png", "out.jpg"])
def test_single_picture_is_written_whole(tmp_path: Path, name: str) -> None:
    fill(open_sink(tmp_path / name, single=True), 1)
    assert [path.name for path in tmp_path.iterdir()] == [name]  # nothing unfinished beside it
    assert np.abs(read_image(tmp_path / name).astype(int) - PICTURE).max() < 6


def test_folder_gets_one_picture_per_name(tmp_path: Path) -> None:
    fill(open_sink(tmp_path / "new" / "folder"), 3)
    names = sorted(path.name for path in (tmp_path / "new" / "folder").iterdir())
    assert names == ["000.png", "001.png", "002.png"]
    np.testing.assert_array_equal(read_image(tmp_path / "new" / "folder" / "002.png"), PICTURE)


def test_existing_folder_with_a_dot_in_its_name_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "run.png").mkdir()
    fill(open_sink(tmp_path / "run.png"), 2)
    assert len(list((tmp_path / "run.png").iterdir())) == 2


def test_second_picture_for_a_single_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"out\.png: holds picture 000 already"):
        fill(ImageSink(tmp_path / "out.png"), 2)
    np.testing.assert_array_equal(read_image(tmp_path / "out.png"), PICTURE)


def test_sequence_into_a_single_file_is_refused_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"out\.png: holds one picture; expected a folder or a"):
        open_sink(tmp_path / "out.png")


@pytest.mark.parametrize("name", ["out.gif", "out.mov"])
def test_unknown_ending_is_refused_with_the_known_ones(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=rf"{name}: expected a picture .*\.png.*\.mp4"):
        open_sink(tmp_path / name)
    with pytest.raises(InputError, match=r"expected a video's name to end in \.mp4 or \.avi"):
        VideoSink(tmp_path / name, rate_hz=10)


@pytest.mark.parametrize("name", ["out.mp4", "out.png"])
def test_folder_that_is_not_there_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(DeviceError, match=r"there is no folder .*gone; create it first"):
        open_sink(tmp_path / "gone" / name, single=True)


def test_video_named_like_a_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out.mp4").mkdir()
    with pytest.raises(DeviceError, match="is a folder, expected the name of a file"):
        VideoSink(tmp_path / "out.mp4", rate_hz=10)


def test_folder_whose_name_is_taken_by_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").touch()
    with pytest.raises(DeviceError, match=r"out: cannot be made a folder: File exists"):
        open_sink(tmp_path / "out")


def test_rate_that_is_not_positive_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="rate_hz = 0: expected more than 0"):
        VideoSink(tmp_path / "out.mp4", rate_hz=0)


def test_picture_that_cannot_be_written_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    sink = ImageSink(tmp_path / "folder")
    (tmp_path / "folder").rmdir()
    with pytest.raises(DeviceError, match=r"000\.png: cannot be written: No such file"):
        fill(sink, 1)


def test_video_that_cannot_be_started_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder").mkdir()
    sink = VideoSink(tmp_path / "folder" / "out.mp4", rate_hz=10)
    (tmp_path / "folder").rmdir()
    with pytest.raises(DeviceError, match=r"out\.mp4: cannot be written as a 32 x 24 video"):
        fill(sink, 1)
    assert capfd.readouterr() == ("", "")
