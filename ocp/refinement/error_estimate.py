"""What is wrong with a solved mesh round between its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.mesh import Extra
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.ipopt import Duals
from ocp.optimality.control_gain import gains, hamiltonian
from ocp.optimality.costates import PhaseCostates, costates
from ocp.optimality.multipliers import path_rows
from ocp.refinement.between import (
    Extremes,
    constraint_excess,
    dynamics_error,
    equation_error,
    quadrature_error,
)
from ocp.refinement.switch_detection import Jump, control_errors, control_samples, jumps, saturated
from ocp.transcription.transcribe import Transcription

Array = NDArray[np.float64]
_SMOOTH = 3e-4
_ACTING = 1e-4  # of the largest multiplier
_MANY_EXTRA = 4  # added points, beyond which a rough control needs shorter intervals
_MOST_EXTRA = 10  # beyond which any control does
_COARSE = 1e-3  # relative excess, beyond which an interval is too long for its constraint


@dataclass(frozen=True, eq=False)
class PhaseAssessment:
    """Errors of one phase, per interval.

    Attributes
    ----------
    dynamics : (N,) relative errors of the dynamics, the integrals and the equations.
    gain : (N,) what a finer control could gain, relative to the objective, to first order, where
        the control is rough.
    switching : (N,) the same wherever it is.
    excess : one `Extremes` a continuous constraint, relative to its size on the trajectory.
    jumps : found jumps of the controls.
    crowded : (N,) whether a constraint is exceeded although several extra points hold it already.
    coarse : (N,) whether one is exceeded by so much that the interval is too long for it.
    """

    dynamics: Array
    gain: Array
    switching: Array
    excess: tuple[Extremes, ...]
    jumps: tuple[Jump, ...]
    crowded: NDArray[np.bool_]
    coarse: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Assessment:
    """Errors of a solved mesh round between its points."""

    phases: tuple[PhaseAssessment, ...]

    @property
    def dynamics(self) -> float:
        """Largest error of the dynamics."""
        return max(float(p.dynamics.max()) for p in self.phases)

    @property
    def excess(self) -> float:
        """Largest excess of a continuous constraint."""
        return max((float(e.values.max()) for p in self.phases for e in p.excess), default=0.0)

    @property
    def gain(self) -> float:
        """What finer controls could still gain, relative to the objective, to first order."""
        return sum(float(p.gain.sum()) for p in self.phases)


def assess(
    transcription: Transcription, trajectory: Trajectory, evaluator: Evaluator,
    tolerance: float, duals: Duals | None = None, objective: float = 1.0,
) -> Assessment:  # fmt: skip
    """Evaluate a round's solution between its points; gains need its multipliers.

    `tolerance` says what counts as an excess of a continuous constraint.
    """
    adjoints = costates(transcription, duals.rows) if duals is not None else None
    pressed = _pressed(transcription, duals, trajectory) if duals is not None else None
    return Assessment(tuple(
        _assess_phase(transcription, trajectory, evaluator, i, tolerance,
                      adjoints[i] if adjoints is not None else None,
                      pressed[i] if pressed is not None else None, objective)
        for i in range(len(transcription.layouts))
    ))  # fmt: skip


def _assess_phase(
    transcription: Transcription, trajectory: Trajectory, evaluator: Evaluator, index: int,
    tolerance: float, adjoints: PhaseCostates | None, pressed: NDArray[np.bool_] | None,
    objective: float,
) -> PhaseAssessment:  # fmt: skip
    layout, mesh = transcription.layouts[index], transcription.mesh.phases[index]
    own = trajectory.phase(layout.phase.name)
    peaks = dict(zip(transcription.peak_ids, trajectory.peaks, strict=True))
    constraints = transcription.constraints[index]
    limited = iter(
        constraint_excess(
            evaluator, trajectory, own.name, [c for c in constraints if not c.is_equation], peaks
        )
    )
    excess = tuple(
        _nothing(mesh.intervals) if c.is_equation else next(limited) for c in constraints
    )
    fractions = (own.breakpoints - own.start) / (own.end - own.start)
    found = [jump for j in range(len(own.controls))
             for jump in jumps(*control_samples(own, j), fractions)]  # fmt: skip
    gain, rough = np.zeros(mesh.intervals), np.zeros(mesh.intervals, dtype=bool)
    if adjoints is not None and pressed is not None:
        slopes = evaluator.kept(
            ("hamiltonian", own.name, own.signals), lambda: hamiltonian(transcription, layout)
        )
        gain = gains(transcription, trajectory, adjoints, layout, slopes)
        gain /= max(abs(objective), 1e-3 * transcription.scales.objective)
        limits = {c.name: (evaluate_limit(c.lower, trajectory.constants),
                           evaluate_limit(c.upper, trajectory.constants))
                  for c in slopes.controls}  # fmt: skip
        rough = (control_errors(own, mesh, limits) >= _SMOOTH) | saturated(own, limits) | ~pressed
    sizes = [transcription.scales.signals[s.name] for s in layout.states]
    equations = [c for c in constraints if c.is_equation]
    error = np.maximum.reduce([
        dynamics_error(evaluator, trajectory, own.name, sizes),
        _integrals_error(transcription, trajectory, evaluator, own.name),
        equation_error(evaluator, trajectory, own.name, equations),
    ])  # fmt: skip
    return PhaseAssessment(
        error, np.where(rough, gain, 0.0), gain, excess, tuple(found),
        _crowded(transcription.mesh.extra[index], excess, rough, tolerance),
        np.any([np.zeros_like(rough), *(e.values > _COARSE for e in excess)], axis=0),
    )  # fmt: skip


def _pressed(
    transcription: Transcription, duals: Duals, trajectory: Trajectory
) -> list[NDArray[np.bool_]]:
    """Intervals of each phase, (N,), on which a path constraint, a peak or a state's bound acts.

    Its multipliers sit at points, so that the costates between them say little of the controls.
    """
    force = [np.zeros(layout.intervals) for layout in transcription.layouts]
    for part in path_rows(transcription):
        np.maximum.at(force[part.phase], part.intervals, np.abs(duals.rows[part.rows]))
    lower, upper = transcription.columns.evaluate(trajectory.constants)
    bounds = np.where(lower < upper, np.abs(duals.columns), 0.0)
    for own, layout in zip(force, transcription.layouts, strict=True):
        for group in layout.groups:
            held = bounds[group.support].max(axis=(1, 2))
            own[group.intervals] = np.maximum(own[group.intervals], held)
    largest = max(float(own.max(initial=0.0)) for own in force)
    return [own > _ACTING * largest for own in force]


def _integrals_error(
    transcription: Transcription, trajectory: Trajectory, evaluator: Evaluator, phase: str
) -> Array:
    """Error of the integrals over a phase in each interval, (N,)."""
    integrals = [f for f in transcription.problem.functionals
                 if f.kind == "integral" and f.pieces[0][0] == phase]  # fmt: skip
    sizes = [transcription.scales.functionals[f] for f in integrals]
    return quadrature_error(evaluator, trajectory, integrals, phase, sizes)


def _crowded(
    extra: Sequence[Extra], excess: Sequence[Extremes], rough: NDArray[np.bool_], tolerance: float
) -> NDArray[np.bool_]:
    """Intervals in which further extra points would not do."""
    crowded = np.zeros(rough.size, dtype=bool)
    for e in extra:
        held = np.bincount(e.intervals, minlength=rough.size)
        over = excess[e.constraint].values > tolerance
        crowded |= (held > np.where(rough, _MANY_EXTRA, _MOST_EXTRA)) & over
    return crowded


def _nothing(intervals: int) -> Extremes:
    return Extremes(np.full(intervals, -np.inf), np.full(intervals, 0.5))
