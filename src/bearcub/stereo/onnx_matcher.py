"""Learned matchers: a model file of the user's own, run by ONNX Runtime.

For models that take two images and return disparity or optical flow, as RAFT-Stereo [1]_ and
CREStereo [2]_ do when they are exported.

.. [1] L. Lipson, Z. Teed, J. Deng: "RAFT-Stereo: multilevel recurrent field transforms for stereo
   matching", 3DV 2021.
.. [2] J. Li et al.: "Practical stereo matching via cascaded recurrent network with adaptive
   correlation", CVPR 2022.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import ConfigError, FormatError, InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.images import grey, mirrored
from bearcub.stereo.matchers import SearchRange, inside, left_right_check

_MULTIPLE = 32  # of its sides a model of any size wants its images [px]: it halves them five times
_UNCHECKED = 100.0  # a left-right difference that everything passes [px]
_EXPECTED = "expected two images of float32 of shape (1, 3 or 1, height, width)"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Port:
    """One of a model's inputs.

    Attributes
    ----------
    name : str
    right : bool
        Whether it takes the right image.
    channels : int
        3 or 1.
    height, width : int or None
        [px]; None where it takes any.
    """

    name: str
    right: bool
    channels: int
    height: int | None
    width: int | None

    def size_for(self, image: UInt8) -> tuple[int, int]:
        """Return height and width of the image once resized, before it is padded."""
        return self.height or image.shape[0], self.width or image.shape[1]

    def tensor(self, image: UInt8, *, factor: float) -> Float32:
        """Return the image as the input wants it, shape (1, channels, height, width)."""
        height, width = self.size_for(image)
        if (height, width) != image.shape[:2]:
            shrinks = height * width < image.shape[0] * image.shape[1]
            way = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
            image = np.asarray(cv2.resize(image, (width, height), interpolation=way), np.uint8)
        below = 0 if self.height else -height % _MULTIPLE
        beside = 0 if self.width else -width % _MULTIPLE
        image = np.asarray(
            cv2.copyMakeBorder(image, 0, below, 0, beside, cv2.BORDER_REPLICATE), np.uint8
        )
        planes = grey(image)[np.newaxis] if self.channels == 1 else _red_green_blue(image)
        return np.ascontiguousarray(planes[np.newaxis], dtype=np.float32) * np.float32(factor)


class OnnxMatcher:
    """A model of the user's own that was trained to match.

    Images of another size than the model's are resized to it and the answer back, its values too;
    for a model that takes any size they are extended at the right and the bottom to a multiple of
    32 px. Of several outputs the last one is taken that is called a disparity or a flow, else the
    last. Flow is horizontal flow: of two channels the first. Whether disparity is the output or its
    negative is told by the sign under which less of it lies beyond infinity.

    Parameters
    ----------
    model : Path
        An ``.onnx`` file. Its inputs are left and right by name, by number, or in this order.
    search : SearchRange
        Disparities that can be believed; what the model reports beyond them is no match.
    white : float
        What the model takes for white; black is 0.
    left_right : float
        Largest disagreement of the match from the right image [px]; below 100 the model is run a
        second time on the mirrored pair to find out.
    threads : int
        That work at the same time.

    Attributes
    ----------
    smallest, largest : float
        The disparities it can report [px].
    fattening : float
        0: what learned models carry past edges is not known.

    Raises
    ------
    ConfigError
        If ONNX Runtime is not installed.
    InputError
        If there is no such file, or the model does not take two images.
    FormatError
        If the file is no model that ONNX Runtime can run.
    """

    fattening: float = 0.0

    def __init__(
        self,
        model: Path,
        search: SearchRange,
        *,
        white: float = 255.0,
        left_right: float = 1.0,
        threads: int = 1,
    ) -> None:
        self._model = model
        self._session = _session(model, threads=threads)
        self._ports = _ports(self._session.get_inputs(), model=model)
        self._output = _output([output.name for output in self._session.get_outputs()])
        self._factor = white / 255.0
        self._left_right = left_right
        self.smallest: float = search.smallest
        self.largest: float = search.largest

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched.

        Raises
        ------
        InputError
            If the model cannot be run on them, or returns anything but one value a pixel.
        """
        forward = self._believed(self._run(left, right))
        if self._left_right >= _UNCHECKED:
            return forward
        # Mirrored, the right image is a left one: the same model answers for it.
        of_mirrored = self._believed(self._run(mirrored(right), mirrored(left)))
        backward = np.ascontiguousarray(of_mirrored[:, ::-1])
        return left_right_check(forward, backward, largest_difference=self._left_right)

    def _run(self, left: UInt8, right: UInt8) -> Float32:
        """Return the model's answer [px] at the images' size."""
        tensors = {
            port.name: port.tensor(right if port.right else left, factor=self._factor)
            for port in self._ports
        }
        try:
            answer = self._session.run([self._output], tensors)[0]
        except Exception as error:  # ONNX Runtime's own share no base
            raise InputError(
                f"{self._model}: cannot be run on images of {left.shape[1]} x {left.shape[0]} px: "
                f"{_first_line(error)}"
            ) from error
        finest = max(self._ports, key=lambda port: tensors[port.name].size)
        plane = self._plane(answer, shape=tensors[finest.name].shape[2:])
        height, width = finest.size_for(left)
        return _resized(plane[:height, :width], left.shape[:2])

    def _plane(self, answer: Any, *, shape: tuple[int, ...]) -> Float32:
        """Return the one value a pixel that the model answers, shape (H, W)."""
        found = np.asarray(answer)
        if found.shape[-2:] != shape or math.prod(found.shape[:-2]) not in (1, 2):
            raise InputError(
                f"{self._model}: its output {self._output} has shape {found.shape}: expected "
                f"disparity (1, 1, {shape[0]}, {shape[1]}) or flow (1, 2, {shape[0]}, {shape[1]})"
            )
        return np.asarray(found.reshape(-1, *shape)[0], dtype=np.float32)

    def _believed(self, found: Float32) -> Float32:
        """Return disparity of the right sign; NaN where it is none that can be."""
        found = np.where(np.isfinite(found), found, np.float32(np.nan))
        disparity = min(found, -found, key=self._beyond_infinity)
        noise = (disparity < self.smallest) & (disparity >= self.smallest - 1)
        disparity = np.where(noise, np.float32(self.smallest), disparity)
        sound = (disparity >= self.smallest) & (disparity <= self.largest)
        return inside(np.where(sound, disparity, np.float32(np.nan)))

    def _beyond_infinity(self, disparity: Float32) -> float:
        return float(np.nansum(np.maximum(self.smallest - disparity, 0)))


def _session(model: Path, *, threads: int) -> Any:
    """Return ONNX Runtime's session, which says nothing by itself and waits without spinning."""
    try:
        runtime = import_module("onnxruntime")
    except ImportError as error:
        raise ConfigError(
            f"the matcher onnx needs ONNX Runtime: pip install 'bearcub[onnx]' ({error})"
        ) from error
    if not model.is_file():
        raise InputError(f"{model}: no such model file; expected an .onnx file")
    options = runtime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4  # fatal alone: errors are raised
    try:
        return runtime.InferenceSession(str(model), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # its own share no base
        raise FormatError(
            f"{model}: is no ONNX model that can be run: {_first_line(error)}"
        ) from error


def _ports(inputs: Sequence[Any], *, model: Path) -> tuple[_Port, ...]:
    """Return the inputs of a model and which image each takes."""
    names = [given.name for given in inputs]
    rights = _right_names(names)
    if not rights:
        raise InputError(
            f"{model}: has {len(names)} input{'s' * (len(names) != 1)} ({', '.join(names)}): "
            f"{_EXPECTED}"
        )
    return tuple(_port(given, right=given.name in rights, model=model) for given in inputs)


def _port(given: Any, *, right: bool, model: Path) -> _Port:
    shape = [side if isinstance(side, int) else None for side in given.shape]
    fits = len(shape) == 4 and shape[0] in (1, None) and shape[1] in (1, 3, None)
    if not fits or given.type != "tensor(float)":
        raise InputError(
            f"{model}: its input {given.name} is {given.type} of shape {tuple(given.shape)}: "
            f"{_EXPECTED}"
        )
    _, channels, height, width = shape
    return _Port(name=given.name, right=right, channels=channels or 3, height=height, width=width)


def _right_names(names: Sequence[str]) -> set[str]:
    """Return which inputs take the right image; empty where that cannot be told.

    Examples
    --------
    >>> _right_names(["image2", "image1"]), _right_names(["x", "y"])
    ({'image2'}, {'y'})
    >>> sorted(_right_names(["init_left", "init_right", "next_left", "next_right"]))
    ['init_right', 'next_right']
    """
    right = {name for name in names if "right" in name.lower()}
    left = {name for name in names if "left" in name.lower()}
    if right and left and right | left == set(names) and not right & left:
        return right
    if len(names) != 2:
        return set()
    first, second = (re.fullmatch(r"(.*?)(\d+)", name) for name in names)
    exchanged = first and second and first[1] == second[1] and int(first[2]) > int(second[2])
    return {names[0] if exchanged else names[1]}


def _output(names: Sequence[str]) -> str:
    """Return the output that holds the answer: the last is the finest.

    Examples
    --------
    >>> _output(["flow_low", "flow_up"]), _output(["disparity", "confidence"]), _output(["a", "b"])
    ('flow_up', 'disparity', 'b')
    """
    named = [name for name in names if "disp" in name.lower() or "flow" in name.lower()]
    return (named or list(names))[-1]


def _red_green_blue(image: UInt8) -> UInt8:
    way = cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB
    return np.asarray(cv2.cvtColor(image, way), dtype=np.uint8).transpose(2, 0, 1)


def _resized(found: Float32, shape: tuple[int, ...]) -> Float32:
    """Return disparity for images of another size; a mean would mix near and far."""
    if found.shape == shape:
        return found
    factor = np.float32(shape[1] / found.shape[1])
    nearest = cv2.resize(found, shape[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    taken: NDArray[np.float32] = np.asarray(nearest, dtype=np.float32)
    return taken * factor


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
