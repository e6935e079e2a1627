import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.sim import degrade
from bearcub.sim.sensor import Strength, linear, quantised

GREY = np.full((120, 160), 120, dtype=np.uint8)
COLOUR = np.dstack([GREY, GREY // 2, GREY + 60])


def test_light_and_pixels_convert_both_ways() -> None:
    every = np.arange(256, dtype=np.uint8).reshape(16, 16)
    np.testing.assert_array_equal(quantised(linear(every)), every)
    assert linear(every)[15, 15] == 1


def test_same_seed_gives_the_same_image_and_another_does_not() -> None:
    one = degrade(COLOUR, "medium", (1, 0))
    np.testing.assert_array_equal(one, degrade(COLOUR, "medium", (1, 0)))
    assert (one != degrade(COLOUR, "medium", (1, 1))).any()


def test_stronger_means_noisier() -> None:
    centre = np.s_[50:70, 60:100]  # where vignetting is flat
    strengths: tuple[Strength, ...] = ("weak", "medium", "strong")
    noise = [degrade(GREY, strength, 3)[centre].std() for strength in strengths]
    assert 0.5 < noise[0] < noise[1] < noise[2] < 8


def test_brightness_stays_within_the_gain() -> None:
    means = [degrade(GREY, "medium", seed)[50:70, 60:100].mean() for seed in range(8)]
    # 6 % of light is 2.7 % of a pixel value: 120 +- 3.3, and a little vignetting
    assert max(abs(mean - 120) for mean in means) < 5
    assert np.ptp(means) > 1


def test_corners_are_darker() -> None:
    bright = degrade(GREY, "strong", 4).astype(float)
    assert bright[:10, :10].mean() < bright[55:65, 75:85].mean() - 10


def test_edges_get_softer() -> None:
    edge = np.zeros((64, 64), dtype=np.uint8)
    edge[:, 32:] = 200
    assert 20 < degrade(edge, "medium", 0)[:, 31].mean() < 150


def test_grey_stays_grey_and_colour_keeps_its_hue() -> None:
    assert degrade(GREY, "weak", 0).shape == GREY.shape
    means = degrade(COLOUR, "weak", 0)[50:70, 60:100].mean(axis=(0, 1))
    assert means == pytest.approx([120, 60, 180], abs=4)


def test_unknown_strength_and_wrong_type_are_refused() -> None:
    with pytest.raises(InputError, match="must be one of weak, medium, strong"):
        degrade(GREY, "huge", 0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected an 8-bit image"):
        degrade(GREY.astype(float), "weak", 0)
