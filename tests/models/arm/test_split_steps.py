"""Explicit steps that are split where they are too long: against closed forms."""

import casadi as ca
import numpy as np
import pytest

from models.arm.split_steps import split_steps
from models.errors import ModelError

OMEGA = 30.0  # [rad/s]


def oscillator():
    """An oscillator under a force: state (x, v)."""
    y, u = ca.SX.sym("y", 2), ca.SX.sym("u")
    return ca.Function("rate", [y, u], [ca.vertcat(y[1], u - OMEGA**2 * y[0])])


def pushed(t, start):
    """Its place and rate under a unit force from an instant on, from rest."""
    since = OMEGA * np.clip(t - start, 0.0, None)
    return np.array([(1.0 - np.cos(since)) / OMEGA**2, np.sin(since) / OMEGA])


@pytest.mark.parametrize("longest", [0.1, 0.01])
@pytest.mark.parametrize("tolerance", [1e-8, 1e-12])
def test_a_force_that_jumps_inside_a_step_is_met_to_the_tolerance(longest, tolerance):
    # 301 uneven instants and more than one call of the compiled steps
    times = np.linspace(0.0, 1.0, 301) ** 2 * 5.0
    start = 1.234567
    path = split_steps(
        oscillator(), np.zeros(2), times, lambda t: 1.0 * (t > start)[None], longest, tolerance
    )
    assert path.shape == (2, 301)
    assert np.abs(path - pushed(times, start)).max() < 200 * tolerance


def test_an_unstable_step_is_split_until_it_is_stable():
    # a hundred times too long for the oscillator
    times = np.array([0.0, 40.0])
    path = split_steps(oscillator(), np.zeros(2), times, lambda t: np.ones((1, t.size)), 20.0, 1e-9)
    assert np.abs(path[:, -1] - pushed(40.0, 0.0)).max() < 1e-6


def test_a_motion_without_end_is_refused_where_it_ends():
    y, u = ca.SX.sym("y"), ca.SX.sym("u")
    rate = ca.Function("rate", [y, u], [y**2])  # infinite at t = 1
    with pytest.raises(ModelError, match=r"no step is short enough at t = (1|0\.9)"):
        split_steps(rate, np.ones(1), np.array([0.0, 2.0]), lambda t: t[None], 0.1, 1e-9)
