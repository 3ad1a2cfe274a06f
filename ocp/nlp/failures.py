"""Failed solves in the words of the statement: what went wrong, and where."""

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
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.result import NlpResult
from ocp.problem.integrator_chains import in_equation
from ocp.problem.kinks import kinks_of
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.rows import PhaseRows
from ocp.transcription.transcribe import ProgramLimits, Transcription

# parts of the guessed duration below which a motion takes no time, and next to none
_NO_TIME = 1e-6
_LITTLE_TIME = 1e-3
# typical sizes of the objective or an unknown beyond which it counts as unbounded
_RUNAWAY = 1e7
# Scaled. A thousand times what IPOPT is held to, so that nothing is named that is met.
_VIOLATED = 1e-7
# as many violated constraints as a sentence holds
_MOST_NAMED = 3


# Instants of an interval at which limits are looked at, the part of a size within which one is
# reached (what the solver is held to while it restores feasibility is far closer), and the part of
# a phase for which it is, to be named
_SAMPLES = 4
_AT_LIMIT = 1e-3
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
        unit = "" if kind.unit in ("", "1") else f" {kind.unit}"
        return f"{text} is off by {self.amount * kind.size:.3g}{unit}"


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
    name, count = transcription.problem.name, result.iterations

    if result.outcome == "invalid number":
        from ocp.nlp.non_finite import non_finite_value  # only when something is wrong

        culprit = non_finite_value(transcription.problem, iterate)
        what = culprit or "a derivative of the problem is NaN or infinite"
        return InvalidNumber(
            f"'{name}': {what}; start from a guess where everything is finite, or bound the "
            "signals that lead there",
            iterate,
        )

    if result.outcome == "unbounded" or result.objective < -_RUNAWAY:
        value = transcription.problem.sense * result.objective * transcription.scales.objective
        return Unbounded(
            f"the objective of '{name}' ran away to {value:.1e} in {count} iterations: it seems "
            "unbounded; bound what it depends on",
            iterate,
        )

    if vanished := collapsed(transcription, iterate, result.x):
        return vanished

    limits = transcription.limits(parameters)
    worst = violations(transcription, result.rows, limits)
    listed = "; ".join(violation.words(iterate) for violation in worst)
    in_brackets = f" ({listed})" if worst else ""

    if result.outcome == "budget":
        return IterationLimit(
            f"'{name}' used up its budget of iterations or seconds after {count} iterations"
            f"{in_brackets}; {_of_kinks(transcription.problem)}raise the budget, give a better "
            "guess or check the scales",
            iterate,
        )

    free, equations = counted(limits)
    if result.outcome == "overdetermined" or (result.outcome == "infeasible" and equations > free):
        missed = f" and meets not all of them{in_brackets}" if worst else ""
        return Overdetermined(
            f"'{name}' has {equations} equations for {free} free unknowns on its mesh{missed}: "
            "more is prescribed than the controls and unknowns can bring about; take back a "
            f"boundary value, a link or an equation, or add a control{_algebraic(transcription)}",
            iterate,
        )

    if result.outcome == "infeasible" and worst:
        reached = list(_limits_reached(transcription, parameters, iterate))
        return Infeasible(
            f"no motion was found that meets all constraints of '{name}'; worst: {listed}; "
            f"{_remedy(worst, reached)} (ocp.relaxed(problem) finds the least), or try another "
            "guess or ocp.audit(problem); this is no proof that there is none",
            iterate,
        )

    return NumericalTrouble(
        f"IPOPT got into numerical trouble on '{name}' after {count} iterations "
        f"('{result.status}'), {f'with {listed}' if worst else 'all constraints met'}; "
        f"{_of_kinks(transcription.problem)}state sizes by `scale`, give a better guess, or bound "
        "what the objective depends on",
        iterate,
    )


def _of_kinks(problem: Problem) -> str:
    """What has kinks, which a solver of smooth problems may not get past; empty if nothing."""
    for what, operations in kinks_of(problem):
        return (
            f"{what} has a kink, by {' and '.join(operations)}: state both sides as bounds, or "
            "the parts above and below it as controls of their own, each not negative; or "
        )
    return ""


def _algebraic(transcription: Transcription) -> str:
    """How to write controls that equations determine, where there are some of another shape."""
    for phase in transcription.problem.phases:
        for control in transcription.problem.controls[phase.name]:
            if control.shape != "polynomial" and in_equation(control, phase):
                return (
                    f"; '{control.name}' is in an equation of phase '{phase.name}': if that "
                    f"determines it, declare it as Algebraic({control.name!r}) and not as Control"
                )
    return ""


def _remedy(worst: list[Violation], reached: list[str]) -> str:
    """What the user can change about rows that cannot be met."""
    if not worst[0].kind.what.startswith("dynamics"):
        return "relax one of these"
    limits = f"{'; '.join(reached[:_MOST_REACHED])}: " if reached else ""
    return f"{limits}relax a limit or a prescribed value"


def _limits_reached(
    transcription: Transcription, parameters: Parameters, iterate: Trajectory
) -> Iterator[str]:
    """Limits at which the iterate lies for a part of a phase, the longest first."""
    problem, evaluator = transcription.problem, Evaluator(transcription.problem)
    found: list[tuple[float, str]] = []
    for motion, constraints in zip(iterate.phases, transcription.constraints, strict=True):
        held = [
            (c.name, c.unit, c.expression, c.scale, c.limits(parameters, {}))
            for c in constraints
            if c.peak is None and not c.is_equation
        ]
        for u in problem.controls[motion.name]:
            size, limits = transcription.scales.signals[u.name], parameters.signal_limits[u.name]
            held.append((u.name, u.unit, u.symbol, size, limits))

        k = np.repeat(np.arange(motion.intervals), _SAMPLES)
        tau = np.tile((np.arange(_SAMPLES) + 0.5) / _SAMPLES, motion.intervals)
        weights = np.diff(motion.breakpoints)[k]
        expressions = [expression for _, _, expression, *_ in held]
        values = evaluator.values(iterate, motion.name, expressions, k, tau)
        for (name, unit, _, size, limits), value in zip(held, values.T, strict=True):
            for side, limit in zip(("lower", "upper"), limits, strict=True):
                share = float(weights @ (np.abs(value - limit) < _AT_LIMIT * size) / weights.sum())
                if share > _LEAST_SHARE:
                    bare = "" if unit in ("", "1") else f" {unit}"
                    text = f"'{name}' is at its {side} limit of {limit:.6g}{bare} for "
                    found.append((share, text + f"{share:.0%} of '{motion.name}'"))
    yield from (text for _, text in sorted(found, reverse=True))


def counted(limits: ProgramLimits) -> tuple[int, int]:
    """Numbers of free unknowns and of equations."""
    free = limits.columns[0] < limits.columns[1]
    equations = limits.rows[0] == limits.rows[1]
    return int(free.sum()), int(equations.sum())


def collapsed(
    transcription: Transcription, trajectory: Trajectory, failed: Array | None = None
) -> Collapsed | None:
    """The error of a motion that takes no time, or None.

    Parameters
    ----------
    failed : (n,)
        The scaled unknowns, if the solver failed there. It may have been on its way: little time is
        left, and the control that makes it so runs away.
    """
    duration = sum(float(np.ptp(phase.breakpoints)) for phase in trajectory.phases)
    share = duration / transcription.scales.time
    on_its_way = failed is not None and float(np.abs(failed).max(initial=0.0)) > _RUNAWAY
    if share > (_LITTLE_TIME if on_its_way else _NO_TIME):
        return None
    return Collapsed(
        f"the motion of '{transcription.problem.name}' shrinks to {duration:.1e} s: nothing in "
        "the statement needs time; prescribe where the motion ends, bound what drives it, or state "
        "a least duration",
        trajectory,
    )


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
        yield from _dynamics(transcription, columns, rows.phases[index])
        yield from _path_constraints(transcription, index)
        yield from _joints(transcription, columns, rows.phases[index])

    bounds = transcription.problem.boundary_constraints
    for bound, row in zip(bounds, rows.boundary, strict=True):
        size = scales.bounds["", bound.name]
        yield RowKind(f"'{bound.name}'", np.array([row]), unit=bound.unit, size=size)


def _dynamics(
    transcription: Transcription, columns: PhaseColumns, rows: PhaseRows
) -> Iterator[RowKind]:
    """Dynamics of each state, and the right ends of intervals without a support point there."""
    sizes, name = transcription.scales.signals, columns.phase.name
    points = columns.mesh.breakpoints
    by_group = [
        _fractions(points, group.intervals[:, None], group.collocation.points).ravel()
        for group in columns.groups
    ]
    ends = [points[g.intervals + 1] for g in columns.groups if not g.collocation.ends_on_support]

    for j, state in enumerate(columns.states):
        defects = [table[:, :, j].ravel() for table in rows.defects]
        yield RowKind(
            f"dynamics of '{state.name}'",
            np.concatenate(defects),
            name,
            np.concatenate(by_group),
            state.unit,
            sizes[state.name],
        )
        if rows.continuity:
            yield RowKind(
                f"continuity of '{state.name}'",
                np.concatenate([table[:, j] for table in rows.continuity]),
                name,
                np.concatenate(ends),
                state.unit,
                sizes[state.name],
            )


def _path_constraints(transcription: Transcription, index: int) -> Iterator[RowKind]:
    """Path constraints at collocation points and at points added between them."""
    columns = transcription.columns.phases[index]
    for number, constraint in enumerate(transcription.constraints[index]):
        parts = transcription.rows.of_constraint(index, number)
        if not parts:
            continue
        fractions = [
            _fractions(columns.mesh.breakpoints, part.intervals, part.tau) for part in parts
        ]
        yield RowKind(
            f"'{constraint.name}'",
            np.concatenate([part.rows for part in parts]),
            columns.phase.name,
            np.concatenate(fractions),
            constraint.unit,
            constraint.scale,
        )


def _joints(
    transcription: Transcription, columns: PhaseColumns, rows: PhaseRows
) -> Iterator[RowKind]:
    """Running totals of integrals, and the order of times and breakpoints."""
    scales, name = transcription.scales, columns.phase.name
    for j, integral in enumerate(columns.integrals):
        size = scales.functionals[integral]
        ends = columns.mesh.breakpoints[1:]
        what = f"integral '{integral.name}'"
        yield RowKind(what, rows.totals[:, j], name, ends, integral.unit, size)
    if rows.duration.size:
        yield RowKind("duration", rows.duration, name, unit="s", size=scales.time)
    if rows.breakpoints.size:
        yield RowKind("order of the breakpoints", rows.breakpoints, name)


def _fractions(breakpoints: Array, intervals: Integers, tau: Array) -> Array:
    """Fractions of the phase of local times of intervals."""
    return np.asarray(breakpoints[intervals] + tau * np.diff(breakpoints)[intervals])
