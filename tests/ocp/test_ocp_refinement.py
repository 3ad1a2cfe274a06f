"""Meshes of a refinement: the first one, one that the solver gives up, and the last one."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ocp import Accuracy, Between, Control, Ipopt, NlpSolver, Phase, Problem, Settings, State, solve
from ocp.algorithm import first_mesh
from ocp.refinement import endings
from tests.ocp.problems import double_integrator

SWING = 0.2  # [s], at the end of a long phase


def waiting(duration, swing=SWING):
    """A mass waits for long, then moves by 1 m: that is the guess."""
    x, v = State("x", "m", lower=0), State("v", "m/s", lower=0)
    u = Control("u", "m/s^2")

    def since(time):
        return np.clip((time - duration + swing) / swing, 0.0, 1.0)

    guess = {
        x: lambda time: 3 * since(time) ** 2 - 2 * since(time) ** 3,
        v: lambda time: 6 * since(time) * (1 - since(time)) / swing,
    }
    phase = Phase("all", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=duration, guess=guess)
    return Problem("waiting", phase, minimise=phase.integral(u**2))


def test_a_guess_that_a_uniform_mesh_carries_leaves_it_uniform():
    (mesh,) = first_mesh(waiting(2.0, swing=2.0), Settings(intervals=20)).phases
    assert np.diff(mesh.breakpoints) == pytest.approx(1 / 20, abs=1e-12)  # rounding


def test_intervals_gather_where_the_guess_moves():
    (mesh,) = first_mesh(waiting(100.0), Settings(intervals=20)).phases
    moving = mesh.breakpoints > 1 - SWING / 100
    # half of the way is the states', of which two go 1 and 2 of their ranges
    assert moving.sum() >= 0.5 * mesh.intervals
    # and the wait keeps its share
    assert np.diff(mesh.breakpoints).max() <= 2.1 * 4 / mesh.intervals


def test_the_optimum_may_move_where_the_guess_waits():
    solution = solve(waiting(100.0))
    # the cubic law: 12 D^2/T^3
    assert solution.objective == pytest.approx(1.2e-5, rel=1e-6)
    assert solution.verification.passed


class Choosy:
    """IPOPT, but for programs with the unknowns of the last one and more rows.

    Parameters
    ----------
    ipopt : Ipopt
    seen : list of (unknowns, rows)
        Of the programs that were solved, shared by all that follow from it.
    """

    def __init__(self, ipopt, seen):
        self.ipopt, self.seen = ipopt, seen

    def solve(self, program, start, limits, parameters, listener=None):
        size = start.x.size, limits.rows[0].size
        result = self.ipopt.solve(program, start, limits, parameters, listener)
        if self.seen and size[0] == self.seen[-1][0] and size[1] > self.seen[-1][1]:
            return replace(result, outcome="failed", status="Given_Up")
        self.seen.append(size)
        return result

    def within(self, iterations, seconds):
        return Choosy(self.ipopt.within(iterations, seconds), self.seen)

    def loosened(self, tolerance):
        return Choosy(self.ipopt.loosened(tolerance), self.seen)

    def within_gap(self, gap):
        return Choosy(self.ipopt.within_gap(gap), self.seen)

    def alternatives(self, *, warm):
        return [Choosy(other, self.seen) for other in self.ipopt.alternatives(warm=warm)]


def test_intervals_are_cut_where_more_points_lead_the_solver_astray():
    x, v, u, _ = double_integrator()
    rates, bounds = {x: v, v: u - ca.sin(x)}, [ca.sin(x) * v + v**2 / 2 <= 0.72]
    phase = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=1.5, bounds=bounds)
    problem = Problem("move", [phase], minimise=phase.integral(u**2))
    solver = Choosy(Ipopt(), [])
    assert isinstance(solver, NlpSolver)
    found = solve(problem, settings=Settings(intervals=6, solver=solver))
    given_up = [k for k, m in enumerate(found.mesh_iterations) if m.status == "Given_Up"]
    assert given_up
    before, after = (found.mesh_iterations[given_up[0] + k] for k in (-1, 1))
    assert after.intervals > before.intervals
    assert found.verification.passed
    assert found.objective == pytest.approx(3.9522152, rel=1e-6)


FEW = Settings(intervals=5)


def drive():
    """A way in little time and with little effort, below a speed: its limit leaks for long."""
    x, v, u = State("x"), State("v", upper=1), Control("u", lower=-1, upper=1)
    rates, end = {x: v, v: u - v**2 / 2}, Between(1, 9, guess=4)
    phase = Phase("drive", rates, {x: 0, v: 0}, {x: 3, v: 0}, end=end)
    return Problem("drive", [phase], minimise=phase.duration + phase.integral(u**2) / 10)


def test_a_dear_solve_ends_if_it_is_accurate_and_finer_meshes_bring_little(monkeypatch):
    full = solve(drive(), settings=FEW)
    monkeypatch.setattr(endings, "MUCH", 0.0)
    found = solve(drive(), settings=FEW)
    assert len(found.mesh_iterations) <= len(full.mesh_iterations)
    assert "no finer mesh improved it" in full.verdict
    assert "further meshes would cost much for little" in found.verdict
    assert abs(found.objective - full.objective) / full.objective <= found.accuracy <= 1e-4


@pytest.mark.parametrize("asked", [{"seconds": 600.0}, {"accuracy": Accuracy(objective=2e-6)}])
def test_who_states_an_accuracy_or_seconds_gets_it(monkeypatch, asked):
    monkeypatch.setattr(endings, "MUCH", 0.0)
    found = solve(drive(), settings=Settings(intervals=5, **asked))
    assert "would cost" not in found.verdict
