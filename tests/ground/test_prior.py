"""What is expected of the floor, and how it is weighed against what the image shows."""

import math

import numpy as np
import pytest

from bearcub.ground.prior import expect
from bearcub.ground.stage import fuse
from bearcub.messages import Tilt
from bearcub.rig import Mount

DEG = math.pi / 180
MOUNT = Mount(height=1.2, pitch=5.9 * DEG)
DEFAULTS = {"sigma_height_share": 0.1, "sigma_mount": 5 * DEG, "sigma_tilt": 1.5 * DEG}


def test_without_a_reading_the_mount_alone_is_expected() -> None:
    prior = expect(MOUNT, None, **DEFAULTS)
    assert (prior.height, prior.pitch, prior.roll) == pytest.approx((1.2, 5.9 * DEG, 0.0))
    assert not prior.tilted
    np.testing.assert_allclose(prior.sigma, [0.12, 5 * DEG, 5 * DEG])


def test_reading_turns_the_mounted_camera_and_is_trusted_more() -> None:
    prior = expect(MOUNT, Tilt(roll=12 * DEG, pitch=0.0), **DEFAULTS)
    # sin(pitch) = cos 12 sin 5.9, tan(roll) = tan 12 / cos 5.9
    assert prior.pitch == pytest.approx(5.7706 * DEG, abs=1e-5)
    assert prior.roll == pytest.approx(12.0620 * DEG, abs=1e-5)
    assert prior.height == 1.2
    assert prior.tilted
    np.testing.assert_allclose(prior.sigma, [0.12, 1.5 * DEG, 1.5 * DEG])


def test_level_reading_is_not_the_same_as_none() -> None:
    level = expect(MOUNT, Tilt(roll=0.0, pitch=0.0), **DEFAULTS)
    assert level.tilted
    assert level.sigma[1] < expect(MOUNT, None, **DEFAULTS).sigma[1]


def test_sigmas_that_the_mount_states_win() -> None:
    mount = Mount(height=1.2, sigma_height=0.01, sigma_pitch=0.2 * DEG)
    prior = expect(mount, None, **DEFAULTS)
    np.testing.assert_allclose(prior.sigma, [0.01, 0.2 * DEG, 5 * DEG])


def test_equal_doubts_meet_in_the_middle_and_halve_the_variance() -> None:
    values, covariance = fuse(np.zeros(3), np.ones(3), np.array([1.0, 0.5, -1.0]), np.eye(3))
    np.testing.assert_allclose(values, [0.5, 0.25, -0.5])
    np.testing.assert_allclose(covariance, np.eye(3) / 2)


def test_weights_are_inverse_variances() -> None:
    # prior 1 with sigma 1, image 4 with sigma 2: (1 / 1 + 4 / 4) / (1 / 1 + 1 / 4) = 1.6
    values, covariance = fuse(np.ones(3), np.ones(3), np.full(3, 4.0), 4 * np.eye(3))
    np.testing.assert_allclose(values, np.full(3, 1.6))
    np.testing.assert_allclose(np.diag(covariance), np.full(3, 0.8))


def test_contradicted_part_of_the_prior_has_no_say_and_the_others_keep_theirs() -> None:
    expected, measured = np.zeros(3), np.array([1.0, 9.0, 1.0])
    values, covariance = fuse(expected, np.ones(3), measured, np.eye(3))
    np.testing.assert_allclose(values, [0.5, 9.0, 0.5])
    np.testing.assert_allclose(np.diag(covariance), [0.5, 1.0, 0.5])


def test_contradiction_begins_at_three_sigmas_of_both_together() -> None:
    limit = 3 * math.sqrt(1 + 4)  # prior sigma 1, image sigma 2
    for share, kept in ((0.99, True), (1.01, False)):
        measured = np.array([0.0, share * limit, 0.0])
        values, _ = fuse(np.zeros(3), np.ones(3), measured, 4 * np.eye(3))
        assert (values[1] < 0.5 * measured[1]) == kept


def test_what_the_image_ties_together_moves_together() -> None:
    """A prior on one of two correlated values corrects the other, too."""
    covariance = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    sigma = np.array([1e-3, 1e3, 1e3])
    values, fused = fuse(np.zeros(3), sigma, np.array([1.0, 1.0, 1.0]), covariance)
    np.testing.assert_allclose(values, [0.0, 0.1, 1.0], atol=1e-4)  # 1 - 0.9 * 1
    assert fused[1, 1] == pytest.approx(1 - 0.9**2, rel=1e-4)


def test_fused_floor_is_never_known_worse_than_the_image_alone() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        root = rng.normal(size=(3, 3))
        covariance = root @ root.T + 0.01 * np.eye(3)
        _, fused = fuse(rng.normal(size=3), rng.uniform(0.1, 3, 3), rng.normal(size=3), covariance)
        assert (np.diag(fused) <= np.diag(covariance) * (1 + 1e-9)).all()
        assert np.linalg.eigvalsh(fused).min() > 0
