"""Arcs that begin inside an interval: the optimum in closed form, and what a coarse mesh is told.

On such a mesh the limit is met at all points of the interval that holds the junction. The control
there is what the limit asks for, no control is rough, and only the Hamiltonian tells.
"""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ocp import TIME, Bound, Control, FixedMesh, Phase, Problem, Settings, State, certify, solve
from ocp.estimates.constrained_arcs import junction_gains
from tests.ocp.problems import certified


def below_a_speed(limit):
    """One metre in one second from rest to rest with least effort, below a speed [m/s]."""
    x, v, u = State("x", "m"), State("v", "m/s", upper=limit), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1)
    return Problem("below a speed", phase, minimise=phase.integral(u**2))


def least_effort(limit):
    """Parabolas of ``t_a = 3 (V - 1) / (2 V)`` at both ends, which cost ``8 V^2 / (3 t_a)``."""
    return 8.0 * limit**2 / (3.0 * (1.5 * (limit - 1.0) / limit))


def over_a_hill(steepness, top):
    """From 0 to 0 in one second over a parabola of height 1, with least integral of u^2."""
    x, u = State("x"), Control("u")
    hill = Bound("hill", x - 1 + steepness * (TIME - top) ** 2, lower=0)
    phase = Phase("over", {x: u}, initial={x: 0}, final={x: 0}, end=1, bounds=[hill])
    return Problem("over a hill", phase, minimise=phase.integral(u**2))


def least_over_a_hill(k, c):
    """Tangents from both ends and the parabola between: slope s at a, ``s a = 1 - k (a - c)^2``."""
    a = np.sqrt(c**2 - 1.0 / k)
    b = 1.0 - np.sqrt((1.0 - c) ** 2 - 1.0 / k)
    slopes = -2.0 * k * (np.array([a, b]) - c)
    arc = 4.0 * k**2 * ((b - c) ** 3 - (a - c) ** 3) / 3.0
    return slopes[0] ** 2 * a + slopes[1] ** 2 * (1.0 - b) + arc


@pytest.mark.parametrize("limit", [1.04, 1.08, 1.12, 1.35, 1.48])
def test_a_speed_is_held_from_where_it_is_best(limit):
    certified(below_a_speed(limit), least_effort(limit))


@pytest.mark.parametrize(("k", "c"), [(10, 0.4), (100, 0.5), (400, 0.51237), (1000, 0.51237)])
def test_a_hill_that_is_narrower_than_an_interval_is_touched_where_it_is_best(k, c):
    # time enters, so that the Hamiltonian is not constant
    certified(over_a_hill(k, c), least_over_a_hill(k, c))


def over_a_bell(width):
    """From 0 to 0 over a bell of height 1; it vanishes at both ends, where the motion begins."""
    x, u = State("x"), Control("u")
    bell = Bound("bell", x - ca.exp(-(((TIME - 0.5) / width) ** 2) / 2), lower=0)
    phase = Phase("over", {x: u}, initial={x: 0}, final={x: 0}, end=1, bounds=[bell])
    return Problem("over a bell", phase, minimise=phase.integral(u**2))


def least_over_a_bell(width):
    """Twice a tangent from the start to the bell, and the bell up to its top."""

    def bell(t):
        return np.exp(-(((t - 0.5) / width) ** 2) / 2)

    def slope(t):
        return -(t - 0.5) / width**2 * bell(t)

    at = brentq(lambda t: slope(t) * t - bell(t), 0.5 - width, 0.5 - 1e-9, xtol=1e-15)
    return 2 * (slope(at) ** 2 * at + quad(lambda t: slope(t) ** 2, at, 0.5)[0])


@pytest.mark.parametrize("width", [0.01, 0.02])
def test_a_limit_that_fixed_values_meet_hides_no_other_arc(width):
    # the start lies on the limit, whose multiplier there is any number, often a huge one
    found = certified(over_a_bell(width), least_over_a_bell(width))

    # those of the bell at the start and the end, and no others
    iterate = found.kept_iterate
    determined = iterate.determined_row_multipliers
    undetermined = np.flatnonzero(iterate.row_multipliers != determined)
    bell = np.concatenate([path.rows for path in iterate.transcription.rows.phases[0].path])
    assert undetermined.size == 2
    assert np.isin(undetermined, bell).all()


@pytest.mark.parametrize("limit", [1.04, 1.08, 1.12])
def test_a_mesh_whose_arcs_begin_too_early_is_not_certified(limit):
    coarse = solve(below_a_speed(limit), settings=Settings(refinement=FixedMesh()))
    assert coarse.objective > least_effort(limit) * (1 + 3e-4)
    failed = {c.name for c in certify(coarse).checks if not c.passed}
    assert any("where path constraints act" in name for name in failed)


def test_a_quarter_of_the_hamiltonians_difference_beside_the_end_of_an_arc_counts():
    ends = np.array([False, True, False, False])
    steps, stretches = np.array([0.5, 0.25, 1.0, 1.0]), np.zeros(4, dtype=int)
    found = junction_gains(np.array([2.0, -4.0, 8.0]), steps, stretches, ends)
    np.testing.assert_allclose(found, [0.0625, 0.0625 + 0.125, 0.125, 0.0])
    # at a known instant it may jump
    found = junction_gains(np.array([2.0, -4.0, 8.0]), steps, np.array([0, 1, 1, 1]), ends)
    np.testing.assert_allclose(found, [0.0, 0.125, 0.125, 0.0])
