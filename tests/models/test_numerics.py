"""Peaks between the samples are found, and the highest of several."""

import math

import numpy as np
import pytest

from models.numerics import dense_peak


@pytest.mark.parametrize("centre", [0.1234567, 0.5, 0.98765])
def test_a_ridge_narrower_than_the_samples_show(centre):
    peak = dense_peak(lambda t: 3 / (1 + ((t - centre) / 1e-3) ** 2), 0.0, 1.0, samples=501)
    assert peak.where == pytest.approx(centre, abs=1e-9)
    assert peak.value == pytest.approx(3, rel=1e-12)


def test_the_highest_of_many():
    peak = dense_peak(lambda t: np.sin(40 * t) * (1 + t), 0.0, 3.0, samples=301)
    dense = np.linspace(0, 3, 3_000_001)
    assert peak.value == pytest.approx((np.sin(40 * dense) * (1 + dense)).max(), rel=1e-9)


def test_kinks_plateaus_and_ends():
    assert dense_peak(lambda t: 1 - np.abs(t - 1 / 3), 0, 1).value == pytest.approx(1, abs=1e-9)
    assert dense_peak(lambda t: np.minimum(t, 0.5), 0, 1).value == 0.5
    assert dense_peak(np.exp, 0, 1) == (1.0, math.e)
    assert dense_peak(lambda t: -t, 0, 1) == (0.0, 0.0)
    jump = dense_peak(lambda t: np.where(t < 0.3, t, 0.0), 0, 1, breakpoints=(0.3,))
    assert jump.value == pytest.approx(0.3, rel=1e-9)
