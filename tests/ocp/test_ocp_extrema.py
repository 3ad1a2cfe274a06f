"""Maxima of sampled functions, interval by interval."""

import numpy as np

from ocp.numerics.piecewise_polynomial import dense_grid, maxima


def all_maxima(function, intervals, level=-np.inf):
    grid = dense_grid(4)
    k, tau = np.repeat(np.arange(intervals), grid.size), np.tile(grid, intervals)
    return maxima(function, function(k, tau).reshape(intervals, -1), grid, level)


def test_maxima_of_known_functions():
    # interval k: a parabola with its top at (k + 1) / 5, on a slope that moves none of them out
    def parabolas(k, tau):
        return 3 * k - (tau - (k + 1) / 5) ** 2

    found = all_maxima(parabolas, 4)
    # five rounds of zooming by 1/4 or more from a grid of 0.1: below 1e-4, squared in the value
    np.testing.assert_allclose(found.tau, [0.2, 0.4, 0.6, 0.8], atol=2e-4)
    np.testing.assert_allclose(found.values, [0, 3, 6, 9], atol=1e-7)


def test_maxima_at_ends_kinks_and_of_constants():
    functions = [lambda t: t, lambda t: -t, lambda t: 1 - np.abs(t - 1 / 3), lambda t: 0 * t + 5]

    def values(k, tau):
        return np.array([functions[i](t) for i, t in zip(k, tau, strict=True)])

    found = all_maxima(values, 4)
    np.testing.assert_allclose(found.values, [1, 0, 1, 5], atol=1e-4)  # a kink: the last grid
    np.testing.assert_allclose(found.tau[:3], [1, 0, 1 / 3], atol=1e-4)


def test_only_what_may_reach_the_level_or_is_the_largest_is_zoomed_into():
    asked = set()

    def parabolas(k, tau):
        asked.update(k)
        return k - 2.5 - (tau - 0.437) ** 2

    grid = dense_grid(4)
    k, tau = np.repeat(np.arange(4), grid.size), np.tile(grid, 4)
    values = parabolas(k, tau).reshape(4, -1)
    for level, zoomed in ((0.0, {3}), (-0.5001, {2, 3}), (7.0, {3})):
        asked.clear()
        found = maxima(parabolas, values, grid, level)
        assert asked == zoomed
        np.testing.assert_allclose(found.values[3], 0.5, atol=1e-7)
        np.testing.assert_allclose(found.values, [-2.5, -1.5, -0.5, 0.5], atol=0.02)


def test_a_value_that_is_not_finite_is_the_largest():
    found = all_maxima(lambda k, tau: np.where(tau > 0.9, np.nan, tau), 1)
    assert found.values[0] == np.inf


def test_a_peak_beside_lower_samples_is_found_where_the_highest_sample_is_at_an_end():
    # the end is at -0.4; between two samples there is a narrow peak of 5.7, beside them -80
    grid = dense_grid(4)
    middle = 0.5 * (grid[15] + grid[16])
    curvature = 85.7 / (grid[16] - middle) ** 2

    def values(k, tau):
        return np.maximum(5.7 - curvature * (tau - middle) ** 2, -0.4 - 1e5 * (1.0 - tau))

    samples = values(np.zeros(grid.size, dtype=int), grid)
    assert samples.max() == -0.4  # no sample shows it
    found = all_maxima(values, 1, level=0.0)
    np.testing.assert_allclose(found.values, [5.7], atol=1e-3)
    np.testing.assert_allclose(found.tau, [middle], atol=1e-5)
