"""Rectified pairs have every point in one row, at the column its depth says."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import UInt8
from bearcub.rig import Camera, Lens, Rectification, Rig
from bearcub.stereo import rectification
from bearcub.stereo.native import NativeRemap, RawPixels, levels, reason_missing
from bearcub.stereo.rectification import Rectifier

CALIBRATION_IMAGES = Path(__file__).parents[2] / ".." / "shared" / "data" / "opencv_calibration"

Points = NDArray[np.float64]

KALIBR = """\
cam0:
  camera_model: pinhole
  distortion_coeffs: {left}
  distortion_model: {model}
  intrinsics: [380.0, 382.0, 330.0, 228.0]
  resolution: [640, 480]
cam1:
  T_cn_cnm1: {pose}
  camera_model: pinhole
  distortion_coeffs: {right}
  distortion_model: {model}
  intrinsics: [376.0, 377.0, 308.0, 251.0]
  resolution: [640, 480]
"""
COEFFICIENTS = {
    "radtan": ([-0.28, 0.07, 0.0004, -0.0006], [-0.26, 0.06, -0.0005, 0.0003]),
    "equidistant": ([-0.0135, 0.0200, -0.0162, 0.0047], [0.0034, 0.0007, -0.0020, 0.0002]),
}
TURN = cv2.Rodrigues(np.array([0.02, -0.03, 0.025]))[0]
SHIFT = np.array([-0.118, 0.004, 0.006])
"""The right camera is turned by 1.1, 1.7 and 1.4 deg and sits 4 mm up and 6 mm behind."""


def load(tmp_path: Path, model: str) -> Rig:
    """Return the rig of two such lenses, as Kalibr would write it."""
    pose = np.vstack([np.column_stack([TURN, SHIFT]), [0, 0, 0, 1]]).tolist()
    left, right = COEFFICIENTS[model]
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR.format(model=model, left=left, right=right, pose=pose), encoding="utf-8")
    return Rig.load(path, height=1.0)


def project(points: Points, lens: Lens) -> Points:
    """Return raw pixels, shape (N, 2), of points in the lens's own axes: written out, not cv2's.

    Plumb bob: Brown's radial and tangential terms. Equidistant: Kannala and Brandt's odd powers.
    """
    k = lens.distortion
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x * x + y * y
    if lens.model == "equidistant":
        angle = np.arctan(np.sqrt(r2))
        bent = angle * (1 + sum(c * angle ** (2 * i + 2) for i, c in enumerate(k)))
        x, y = x * bent / np.sqrt(r2), y * bent / np.sqrt(r2)
    else:
        radial = 1 + k[0] * r2 + k[1] * r2**2
        x, y = (
            x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
            y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y,
        )
    return np.column_stack([lens.fx * x + lens.cx, lens.fy * y + lens.cy])


def draw(pixels: Points, *, width: int = 640, height: int = 480) -> UInt8:
    """Return an image of small bright spots."""
    v, u = np.mgrid[:height, :width]
    image = np.zeros((height, width))
    for x, y in pixels:
        image += 250 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * 2.0**2))
    return np.clip(image.round(), 0, 255).astype(np.uint8)


def spot(image: UInt8, near: Points) -> Points:
    """Return the centroid of the spot within 9 px of a pixel."""
    u, v = near.round().astype(int)
    window = image[v - 9 : v + 10, u - 9 : u + 10].astype(float)
    dv, du = np.mgrid[-9:10, -9:10]
    weights = window / window.sum()
    return np.array([u + (weights * du).sum(), v + (weights * dv).sum()])


def scene() -> Points:
    """Return points in the left lens's axes, 1.5 to 6 m away, all over the view."""
    return np.array(
        [
            [depth * across, depth * down, depth]
            for across, depth in ((-0.5, 2.0), (-0.2, 1.5), (0.1, 6.0), (0.45, 3.0))
            for down in (-0.4, 0.02, 0.35)
        ]
    )


@pytest.mark.parametrize("model", ["radtan", "equidistant"])
def test_spots_come_to_lie_in_one_row_at_the_column_of_their_depth(
    tmp_path: Path, model: str
) -> None:
    rig = load(tmp_path, model)
    whole = rig.rectification
    assert whole is not None
    points = scene()
    raw = draw(project(points, whole.left)), draw(project(points @ TURN.T + SHIFT, whole.right))
    left, right = Rectifier(whole)(*raw)
    camera = rig.camera
    for point in points @ whole.left.rectified_from_raw.T:
        row = camera.fy * point[1] / point[2] + camera.cy
        column = camera.fx * point[0] / point[2] + camera.cx
        disparity = camera.fx * camera.baseline / point[2]
        seen_left = spot(left, np.array([column, row]))
        seen_right = spot(right, np.array([column - disparity, row]))
        assert seen_left == pytest.approx([column, row], abs=0.1)
        assert seen_right == pytest.approx([column - disparity, row], abs=0.1)


def test_the_raw_pair_of_the_test_is_out_of_line(tmp_path: Path) -> None:
    """Without this the test above could pass on a pair that needs no rectification."""
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    points = scene()
    left, right = project(points, whole.left), project(points @ TURN.T + SHIFT, whole.right)
    assert np.abs(left[:, 1] - right[:, 1]).min() > 5


def test_images_of_half_the_size_are_rectified_alike(tmp_path: Path) -> None:
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    half = whole.for_image(width=320, height=240)
    points = scene()
    raw = (
        draw(project(points, half.left), width=320, height=240),
        draw(project(points @ TURN.T + SHIFT, half.right), width=320, height=240),
    )
    left, right = Rectifier(whole)(*raw)
    assert left.shape == (240, 320)
    camera = half.camera
    for point in points @ whole.left.rectified_from_raw.T:
        row = camera.fy * point[1] / point[2] + camera.cy
        column = camera.fx * point[0] / point[2] + camera.cx
        near = np.array([column, row])
        assert spot(left, near) == pytest.approx(near, abs=0.1)
        near -= [camera.fx * camera.baseline / point[2], 0]
        assert spot(right, near) == pytest.approx(near, abs=0.1)


def test_nothing_to_undo_leaves_the_images_alone() -> None:
    camera = Camera(width=64, height=48, fx=60, fy=60, cx=30, cy=20, baseline=0.1, doffs=2)
    lens = Lens(fx=60, fy=60, cx=30, cy=20)
    whole = Rectification(camera=camera, left=lens, right=replace(lens, cx=32))
    assert not whole.needed
    assert replace(whole, right=lens).needed
    image = np.random.default_rng(1).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    left, right = Rectifier(whole)(image, image)
    np.testing.assert_array_equal(left, image)
    np.testing.assert_array_equal(right, image)


def test_maps_are_built_once_for_a_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    rectify = Rectifier(whole)
    image = np.zeros((480, 640), dtype=np.uint8)
    rectify(image, image)
    monkeypatch.setattr(cv2, "initUndistortRectifyMap", None)
    rectify(image, image)


def test_refuses_pairs_that_are_not_of_this_camera(tmp_path: Path) -> None:
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    image = np.zeros((480, 640), dtype=np.uint8)
    with pytest.raises(InputError, match="left image is 640 x 480 px, the right one 640 x 479"):
        Rectifier(whole)(image, image[1:])
    with pytest.raises(InputError, match="640 x 360 px, but the rig is for 640 x 480"):
        Rectifier(whole)(image[:360], image[:360])


def noise(height: int, width: int, *, seed: int) -> UInt8:
    return np.random.default_rng(seed).integers(0, 256, (height, width), dtype=np.uint8)


def wandering_map(height: int, width: int, *, reach: float, seed: int) -> RawPixels:
    """Return a map that turns, bends and leaves the image by up to `reach` pixels."""
    random = np.random.default_rng(seed)
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    bends = [
        cv2.resize(random.uniform(-reach, reach, (3, 3)).astype(np.float32), (width, height))
        for _ in range(2)
    ]
    whole, shares = cv2.convertMaps(columns + bends[0], rows + bends[1], cv2.CV_16SC2)
    return np.asarray(whole, dtype=np.int16), np.asarray(shares, dtype=np.uint16)


@pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")
@settings(max_examples=40, deadline=None)
@given(
    height=st.integers(1, 60),
    width=st.integers(1, 90),
    reach=st.sampled_from([0.0, 0.7, 9.0, 200.0]),
    seed=st.integers(0, 2**31),
)
def test_the_compiled_remap_is_opencvs_to_the_bit(
    *, height: int, width: int, reach: float, seed: int
) -> None:
    maps = [wandering_map(height, width, reach=reach, seed=seed + i) for i in (0, 1)]
    pair = noise(height, width, seed=seed), noise(height, width + 7, seed=seed + 1)[:, 3:-4]
    expected = [
        cv2.remap(np.ascontiguousarray(image), *each, cv2.INTER_LINEAR)
        for image, each in zip(pair, maps, strict=True)
    ]
    for level in levels():
        for threads in (1, 2):
            remap = NativeRemap(maps[0], maps[1], threads=threads, level=level)
            for found, image in zip(remap(*pair), expected, strict=True):
                np.testing.assert_array_equal(found, image)


@pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")
def test_the_compiled_remap_weighs_four_neighbours_and_takes_what_is_beyond_as_black() -> None:
    raw = np.array([[100, 200], [0, 60]], dtype=np.uint8)
    # Column and row, and thirty-seconds beyond: the row's shares stand above the column's.
    whole = np.array([[[0, 0], [-1, 0]], [[1, 1], [5, 0]]], dtype=np.int16)
    shares = np.array([[8 + 32 * 16, 24], [16, 0]], dtype=np.uint16)
    found, _ = NativeRemap((whole, shares), (whole, shares))(raw, raw)
    # (100 + (200 - 100) / 4 + 60 / 4) / 2 = 70; 3/4 of 100; half of 60; nothing.
    np.testing.assert_array_equal(found, [[70, 75], [30, 0]])


def test_grey_pairs_come_out_alike_with_the_core_and_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    pair = noise(480, 640, seed=1), noise(480, 640, seed=2)
    found = Rectifier(whole)(*pair)
    monkeypatch.setattr(rectification, "reason_missing", lambda: "no compiler")
    for native, plain in zip(found, Rectifier(whole)(*pair), strict=True):
        np.testing.assert_array_equal(native, plain)


def test_the_left_picture_can_be_rectified_alone_in_colour(tmp_path: Path) -> None:
    whole = load(tmp_path, "radtan").rectification
    assert whole is not None
    colour = np.dstack([noise(480, 640, seed=seed) for seed in range(3)])
    np.testing.assert_array_equal(
        Rectifier(whole).left(colour), Rectifier(whole)(colour, colour)[0]
    )


SQUARE = 0.025
"""Side of a square of the chessboards [m]."""


def corners(image: UInt8) -> NDArray[np.float32] | None:
    """Return the inner corners of the chessboard, shape (54, 2)."""
    found, pixels = cv2.findChessboardCorners(image, (9, 6))
    if not found:
        return None
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.01)
    refined = cv2.cornerSubPix(image, pixels, (7, 7), (-1, -1), stop)
    return np.asarray(refined, dtype=np.float32).reshape(-1, 2)


def chessboards() -> list[tuple[UInt8, UInt8]]:
    """Return the pairs of the calibration recording."""
    lefts = sorted(CALIBRATION_IMAGES.glob("left*.jpg"))
    files = [(path, path.with_name(path.name.replace("left", "right"))) for path in lefts]
    return [
        (
            np.asarray(cv2.imread(str(left), cv2.IMREAD_GRAYSCALE), dtype=np.uint8),
            np.asarray(cv2.imread(str(right), cv2.IMREAD_GRAYSCALE), dtype=np.uint8),
        )
        for left, right in files
    ]


def calibrate(pairs: list[tuple[UInt8, UInt8]], path: Path) -> None:
    """Calibrate with OpenCV as its sample does, and let OpenCV write the file."""
    board = np.zeros((54, 3), dtype=np.float32)
    board[:, :2] = SQUARE * np.mgrid[:9, :6].T.reshape(-1, 2)
    seen = [(corners(left), corners(right)) for left, right in pairs]
    both = [(left, right) for left, right in seen if left is not None and right is not None]
    left, right = [pair[0] for pair in both], [pair[1] for pair in both]
    boards, size = [board] * len(left), (640, 480)
    _, m1, d1, *_ = cv2.calibrateCamera(boards, left, size, None, None)
    _, m2, d2, *_ = cv2.calibrateCamera(boards, right, size, None, None)
    _, m1, d1, m2, d2, turn, shift, *_ = cv2.stereoCalibrate(
        boards, left, right, m1, d1, m2, d2, size
    )
    r1, r2, p1, p2, *_ = cv2.stereoRectify(m1, d1, m2, d2, size, turn, shift, alpha=0)
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    names = ["M1", "D1", "M2", "D2", "R1", "R2", "P1", "P2"]
    for name, matrix in zip(names, [m1, d1, m2, d2, r1, r2, p1, p2], strict=True):
        file.write(name, np.asarray(matrix))
    file.release()


@pytest.mark.skipif(not CALIBRATION_IMAGES.is_dir(), reason="the chessboard pairs are not here")
def test_real_chessboards_calibrated_by_opencv_come_into_line(tmp_path: Path) -> None:
    pairs = chessboards()
    calibrate(pairs, tmp_path / "stereo.yml")
    rig = Rig.load(tmp_path / "stereo.yml", height=1.0, size=(640, 480))
    assert rig.camera.baseline == pytest.approx(3.34 * SQUARE, rel=0.01)
    assert rig.rectification is not None
    rectify = Rectifier(rig.rectification)
    offsets = []
    for pair in pairs:
        left, right = (corners(image) for image in rectify(*pair))
        if left is not None and right is not None:
            offsets.append(right[:, 1] - left[:, 1])
    assert len(offsets) >= 8
    assert np.sqrt(np.mean(np.square(offsets))) < 0.5
    assert abs(np.median(offsets)) < 0.1
