"""When a refinement ends short of its tolerances, and when no finer mesh would help."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from ocp.accuracy import SLACK, Accuracy
from ocp.errors import Collapsed, NumericalTrouble
from ocp.estimates.kink_crossings import NEAR
from ocp.optimality.unwrapping import lost_angle
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.planning import History, NextStep
from ocp.refinement.runaway import check_growth
from ocp.refinement.solved_mesh import (
    OVERESTIMATE,
    Ending,
    SolvedMesh,
    best_of,
    is_refuted,
    objective_error,
)

# Mesh iterations after which an angle that still turns to and fro does so on finer meshes, too, and
# after which a motion that has shrunk to next to no time will not grow.
_TURNING = 3

# Error of the dynamics, or estimated gain, that such an angle leaves at least
_FAR = 1e-3

# Part of the objective that is as good as all of it, and of the typical time that is next to none.
_ALL_OF_IT = 0.5
_NEXT_TO_NO_TIME = 1e-2

# Iterations times unknowns times signals from which on a solve has cost much, and the accuracy of a
# motion that may do then. The dearest case of `make regression` takes 2.4e7.
MUCH, _FINE = 3e7, 1e-4

# Mesh iterations in a row over which the objective stands still where nothing more is to be gained.
# It takes one more where only an estimated gain is open, or a large one, as a mesh may have been
# finer at the wrong place, and where the next mesh only removes violations between the points,
# which costs little.
_STILL = 2
_STILL_IN_DOUBT = 3

# Part of the last violation that the next mesh may have, where it is about to be removed.
_FALLING = 0.5


def _check_angles(solved: Sequence[SolvedMesh]) -> None:
    """NumericalTrouble where an angle without bounds is one that no finer mesh makes smooth."""
    last = solved[-1]
    # dynamics may hold while neighbouring intervals are whole turns apart, with a large gain
    if len(solved) < _TURNING or max(last.errors.dynamics, last.errors.gain) < _FAR:
        return
    if lost := lost_angle(last.iterate):
        phase, control = lost
        raise NumericalTrouble(
            f"the control '{control.name}' of phase '{phase}' jumps back and forth between "
            f"neighbouring points, even after {len(solved)} mesh iterations, because it has no "
            "bounds; its full turns cannot be removed, because the problem does not only contain "
            f"its sine and cosine; bound this angle, as in Control({control.name!r}, lower=-4, "
            "upper=4)",
            last.iterate.trajectory,
        )


def _check_duration(solved: Sequence[SolvedMesh]) -> None:
    """Collapsed if next to no time is left, and several meshes could gain the whole objective.

    Where the optimum is at infinite controls, as a least time without a limit of the force, the
    solver stops somewhere on the way, and finer meshes lead nowhere.
    """
    latest = solved[-_TURNING:]
    if len(latest) < _TURNING or min(s.errors.gain for s in latest) < _ALL_OF_IT:
        return
    last = latest[-1].iterate
    duration = sum(phase.end - phase.start for phase in last.trajectory.phases)
    # later sizes are those of what was found
    if duration > _NEXT_TO_NO_TIME * solved[0].iterate.scales.time:
        return
    raise Collapsed(
        f"the duration of '{last.problem.name}' tends to zero ({duration:.1e} s), because nothing "
        "seems to limit the controls; bound them, or prescribe a minimum duration",
        last.trajectory,
    )


def ending_of(
    meshes: MeshSolver, history: History, step: NextStep, accuracy: Accuracy
) -> Ending | None:
    """What ends a refinement that has a next mesh, if anything does.

    Parameters
    ----------
    step : NextStep
        To the next mesh. There is no time for it unless what it took to look at the last one is
        left.

    Raises
    ------
    NumericalTrouble
        An angle without bounds turns to and fro on finer meshes, too, or a control without a limit
        has become an impulse.
    Collapsed
        Next to no time is left.
    Unbounded
        A state without a limit grows from mesh to mesh.
    """
    solved = history.solved
    _check_angles(solved)
    _check_duration(solved)
    if len(solved) > 1:  # one mesh tells nothing of what the next ones make larger
        check_growth(solved)
    if step.over and not step.again:
        return "mesh iterations"
    if meshes.spent(history.mesh_iterations, step.examining):
        return "budget"
    if _has_cost_enough(meshes, history, step, accuracy):
        return "cost"
    # nor does it end where no mesh was fine enough to tell what the objective is off by
    unknown = math.isinf(objective_error(solved, solved[-1]))
    if (
        step.again
        or unknown
        or not stands_still(solved, accuracy, removes_violations=step.removes_violations)
    ):
        return None
    return "standstill"


def _has_cost_enough(
    meshes: MeshSolver, history: History, step: NextStep, accuracy: Accuracy
) -> bool:
    """Whether a motion that is accurate to 1e-4 has cost much, and a better one would cost more.

    That is where the meshes to come would cost more than all before them: as many as it takes until
    all tolerances are met, by the rate of the last ones. Costs are iterations times unknowns times
    the most signals of a phase, as what it takes to factorise a point grows faster than its
    unknowns. Not where an accuracy or a budget of seconds was asked for.
    """
    solved, settings = history.solved, meshes.settings
    default = settings.accuracy == Accuracy() and settings.seconds is None
    signals = max(map(len, meshes.problem.signals.values()))
    cost = sum(m.iterations * m.unknowns * signals for m in history.mesh_iterations)
    if not default or step.mesh is None or cost < MUCH or len(solved) < _STILL_IN_DOUBT:
        return False
    best, last = best_of(solved, accuracy), solved[-1]
    if max(best.errors.dynamics, best.excess, objective_error(solved, best)) > _FINE:
        return False
    finer = step.mesh.intervals / last.iterate.mesh.intervals
    ahead = last.iterations * last.iterate.x.size * signals * finer
    return ahead * meshes_to_come(solved, accuracy) > cost


def meshes_to_come(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> float:
    """How many meshes it takes until all tolerances are met, at the rate of the last two, from 1.

    Infinite where these have brought nothing.
    """
    before, _, now = (s.worst_in_tolerances(accuracy) for s in solved[-_STILL_IN_DOUBT:])
    if now >= before:
        return math.inf
    return max(1.0, 2.0 * math.log(max(now, 1.0)) / math.log(before / now))


def stands_still(
    solved: Sequence[SolvedMesh], accuracy: Accuracy, *, removes_violations: bool = False
) -> bool:
    """Whether further meshes would change nothing but last digits of the constraints' tolerance.

    The objective has stayed within its tolerance for several meshes, and one of them is good enough
    to be verified. The estimated gain of the last of them is below the tolerance, too, or refuted:
    a finer mesh has gained nothing, and the estimate is about what it was.

    Parameters
    ----------
    removes_violations : bool
        Whether the next mesh would only impose limits at more points: then one more is waited for.
    """
    last, gain = solved[-1], solved[-1].errors.gain
    violated, much = last.excess > accuracy.path, gain > OVERESTIMATE * accuracy.objective
    count = _STILL if violated and not (much or removes_violations) else _STILL_IN_DOUBT
    latest = solved[-count:]
    # a loose solve that is made again to the tolerance asked for is no second mesh
    if len(latest) < count or not all(s.tight for s in latest):
        return False

    # the effect that violations up to the looser tolerance may have, however loosely the optimum is
    # asked for
    objectives = [s.iterate.objective for s in latest]
    slack = min(accuracy.objective, SLACK * accuracy.path) * last.iterate.objective_size
    if max(objectives) - min(objectives) > slack:
        return False
    finer = any(s.finer for s in latest[1:])
    refuted = finer and is_refuted(latest, len(latest) - 1, accuracy)
    if gain > accuracy.objective and not refuted:
        return False
    if (violated and _violations_fall(latest)) or _crossings_settle(latest):
        return False
    # a limit that has just begun to be violated has had no mesh yet on which that is removed
    if latest[-2].is_verifiable(accuracy) and not last.is_verifiable(accuracy):
        return False
    return any(s.is_verifiable(accuracy) for s in latest)


def _violations_fall(latest: Sequence[SolvedMesh]) -> bool:
    """Whether each of the meshes left much less over the limits than the one before."""
    return all(new.excess <= _FALLING * old.excess for old, new in itertools.pairwise(latest))


def _crossings_settle(latest: Sequence[SolvedMesh]) -> bool:
    """Whether the last mesh brought the breakpoints much nearer to crossings of kinks, if any."""
    before, last = (s.errors.farthest_crossing for s in latest[-2:])
    return last <= _FALLING * before and last > NEAR
