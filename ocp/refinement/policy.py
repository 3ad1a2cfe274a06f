"""Mesh refinement: from what is wrong between the points to the next mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.mesh import Extra, Mesh, PhaseMesh, distinct
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.refinement.error_estimate import Assessment, PhaseAssessment
from ocp.refinement.switch_detection import settled, with_jumps
from ocp.settings import Settings
from ocp.transcription.transcribe import Transcription

Array = NDArray[np.float64]
_FAR = 1e4
_MOST = 0.8
_AROUND = np.array([-0.15, 0.0, 0.15])


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


@dataclass(frozen=True, eq=False)
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
        coarse=gathered(found.coarse, np.maximum) > 0,
    )  # fmt: skip


def _marks(
    mesh: PhaseMesh, found: PhaseAssessment, settings: Settings, least: float
) -> _Marks:  # fmt: skip
    """Intervals to split, in two or (far off) four, and degrees to raise the others to.

    Forced are those split for their dynamics, because they hold enough extra points or because
    they are too long for a constraint.
    """
    ratio = found.dynamics / settings.dynamics_tolerance
    degrees = mesh.degrees.astype(float)
    wanted = np.ceil(degrees + np.log(np.maximum(ratio, 1.0)) / np.log(degrees + 1.0))
    fixed_degree = settings.scheme in ("trapezoid", "hermite-simpson")
    high = (wanted > settings.highest_degree) | fixed_degree
    forced = ((ratio > 1.0) & high) | found.crowded | found.coarse
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
    known = np.isin(mesh.breakpoints, base.breakpoints, assume_unique=True)
    whole = np.diff(mesh.breakpoints) >= _MOST * np.diff(base.breakpoints)[parent]
    untouched = (known[:-1] & known[1:]) | (whole & (known[:-1] | known[1:]))
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
        at = distinct(np.array(values))
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
