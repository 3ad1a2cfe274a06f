"""Failed solves in the words of the statement: what went wrong, and where.

The worst rows of the program are named: which equation or limit each is, and where.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.errors import (
    Collapsed,
    Infeasible,
    InvalidNumber,
    IterationLimit,
    NumericalTrouble,
    Overdetermined,
    SolveFailed,
    Unbounded,
)
from ocp.mesh.mesh import MIDPOINTS
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.solver import NlpResult
from ocp.problem.display import with_unit
from ocp.problem.integrator_chains import in_equation
from ocp.problem.kinks import choices_of, kinks_of, rate_text
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.scaling.scales import VANISHED
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.rows import PhaseRows
from ocp.transcription.transcribe import ProgramLimits, Transcription


@dataclass(frozen=True, eq=False)
class RowKind:
    """The rows of one equation or limit.

    Attributes
    ----------
    what : str
        The equation or limit.
    rows : (m,)
        Where they are in the constraint vector.
    phase : str
        The phase they belong to, "" if to none.
    fractions : (m,) or None
        Where each is in the phase, as a fraction of its duration; None if at no single instant.
    unit : str
        Of the unscaled rows.
    size : float
        A scaled residual of 1 is `size` in `unit`.
    """

    what: str
    rows: Integers
    phase: str = ""
    fractions: Array | None = None
    unit: str = ""
    size: float = 1.0


def row_kinds(transcription: Transcription) -> Iterator[RowKind]:
    """All rows of a program by kind; every row belongs to one of them."""
    rows, scales = transcription.rows, transcription.scales
    for index, columns in enumerate(transcription.columns.phases):
        yield from _of_phase(transcription, index, columns, rows.phases[index])

    bounds = transcription.problem.boundary_constraints
    for bound, row in zip(bounds, rows.boundary, strict=True):
        size = scales.bounds["", bound.name]
        yield RowKind(f"'{bound.name}'", np.array([row]), unit=bound.unit, size=size)


def _of_phase(
    transcription: Transcription, index: int, columns: PhaseColumns, rows: PhaseRows
) -> Iterator[RowKind]:
    """Dynamics, path constraints, running totals, and the order of times and breakpoints."""
    scales, name = transcription.scales, columns.phase.name
    points, groups = columns.mesh.breakpoints, columns.groups
    inside = [
        _fractions(points, group.intervals[:, None], group.collocation.points).ravel()
        for group in groups
    ]
    at_points = np.concatenate(inside)
    # of intervals without a support point at their end
    ends = [points[g.intervals + 1] for g in groups if not g.collocation.ends_on_support]
    for j, state in enumerate(columns.states):
        size, unit = scales.signals[state.name], state.unit
        defects = np.concatenate([table[:, :, j].ravel() for table in rows.defects])
        yield RowKind(f"dynamics of '{state.name}'", defects, name, at_points, unit, size)
        if rows.continuity:
            joints = np.concatenate([table[:, j] for table in rows.continuity])
            where = np.concatenate(ends)
            yield RowKind(f"continuity of '{state.name}'", joints, name, where, unit, size)

    for number, constraint in enumerate(transcription.constraints[index]):
        if parts := transcription.rows.of_constraint(index, number):
            own = np.concatenate([part.rows for part in parts])
            where = np.concatenate([_fractions(points, p.intervals, p.tau) for p in parts])
            what, unit, size = f"'{constraint.name}'", constraint.unit, constraint.scale
            yield RowKind(what, own, name, where, unit, size)

    for j, integral in enumerate(columns.integrals):
        what, size = f"integral '{integral.name}'", scales.functionals[integral]
        yield RowKind(what, rows.totals[:, j], name, points[1:], integral.unit, size)
    if rows.duration.size:
        yield RowKind("duration", rows.duration, name, unit="s", size=scales.time)
    if rows.breakpoints.size:
        yield RowKind("order of the breakpoints", rows.breakpoints, name)


def _fractions(breakpoints: Array, intervals: Integers, tau: Array) -> Array:
    """Fractions of the phase of local times of intervals."""
    return np.asarray(breakpoints[intervals] + tau * np.diff(breakpoints)[intervals])


# Of the typical duration: what a solver may have left when it fails on the way there
_NEARLY_VANISHED = 1e-3

# Typical sizes of the objective or an unknown beyond which it counts as unbounded
RUNAWAY = 1e7


def collapses(transcription: Transcription, trajectory: Trajectory, failed: Array) -> bool:
    """Whether a motion at which a solver failed takes no time, or is on its way there.

    On its way little time is left, and the control that makes it so runs away.

    Parameters
    ----------
    failed : (n,)
        The scaled unknowns.
    """
    on_its_way = float(np.abs(failed).max(initial=0.0)) > RUNAWAY
    least = _NEARLY_VANISHED if on_its_way else VANISHED
    return not trajectory.duration / transcription.scales.time > least


def collapse_of(problem: Problem, trajectory: Trajectory) -> Collapsed:
    """The error of a motion that takes no time."""
    return Collapsed(
        f"the motion of '{problem.name}' tends to zero duration ({trajectory.duration:.1e} s), "
        "because nothing in the problem needs time; prescribe the final values, bound the "
        "controls, or give a minimum duration",
        trajectory,
    )


# Scaled. A thousand times what IPOPT is held to, so that nothing is named that is met.
_VIOLATED = 1e-7
# as many violated constraints as a sentence holds
_MOST_NAMED = 3

# Part of a size within which a limit is reached. A solver that restores feasibility is held to far
# less.
_AT_LIMIT = 1e-3

# Part of a phase for which a limit is reached at least, to be named, and how many are named
_LEAST_SHARE = 0.02
_MOST_REACHED = 2


@dataclass(frozen=True, eq=False)
class Violation:
    """The worst violated row of a kind.

    Attributes
    ----------
    kind : RowKind
        What it is.
    place : int
        Which row of the kind it is.
    amount : float
        By how much it is violated, as a part of its typical size.
    """

    kind: RowKind
    place: int
    amount: float

    def words(self, iterate: Trajectory) -> str:
        """The row with its phase, its time in the iterate, and the amount in its unit."""
        kind = self.kind
        text = kind.what
        if kind.phase:
            text += f" in phase '{kind.phase}'"
        if kind.fractions is not None:
            motion = iterate.phase(kind.phase)
            time = motion.start + kind.fractions[self.place] * (motion.end - motion.start)
            text += f" at {time:.3g} s"
        return f"{text} is violated by {with_unit(f'{self.amount * kind.size:.3g}', kind.unit)}"


def violations(transcription: Transcription, rows: Array, limits: ProgramLimits) -> list[Violation]:
    """The worst violated rows relative to their sizes, one a kind of row.

    Parameters
    ----------
    rows : (m,)
        Scaled values of the constraint rows.
    """
    excess = limits.excess(rows)
    violated: list[Violation] = []
    for kind in row_kinds(transcription):
        worst = int(np.argmax(excess[kind.rows]))
        amount = float(excess[kind.rows[worst]])
        if amount > _VIOLATED:
            violated.append(Violation(kind, worst, amount))
    return sorted(violated, key=lambda violation: -violation.amount)[:_MOST_NAMED]


def failure(
    transcription: Transcription, result: NlpResult, parameters: Parameters, iterate: Trajectory
) -> SolveFailed:
    """The error that a failed solve raises, naming its worst constraints.

    Parameters
    ----------
    result : NlpResult
        Of the solver that failed.
    parameters : Parameters
        The problem's constants.
    iterate : Trajectory
        Where it ended.
    """
    problem, outcome = transcription.problem, result.outcome
    name, count = f"'{problem.name}'", result.iterations
    if outcome == "invalid number":
        from ocp.nlp.non_finite import non_finite_value  # only when something is wrong

        what = non_finite_value(problem, iterate)
        return InvalidNumber(
            f"{name}: {what or 'a derivative of the problem is NaN or infinite'}; give a guess at "
            "which all expressions are finite, or bound the signals in them",
            iterate,
        )
    if outcome == "unbounded" or result.objective < -RUNAWAY:
        value = problem.sense * result.objective * transcription.scales.objective
        return Unbounded(
            f"the objective of {name} seems unbounded: it is {value:.1e} after {count} "
            "iterations; add bounds to the signals on which it depends",
            iterate,
        )
    # a motion that takes no time meets no constraint, and says nothing of them
    if collapses(transcription, iterate, result.x):
        return collapse_of(transcription.problem, iterate)

    limits = transcription.limits(parameters)
    worst = violations(transcription, result.rows, limits)
    listed = "; ".join(violation.words(iterate) for violation in worst)
    in_brackets = f" ({listed})" if worst else ""
    if outcome == "budget":
        return IterationLimit(
            f"{name} reached its budget of iterations or seconds after {count} "
            f"iterations{in_brackets}; {remedy_for_kinks(problem)}raise the budget, give a better "
            "guess or check the scales",
            iterate,
        )

    free, equations = counted(limits)
    if outcome == "overdetermined" or (outcome == "infeasible" and equations > free):
        missed = f" and does not meet all of them{in_brackets}" if worst else ""
        return Overdetermined(
            f"{name} has {equations} equations for {free} free unknowns on its mesh{missed}, so "
            "it is over-determined; remove a boundary value, a link or an equation, or add a "
            f"control{_algebraic(problem)}",
            iterate,
        )
    if outcome == "infeasible" and worst:
        remedy = "relax one of these"
        if worst[0].kind.what.startswith("dynamics"):
            reached = _limits_reached(transcription, parameters, iterate)[:_MOST_REACHED]
            remedy = "relax a limit or a prescribed value"
            remedy = f"{'; '.join(reached)}: {remedy}" if reached else remedy
        return Infeasible(
            f"no motion was found that meets all constraints of {name} (this is no proof that "
            f"there is none); largest violations: {listed}; {remedy} (ocp.relaxed(problem) finds "
            "the smallest change), or try another guess or ocp.audit(problem)",
            iterate,
        )
    return NumericalTrouble(
        f"IPOPT stopped on {name} after {count} iterations with '{result.status}', "
        f"{f'with {listed}' if worst else 'with all constraints met'}; "
        f"{remedy_for_kinks(problem)}set scale=, give a better guess, or bound the signals on "
        "which the objective depends",
        iterate,
    )


def remedy_for_kinks(problem: Problem) -> str:
    """What jumps or has kinks, which a solver of smooth problems may not get past, and what to do.

    Ends with "or", as other remedies follow. Empty if nothing does.
    """
    for found in problem.discontinuities:
        if found.moves:
            return f"{found.sentence}; or "
    for what, operations in kinks_of(problem):
        return (
            f"{what} has a kink, by {' and '.join(operations)}: {_as_integral(problem, what)}write "
            "both sides as bounds, or use separate non-negative controls for the parts above and "
            "below the kink; or "
        )
    for what in choices_of(problem):
        return (
            f"{what} contains if_else: if it selects the larger of two values, write it with fmax, "
            "which the engine replaces by a limit; or "
        )
    return ""


def _as_integral(problem: Problem, what: str) -> str:
    """To state a state that only sums something up as an integral, if `what` is the rate of one.

    The kink of an integral that only costs becomes a control, and that of a rate does not.
    """
    for phase in problem.phases:
        used = {id(s) for symbols in phase.rate_symbols.values() for s in symbols}
        for state in phase.states:
            if id(state) not in used and what == rate_text(state):
                return (
                    f"no rate depends on '{state.name}', so write it as an integral of phase "
                    f"'{phase.name}', whose kink the engine replaces by a control; or "
                )
    return ""


def _algebraic(problem: Problem) -> str:
    """How to write controls that equations determine, where there are some of another shape."""
    for phase in problem.phases:
        for control in problem.controls[phase.name]:
            if control.piecewise != "polynomial" and in_equation(control, phase):
                return (
                    f"; '{control.name}' is in an equation of phase '{phase.name}': if the "
                    f"equation determines it, declare it as Algebraic({control.name!r}) instead of "
                    "Control"
                )
    return ""


def _limits_reached(
    transcription: Transcription, parameters: Parameters, iterate: Trajectory
) -> list[str]:
    """Limits at which the iterate lies for a part of a phase, the longest first."""
    evaluator, found = Evaluator(transcription.problem), list[tuple[float, str]]()
    for motion, constraints in zip(iterate.phases, transcription.constraints, strict=True):
        k = np.repeat(np.arange(motion.intervals), MIDPOINTS.size)
        tau = np.tile(MIDPOINTS, motion.intervals)
        weights = np.diff(motion.breakpoints)[k]
        limited = [
            (c.name, c.unit, c.expression, c.scale, c.limits(parameters, {}))
            for c in constraints
            if c.peak is None and not c.is_equation
        ]
        for u in transcription.problem.controls[motion.name]:
            size, limits = transcription.scales.signals[u.name], parameters.signal_limits[u.name]
            limited.append((u.name, u.unit, u.symbol, size, limits))
        for name, unit, expression, size, limits in limited:
            values = evaluator.values(iterate, motion.name, [expression], k, tau)[:, 0]
            for side, limit in zip(("lower", "upper"), limits, strict=True):
                share = float(weights @ (np.abs(values - limit) < _AT_LIMIT * size))
                share /= float(weights.sum())
                if share > _LEAST_SHARE:
                    place = f"its {side} limit of {with_unit(f'{limit:.6g}', unit)}"
                    text = f"'{name}' is at {place} for {share:.0%} of '{motion.name}'"
                    found.append((share, text))
    return [text for _, text in sorted(found, reverse=True)]


def counted(limits: ProgramLimits) -> tuple[int, int]:
    """Numbers of free unknowns and of equations."""
    free = limits.columns[0] < limits.columns[1]
    equations = limits.rows[0] == limits.rows[1]
    return int(free.sum()), int(equations.sum())
