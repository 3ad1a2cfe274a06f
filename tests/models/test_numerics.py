"""Quadratures have their degree; peaks between samples are found, and the highest of several."""

import math

import numpy as np
import pytest

from models.numerics import dense_peak, gauss_legendre, interior, radau_nodes


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


@pytest.mark.parametrize("points", [1, 2, 5, 8])
def test_gauss_legendre_is_exact_to_degree_2n_minus_1(points):
    nodes, weights = gauss_legendre(points)
    for degree in range(2 * points):
        assert weights @ nodes**degree == pytest.approx(1 / (degree + 1), rel=1e-13)
    assert weights @ nodes ** (2 * points) != pytest.approx(1 / (2 * points + 1), rel=1e-9)


@pytest.mark.parametrize("points", [2, 3, 5, 7])
def test_radau_nodes_end_at_one_and_are_exact_to_degree_2n_minus_2(points):
    nodes = radau_nodes(points)
    assert nodes[-1] == 1.0
    assert (nodes > 0).all()
    # the polynomial that vanishes at the nodes is orthogonal to all of degree n - 2 at most
    x, w = gauss_legendre(points + 1)
    product = np.prod(x[:, None] - nodes, axis=1)
    for degree in range(points - 1):
        assert w @ (product * x**degree) == pytest.approx(0.0, abs=1e-15)


def test_interior_excludes_the_ends_only():
    for start, end in ((0.0, 1.0), (100.0, 140.0), (-3.0, 0.0)):
        low, high = interior(start, end)
        assert start < low < start + 1e-10
        assert end - 1e-10 < high < end
