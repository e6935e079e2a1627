"""Frames of a source become what the pipeline looks at: decoded, scaled, with rig and tilt."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bearcub.devices import Frame, FrameSource
from bearcub.errors import InputError
from bearcub.messages import Float32, Snapshot, Tilt, UInt8
from bearcub.rig import Rig
from bearcub.stereo import Encoding, read_disparity
from bearcub.stereo.formats import ByteOrder
from bearcub.stereo.images import shrunk

_DEPTHS = (Encoding.DEPTH_MM, Encoding.DEPTH_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoding:
    """What the numbers of disparity files mean; see `bearcub.stereo.read_disparity`."""

    encoding: str = Encoding.AUTO
    byte_order: ByteOrder = "auto"
    scale: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """One frame, ready for the pipeline.

    Attributes
    ----------
    name : str
        Of the frame.
    source : str
        The file or files it came from, for messages.
    snapshot : Snapshot
        Pictures as they were taken: rectifying is the pipeline's business.
    rig : Rig
        Of the size of the snapshot.
    notes : tuple of str
        What had to be guessed when it was read, or changed.
    """

    name: str
    source: str
    snapshot: Snapshot
    rig: Rig
    notes: tuple[str, ...] = ()


class Feed:
    """Shots, one for every frame of a source; they can be walked through once.

    Parameters
    ----------
    frames : FrameSource
        Open.
    rig : Rig
        Of any size of the same view.
    tilts : iterator of Tilt or None
        One for every frame.
    source : str
        What to call the input in messages.
    decoding : Decoding
        Of disparity files.
    scale : float
        From 0.05 to 1, of the pictures' sides; the rig follows by the pixel-centre rule.

    Raises
    ------
    InputError
        If `scale` is out of range.
    """

    def __init__(
        self,
        frames: FrameSource,
        rig: Rig,
        *,
        tilts: Iterator[Tilt | None],
        source: str,
        decoding: Decoding | None = None,
        scale: float = 1.0,
    ) -> None:
        if not 0.05 <= scale <= 1.0:
            raise InputError(f"scale {scale:g}: expected 0.05 to 1, of the pictures' sides")
        self._frames = frames
        self._rig = rig
        self._tilts = tilts
        self._source = source
        self._decoding = decoding or Decoding()
        self._scale = scale
        self._size = (0, 0)

    def __iter__(self) -> Iterator[Shot]:
        """Walk through the shots.

        Raises
        ------
        BearcubError
            If a frame cannot be read, fits neither rig nor the others, or has no tilt reading.
        """
        for frame, tilt in zip(self._frames, self._tilts, strict=False):
            yield self._shot(frame, tilt)

    def _shot(self, frame: Frame, tilt: Tilt | None) -> Shot:
        source = self._where(frame)
        disparity, notes = self._disparity(frame)
        notes += self._settle_size(frame.left if disparity is None else disparity, source)
        width, height = (round(side * self._scale) for side in self._size)
        return Shot(
            name=frame.name,
            source=source,
            snapshot=Snapshot(
                left=_smaller(frame.left, width=width, height=height),
                right=_smaller(frame.right, width=width, height=height),
                disparity=_thinned(disparity, width=width, height=height),
                tilt=tilt,
                stamp_ns=frame.stamp_ns,
            ),
            rig=self._rig.for_image(width=width, height=height),
            notes=notes,
        )

    def _where(self, frame: Frame) -> str:
        if frame.disparity_path is not None:
            return str(frame.disparity_path)
        return self._source if self._frames.count == 1 else f"frame {frame.name} of {self._source}"

    def _settle_size(self, first: UInt8 | Float32 | None, source: str) -> tuple[str, ...]:
        """Fit the rig to the first picture and say how; require its size of all others."""
        if first is None:
            raise InputError(f"{source}: holds neither a picture nor a disparity map")
        height, width = first.shape[:2]
        if self._size == (width, height):
            return ()
        if self._size != (0, 0):
            raise InputError(
                f"{source}: {width} x {height} pixels, expected {self._size[0]} x "
                f"{self._size[1]} as in the first frame"
            )
        camera = self._rig.camera
        self._size = (width, height)
        self._rig = self._rig.for_image(width=width, height=height)
        if not camera.size_known or (camera.width, camera.height) == self._size:
            return ()
        note = (
            f"{self._rig.source or 'the rig'}: is for {camera.width} x {camera.height} px and "
            f"scaled to the images' {width} x {height}"
        )
        return (note,)

    def _disparity(self, frame: Frame) -> tuple[Float32 | None, tuple[str, ...]]:
        """Read the frame's disparity file, if it has one, and what had to be guessed."""
        path = frame.disparity_path
        if path is None:
            return None, ()
        how = self._decoding
        # Depth is read as fx B = 1 first: what fx is depends on the size of the map.
        found = read_disparity(
            path,
            encoding=how.encoding,
            byte_order=how.byte_order,
            scale=how.scale,
            focal_baseline=1.0,
        )
        rows, columns = found.disparity.shape
        _require_same_size(frame.left, found.disparity, path)
        notes = (f"{path}: {found.note}",) if found.note else ()
        if found.encoding not in _DEPTHS:
            return found.disparity, notes
        camera = self._rig.for_image(width=columns, height=rows).camera
        focal_baseline = np.float32(camera.fx * camera.baseline)
        return found.disparity * focal_baseline - np.float32(camera.doffs), notes


def _require_same_size(left: UInt8 | None, disparity: Float32, path: Path) -> None:
    if left is not None and left.shape[:2] != disparity.shape:
        raise InputError(
            f"{path}: {disparity.shape[1]} x {disparity.shape[0]} pixels, expected "
            f"{left.shape[1]} x {left.shape[0]} as in the left image"
        )


def _smaller(image: UInt8 | None, *, width: int, height: int) -> UInt8 | None:
    if image is None or image.shape[:2] == (height, width):
        return image
    return shrunk(image, width=width, height=height)


def _thinned(disparity: Float32 | None, *, width: int, height: int) -> Float32 | None:
    """Take the disparity at the centre of every larger pixel: a mean would mix near and far."""
    if disparity is None or disparity.shape == (height, width):
        return disparity
    factor = np.float32(width / disparity.shape[1])
    taken = cv2.resize(disparity, (width, height), interpolation=cv2.INTER_NEAREST_EXACT)
    return np.asarray(taken, dtype=np.float32) * factor
