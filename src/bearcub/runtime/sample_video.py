"""The embedded sample as a video from a camera that shakes, seen through its lenses."""

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from bearcub import sample
from bearcub.errors import DeviceError
from bearcub.messages import UInt8
from bearcub.rig import Rig
from bearcub.rig.camera import Lens
from bearcub.runtime.bench import sample_pair

_BARREL = (-0.08, 0.01, 0.0, 0.0)  # moves the corners by 7 % of their distance from the centre
_SHAKE = 3  # to each side [px]
_RATE_HZ = 30.0
_QUALITY = 95.0  # of the JPEG pictures [%]


@contextlib.contextmanager
def sample_video(*, size: tuple[int, int], frames: int) -> Iterator[tuple[Path, Rig]]:
    """Write the sample as a side-by-side video, Motion JPEG as USB cameras send it.

    Parameters
    ----------
    size : tuple of int
        Width and height of each of the two images [px], of the sample's aspect.
    frames : int
        The pair, moved by up to 3 px from frame to frame.

    Yields
    ------
    path : Path
        Removed in the end.
    rig : Rig
        With the lenses that the pictures are distorted by.

    Raises
    ------
    InputError
        If the size is of another aspect.
    DeviceError
        If there is no room for the video.
    """
    width, height = size
    rig = Rig.load(sample.load().rig).for_image(width=width, height=height)
    camera = rig.camera
    lens = Lens(fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy, distortion=_BARREL)
    lenses = lens, replace(lens, cx=camera.cx + camera.doffs)
    pair = sample_pair(width=width, height=height)
    raw = [_through(lens, image) for lens, image in zip(lenses, pair, strict=True)]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sample.avi"
        _write(path, raw, frames=frames)
        yield path, replace(rig, lenses=lenses)


def _write(path: Path, pair: list[UInt8], *, frames: int) -> None:
    height, width = pair[0].shape[:2]
    codec = cv2.VideoWriter.fourcc(*"MJPG")
    # OpenCV's own writer: FFmpeg's is deaf to the quality.
    writer = cv2.VideoWriter(str(path), cv2.CAP_OPENCV_MJPEG, codec, _RATE_HZ, (2 * width, height))
    if not writer.isOpened():
        raise DeviceError(f"{path}: cannot be written as a {2 * width} x {height} video")
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, _QUALITY)
    random = np.random.default_rng(0)
    for _ in range(frames):
        down, right = random.integers(2 * _SHAKE + 1, size=2)
        writer.write(np.hstack([_moved(image, int(down), int(right)) for image in pair]))
    writer.release()


def _through(lens: Lens, image: UInt8) -> UInt8:
    """Return an image without distortion as this lens shows the same."""
    height, width = image.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    straight = cv2.undistortPoints(
        pixels.reshape(-1, 1, 2).astype(np.float64), lens.matrix, lens.coefficients, P=lens.matrix
    )
    columns, rows = np.moveaxis(straight.reshape(height, width, 2).astype(np.float32), -1, 0)
    seen = cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.uint8)


def _moved(image: UInt8, down: int, right: int) -> UInt8:
    wide = cv2.copyMakeBorder(image, _SHAKE, _SHAKE, _SHAKE, _SHAKE, cv2.BORDER_REPLICATE)
    height, width = image.shape[:2]
    return np.asarray(wide[down : down + height, right : right + width], dtype=np.uint8)
