"""Algebraic variables between the points of a mesh: the values that solve their equations.

At its points a motion meets all equations. Between them the polynomial of an algebraic variable is
only near to what solves its own, and farthest beside a jump of a control. What counts there is the
motion of the states: its rates are those of the values that solve the equations.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, SignalGroup, Trajectory
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.problem.problem import Problem
from ocp.problem.symbols import Algebraic, column_of, scalar

# Newton's steps where the equations are not linear in the variables. Each doubles the digits, and
# the polynomial of a motion that is nearly right has one or two.
_STEPS = 4

# Local times of an interval at which the variables are worked out: as many as a replay keeps of its
# states.
_NODES = np.linspace(0.0, 1.0, 9)


@lru_cache(maxsize=64)
def solved_algebraics(problem: Problem, phase: str) -> ca.SX | None:
    """The algebraic variables of a phase by Newton's steps that start at their symbols, (n_z,).

    None where the equations with algebraic variables do not determine them: there are more or fewer
    of them, or their Jacobian is singular whatever the motion is (index 2 and more).

    Parameters
    ----------
    phase : str
        Its name.
    """
    variables = column_of(problem.algebraics[phase])
    (stated,) = (each for each in problem.phases if each.name == phase)
    equations = [
        bound.expression - scalar(bound.lower, bound.name)
        for bound in stated.bounds
        if bound.is_equation and any(isinstance(symbol, Algebraic) for symbol in bound.symbols)
    ]
    residual = ca.vertcat(*equations, ca.SX(0, 1))
    slope = ca.jacobian(residual, variables)
    if variables.is_empty() or not slope.is_square() or ca.sprank(slope) < slope.size1():
        return None

    step = variables - ca.solve(slope, residual)
    # of linear equations the first one is exact
    reached = step
    for _ in range(_STEPS - 1 if ca.depends_on(slope, variables) else 0):
        reached = ca.substitute(step, variables, reached)
    return reached


def with_solved_algebraics(trajectory: Trajectory, evaluator: Evaluator) -> Trajectory:
    """A motion whose algebraic variables solve their equations within the intervals, too.

    They keep their polynomials in the phases of which `taken_algebraics` has them.
    """
    phases = []
    for phase in trajectory.phases:
        values = algebraic_values(trajectory, phase, evaluator)
        if values is not None:
            names = tuple(s.name for s in evaluator.problem.algebraics[phase.name])
            piece = Piece(np.arange(phase.intervals), Lagrange(tuple(_NODES.tolist())), values)
            polynomial = PiecewisePolynomial(phase.breakpoints, (piece,))
            others = (group for group in phase.groups if group.kind != "algebraic")
            groups = (*others, SignalGroup("algebraic", names, polynomial))
            phase = replace(phase, groups=groups)
        phases.append(phase)
    return replace(trajectory, phases=tuple(phases))


def algebraic_values(
    trajectory: Trajectory, phase: PhaseTrajectory, evaluator: Evaluator
) -> Array | None:
    """What solves the algebraic equations at some local times of each interval, (N, 9, n_z).

    None where the equations do not determine the variables, or Newton's method finds no values
    anywhere along the phase.
    """
    solved = solved_algebraics(evaluator.problem, phase.name)
    if solved is None:
        return None
    places = np.repeat(np.arange(phase.intervals), _NODES.size), np.tile(_NODES, phase.intervals)
    values = evaluator.values(trajectory, phase.name, ca.vertsplit(solved), *places)
    if not np.isfinite(values).all():
        return None
    return values.reshape(phase.intervals, _NODES.size, -1)


def taken_algebraics(trajectory: Trajectory, evaluator: Evaluator) -> tuple[str, ...]:
    """Algebraic variables whose equations do not tell their values between the points, by name."""
    return tuple(
        name
        for phase in trajectory.phases
        if phase.algebraics and algebraic_values(trajectory, phase, evaluator) is None
        for name in phase.algebraics
    )
