"""Angles without bounds: controls that a whole turn leaves as they are, made smooth between points.

A steering angle enters by its sine and cosine. A solver may end with the angle on different
branches at neighbouring points, a turn apart: the points are right, and the polynomial through them
is nonsense between. No finer mesh mends that. Between two meshes such an angle is unwrapped: its
values at the collocation points are shifted by whole turns until each is the nearest to the one
before. The program's rows hold the same values at these points as before, and the multipliers are
kept.

A control is shifted only where nothing notices: it has no bound, and all dynamics, constraints and
functionals of the phase are the same a period further, which is tried at random points. A cost on
the angle itself, a limit of it or a link to another angle then show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.piecewise_polynomial import bernstein
from ocp.numerics.polynomial_expressions import is_linear
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import pieces_over
from ocp.problem.problem import Problem
from ocp.problem.symbols import Control
from ocp.transcription.packing import trajectory_of

# An angle is lost where it turns by more than half a turn between neighbouring points of an
# interval, in more than this part of the intervals.
_LOST = 0.1

# A whole turn in the units in which an angle may be stated in: radians, degrees, turns
_TURNS = (2.0 * math.pi, 360.0, 1.0)

# random points at which a shift must change nothing, and what rounding may change
_TRIED = 32
_SAME = 1e-12


def periods(problem: Problem, index: int) -> dict[str, float]:
    """Periods of the controls of phase `index` that a whole turn leaves as they are, by name."""
    statement = problem.phases[index]
    phase = statement.name
    expressions = [*statement.dynamics.values(), *(bound.expression for bound in statement.bounds)]
    expressions += [expression for _, expression in pieces_over(problem.functionals, phase)]

    found = {}
    rates = ca.vertcat(*statement.dynamics.values())
    for control in problem.controls[phase]:
        if control.is_limited or control.coupled or control.piecewise not in (None, "polynomial"):
            continue
        if ca.depends_on(rates, control.symbol) and is_linear(rates, control.symbol):
            continue  # a force, and no angle
        if turn := _turn_of(expressions, control):
            found[control.name] = turn
    return found


def _turn_of(expressions: Sequence[ca.SX], control: Control) -> float | None:
    """A whole turn of a control that changes none of some expressions; None if it is no angle."""
    return next((turn for turn in _TURNS if _invariant(expressions, control, turn)), None)


def _invariant(expressions: Sequence[ca.SX], control: Control, period: float) -> bool:
    """Whether a shift of a control by a period changes no expression at random points."""
    depending = [e for e in expressions if ca.depends_on(e, control.symbol)]
    if not depending:
        return False
    used = ca.vertcat(*depending)
    shifted = ca.substitute(used, control.symbol, control.symbol + period)
    symbols = ca.vertcat(*ca.symvar(used))
    both = ca.Function("both", [symbols], [used, shifted])

    random = np.random.default_rng(0)
    points = random.uniform(-2.0, 2.0, (symbols.numel(), _TRIED))
    here, there = (np.asarray(values.full()) for values in both(points))
    known = np.isfinite(here) & np.isfinite(there)
    size = 1.0 + np.abs(np.where(known, here, 0.0))
    same = np.abs(np.where(known, there - here, 0.0)) <= _SAME * size
    return bool(known.any(axis=1).all() and same.all())


def lost_angle(iterate: Iterate) -> tuple[str, Control] | None:
    """A phase and its control without bounds that turns to and fro between neighbouring points.

    No rate notices a whole turn, but something else does, so that it is not unwrapped.
    """
    for index, motion in enumerate(iterate.trajectory.phases):
        rates = list(iterate.problem.phases[index].dynamics.values())
        for control in iterate.problem.controls[motion.name]:
            turn = None if control.is_limited or control.coupled else _turn_of(rates, control)
            if turn is None:
                continue
            values = motion.polynomial(control.name)
            steps = [
                np.abs(np.diff(values.value(np.full(tau.size, k), tau)[:, 0])).max(initial=0.0)
                for k, (_, tau) in _determined(iterate, index, control.name).items()
            ]
            if steps and np.mean(np.array(steps) > 0.5 * turn) > _LOST:
                return motion.name, control
    return None


def unwrapped(iterate: Iterate, evaluator: Evaluator) -> Iterate:
    """An iterate whose free angles go on smoothly from point to point; itself where they do.

    Values at the collocation points are shifted by whole periods only.
    """
    x, changed = iterate.x.copy(), False
    for index, motion in enumerate(iterate.trajectory.phases):
        make = partial(periods, iterate.problem, index)
        for name, period in evaluator.once(("periods", motion.name), make).items():
            changed |= _unwrap(x, iterate, index, name, period)
    if not changed:
        return iterate
    trajectory = trajectory_of(iterate.transcription, x, iterate.parameters)
    return replace(iterate, x=x, trajectory=trajectory)


def _unwrap(x: Array, iterate: Iterate, index: int, name: str, period: float) -> bool:
    """Shift one control of a phase in `x`; whether anything was shifted."""
    motion, size = iterate.trajectory.phases[index], iterate.scales.signals[name]
    control, before, changed = motion.polynomial(name), math.nan, False

    for interval, (ids, tau) in sorted(_determined(iterate, index, name).items()):
        values = control.value(np.full(tau.size, interval), tau)[:, 0]
        smooth = values.copy()
        for j, value in enumerate(values):
            if math.isfinite(before):
                smooth[j] -= period * round((value - before) / period)
            before = float(smooth[j])
        if np.any(smooth != values):
            x[ids] = np.linalg.solve(bernstein(tau.size, tau), smooth) / size
            changed = True
    return changed


def _determined(iterate: Iterate, index: int, name: str) -> dict[int, tuple[Integers, Array]]:
    """Intervals in which a control's values at the collocation points say all of it.

    Each with the columns of its coefficients, and the points.
    """
    columns, found = iterate.transcription.columns.phases[index], {}
    for group in columns.groups:
        tau = group.collocation.points
        for members, table in zip(columns.control_sets, group.controls, strict=True):
            names = [control.name for control in members.controls]
            if name not in names or table.shape[1] != tau.size:
                continue
            own = table[:, :, names.index(name)]
            for interval, ids in zip(group.intervals.tolist(), own, strict=True):
                found[interval] = ids, tau
    return found
