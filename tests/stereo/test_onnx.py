"""A learned matcher: tiny models made here show how images go in and disparity comes out."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.config import Config, Matching
from bearcub.errors import BearcubError, ConfigError, FormatError, InputError
from bearcub.messages import Float32, UInt8
from bearcub.rig import Camera, Mount
from bearcub.stereo import StereoStage
from bearcub.stereo.choice import matcher_for
from bearcub.stereo.matchers import Matcher, SearchRange
from bearcub.stereo.onnx_matcher import OnnxMatcher

onnx = pytest.importorskip("onnx", reason="makes the models of these tests")
pytest.importorskip("onnxruntime", reason="runs the models of these tests")

nan = np.nan
FLOAT = onnx.TensorProto.FLOAT
ANY = (1, 3, "height", "width")
WIDE = SearchRange(0, 64)
UNCHECKED = 100.0

Node = tuple[str, list[Any], dict[str, Any]]


@pytest.fixture
def model(tmp_path: Path) -> Callable[..., Path]:
    """Write a model: its inputs with their shapes, and nodes ``output=(kind, inputs, settings)``.

    The last node is the output; numbers among a node's inputs are constants.
    """

    def write(
        inputs: dict[str, Sequence[int | str]],
        *,
        kind: int = FLOAT,
        outputs: Sequence[str] = (),
        **nodes: Node,
    ) -> Path:
        helper = onnx.helper
        constants: list[Any] = []

        def named(source: Any) -> str:
            if isinstance(source, str):
                return source
            value = np.asarray(source)
            value = value.astype(np.float32 if value.dtype.kind == "f" else np.int64)
            constants.append(onnx.numpy_helper.from_array(value, f"constant{len(constants)}"))
            return str(constants[-1].name)

        made = [
            helper.make_node(operator, [named(source) for source in sources], [name], **settings)
            for name, (operator, sources, settings) in nodes.items()
        ]
        graph = helper.make_graph(
            made,
            "tiny",
            [helper.make_tensor_value_info(name, kind, shape) for name, shape in inputs.items()],
            [onnx.ValueInfoProto(name=name) for name in outputs or [list(nodes)[-1]]],
            constants,
        )
        path = tmp_path / "model.onnx"
        versions = [helper.make_opsetid("", 13)]
        onnx.save(helper.make_model(graph, opset_imports=versions, ir_version=8), path)
        return path

    return write


def node(operator: str, *sources: Any, **settings: Any) -> Node:
    return operator, list(sources), settings


def channel(source: str, number: int) -> Node:
    """Return what takes one channel of a tensor."""
    return node("Gather", source, [number], axis=1)


def pair(
    left: float, right: float = 0.0, *, shape: tuple[int, ...] = (32, 64)
) -> tuple[UInt8, ...]:
    return np.full(shape, left, np.uint8), np.full(shape, right, np.uint8)


def test_the_channel_is_red_and_white_is_what_the_model_takes_for_it(
    model: Callable[..., Path],
) -> None:
    path = model({"left": ANY, "right": ANY}, red=channel("left", 0))
    colour = np.full((32, 64, 3), (51, 25, 30), np.uint8)  # BGR
    grey, _ = pair(40)

    def answer(image: UInt8, white: float) -> Float32:
        matcher = OnnxMatcher(path, WIDE, white=white, left_right=UNCHECKED)
        return matcher(image, image)[:, 60]

    np.testing.assert_array_equal(answer(colour, 255.0), 30)
    np.testing.assert_array_equal(answer(grey, 255.0), 40)
    np.testing.assert_allclose(answer(colour, 1.0), 30 / 255, rtol=1e-6)


def test_a_model_with_one_channel_sees_grey(model: Callable[..., Path]) -> None:
    path = model(dict.fromkeys(("left", "right"), (1, 1, "h", "w")), same=node("Identity", "left"))
    colour = np.full((32, 64, 3), (0, 0, 100), np.uint8)
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(colour, colour)
    assert found[0, 60] == 30  # 0.299 of 100, as OpenCV rounds it


def test_any_size_is_extended_to_multiples_of_32_and_cut_again(model: Callable[..., Path]) -> None:
    path = model(
        dict.fromkeys(("left", "right"), (1, 1, "h", "w")),
        # fails but for 64 x 96
        same=node("Reshape", "left", [1, 1, 64, 96]),
    )
    rows, columns = np.mgrid[:50, :70]
    image = (rows * columns // 60).astype(np.uint8)  # less than the column: a disparity in sight
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(image, image)
    np.testing.assert_array_equal(found, image)


def test_a_model_of_one_size_is_answered_at_the_images_size(model: Callable[..., Path]) -> None:
    shape = (1, 3, 24, 40)
    path = model({"left": shape, "right": shape}, red=channel("left", 0))
    image, _ = pair(10, shape=(48, 100))
    image[24:, 50:] = 20
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(image, image)
    # 100 columns are 2.5 times the model's: so is the disparity
    expected = np.full((48, 100), 25.0)
    expected[24:, 50:] = 50.0
    expected[:, :25] = nan
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "names", [("right", "left"), ("image2", "image1"), ("input.10", "input.9"), ("b", "a")]
)
def test_left_and_right_are_told_by_name_number_or_order(
    model: Callable[..., Path], names: tuple[str, str]
) -> None:
    path = model(dict.fromkeys(names, ANY), red=channel(names[0], 0))
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(*pair(3, 7))
    assert found[0, 60] == (3 if names[0] == "b" else 7)


def test_every_input_gets_its_image_at_its_size(model: Callable[..., Path]) -> None:
    half, whole = (1, 3, 16, 32), (1, 3, 32, 64)
    path = model(
        {"init_left": half, "init_right": half, "next_left": whole, "next_right": whole},
        first=node("ReduceMean", "init_right", keepdims=1),
        both=node("Add", "next_left", "first"),
        answer=channel("both", 0),
    )
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(*pair(3, 7, shape=(64, 128)))
    assert found[0, 100] == 20  # 3 + 7, at half the width


@pytest.mark.parametrize(
    ("shape", "kind"), [((1, 32, 64), "FLOAT"), ((32, 64), "FLOAT"), ((1, 1, 32, 64), "INT64")]
)
def test_outputs_of_other_ranks_and_types_are_taken(
    model: Callable[..., Path], shape: tuple[int, ...], kind: str
) -> None:
    path = model(
        {"left": ANY, "right": ANY},
        red=channel("left", 0),
        flat=node("Reshape", "red", list(shape)),
        answer=node("Cast", "flat", to=getattr(onnx.TensorProto, kind)),
    )
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(*pair(9))
    np.testing.assert_array_equal(found[:, 9:], 9)


@pytest.mark.parametrize(
    ("outputs", "expected"),
    [(("coarse", "fine"), 2), (("flow_low", "flow_up", "weight"), 2), (("disparity", "sure"), 1)],
)
def test_the_output_is_the_last_that_is_called_so(
    model: Callable[..., Path], outputs: Sequence[str], expected: float
) -> None:
    nodes = {name: node("Add", "red", float(n)) for n, name in enumerate(outputs, start=1)}
    path = model({"left": ANY, "right": ANY}, outputs=outputs, red=channel("left", 0), **nodes)
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(*pair(0))
    np.testing.assert_array_equal(found[:, 5:], expected)


def test_flow_is_horizontal_and_points_to_the_left(model: Callable[..., Path]) -> None:
    path = model(
        {"left": ANY, "right": ANY},
        red=channel("left", 0),
        x=node("Neg", "red"),
        y=node("Mul", "red", 99.0),
        flow=node("Concat", "x", "y", axis=1),
    )
    found = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(*pair(5))
    np.testing.assert_array_equal(found[:, 5:], 5)


def answered(
    model: Callable[..., Path], values: Float32, search: SearchRange, *, negative: bool
) -> Float32:
    """Return what becomes of a model's answer, whose sign may be the other one."""
    path = model(
        {"left": ANY, "right": ANY},
        nothing=channel("left", 0),
        answer=node("Add", "nothing", -values if negative else values),
    )
    return OnnxMatcher(path, search, left_right=UNCHECKED)(*pair(0))


@pytest.mark.parametrize("negative", [False, True])
def test_the_sign_is_that_under_which_less_lies_beyond_infinity(
    model: Callable[..., Path], *, negative: bool
) -> None:
    values = np.full((32, 64), -0.2, np.float32)  # mostly sky, with the noise of infinity
    values[28:] = 12.0
    found = answered(model, values, WIDE, negative=negative)
    np.testing.assert_array_equal(found[28:, 12:], 12)
    np.testing.assert_array_equal(found[:28], 0)
    # With doffs infinity is measured as -10, and most disparities are negative.
    values = np.full((32, 64), -9.0, np.float32)
    values[20:] = 15.0
    found = answered(model, values, SearchRange(-10, 64), negative=negative)
    np.testing.assert_array_equal(found[20:, 15:], 15)
    np.testing.assert_array_equal(found[:20, :55], -9)


def test_what_cannot_be_a_match_is_none(model: Callable[..., Path]) -> None:
    values = np.full((32, 64), 4.0, np.float32)
    values[0, :8] = (4, 4, 4, 4, 4, nan, np.inf, -np.inf)
    values[1, 50:54] = (16, 15, -1, -1.1)
    found = answered(model, values, SearchRange(0, 16), negative=False)
    np.testing.assert_array_equal(found[0, :9], [nan] * 4 + [4] + [nan] * 3 + [4])
    np.testing.assert_array_equal(found[1, 49:55], [4, nan, 15, 0, nan, 4])


def test_matches_that_do_not_point_back_are_none(model: Callable[..., Path]) -> None:
    path = model({"left": ANY, "right": ANY}, red=channel("left", 0))
    left, right = pair(4, 4)
    right[:, 30:] = 9  # mirrored, this is what the right image's own match says
    checked = OnnxMatcher(path, WIDE, left_right=1.0)(left, right)
    np.testing.assert_array_equal(checked[:, 4:34], 4)
    assert np.isnan(checked[:, 34:]).all()
    loose = OnnxMatcher(path, WIDE, left_right=5.0)(left, right)
    np.testing.assert_array_equal(loose[:, 4:59], 4)  # 63 - 9 is the last that points to the left
    assert np.isnan(loose[:, 59:]).all()
    unchecked = OnnxMatcher(path, WIDE, left_right=UNCHECKED)(left, right)
    np.testing.assert_array_equal(unchecked[:, 4:], 4)


@pytest.fixture
def block_matcher(model: Callable[..., Path]) -> Path:
    """A model that matches: least mean difference in 9 x 9 pixels, of 24 disparities."""
    nodes = {"left1": channel("image1", 1), "right1": channel("image2", 1)}
    for d in range(24):
        nodes[f"wide{d}"] = node("Pad", "right1", [0, 0, 0, d, 0, 0, 0, 0], mode="edge")
        nodes[f"moved{d}"] = node("Slice", f"wide{d}", [0], [-d if d else 2**31], [3])
        nodes[f"difference{d}"] = node("Sub", "left1", f"moved{d}")
        nodes[f"size{d}"] = node("Abs", f"difference{d}")
        nodes[f"cost{d}"] = node("AveragePool", f"size{d}", kernel_shape=[9, 9], pads=[4] * 4)
    nodes["costs"] = node("Concat", *(f"cost{d}" for d in range(24)), axis=1)
    nodes["best"] = node("ArgMin", "costs", axis=1)
    nodes["whole"] = node("Cast", "best", to=FLOAT)
    nodes["flow"] = node("Neg", "whole")
    return model({"image1": ANY, "image2": ANY}, **nodes)


def test_the_stage_measures_a_slanted_floor_with_a_model(block_matcher: Path) -> None:
    height, width = 90, 150
    noise = np.random.default_rng(3).normal(128, 80, (height, width + 120))
    texture = np.clip(cv2.GaussianBlur(noise, (0, 0), 1.2), 0, 255).astype(np.uint8)
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    truth = 2 + 0.2 * rows
    left = cv2.remap(texture, columns - truth + 60, rows, cv2.INTER_CUBIC)
    camera = Camera(width=width, height=height, fx=120, fy=120, cx=75, cy=45, baseline=0.1)
    matching = Matching(matcher="onnx", model=str(block_matcher), nearest=0.52)
    stage = StereoStage.for_rig(camera, Mount(height=1.0), matching)
    found = stage(np.asarray(left, np.uint8), texture[:, 60 : 60 + width].copy())
    assert (found.smallest, found.largest, found.fattening) == (0, 31, 0)
    inside = np.abs(found.disparity - truth)[8:-8, 28:-8]
    assert np.isfinite(inside).mean() > 0.9
    assert np.nanpercentile(inside, 95) < 0.6  # the model tells whole pixels


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"stack": (1, 6, 32, 64)}, r"has 1 input \(stack\): expected two images"),
        (dict.fromkeys("abc", ANY), r"has 3 inputs \(a, b, c\): expected two images"),
        ({"a": (3, 32, 64), "b": ANY}, r"input a is tensor\(float\) of shape \(3, 32, 64\)"),
        ({"a": ANY, "b": (1, 32, 64, 3)}, r"input b is .* of shape \(1, 32, 64, 3\)"),
        ({"a": (1, 2, 32, 64), "b": ANY}, r"of shape \(1, 2, 32, 64\): expected two images"),
        ({"a": (4, 3, 32, 64), "b": ANY}, r"of shape \(4, 3, 32, 64\): expected two images"),
    ],
)
def test_a_model_that_takes_something_else_is_refused(
    model: Callable[..., Path], inputs: dict[str, Sequence[int | str]], words: str
) -> None:
    path = model(inputs, out=node("Identity", next(iter(inputs))))
    with pytest.raises(InputError, match=rf"model\.onnx: .*{words}"):
        OnnxMatcher(path, WIDE)


def test_a_model_of_doubles_is_refused(model: Callable[..., Path]) -> None:
    path = model({"a": ANY, "b": ANY}, kind=onnx.TensorProto.DOUBLE, out=node("Identity", "a"))
    with pytest.raises(InputError, match=r"a is tensor\(double\) .*expected two images of float32"):
        OnnxMatcher(path, WIDE)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (node("Identity", "left"), r"has shape \(1, 3, 32, 64\): expected disparity \(1, 1, 32,"),
        (node("AveragePool", "left", kernel_shape=[2, 2]), r"has shape \(1, 3, 31, 63\)"),
        (node("ReduceMean", "left", keepdims=0), r"has shape \(\): expected"),
        (node("Reshape", "left", [1, 1, 7, 7]), "cannot be run on images of 64 x 32 px: "),
    ],
)
def test_an_answer_that_is_no_disparity_is_refused_in_one_line(
    model: Callable[..., Path], answer: Node, words: str
) -> None:
    path = model({"left": ANY, "right": ANY}, answer=answer)
    with pytest.raises(InputError, match=rf"model\.onnx: .*{words}") as caught:
        OnnxMatcher(path, WIDE)(*pair(1))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"no model", None])
def test_a_file_that_is_no_model_is_refused_in_one_line(
    tmp_path: Path, content: bytes | None
) -> None:
    path = tmp_path / "given.onnx"
    if content is not None:
        path.write_bytes(content)
    words = "no such model file" if content is None else "is no ONNX model that can be run"
    kind = InputError if content is None else FormatError
    with pytest.raises(kind, match=words) as caught:
        OnnxMatcher(path, WIDE)
    assert "\n" not in str(caught.value)


def test_the_configuration_names_the_model(tmp_path: Path, model: Callable[..., Path]) -> None:
    path = model({"left": ANY, "right": ANY}, red=channel("left", 0))
    file = tmp_path / "robot.toml"
    file.write_text(
        '[matching]\nmatcher = "onnx"\nmodel = "model.onnx"\nmodel_white = 1\nleft_right = 100\n'
    )
    config = Config.load(file)
    assert config.matching.model == str(path)  # from the folder of the file
    matcher: Matcher = matcher_for(WIDE, config.matching)
    found = matcher(*pair(51))
    np.testing.assert_allclose(found[:, 1:], 0.2, rtol=1e-6)


def test_a_path_survives_printing_and_loading(tmp_path: Path) -> None:
    config = Config(matching=Matching(matcher="onnx", model='/models/a "fine" one\\ü.onnx'))
    file = tmp_path / "robot.toml"
    file.write_text(config.to_toml(), encoding="utf-8")
    assert Config.load(file) == config


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refusal(model: str) -> BearcubError:
        with pytest.raises(BearcubError) as caught:
            matcher_for(WIDE, Matching(matcher="onnx", model=model))
        return caught.value

    assert "expected a model file, too: matching.model" in str(refusal(""))
    missing = tmp_path / "missing.onnx"
    assert str(missing) in str(refusal(str(missing)))
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    absent = refusal(str(missing))
    assert isinstance(absent, ConfigError)
    assert "pip install 'bearcub[onnx]'" in str(absent)
