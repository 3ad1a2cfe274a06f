"""Mesh refinement: what is wrong between the points, and the next mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocp.between import Extremes, constraint_excess, dynamics_error, quadrature_error
from ocp.costates import costates
from ocp.evaluate import Evaluator
from ocp.guess import evaluate_limit
from ocp.mesh import Extra, Mesh, PhaseMesh
from ocp.optimality import gains, hamiltonian
from ocp.settings import Settings
from ocp.switches import Jump, control_errors, control_samples, jumps, settled, with_jumps
from ocp.trajectory import PhaseTrajectory, Trajectory
from ocp.transcribe import Transcription

Array = NDArray[np.float64]
_SMOOTH = 3e-4
_FAR = 1e4
_MOST_EXTRA = 4
_AROUND = np.array([-0.15, 0.0, 0.15])


@dataclass(frozen=True)
class PhaseAssessment:
    """Errors of one phase, per interval.

    Attributes
    ----------
    dynamics : (N,) relative errors of the dynamics and the integrals.
    gain : (N,) what a finer control could gain, relative to the objective, to first order, where
        the control is rough.
    switching : (N,) the same wherever it is.
    excess : one `Extremes` a continuous constraint, relative to its size on the trajectory.
    jumps : found jumps of the controls.
    crowded : (N,) whether a constraint is exceeded although several extra points hold it already.
    """

    dynamics: Array
    gain: Array
    switching: Array
    excess: tuple[Extremes, ...]
    jumps: tuple[Jump, ...]
    crowded: NDArray[np.bool_]


@dataclass(frozen=True)
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
    tolerance: float, multipliers: Array | None = None, objective: float = 1.0,
) -> Assessment:  # fmt: skip
    """Evaluate a round's solution between its points; gains need its row multipliers.

    `tolerance` says what counts as an excess of a continuous constraint.
    """
    adjoints = costates(transcription, multipliers) if multipliers is not None else None
    peaks = dict(zip(transcription.peak_ids, trajectory.peaks, strict=True))
    phases = []
    for layout, found, mesh, extra in zip(
        transcription.layouts, transcription.constraints, transcription.mesh.phases,
        transcription.mesh.extra, strict=True,
    ):  # fmt: skip
        own = trajectory.phase(layout.phase.name)
        sizes = [transcription.scales.signals[s.name] for s in layout.states]
        excess = tuple(
            constraint_excess(evaluator, trajectory, own.name, c, peaks)
            if not c.is_equation else _nothing(mesh.intervals)
            for c in found
        )  # fmt: skip
        fractions = (own.breakpoints - own.start) / (own.end - own.start)
        all_jumps = [
            jump for j in range(len(own.controls))
            for jump in jumps(*control_samples(own, j), fractions)
        ]  # fmt: skip
        gain, rough = np.zeros(mesh.intervals), np.zeros(mesh.intervals, dtype=bool)
        if adjoints is not None:
            slopes = hamiltonian(transcription, layout)
            index = transcription.layouts.index(layout)
            gain = gains(transcription, trajectory, adjoints[index], layout, slopes)
            gain /= max(abs(objective), 1e-3 * transcription.scales.objective)
            limits = {c.name: (evaluate_limit(c.lower, trajectory.constants),
                               evaluate_limit(c.upper, trajectory.constants))
                      for c in slopes.controls}  # fmt: skip
            rough = control_errors(own, mesh, limits) >= _SMOOTH
        error = np.maximum(
            dynamics_error(evaluator, trajectory, own.name, sizes),
            _integrals_error(transcription, trajectory, evaluator, own.name))  # fmt: skip
        phases.append(PhaseAssessment(
            error, np.where(rough, gain, 0.0), gain, excess, tuple(all_jumps),
            _crowded(extra, excess, mesh.intervals, tolerance),
        ))  # fmt: skip
    return Assessment(tuple(phases))


def _integrals_error(
    transcription: Transcription, trajectory: Trajectory, evaluator: Evaluator, phase: str
) -> Array:
    """Error of the integrals over a phase in each interval, (N,)."""
    integrals = [f for f in transcription.problem.functionals
                 if f.kind == "integral" and f.pieces[0][0] == phase]  # fmt: skip
    sizes = [transcription.scales.functionals[f] for f in integrals]
    return quadrature_error(evaluator, trajectory, integrals, phase, sizes)


def _crowded(
    extra: Sequence[Extra], excess: Sequence[Extremes], intervals: int, tolerance: float
) -> NDArray[np.bool_]:
    """Intervals in which further extra points would not do."""
    crowded = np.zeros(intervals, dtype=bool)
    for e in extra:
        held = np.bincount(e.intervals, minlength=intervals) > _MOST_EXTRA
        crowded |= held & (excess[e.constraint].values > tolerance)
    return crowded


def _nothing(intervals: int) -> Extremes:
    return Extremes(np.full(intervals, -np.inf), np.full(intervals, 0.5))


def next_mesh(
    transcription: Transcription, trajectory: Trajectory, assessment: Assessment,
    settings: Settings, resolve_controls: bool,
) -> Mesh | None:  # fmt: skip
    """A better mesh, or None when the assessment meets all tolerances."""
    phases, extras, changed = [], [], False
    least = _worthwhile(assessment, settings.objective_tolerance) if resolve_controls else np.inf
    for i, (mesh, found) in enumerate(
        zip(transcription.mesh.phases, assessment.phases, strict=True)
    ):
        own = trajectory.phases[i]
        base, pressed = settled(mesh, own) if mesh.movable else (mesh, False)
        marks = _marks(base, _onto(base, own, found), settings, np.inf if pressed else least)
        jumped = _with_jumps(base, mesh, found, settings)
        refined = _refined(jumped or base, base, marks, settings)
        points = _points(transcription.mesh.extra[i], mesh, base, refined, found, settings)
        changed |= pressed or not _equal(refined, base)
        changed |= any(float(e.values.max()) > settings.path_tolerance for e in found.excess)
        phases.append(refined)
        extras.append(points)
    if not changed:
        return None
    if all(_equal(a, b) for a, b in zip(phases, transcription.mesh.phases, strict=True)):
        phases = [mesh.frozen() for mesh in phases]  # only points are missing: hold still
    return Mesh(tuple(phases), tuple(extras))


def _worthwhile(assessment: Assessment, tolerance: float) -> float:
    """The gain from which on an interval is refined: the rest together stays below tolerance."""
    gain = np.sort(np.concatenate([p.gain for p in assessment.phases]))
    if gain.sum() <= tolerance:
        return float(np.inf)
    kept = np.searchsorted(np.cumsum(gain), 0.25 * tolerance, side="right")
    return float(max(gain[kept], 1e-3 * gain[-1]))


def _with_jumps(
    base: PhaseMesh, mesh: PhaseMesh, found: PhaseAssessment, settings: Settings
) -> PhaseMesh | None:
    """Brackets around the jumps that are worth it."""
    points, least = mesh.breakpoints, 0.5 * settings.objective_tolerance
    worth = []
    for jump in found.jumps:
        bracket = (points[1:] > jump.first) & (points[:-1] < jump.last)
        if found.switching[bracket].max(initial=0.0) >= least:
            worth.append(jump)
    return with_jumps(base, worth, settings.move_breakpoints)


def _equal(a: PhaseMesh, b: PhaseMesh) -> bool:
    return (
        np.array_equal(a.breakpoints, b.breakpoints)
        and np.array_equal(a.degrees, b.degrees)
        and a.movable == b.movable
    )


@dataclass(frozen=True)
class _Marks:
    split: NDArray[np.bool_]
    forced: NDArray[np.bool_]
    far: NDArray[np.bool_]
    raised: NDArray[np.int64]


def _onto(base: PhaseMesh, own: PhaseTrajectory, found: PhaseAssessment) -> PhaseAssessment:
    """The assessment on a mesh that lacks some of the trajectory's breakpoints."""
    if base.intervals == found.dynamics.size:
        return found
    middle = 0.5 * (own.breakpoints[:-1] + own.breakpoints[1:])
    parent = np.searchsorted(base.breakpoints, (middle - own.start) / (own.end - own.start)) - 1

    def gathered(values: Array | NDArray[np.bool_], gather: np.ufunc) -> Array:
        result = np.zeros(base.intervals)
        gather.at(result, parent, values)
        return result

    return replace(
        found, dynamics=gathered(found.dynamics, np.maximum), gain=gathered(found.gain, np.add),
        crowded=gathered(found.crowded, np.maximum) > 0,
    )  # fmt: skip


def _marks(
    mesh: PhaseMesh, found: PhaseAssessment, settings: Settings, least: float
) -> _Marks:  # fmt: skip
    """Intervals to split, in two or (far off) four, and degrees to raise the others to.

    Forced are those split for their dynamics or because they hold enough extra points.
    """
    ratio = found.dynamics / settings.dynamics_tolerance
    degrees = mesh.degrees.astype(float)
    wanted = np.ceil(degrees + np.log(np.maximum(ratio, 1.0)) / np.log(degrees + 1.0))
    fixed_degree = settings.scheme in ("trapezoid", "hermite-simpson")
    high = (wanted > settings.highest_degree) | fixed_degree
    forced = ((ratio > 1.0) & high) | found.crowded
    split = forced.copy()
    raised = np.where((ratio > 1.0) & ~high, wanted, degrees).astype(np.int64)
    split |= found.gain >= least
    wide = np.diff(mesh.breakpoints) > 1e-7
    far = high & (ratio > _FAR)
    return _Marks(split & wide, forced & wide, far & wide, raised)


def _refined(
    mesh: PhaseMesh, base: PhaseMesh, marks: _Marks | None, settings: Settings
) -> PhaseMesh:
    """Split and raise marked intervals; those that a jump already replaced are left alone."""
    if marks is None or not (marks.split.any() or np.any(marks.raised != base.degrees)):
        return mesh
    middle = 0.5 * (mesh.breakpoints[:-1] + mesh.breakpoints[1:])
    parent = np.clip(np.searchsorted(base.breakpoints, middle) - 1, 0, base.intervals - 1)
    untouched = np.isin(mesh.breakpoints[:-1], base.breakpoints) & np.isin(
        mesh.breakpoints[1:], base.breakpoints
    )
    split = marks.split[parent] & untouched & ~(mesh.moving & ~marks.forced[parent])
    if mesh.intervals + 3 * split.sum() > settings.most_intervals:
        split[:] = False
    far = split & (marks.far[parent])
    width = np.diff(mesh.breakpoints)
    quarters = np.concatenate([mesh.breakpoints[:-1][far] + q * width[far] for q in (0.25, 0.75)])
    points = np.sort(np.concatenate([mesh.breakpoints, middle[split], quarters]))
    parents = np.searchsorted(mesh.breakpoints, points[:-1], side="right") - 1
    degrees = np.where(untouched, marks.raised[parent], mesh.degrees)[parents]
    movable = tuple(int(np.searchsorted(points, mesh.breakpoints[i])) for i in mesh.movable)
    return PhaseMesh(points, degrees, movable)


def _points(
    extra: Sequence[Extra], mesh: PhaseMesh, base: PhaseMesh, refined: PhaseMesh,
    found: PhaseAssessment, settings: Settings,
) -> tuple[Extra, ...]:  # fmt: skip
    """Old extra points, carried over, and a new one wherever a constraint is exceeded."""
    old = base.breakpoints if base.intervals == mesh.intervals else mesh.breakpoints
    carried = []
    fractions: dict[int, list[float]] = {}
    for e in extra:
        at = old[e.intervals] + e.tau * np.diff(old)[e.intervals]
        fractions.setdefault(e.constraint, []).extend(at)
    for c, excess in enumerate(found.excess):
        over = np.flatnonzero((excess.values > settings.path_tolerance) & ~found.crowded)
        if over.size:
            around = np.clip(excess.tau[over][:, None] + _AROUND, 0.0, 1.0)
            at = (old[over][:, None] + around * np.diff(old)[over][:, None]).ravel()
            fractions.setdefault(c, []).extend(at)
    for c, values in fractions.items():
        at = np.unique(np.array(values))
        k = np.clip(np.searchsorted(refined.breakpoints, at, side="right") - 1, 0,
                    refined.intervals - 1)  # fmt: skip
        tau = (at - refined.breakpoints[k]) / np.diff(refined.breakpoints)[k]
        keep = _spread(k, tau)
        carried.append(Extra(c, k[keep], np.clip(tau[keep], 0.0, 1.0)))
    return tuple(carried)


def _spread(intervals: NDArray[np.int64], tau: Array) -> NDArray[np.bool_]:
    """Keep one of several points of an interval that lie almost on top of each other."""
    keep = np.ones(tau.size, dtype=bool)
    for i in range(1, tau.size):
        close = intervals[i] == intervals[i - 1] and tau[i] - tau[i - 1] < 1e-6
        keep[i] = not close
    return keep
