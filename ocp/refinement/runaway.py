"""Signals that nothing limits: controls that turn into impulses, states that grow without bound.

Where an optimum needs an infinite control for no time, as a thrust without a limit, each finer mesh
makes the control higher in a narrower interval. What it does there, height times width, stays. No
mesh ends that: there is no best motion, only a best impulse. A control with a pole that a motion
can follow does less in a narrower interval, by the square root of its width or so.

With ``x' = x^2`` a motion is at infinity after a finite time. A mesh has no such motion, but one
that is off: each finer mesh follows it further up, and is off by more.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ocp.arrays import Array
from ocp.errors import NumericalTrouble, Unbounded
from ocp.mesh.mesh import MIDPOINTS
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.iterate import Iterate
from ocp.problem.display import with_unit
from ocp.problem.symbols import Control, State
from ocp.refinement.solved_mesh import SolvedMesh


def check_growth(solved: Sequence[SolvedMesh]) -> None:
    """Check that no control has become an impulse, and that no state grows from mesh to mesh.

    Raises
    ------
    NumericalTrouble
        A control without a limit has become an impulse.
    Unbounded
        A state without a limit grows from mesh to mesh.
    """
    _check_impulses(solved)
    _check_states(solved)


def _check_impulses(solved: Sequence[SolvedMesh]) -> None:
    """NumericalTrouble where a control without a limit has become an impulse."""
    last = solved[-1].iterate
    found = _impulse(solved[0].iterate, last)
    if found is None:
        return
    name, side = found.control.name, "lower" if found.height < 0 else "upper"
    height = with_unit(f"{found.height:.1e}", found.control.unit)
    raise NumericalTrouble(
        f"the control '{name}' of phase '{found.phase}' reaches {height} in ever narrower "
        f"intervals, after {len(solved)} mesh iterations: it has no limit, and the optimum is an "
        f"impulse; add a limit, as in Control({name!r}, {side}=...)",
        last.trajectory,
    )


def _check_states(solved: Sequence[SolvedMesh]) -> None:
    """Unbounded if a state without a limit grows from mesh to mesh."""
    found = _growth(solved)
    if found is None:
        return
    name, unit = found.state.name, found.state.unit
    side = "upper" if found.sign > 0 else "lower"
    before, last = (with_unit(f"{value:.2g}", unit) for value in (found.before, found.last))
    raise Unbounded(
        f"the state '{name}' of phase '{found.phase}' grows without bound, from {before} to "
        f"{last} in four mesh iterations, and the dynamics are not satisfied on any of them: the "
        f"motion diverges within the phase; limit the state, as in State({name!r}, {side}=...)",
        solved[-1].iterate.trajectory,
    )


# Meshes in a row on which a state grows and the dynamics are off by more than its size, and how
# many times it is as large on each as on the one before. A motion that is steep and finite is
# followed to its top by one of them, and then is off by less.
_MESHES = 4
_TIMES = 2.0
_FAR = 1.0


class Growth(NamedTuple):
    """A state that grows without bound.

    Attributes
    ----------
    phase : str
    state : State
    sign : float
        1 if it grows upwards, -1 if downwards.
    before, last : float
        Its modulus there on the first of the meshes, and on the last one [unit of the state].
    """

    phase: str
    state: State
    sign: float
    before: float
    last: float


def _growth(solved: Sequence[SolvedMesh]) -> Growth | None:
    """A state that nothing limits and that grew without bound on the latest meshes, if one did."""
    latest = solved[-_MESHES:]
    if len(latest) < _MESHES or min(s.errors.dynamics for s in latest) < _FAR:
        return None
    last = latest[-1].iterate
    for phase in last.problem.phases:
        motions = [s.iterate.trajectory.phase(phase.name) for s in latest]
        for state in phase.states:
            limits = last.parameters.signal_limits[state.name]
            for sign, limit in zip((-1.0, 1.0), limits, strict=True):
                tops = [_top(motion, state, sign) for motion in motions]
                grows = all(new > _TIMES * max(old, 0.0) for old, new in itertools.pairwise(tops))
                if np.isinf(limit) and tops[0] > 0.0 and grows:
                    return Growth(phase.name, state, sign, tops[0], tops[-1])
    return None


def _top(motion: PhaseTrajectory, state: State, sign: float) -> float:
    """The largest value of a state at the breakpoints, in one direction [unit of the state]."""
    return float((sign * motion.polynomial(state.name).ends()).max())


# Part of its width to which the interval of the highest control shrinks, and part of what the
# control did there before that it still does. A layer that is thin, but of some width, is resolved
# before; a pole of t^(-3/4) does less.
_NARROWER = 1e-4
_AS_MUCH = 0.1

# Least height, in sizes of the control on the first mesh: less is what a solver leaves of zero.
_HIGH = 10.0


class Impulse(NamedTuple):
    """A control that has become an impulse.

    Attributes
    ----------
    phase : str
    control : Control
    height : float
        Its mean in the narrow interval, with its sign [unit of the control].
    """

    phase: str
    control: Control
    height: float


def _impulse(first: Iterate, last: Iterate) -> Impulse | None:
    """A control that nothing limits and that is an impulse by now, if there is one.

    Parameters
    ----------
    first, last : Iterate
        On the first mesh and on the last one.
    """
    pairs = zip(first.trajectory.phases, last.trajectory.phases, strict=True)
    for before, after in pairs:
        for control in last.problem.controls[after.name]:
            old, new = _means(before, control), _means(after, control)
            # beside an impulse a polynomial swings to the other side, too, and may do so farther
            sign = float(np.sign(old[np.abs(old).argmax()]))
            was, now = int((sign * old).argmax()), int((sign * new).argmax())
            old_width, width = np.diff(before.fractions)[was], np.diff(after.fractions)[now]
            limit = last.parameters.signal_limits[control.name][int(sign > 0.0)]
            height, old_height = sign * float(new[now]), sign * float(old[was])
            high = height >= _HIGH * first.scales.signals[control.name]
            narrow = width <= _NARROWER * old_width
            as_much = height * width >= _AS_MUCH * old_height * old_width
            if np.isinf(limit) and high and narrow and as_much:
                return Impulse(after.name, control, sign * height)
    return None


def _means(motion: PhaseTrajectory, control: Control) -> Array:
    """Means of a control over the intervals of a phase [unit of the control], (N,)."""
    intervals = np.repeat(np.arange(motion.intervals), MIDPOINTS.size)
    tau = np.tile(MIDPOINTS, motion.intervals)
    values = motion.polynomial(control.name).value(intervals, tau)[:, 0]
    return np.asarray(values.reshape(motion.intervals, -1).mean(axis=1))
