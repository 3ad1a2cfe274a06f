"""Breakpoints at the known times at which expressions step or bend (`Problem.instants`).

Where the times of a phase are fixed, each known time is a fraction of the phase. Where one is free
it is not: there the breakpoint stands at its time, and the mesh to both sides of it is stretched as
the phase begins or ends elsewhere. That is what a phase that is split at its known times would do.
Which of them lie inside stays, while a program is solved: the phase neither begins nor ends beyond
the next one, because what it begins or ends with would step there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocp.arrays import Array
from ocp.mesh.mesh import SAME_POINT, Mesh, PhaseMesh, distinct, with_points
from ocp.mesh.phase_times import Ends, guessed_times
from ocp.mesh.trajectory import Trajectory
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Between

# Of the typical duration: what a free end keeps from a known time inside the phase at least. A
# stretch that is shorter has no rates.
LEAST_STRETCH = 1e-6

# Of the duration: a free end this near to a known time is at it. Which side it is on is taken from
# the mesh before.
AT_KNOWN_TIME = 3 * LEAST_STRETCH

# Of the phase: known times closer than this are one, and breakpoints at two are not closer.
_ONE_TIME = 10 * SAME_POINT
_CLOSEST = 2 * SAME_POINT

# Of the phase: what a mesh may be off from the motion on it, and is still that of the motion.
_AS_IT_IS = 0.1 * SAME_POINT


def with_known_times(
    problem: Problem,
    mesh: Mesh,
    times: Mapping[str, Ends] | None = None,
    before: Mesh | None = None,
) -> Mesh:
    """The mesh with a breakpoint at every known time inside its phases.

    Parameters
    ----------
    problem : Problem
    mesh : Mesh
        Its breakpoints are fractions of phases with these times.
    times : mapping of str to (float, float), optional
        Where each phase begins and ends [s]. Without it known times that the mesh has stay, and
        others are placed by the times of the statement's guess.
    before : Mesh, optional
        Says on which side a known time at an end of a phase is.

    Returns
    -------
    Mesh
        The very same one where it has them already. Points and back-offs between the collocation
        points count by interval, and are left out where intervals were added.
    """
    phases = []
    for index, (phase, own) in enumerate(zip(problem.phases, mesh.phases, strict=True)):
        instants = problem.instants[phase.name]
        if not phase.has_fixed_times and (instants or own.between is not None):
            ends = None if times is None else times[phase.name]
            old = None if before is None else before.phases[index]
            own = _of_free_times(problem, phase, own, ends, old)
        elif instants and phase.has_fixed_times:
            start, end = _fixed(phase)
            own = with_points(own, (np.array(instants) - start) / (end - start))
        phases.append(own)

    if all(a is b for a, b in zip(phases, mesh.phases, strict=True)):
        return mesh

    # extra points count by interval: they stay right only where no interval was added
    same = all(a.intervals == b.intervals for a, b in zip(phases, mesh.phases, strict=True))
    if any(phase.between is not None for phase in phases):
        return replace(mesh, phases=tuple(phases)) if same else Mesh(tuple(phases))
    if same and any(mesh.extra):
        return mesh
    return Mesh(tuple(phases))


def _fixed(phase: Phase) -> Ends:
    """Times of a phase in which both are fixed [s]."""
    assert not isinstance(phase.start, Between)
    assert not isinstance(phase.end, Between)
    return float(phase.start), float(phase.end)


def _of_free_times(
    problem: Problem, phase: Phase, mesh: PhaseMesh, ends: Ends | None, before: PhaseMesh | None
) -> PhaseMesh:
    """The mesh of a phase with a free time, with breakpoints at the known times inside."""
    instants = problem.instants[phase.name]
    if not instants:
        return replace(mesh, known=(), between=None)
    if ends is None:
        if mesh.between is not None:
            return mesh
        ends = guessed_times(problem.phases)[phase.name]
    apart = _apart(instants, _ONE_TIME * (ends[1] - ends[0]))
    return placed(mesh, phase, apart, ends, _inside(phase, apart, ends, before))


def _apart(instants: Sequence[float], least: float) -> list[float]:
    """Known times without those that are next to nothing behind another one [s]."""
    kept: list[float] = []
    for time in instants:
        if not kept or time - kept[-1] > least:
            kept.append(time)
    return kept


def _inside(
    phase: Phase, instants: Sequence[float], ends: Ends, before: PhaseMesh | None
) -> tuple[float, ...]:
    """The known times inside a phase of given times.

    One at a free end is where it was before. Without any before it is behind that end: phases that
    meet at a known time then agree on which of them it belongs to.
    """
    (start, end), at = ends, AT_KNOWN_TIME * (ends[1] - ends[0])
    first_is_free, last_is_free = (isinstance(time, Between) for time in (phase.start, phase.end))
    known = None if before is None or before.between is None else before.times
    found = []
    for time in instants:
        is_first, is_last = abs(time - start) <= at, abs(time - end) <= at
        if is_first and first_is_free:
            inside = known is None or time in known
        elif is_last and last_is_free:
            inside = known is not None and time in known
        else:
            inside = start < time < end
        if inside:
            found.append(time)
    return tuple(found)


def placed(
    mesh: PhaseMesh, phase: Phase, instants: Sequence[float], ends: Ends, inside: Sequence[float]
) -> PhaseMesh:
    """The mesh of a phase of given times with breakpoints at some known times.

    Parameters
    ----------
    mesh : PhaseMesh
        Its breakpoints are fractions of the phase at these times, but where it has the same known
        times already: then they keep their parts of each stretch.
    instants : sequence of float
        All known times [s].
    ends : (float, float)
        Where the phase begins and ends [s].
    inside : sequence of float
        The known times at which breakpoints stand, a run of them [s].
    """
    start, end = ends
    between = _neighbours(phase, instants, ends, inside)
    if mesh.between == between and mesh.times == tuple(inside):
        return rebased(mesh, start, end)

    points, degrees = mesh.breakpoints, mesh.degrees
    fractions = _inner((np.array(inside) - start) / (end - start))
    # of a stretch that is gone nothing is left
    gone = [i for i, time in mesh.known if time not in inside]
    if gone:
        mesh = _without_stretches(mesh, np.array(gone))
        points, degrees = mesh.breakpoints, mesh.degrees

    near = np.abs(points[:, None] - fractions).min(axis=1, initial=np.inf) <= SAME_POINT
    near[[0, -1]] = False
    refined = distinct(np.concatenate([points[~near], fractions]))
    parents = np.searchsorted(points, 0.5 * (refined[1:] + refined[:-1])) - 1
    known = tuple(
        (int(np.searchsorted(refined, fraction)), float(time))
        for fraction, time in zip(fractions, inside, strict=True)
    )
    at_known = {i for i, _ in known}
    movable = {int(np.abs(refined - points[i]).argmin()) for i in mesh.movable}
    same = refined.size == points.size
    return PhaseMesh(
        refined,
        degrees[parents],
        tuple(sorted(movable - at_known - {0, refined.size - 1})),
        longest=mesh.longest,
        sides=mesh.sides if same else None,
        known=known,
        between=between,
    )


def _inner(fractions: Array) -> Array:
    """Fractions that increase, moved into the phase where rounding has them at an end, (k,)."""
    places = _CLOSEST * np.arange(1, fractions.size + 1)
    return np.clip(fractions, places, 1.0 - places[::-1])


def _neighbours(
    phase: Phase, instants: Sequence[float], ends: Ends, inside: Sequence[float]
) -> Ends:
    """The known times next to those inside a phase; infinite without any, and at a fixed end."""
    before, behind = -np.inf, np.inf
    middle = 0.5 * (ends[0] + ends[1])
    outside = [time for time in instants if time not in inside]
    if isinstance(phase.start, Between):
        first = min([*inside, middle])
        before = max((time for time in outside if time < first), default=-np.inf)
    if isinstance(phase.end, Between):
        last = max([*inside, middle])
        behind = min((time for time in outside if time > last), default=np.inf)
    return float(before), float(behind)


def _without_stretches(mesh: PhaseMesh, gone: Array) -> PhaseMesh:
    """The mesh without the stretches before its first or behind its last known times that go.

    What was next to them takes their place.
    """
    kept = [i for i, _ in mesh.known if i not in gone]
    last = mesh.intervals
    if kept:
        first_gone = gone[gone < kept[0]].max(initial=0)
        last_gone = gone[gone > kept[-1]].min(initial=last)
    else:
        # one stretch stays: the longest one
        at = np.array([0, *gone, last])
        longest = int(np.diff(mesh.breakpoints[at]).argmax())
        first_gone, last_gone = at[longest], at[longest + 1]
    points = mesh.breakpoints[first_gone : last_gone + 1].copy()
    points[[0, -1]] = 0.0, 1.0
    movable = tuple(i - int(first_gone) for i in mesh.movable if first_gone < i < last_gone)
    degrees = mesh.degrees[first_gone:last_gone]
    return PhaseMesh(points, degrees, movable, longest=mesh.longest)


def rebased(mesh: PhaseMesh, start: float, end: float) -> PhaseMesh:
    """The mesh as fractions of the phase where it begins and ends at given times [s].

    The very same one where they are as they were.
    """
    if not mesh.known:
        return mesh
    fractions = mesh.fractions_at(start, end)
    if np.abs(fractions - mesh.breakpoints).max() <= _AS_IT_IS:
        return mesh
    return replace(mesh, breakpoints=fractions)


def of_motion(mesh: Mesh, motion: Trajectory) -> Mesh:
    """The mesh of a motion that was found on it, as fractions of the motion's phases."""
    pairs = zip(mesh.phases, motion.phases, strict=True)
    phases = tuple(
        rebased(own, of_phase.start, of_phase.end) if of_phase.end > of_phase.start else own
        for own, of_phase in pairs
    )
    same = all(a is b for a, b in zip(phases, mesh.phases, strict=True))
    return mesh if same else replace(mesh, phases=phases)


def known_limits(mesh: PhaseMesh, phase: Phase) -> tuple[Ends, Ends]:
    """Between which known times the start of a phase stays, and between which its end does [s].

    Infinite where none is next to it, and for a time that is fixed.
    """
    free = -np.inf, np.inf
    if mesh.between is None:
        return free, free
    first, last = min(mesh.times, default=np.inf), max(mesh.times, default=-np.inf)
    return (
        (mesh.between[0], first) if isinstance(phase.start, Between) else free,
        (last, mesh.between[1]) if isinstance(phase.end, Between) else free,
    )


def times_of(motion: Trajectory) -> dict[str, Ends]:
    """Where each phase of a motion begins and ends, by name [s]."""
    return {phase.name: (phase.start, phase.end) for phase in motion.phases}
