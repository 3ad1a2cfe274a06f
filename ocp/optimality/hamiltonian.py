"""The Hamiltonian of a solved phase: its course, its end values and its slope by the controls.

``H = L + lambda . f`` in the sign of `ocp.optimality.costates`.  The slope carries the path
multipliers,
``H_u + sum mu c_u`` (Bryson and Ho, "Applied Optimal Control", ch. 2-3).  Integrals over an
interval use the points and weights of the collocation, where the costates are given, so that for
controls that are constant in an interval the interval mean of the slope must vanish.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.optimality.active_set_changes import corners
from ocp.optimality.costates import PhaseCostates
from ocp.optimality.multipliers import SolvedProgram, path_rows
from ocp.problem.symbols import time
from ocp.problem.terms import Functional
from ocp.transcription.transcribe import inline_weights
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_TOUCHING = 1e-5  # of a control's size: closer than this to a bound, it is at the bound


@dataclass(frozen=True, eq=False)
class HamiltonianReport:
    """Numbers of one phase.

    Attributes
    ----------
    autonomous : whether time does not enter the phase.
    means : (N,) of `H` in the intervals; `mean` over the phase [unit of the objective / s].
    ends : (2,) values at the first and last instant.
    size : mean of ``|L| + sum |lambda_i f_i|``.
    drift : mean over time of how far the interval means are from their own mean, relative to the
        size.  At instants that `Phase.at` names `H` may jump: each stretch has its own mean.
    slopes : (N, n_u) interval means of dH/du, projected on the controls' bounds, relative to the
        mean size of the terms that make them up.
    slope : largest mean over time of ``|slopes|``.
    corners : (N,) intervals that hold a corner of the control or are next to one, and `share`, the
        part of the duration that they take.
    within : largest range of `H` between two corners, relative to the size.
    strict : largest of ``|slopes|`` in the other intervals.
    concave : largest negative curvature of `H` by a free control relative to its mean size (the
        Legendre condition asks for none); nan where path constraints limit the controls.
    """

    name: str
    autonomous: bool
    means: Array
    mean: float
    ends: Array
    size: float
    drift: float
    slopes: Array
    slope: float
    corners: NDArray[np.bool_]
    share: float
    within: float
    strict: float
    concave: float


def report(
    solved: SolvedProgram, trajectory: Trajectory, adjoint: PhaseCostates, index: int
) -> HamiltonianReport:
    """The Hamiltonian of phase number `index` along a trajectory."""
    layout = solved.transcription.layouts[index]
    k, tau, weights = _collocation(layout)
    course = _Course(solved, trajectory, adjoint, index)
    h, terms, slope, parts = course.at(k, tau)[:4]
    count, steps = layout.intervals, np.diff(trajectory.phases[index].breakpoints)
    duration = steps.sum()

    def means(values: Array) -> Array:
        total = np.zeros((count, *values.shape[1:]))
        np.add.at(total, k, (weights * values.T).T)
        return total

    mean_h = means(h[:, 0])
    mean = float(mean_h @ steps / duration)
    size = float(means(np.abs(terms)).sum(axis=1) @ steps / duration) or 1.0
    gradient, sizes = means(slope), means(np.abs(parts))
    for part in path_rows(solved.transcription):
        constraint = solved.transcription.constraints[part.phase][part.constraint]
        if part.phase == index and constraint.sampled:
            mass = solved.row_multipliers[part.rows] * solved.scales.objective / constraint.scale
            j = course.paths.index(part.constraint)
            own = course.at(part.intervals, part.tau)[4]
            own = own.reshape(part.tau.size, gradient.shape[1], len(course.paths))[:, :, j]
            share = (mass / steps[part.intervals])[:, None] * own
            np.add.at(gradient, part.intervals, share)
            np.add.at(sizes, part.intervals, np.abs(share))
    typical = sizes.T @ steps / duration
    gradient /= np.where(typical > 0, typical, 1.0)
    ends = course.at(np.array([0, count - 1]), np.array([0.0, 1.0]))[0][:, 0]
    drift = float(np.abs(mean_h - _stretches(solved, trajectory, index, mean_h)) @ steps)
    slopes = _projected(solved, trajectory, layout, gradient)
    slope_mean = float((np.abs(slopes).T @ steps).max(initial=0.0) / duration)
    found = corners(solved, trajectory, index)
    return HamiltonianReport(
        layout.phase.name, course.autonomous, mean_h, mean, ends, size, drift / duration / size,
        slopes, slope_mean, found, float(steps[found].sum() / duration),
        _within(solved, trajectory, index, mean_h, found) / size,
        float(np.abs(slopes[~found]).max(initial=0.0)),
        _concave(course.at(k, tau)[5], _free(solved, trajectory, layout)[k]),
    )  # fmt: skip


def _within(
    solved: SolvedProgram, trajectory: Trajectory, index: int, means: Array,
    found: NDArray[np.bool_],
) -> float:  # fmt: skip
    """Largest range of `H` over runs of intervals without corners or named instants."""
    own = trajectory.phases[index]
    breaks = np.searchsorted(_instants(solved, own), 0.5 * (own.breakpoints[:-1]
                                                            + own.breakpoints[1:]))  # fmt: skip
    run = np.cumsum(found) + breaks * (found.size + 1)
    return max((float(np.ptp(means[~found & (run == r)])) for r in np.unique(run[~found])),
               default=0.0)  # fmt: skip


def _free(solved: SolvedProgram, trajectory: Trajectory, layout: PhaseLayout) -> NDArray[np.bool_]:
    """Whether each control stays off its bounds all through an interval, (N, n_u)."""
    own, constants = trajectory.phase(layout.phase.name), trajectory.constants
    count, tau = layout.intervals, np.linspace(0.0, 1.0, 9)
    k = np.repeat(np.arange(count), tau.size)
    first = len(layout.states)
    found = np.ones((count, len(own.controls)), dtype=bool)
    values = own.local(k, np.tile(tau, count)).reshape(count, tau.size, -1)
    for j, control in enumerate((*layout.constant, *layout.linear, *layout.polynomial)):
        near = 1e-3 * solved.scales.signals[control.name]
        lower, upper = (evaluate_limit(v, constants) for v in (control.lower, control.upper))
        inside = (values[:, :, first + j] > lower + near) & (values[:, :, first + j] < upper - near)
        found[:, j] = inside.all(axis=1)
    return found


def _concave(curvature: Array, free: NDArray[np.bool_]) -> float:
    """Largest negative eigenvalue of ``H_uu`` of the free controls, relative to its mean size."""
    n_u = free.shape[1]
    if n_u == 0:
        return 0.0
    if not np.isfinite(curvature).all():
        return float("nan")
    blocks = curvature.reshape(-1, n_u, n_u) * (free[:, :, None] & free[:, None, :])
    size = float(np.abs(curvature).mean()) or 1.0
    return max(0.0, -float(np.linalg.eigvalsh(blocks).min(initial=0.0))) / size


def _stretches(
    solved: SolvedProgram, trajectory: Trajectory, index: int, means: Array
) -> Array:  # fmt: skip
    """The mean of `H` over the stretch between two named instants that an interval is in."""
    own = trajectory.phases[index]
    middle = 0.5 * (own.breakpoints[:-1] + own.breakpoints[1:])
    stretch, steps = np.searchsorted(_instants(solved, own), middle), np.diff(own.breakpoints)
    total, length = np.bincount(stretch, means * steps), np.bincount(stretch, steps)
    return np.asarray((total / np.where(length > 0, length, 1.0))[stretch])


def _instants(solved: SolvedProgram, own: PhaseTrajectory) -> Array:
    """Times that `Phase.at` names in a phase [s]."""
    return np.array(sorted({
        float(f.at) for f in solved.problem.functionals
        if f.at is not None and f.pieces[0][0] == own.name
    }))  # fmt: skip


def _collocation(layout: PhaseLayout) -> tuple[Integers, Array, Array]:
    """Intervals, local times and weights of all collocation points."""
    parts: list[tuple[Any, Any, Any]] = []
    for group in layout.groups:
        s, m = group.scheme.degree, group.intervals.size
        parts.append((np.repeat(group.intervals, s), np.tile(group.scheme.points, m),
                      np.tile(group.scheme.weights, m)))  # fmt: skip
    k, tau, weights = (np.concatenate(p) for p in zip(*parts, strict=True))
    return k, tau, weights


class _Course:
    """`H` and its derivatives along one phase of a trajectory."""

    def __init__(
        self, solved: SolvedProgram, trajectory: Trajectory, adjoint: PhaseCostates, index: int
    ) -> None:
        made, problem = solved.transcription, solved.problem
        layout = made.layouts[index]
        self.own, self.adjoint = trajectory.phases[index], adjoint
        rates = [*layout.phase.dynamics.values(), *[f.pieces[0][1] for f in layout.integrals]]
        costs = [w * f.pieces[0][1] for f, w in inline_weights(problem).items()
                 if f.pieces[0][0] == layout.phase.name]  # fmt: skip
        found = made.constraints[index]
        self.paths = [j for j, c in enumerate(found) if c.sampled]
        rows = ca.vertcat(*[found[j].sign * found[j].expression for j in self.paths], ca.SX(0, 1))
        self.autonomous = not ca.depends_on(
            ca.vertcat(*rates, *costs, rows, ca.SX(0, 1)), time.symbol
        )
        costates = ca.SX.sym("costate", len(rates))
        terms = ca.vertcat(*costs, costates * ca.vertcat(*rates))
        controls = (*layout.constant, *layout.linear, *layout.polynomial)
        u = ca.vertcat(*[c.symbol for c in controls], ca.SX(0, 1))
        by_term = ca.densify(ca.jacobian(terms, u))
        fixed = [s.symbol for s in (*problem.unknowns, *problem.constants)]
        self.values = [trajectory.unknowns[s.name] for s in problem.unknowns]
        self.values += [trajectory.constants[s.name] for s in problem.constants]
        signals = ca.vertcat(*[s.symbol for s in layout.signals])
        self.function = ca.Function(
            "hamiltonian",
            [signals, time.symbol, ca.vertcat(*fixed, ca.SX(0, 1)), costates],
            ca.cse([ca.sum1(terms), ca.densify(terms), ca.sum1(by_term).T,
                    ca.sum1(ca.fabs(by_term)).T,
                    ca.densify(ca.vec(ca.jacobian(rows, u))), self._curvature(terms, rows, u)]),
        )  # fmt: skip

    @staticmethod
    def _curvature(terms: ca.SX, rows: ca.SX, u: ca.SX) -> ca.SX:
        """``H_uu``; nan where path constraints limit the controls, whose share it lacks."""
        if ca.jacobian(rows, u).nnz():
            return ca.SX.nan(u.numel() ** 2, 1)
        return ca.densify(ca.vec(ca.hessian(ca.sum1(terms), u)[0]))

    def at(self, intervals: Integers, tau: Array) -> list[Array]:
        """``H``, its terms, its slope, the slope's size, ``c_u`` and ``H_uu``, (m, ...) each."""
        breakpoints = self.own.breakpoints
        times = breakpoints[intervals] + tau * np.diff(breakpoints)[intervals]
        fixed = ca.DM(self.values) if self.values else ca.DM(0, 1)
        found = self.function(
            self.own.local(intervals, tau).T, times[None, :], fixed,
            self.adjoint.local(intervals, tau).T,
        )  # fmt: skip
        return [v.full().reshape(-1, tau.size).T for v in found]


def _projected(
    solved: SolvedProgram, trajectory: Trajectory, layout: PhaseLayout, gradient: Array
) -> Array:
    """Zero where a control sits at the bound against which the slope presses it."""
    values = solved.x * solved.transcription.sizes
    held = [(c, layout.steps[:, [j]]) for j, c in enumerate(layout.constant)]
    held += [(c, layout.ramps[:, :, j]) for j, c in enumerate(layout.linear)]
    result = gradient.copy()
    for j, (control, ids) in enumerate(held):
        _project(solved, trajectory, control, values[ids], result[:, j])
    for j, control in enumerate(layout.polynomial):
        for group in layout.groups:
            part = result[group.intervals, len(held) + j]
            _project(solved, trajectory, control, values[group.controls[:, :, j]], part)
            result[group.intervals, len(held) + j] = part
    return result


def _project(
    solved: SolvedProgram, trajectory: Trajectory, control: Any, values: Array, slope: Array
) -> None:
    lower, upper = (evaluate_limit(v, trajectory.constants) for v in (control.lower, control.upper))
    near = _TOUCHING * solved.scales.signals[control.name]
    slope[(values.min(axis=1) <= lower + near) & (slope > 0)] = 0.0
    slope[(values.max(axis=1) >= upper - near) & (slope < 0)] = 0.0


def end_slopes(solved: SolvedProgram, what: Functional, terminal: dict[str, float]) -> ca.SX:
    """``d(J + sum mu b)/d what``, an expression of the numbers of the motion."""
    problem = solved.problem
    total = problem.objective
    for b in (*problem.bounds, *problem.links):
        total = total + terminal[b.name] * b.expression
    return ca.densify(ca.jacobian(total, what.symbol))
