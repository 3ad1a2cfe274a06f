"""Algebraic variables between the points: what solves their equations, by other means."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from ocp import (
    Algebraic,
    Between,
    Bound,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    solve,
)
from ocp.verification.simulation import simulate


def cart(law, limit=30.0):
    """A cart and its pendulum, driven over 1 m in least time; `law` tells the accelerations.

    Both bodies have the same length and mass of 1, so that with the angle q from the vertical
    2 a + w' cos q = u + w^2 sin q, and a cos q + w' = -10 sin q.
    """
    x, v, q, w = State("x", "m"), State("v", "m/s"), State("q", "rad"), State("w", "rad/s")
    force = Control("force", "N", lower=-limit, upper=limit)
    a, b, equations = law(q, w, force)
    rest = {x: 0, v: 0, q: 0, w: 0}
    phase = Phase(
        "move",
        dynamics={x: v, v: a, q: w, w: b},
        initial=rest,
        final={**rest, x: 1},
        end=Between(0.3, 4, guess=1.5),
        bounds=equations,
    )
    return Problem("cart", [phase], minimise=phase.duration)


def by_equations(q, w, force):
    a, b = Algebraic("a", "m/s^2"), Algebraic("b", "rad/s^2")
    cart = 2 * a + b * ca.cos(q) - force - w**2 * ca.sin(q)
    link = a * ca.cos(q) + b + 10 * ca.sin(q)
    equations = [Bound("cart", cart, lower=0, upper=0), Bound("link", link, lower=0, upper=0)]
    return a, b, equations


def by_hand(q, w, force):
    """Cramer's rule."""
    right = [force + w**2 * ca.sin(q), -10 * ca.sin(q)]
    determinant = 2 - ca.cos(q) ** 2
    a = (right[0] - ca.cos(q) * right[1]) / determinant
    b = (2 * right[1] - ca.cos(q) * right[0]) / determinant
    return a, b, []


COARSE = Settings(scheme=Radau(3), intervals=12, refinement=FixedMesh(3))


@pytest.fixture(scope="module")
def coarse():
    """On a mesh that is too coarse for a control that jumps."""
    return solve(cart(by_equations), settings=COARSE)


def test_replay_is_that_of_the_eliminated_equations(coarse):
    motion = coarse.trajectory
    (phase,) = motion.phases
    alone = replace(phase, groups=tuple(g for g in phase.groups if g.kind != "algebraic"))
    sizes = dict.fromkeys(phase.states, 1.0)
    one = simulate(coarse.problem, motion, sizes)
    two = simulate(cart(by_hand), replace(motion, phases=(alone,)), sizes)
    assert_allclose(one.phases[0].states, two.phases[0].states, atol=1e-10)
    assert one.amplification == pytest.approx(two.amplification, rel=1e-6)
    assert one.miss > 1e-4  # what the coarse mesh is off by


NODES = np.linspace(0, 1, 9)


def at_nodes(phase, *names):
    """Values at the samples of a replay."""
    places = np.repeat(np.arange(phase.intervals), 9), np.tile(NODES, phase.intervals)
    values = phase.local(*places)
    return [values[:, phase.signals.index(name)] for name in names]


def test_replayed_values_solve_the_equations_and_those_of_the_solution_do_not(coarse):
    def residual(phase):
        q, w, force, a, b = at_nodes(phase, "q", "w", "force", "a", "b")
        cart = 2 * a + b * np.cos(q) - force - w**2 * np.sin(q)
        return np.abs([cart, a * np.cos(q) + b + 10 * np.sin(q)]).max()

    assert residual(coarse.replayed.phases[0]) < 1e-11
    assert residual(coarse.trajectory.phases[0]) > 0.1


def test_what_counts_of_an_equation_is_what_the_motion_is_off_by(coarse):
    (phase,) = coarse.trajectory.phases
    sizes = [coarse.iterate.scales.signals[name] for name in phase.states]
    force, worst = phase.polynomial("force"), 0.0
    for k in range(phase.intervals):
        begin, end = phase.breakpoints[k : k + 2]

        def rate(t, state, k=k, begin=begin, end=end):
            (pushed,) = force.value(np.array([k]), np.array([(t - begin) / (end - begin)]))
            a, b, _ = by_hand(*state[2:], pushed[0])
            return [state[1], float(a), state[3], float(b)]

        times = np.linspace(begin, end, 20)
        tau = (times - begin) / (end - begin)
        own = phase.state_polynomial.value(np.full(20, k), tau)
        true = solve_ivp(rate, (begin, end), own[0], t_eval=times, rtol=1e-10, atol=1e-12).y.T
        worst = max(worst, float(np.abs((own - true) / sizes).max()))
    # the integrated residual is of first order in what the motion is off by
    assert coarse.verification.dynamics == pytest.approx(worst, rel=0.2)


def test_a_limit_is_held_against_the_values_of_the_replay():
    def limited(q, w, force):
        a, b, equations = by_equations(q, w, force)
        return a, b, [*equations, Bound("comfort", a, "m/s^2", lower=-8, upper=8)]

    found = solve(cart(limited), settings=COARSE)
    phase = found.replayed.phases[0]
    times = np.linspace(0, 1, 400)
    places = np.repeat(np.arange(phase.intervals), times.size), np.tile(times, phase.intervals)
    q, w, force = (phase.local(*places)[:, phase.signals.index(n)] for n in ("q", "w", "force"))
    a = (force + w**2 * np.sin(q) + 10 * np.sin(q) * np.cos(q)) / (2 - np.cos(q) ** 2)
    excess = (np.abs(a).max() - 8) / np.abs(a).max()
    assert excess > 1e-3
    assert found.verification.excess == pytest.approx(excess, rel=2e-2)  # of 400 samples, degree 8


def valve(*equations):
    """Least effort over 1 m against a drag; z is what the equations make of the control u."""
    x, u, z = State("x", "m"), Control("u", "m/s"), Algebraic("z", "m/s")
    phase = Phase(
        "fill",
        dynamics={x: z - 0.1 * x},
        initial={x: 0},
        final={x: 1},
        end=1.0,
        bounds=[Bound(f"law{i}", law(z, u), lower=0, upper=0) for i, law in enumerate(equations)],
    )
    return Problem("valve", [phase], minimise=phase.integral(u**2))


def test_equations_that_are_not_linear_are_solved_too():
    found = solve(valve(lambda z, u: z + z**3 - u))
    u, z = at_nodes(found.replayed.phases[0], "u", "z")
    roots = [np.roots([1, 0, 1, -value]) for value in u]
    real = [float(r[np.abs(r.imag).argmin()].real) for r in roots]
    assert_allclose(z, real, atol=1e-11)
    assert "the replay takes" not in found.verdict


def test_values_that_no_equations_tell_are_those_of_the_solution():
    x, u = State("x", "m"), Control("u", "m/s")
    z, y = Algebraic("z", "m/s"), Algebraic("y", "m/s")
    law = Bound("law", z + y - u, lower=0, upper=0)
    phase = Phase("fill", {x: z + 2 * y}, {x: 0}, {x: 1}, end=1.0, bounds=[law])
    effort = phase.integral(z**2 + y**2 + u**2)
    found = solve(Problem("two ways", [phase], minimise=effort))
    # the least of z^2 + y^2 + (z + y)^2 with z + 2 y = 1: z = 0, y = 1/2
    assert found.objective == pytest.approx(0.5, rel=1e-9)
    assert found.verification.passed
    assert "the replay takes 'z', 'y' from the solution" in found.verdict


def test_replay_of_coupled_curved_equations_is_an_integration_that_solves_them_at_each_time():
    """Neither the equations nor their solution is linear; the mesh is too coarse to hold them."""
    x, w, u = State("x", "m"), State("w", "m"), Control("u", "m/s", lower=-8, upper=8)
    z, y = Algebraic("z", "m/s"), Algebraic("y", "m/s")

    def equations(z, y, x, w, u, sin):
        return z + 0.3 * sin(y) - u + x, y + 0.5 * y**3 + z * (0.5 + w) - 3 * u * x

    stated = equations(*(one.symbol for one in (z, y, x, w, u)), ca.sin)
    bounds = [Bound(f"law {i}", law, lower=0, upper=0) for i, law in enumerate(stated)]
    ends = {x: 0, w: 0}, {x: 1, w: 0.2}
    phase = Phase("stir", {x: z, w: y + x}, *ends, end=Between(0.2, 3, guess=1), bounds=bounds)
    coarse = Settings(scheme=Radau(3), intervals=4, refinement=FixedMesh(3))
    found = solve(Problem("stirred", [phase], minimise=phase.duration), settings=coarse)

    own, (motion,) = found.replayed.phases[0], found.trajectory.phases
    control, state, off = motion.polynomial("u"), np.zeros(2), 0.0
    for k in range(motion.intervals):
        begin, end = motion.breakpoints[k : k + 2]
        known = motion.local(np.array([k]), np.array([0.0]))[0]
        guess = known[[motion.signals.index(name) for name in ("z", "y")]]

        def rate(t, state, k=k, begin=begin, end=end, guess=guess):
            (pushed,) = control.value(np.array([k]), np.array([(t - begin) / (end - begin)]))
            solved = root(lambda zy: equations(*zy, *state, pushed[0], np.sin), guess, tol=1e-11)
            assert solved.success
            return [solved.x[0], solved.x[1] + state[0]]

        path = solve_ivp(
            rate, (begin, end), state, t_eval=begin + (end - begin) * NODES, rtol=1e-9, atol=1e-11
        )
        state = path.y[:, -1]
        places = np.full(9, k), NODES
        replayed, planned = (
            one.local(*places)[:, [one.signals.index(name) for name in ("x", "w")]]
            for one in (own, motion)
        )
        assert_allclose(replayed, path.y.T, atol=1e-7)
        off = max(off, np.abs(planned - path.y.T).max())
    assert off > 1e-4  # of the mesh itself
