"""A mesh that the solver gives up, though it differs from the last one by a few points only."""

from dataclasses import replace

import casadi as ca
import pytest

from ocp import Control, Ipopt, NlpSolver, Phase, Problem, Settings, State, solve


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
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase(
        "move",
        {x: v, v: u - ca.sin(x)},
        {x: 0, v: 0},
        {x: 1, v: 0},
        end=1.5,
        bounds=[ca.sin(x) * v + v**2 / 2 <= 0.72],
    )
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
