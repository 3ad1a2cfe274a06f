"""Ropes that give, against the twin of the drive: by virtual work, by an author who has not read
the models.

A motor that stands holds h, the rope that it has wound in. The truss then feels the generalised
force T1(h, alpha) f - U', and its slope, by a complex step, is the stiffness.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from models.laws import Bezier, paper_points
from models.truss import DYNAMIC_SET, least_rope_stiffness, rope_mode_frequency, rope_swing
from tests.models import drive_twin as twin
from tests.models.test_drive_twin_itself import random_truss
from tests.seeds import seeds

CLOSE = 1e-8
OPEN = math.pi / 2


def taken(p, alpha):
    """Rope that the truss has taken since it was stowed, s [m]."""
    e, stowed = (twin.slider(p, np.asarray(at))[0] for at in (alpha, p.stowed_angle))
    return 2 * p.modules * (stowed - e)


def stretching(p, alpha, yields):
    """Tension that stretches a rope, over T1: of the motor, or the mean along the rope's length."""
    if yields == "at the motor":
        return np.ones_like(alpha)
    e = twin.slider(p, alpha)[0][..., None]
    b = p.half_cross_bar + 0 * e
    length = np.concatenate(p.modules * [e, b, b, e], axis=-1)
    return np.sum(twin.segments(p, alpha)[0] * length, axis=-1) / np.sum(length, axis=-1)


def slope(p, alpha):
    """U' [N m] of the springs and the net; analytic on each side of the net's angle."""
    cos, sin = np.cos(alpha), np.sin(alpha)
    e, e1, _ = twin.slider(p, alpha)
    springs = -2 * p.modules * p.spring_stiffness * (p.spring_free_length - e) * e1
    radius = p.half_cross_bar / np.sin(np.pi / p.modules)
    net = 2 * p.modules * p.net_stiffness * radius**2 * (sin - np.sin(p.net_angle)) * cos
    return springs + np.where(np.real(alpha) > p.net_angle, net, 0.0)


def stiffness_felt(p, alpha, stiffness, yields):
    """K [N m/rad] with the motor at rest and h such that the truss is in balance."""
    pull = slope(p, alpha) / twin.leverage(p, alpha)
    wound = taken(p, alpha) + pull * stretching(p, alpha, yields) / stiffness

    def force(at):
        tension = stiffness * (wound - taken(p, at)) / stretching(p, at, yields)
        return tension * twin.leverage(p, at) - slope(p, at)

    return -twin.derivative(force, alpha)


def rough(seed):
    """A truss with friction in its pulleys, and angles on both sides of the net's."""
    draw = np.random.default_rng(seed)
    parameters, _, _ = random_truss(draw)
    return parameters, draw.uniform(parameters.stowed_angle, OPEN, 9), draw


@pytest.mark.parametrize("yields", ["at the motor", "along its length"])
@pytest.mark.parametrize("seed", seeds(15, 50))
def test_the_truss_swings_on_its_ropes_as_virtual_work_says(seed, yields):
    parameters, angle, draw = rough(seed)
    stiffness = 10 ** draw.uniform(2, 4)
    felt = stiffness_felt(parameters, angle, stiffness, yields)
    square = felt / twin.inertia(parameters, angle)
    stable = square > 0
    assert stable.any()
    found = rope_mode_frequency(parameters, angle, stiffness, yields)
    assert np.array_equal(np.isnan(found), ~stable)
    expected = np.sqrt(square[stable]) / math.tau
    np.testing.assert_allclose(found[stable], expected, rtol=CLOSE)


@pytest.mark.parametrize("yields", ["at the motor", "along its length"])
@pytest.mark.parametrize("seed", seeds(4, 12))
def test_below_the_least_stiffness_an_angle_is_unstable(seed, yields):
    """Each angle needs a stiffness of its own; the largest of them is looked for on grids."""
    parameters, _, _ = rough(seed)

    def needed(angle):
        one, two = (stiffness_felt(parameters, angle, k, yields) for k in (1.0, 2.0))
        return 1.0 - one / (two - one)  # K is linear in k

    # U'' has a step at the net's angle
    parts = [(parameters.stowed_angle, parameters.net_angle), (parameters.net_angle + 1e-12, OPEN)]
    largest = 0.0
    for low, high in parts:
        for _ in range(4):  # each time closer about the largest
            grid = np.linspace(low, high, 201)
            at = int(np.argmax(needed(grid)))
            low, high = grid[max(at - 1, 0)], grid[min(at + 1, 200)]
        largest = max(largest, float(needed(grid)[at]))
    assert least_rope_stiffness(parameters, yields).stiffness == pytest.approx(largest, rel=CLOSE)


@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.slow), 0.01])
def test_the_swing_of_a_fast_law(friction):
    """Energy and what is lost give the motion; one number for the rope's pull and the rest."""
    parameters = replace(DYNAMIC_SET, pulley_friction=friction)
    law, stiffness = Bezier(10.0, paper_points(parameters.stowed_angle, OPEN)), 600.0
    swing = rope_swing(parameters, law, stiffness)

    grid = np.linspace(parameters.stowed_angle - 0.01, 1.7, 3001)
    mass = twin.inertia(parameters, grid)
    rows = mass, sum(twin.damping(parameters, grid)), twin.leverage(parameters, grid)
    smooth = CubicSpline(grid, rows, axis=1)  # of a thousandth of a degree
    faster = smooth.derivative()

    stowed = np.asarray([parameters.stowed_angle])
    first = (slope(parameters, stowed) / twin.leverage(parameters, stowed)).item() / stiffness

    def tension(time, angle):
        meant = law.motion(np.minimum([time], law.duration)).angle
        wound = first + taken(parameters, meant)
        return np.maximum(0.0, stiffness * (wound - taken(parameters, angle))).item()

    def right_side(time, state):
        angle, rate = state
        mass, lost, lever = smooth(angle)
        resists = faster(angle)[0] * rate**2 / 2 + lost * rate + slope(parameters, angle)
        return [rate, (tension(time, angle) * lever - resists) / mass]

    path = solve_ivp(
        right_side,
        (0.0, swing.time[-1]),
        [parameters.stowed_angle, 0.0],
        method="LSODA",
        t_eval=swing.time,
        rtol=1e-9,
        atol=1e-11,
        max_step=0.1,
    )
    np.testing.assert_allclose(swing.angle, path.y[0], rtol=0, atol=1e-6)
    pull = [tension(*at) for at in zip(path.t, path.y[0], strict=True)]
    np.testing.assert_allclose(swing.tension[0], pull, rtol=0, atol=1e-4 * max(pull))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "yields", "late"), [(0.01, "at the motor", 0.1), (0.0, "along its length", 0.05)]
)
def test_the_truss_with_one_motor_behind_the_other(friction, yields, late):
    """Two springs turn one angle: each motor winds in the law's rope and its stretch, one late."""
    parameters = replace(DYNAMIC_SET, pulley_friction=friction)
    law, stiffness = Bezier(10.0, paper_points(parameters.stowed_angle, OPEN)), 600.0
    swing = rope_swing(parameters, law, stiffness, yields, winds_stretch=True, behind=late)

    grid = np.linspace(parameters.stowed_angle - 0.01, 1.7, 6001)
    mass = twin.inertia(parameters, grid)
    rows = mass, sum(twin.damping(parameters, grid)), twin.leverage(parameters, grid)
    smooth = CubicSpline(grid, [*rows, stretching(parameters, grid, yields)], axis=1)
    faster = smooth.derivative()

    def resists(angle, rate):
        lost = smooth(angle)[1]
        return faster(angle)[0] * rate**2 / 2 + lost * rate + slope(parameters, angle)

    # straight lines between 0.25 ms leave 1e-8 m
    times = np.linspace(0.0, law.duration, 40_001)
    meant = law.motion(times)
    mass, _, lever, mean = smooth(meant.angle)
    pull = (mass * meant.acceleration + resists(meant.angle, meant.speed)) / lever
    wound = taken(parameters, meant.angle) + mean * pull / stiffness

    def tensions(time, angle):
        each = np.array([np.interp(time - behind, times, wound) for behind in (0.0, late)])
        return np.maximum(0.0, stiffness * (each - taken(parameters, angle)) / smooth(angle)[3])

    def right_side(time, state):
        angle, rate = state
        mass, _, lever, _ = smooth(angle)
        return [rate, (tensions(time, angle).mean() * lever - resists(angle, rate)).item() / mass]

    path = solve_ivp(
        right_side,
        (0.0, swing.time[-1]),
        [parameters.stowed_angle, 0.0],
        method="LSODA",
        dense_output=True,
        rtol=1e-9,
        atol=1e-11,
        max_step=0.05,
    )
    np.testing.assert_allclose(swing.angle, path.sol(swing.time)[0], rtol=0, atol=1e-6)

    fine = np.linspace(0.0, swing.time[-1], 20_001)
    angle, rate = path.sol(fine)
    pulls = tensions(fine, angle)
    np.testing.assert_allclose(swing.tension.max(axis=1), pulls.max(axis=1), rtol=1e-4)
    # the rope in time is never slack; the other one is, up to some samples
    assert pulls[0].min() > 0.0
    assert swing.slack == pytest.approx((pulls[1] <= 0.0).mean() * fine[-1], abs=0.01)
    # it creeps to its end, where a millijoule would be a fault of the model
    reached = int(np.argmax(angle >= OPEN - 1e-6))
    left = float(twin.inertia(parameters, OPEN) * rate[reached] ** 2 / 2)
    assert swing.arrival_energy == pytest.approx(left, rel=0.2)
    assert swing.arrival_energy < 1e-9
