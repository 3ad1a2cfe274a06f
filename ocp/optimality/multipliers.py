"""Multipliers of a solved program in the user's units and names.

Convention: with ``J`` as it is minimised (the negative of what is maximised), the Lagrangian is
``J + sum mu . expression``, so a multiplier is positive where an upper limit holds the optimum
back and negative where a lower one does, and ``dJ/dlimit = -mu`` for either.  The solver's
multiplier ``nu`` of a row ``expression / scale`` gives ``mu = nu * objective scale / scale``.
Dynamics have costates instead, see `ocp.optimality.costates`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.ipopt import NlpResult
from ocp.optimality.costates import PhaseCostates, costates
from ocp.problem.statement import Problem
from ocp.transcription.defects import boundary_points
from ocp.transcription.scaling import Scales
from ocp.transcription.transcribe import Method, Transcription, transcribe

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PathRows:
    """The rows of one continuous constraint: points of intervals at which it is imposed.

    Attributes
    ----------
    phase, constraint : indices of the phase and of its continuous constraint.
    weights : (m,) quadrature weights on [0, 1]; nan at points added between collocation points.
    """

    phase: int
    constraint: int
    rows: Integers
    intervals: Integers
    tau: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class PathMultiplier:
    """Multipliers of one path bound or peak of a phase.

    Attributes
    ----------
    times : (m,) where it is imposed [s].
    masses : (m,) multipliers, unit of the objective per unit of the expression.
    densities : (m,) masses per second: divided by step and quadrature weight at collocation
        points, nan at points added between them.
    sign : -1 for the lower side of a peak of an absolute value.
    """

    name: str
    phase: str
    is_peak: bool
    sign: float
    times: Array
    masses: Array
    densities: Array


@dataclass(frozen=True, eq=False)
class Multipliers:
    """All multipliers of a solution.

    Attributes
    ----------
    costates : of each phase, functions of time.
    terminal : of the problem's bounds and links, by name.
    paths : of the phases' bounds and peaks.
    """

    costates: tuple[PhaseCostates, ...]
    terminal: dict[str, float]
    paths: tuple[PathMultiplier, ...]


@dataclass(frozen=True, eq=False)
class SolvedProgram:
    """What it takes to build a solved program again: numbers, and the problem itself.

    Attributes
    ----------
    x, bound_multipliers, row_multipliers : scaled, as the solver left them.
    """

    problem: Problem
    mesh: Mesh
    method: Method
    scales: Scales
    x: Array
    bound_multipliers: Array
    row_multipliers: Array

    @cached_property
    def transcription(self) -> Transcription:
        """The program, built on first use."""
        return transcribe(self.problem, self.mesh, self.method, self.scales)

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k != "transcription"}


def solved_program(transcription: Transcription, result: NlpResult) -> SolvedProgram:
    """Keep a solved transcription."""
    t = transcription
    made = SolvedProgram(t.problem, t.mesh, t.method, t.scales, result.x,
                         result.bound_multipliers, result.row_multipliers)  # fmt: skip
    made.__dict__["transcription"] = transcription
    return made


def multipliers(solved: SolvedProgram, trajectory: Trajectory) -> Multipliers:
    """Unscaled multipliers by name."""
    made, nu = solved.transcription, solved.row_multipliers
    bounds = (*solved.problem.bounds, *solved.problem.links)
    rows = made.blocks[-1].rows[0] if bounds else []
    size = solved.scales.objective
    terminal = {
        b.name: float(nu[row] * size / solved.scales.bounds["", b.name])
        for b, row in zip(bounds, rows, strict=True)
    }
    parts: dict[tuple[int, int], list[PathRows]] = {}
    for part in path_rows(made):
        parts.setdefault((part.phase, part.constraint), []).append(part)
    paths = []
    for (i, j), found in parts.items():
        own, constraint = trajectory.phases[i], made.constraints[i][j]
        k = np.concatenate([p.intervals for p in found])
        tau, weights = (np.concatenate([getattr(p, n) for p in found]) for n in ("tau", "weights"))
        masses = nu[np.concatenate([p.rows for p in found])] * size / constraint.scale
        steps = np.diff(own.breakpoints)[k]
        times = own.breakpoints[k] + tau * steps
        order = np.argsort(times, kind="stable")
        paths.append(PathMultiplier(
            constraint.name, own.name, constraint.peak is not None, constraint.sign,
            times[order], masses[order], (masses / (weights * steps))[order]))  # fmt: skip
    return Multipliers(costates(made, nu), terminal, tuple(paths))


def path_rows(transcription: Transcription) -> Iterator[PathRows]:
    """Rows of all continuous constraints, in the order in which `transcribe` took them."""
    blocks = iter(transcription.blocks)
    for i, (layout, found, extra) in enumerate(
        zip(transcription.layouts, transcription.constraints, transcription.mesh.extra, strict=True)
    ):
        sampled = [j for j, c in enumerate(found) if c.sampled]
        for group in layout.groups:
            s, m = group.scheme.degree, group.intervals.size
            block = next(blocks)
            for n, j in enumerate(sampled):
                yield PathRows(
                    i, j, block.rows[:, len(layout.states) + n], np.repeat(group.intervals, s),
                    np.tile(group.scheme.points, m), np.tile(group.scheme.weights, m))  # fmt: skip
        connections = sum(not group.scheme.ends_on_support for group in layout.groups)
        connections += bool(layout.integrals) + (layout.ends is not None)
        connections += bool(layout.mesh.moving.any())
        for _ in range(connections):
            next(blocks)
        for points in (*boundary_points(layout, found), *extra):
            for group in layout.groups:
                here = np.isin(points.intervals, group.intervals)
                if here.any():
                    yield PathRows(
                        i, points.constraint, next(blocks).rows[:, 0], points.intervals[here],
                        points.tau[here], np.full(int(here.sum()), np.nan))  # fmt: skip


def column_multipliers(solved: SolvedProgram, constants: dict[str, float]) -> Array:
    """Scaled multipliers of the unknowns' bounds.

    Those of fixed unknowns, which the solver takes out of the program, follow from stationarity.
    """
    made = solved.transcription
    values = ca.DM([constants[c.name] for c in solved.problem.constants] or ca.DM(0, 1))
    gradient = np.array(made.program.objective_gradient(solved.x, values)[1]).ravel()
    jacobian = made.program.constraint_jacobian(solved.x, values)[1]
    gradient += np.array(ca.mtimes(jacobian.T, ca.DM(solved.row_multipliers))).ravel()
    lower, upper = made.columns.evaluate(constants)
    return np.where(lower == upper, -gradient, solved.bound_multipliers)
