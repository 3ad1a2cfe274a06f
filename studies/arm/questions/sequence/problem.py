"""Both stages as one optimal control problem: big arm, locked dwell, small arm, split free.

Three phases of B21 with their own coordinates. The root's lock is the jump map from the first to
the second: positions continuous, rates projected by the inelastic impulse. The elbow's release
leads on without a jump. Each lock must meet an arm at rest.

Symbols: J rigid inertia [kg m^2], D turn [rad], T total time of both motions [s].
"""

from __future__ import annotations

from collections.abc import Sequence as Several
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from models.arm.parameters import ArmParameters
from models.arm.reduced import COORDINATES, ReducedArm, solve_small
from ocp import Between, Bound, Mesh, Phase, Problem, State, joined, peak
from ocp.mesh.mesh import uniform
from studies.arm.optimal.mesh import DEGREE, graded
from studies.arm.optimal.phase import (
    ArmPhase,
    Limits,
    arm_phase,
    column,
    smoothness,
    starting_law,
)
from studies.arm.stage import ELBOW, ROOT, Stage, big_arm, small_arm
from studies.common.exit_codes import StudyError

Least = Literal["peak-torque", "time"]
SMOOTHING = 1e-5  # weight of the smoothness of both torques beside the objective
_SHARE = (0.3, 3.0)  # of the guessed durations, between which the optimiser chooses


@dataclass(frozen=True)
class Sequence:
    """Two stages one after the other.

    Attributes
    ----------
    first, second : stages of the guessed durations; the second begins where the first ends.
    dwell : time that the arm stays locked between them, on top of the motions [s].
    """

    first: Stage
    second: Stage
    dwell: float

    @property
    def moving_time(self) -> float:
        """Time of both motions [s]."""
        return self.first.duration + self.second.duration

    @property
    def rigid_bound(self) -> float:
        """Least common peak torque of the rigid arm, 4 (sum sqrt(J D))^2 / T^2 [N m]."""
        return (
            4.0
            * sum(np.sqrt(turning(s)) for s in (self.first, self.second)) ** 2
            / (self.moving_time**2)
        )


@dataclass(frozen=True, eq=False)
class SequencePhases:
    """The phases of a sequence with the signals their expressions are made of."""

    first: ArmPhase
    dwell: Phase
    second: ArmPhase


def turning(stage: Stage) -> float:
    """J D of the joint that turns [N m s^2]."""
    k = stage.moving[0]
    return float(stage.inertias[k] * abs(stage.turn[k]))


def sequence(total: float, dwell: float, arm: ArmParameters | None = None) -> Sequence:
    """Big and small arm in a total time, split as the rigid bound has it.

    Raises
    ------
    StudyError
        If a time is not positive.
    """
    for name, value in (("total time", total), ("dwell", dwell)):
        if not (np.isfinite(value) and value > 0):
            raise StudyError(f"the {name} is {value:g} s; give a positive finite time")
    first, second = big_arm(arm=arm), small_arm(arm=arm)
    roots = np.sqrt([turning(first), turning(second)])
    shares = total * roots / roots.sum()
    return Sequence(first.lasting(shares[0]), second.lasting(shares[1]), dwell)


def sequence_problem(
    case: Sequence, least: Least = "peak-torque", cap: float | None = None,
    left: float | None = None, smoothing: float = SMOOTHING,
) -> tuple[Problem, SequencePhases]:  # fmt: skip
    """The three phases, linked, with least common peak torque or least time under a cap [N m].

    `left` is the energy [J] that the first lock may meet; None demands rest there too.
    """
    phases = _phases(case, cap, least == "time", left)
    big, rest, small = phases.first, phases.dwell, phases.second
    stages = case.first, case.second
    smooth = sum(smoothness(arm, stage) for arm, stage in zip((big, small), stages, strict=True))
    if least == "time":
        best = (small.phase.end_time - case.dwell) / case.moving_time
    else:
        torques = ((arm.phase, t / case.rigid_bound) for arm in (big, small)
                   for t in arm.torque.values())  # fmt: skip
        best = peak(*torques, absolute=True)
    bounds = [
        Bound("dwell", rest.duration, "s", case.dwell, case.dwell), *big.bounds, *small.bounds,
    ]  # fmt: skip
    links = (*lock_links(phases, case), *release_links(phases, case))
    stated = Problem(
        "big arm, dwell, small arm", [big.phase, rest, small.phase],
        minimise=best + smoothing * smooth, bounds=bounds, links=links,
    )  # fmt: skip
    return stated, phases


def _phases(case: Sequence, cap: float | None, free: bool, left: float | None) -> SequencePhases:
    limits = Limits((cap, cap))
    t1, t2 = case.first.duration, case.first.duration + case.dwell
    t3 = t2 + case.second.duration
    first = arm_phase(
        case.first, limits, end=window(t1, t1), law=starting_law(case.first, limits),
        suffix=", big", left=left,
    )  # fmt: skip
    second = arm_phase(
        case.second, limits, start=window(t2, t1), law=starting_law(case.second, limits),
        end=window(t3, case.second.duration) if free else t3, suffix=", small", linked=True,
    )  # fmt: skip
    return SequencePhases(first, _dwell(case, first, (t1, t2)), second)


def window(guess: float, span: float) -> Between:
    """Where the optimiser may put an instant, by the length of the motion before it [s]."""
    return Between(guess - (1 - _SHARE[0]) * span, guess + (_SHARE[1] - 1) * span, guess)


def locked(case: Sequence) -> ReducedArm:
    """B21 with both joints locked, as during the dwell."""
    return ReducedArm(case.first.arm, root_lock=case.first.end[ROOT],
                      elbow_lock=case.first.end[ELBOW])  # fmt: skip


def _dwell(case: Sequence, before: ArmPhase, times: tuple[float, float]) -> Phase:
    """The locked arm, nothing driven."""
    model = locked(case)
    names = model.coordinates
    old = {s.name.split(",")[0]: s for s in (*before.q, *before.v)}
    q = tuple(State(f"{n}, dwell", old[n].unit, scale=old[n].scale) for n in names)
    rates = [old[f"rate of {n}"] for n in names]
    v = tuple(State(f"{s.name.split(',')[0]}, dwell", s.unit, scale=s.scale) for s in rates)
    pull = model.force(column(q), column(v), ca.DM.zeros(2))
    acceleration = solve_small(model.mass_matrix(column(q)), pull)
    dynamics: dict[State, Any] = dict(zip(q, v, strict=True))
    dynamics |= dict(zip(v, acceleration, strict=True))
    span = times[0]
    return Phase(
        "dwell", dynamics=dynamics, start=window(times[0], span), end=window(times[1], span),
        guess=dict.fromkeys((*q, *v), 0.0),
    )  # fmt: skip


def lock_links(phases: SequencePhases, case: Sequence) -> tuple[Bound, ...]:
    """Jump map of the root's lock: M (v+ - v-) = Phi_q^T Lambda, in the locked coordinates.

    J^T M J v+ = J^T M v-, J the tangent of the locked coordinates in the free ones.
    """
    free, model = phases.first.model, locked(case)
    q, v = column(phases.first.q), column(phases.first.v)
    kept = [free.coordinates.index(name) for name in model.coordinates]
    z = ca.SX.sym("z", model.size)
    tangent = ca.jacobian(model.embed(z), z)
    rows = [COORDINATES.index(name) for name in free.coordinates]
    J = ca.substitute(tangent[rows, :], z, q[kept])
    mass = free.mass_matrix(q)
    after = solve_small(J.T @ mass @ J, J.T @ (mass @ v))
    states = phases.dwell.states
    jump = dict(zip(states, [*(q[i] for i in kept), *after], strict=True))
    return joined(phases.first.phase, phases.dwell, jump)


def release_links(phases: SequencePhases, case: Sequence) -> tuple[Bound, ...]:
    """The elbow's release: positions and rates lead on."""
    model, free = locked(case), phases.second.model
    states = phases.dwell.states
    q, v = column(states[: model.size]), column(states[model.size :])
    all_six = model.embed(q)
    rates = ca.jtimes(all_six, q, v)
    places = [COORDINATES.index(name) for name in free.coordinates]
    values = [all_six[i] for i in places] + [rates[i] for i in places]
    jump = dict(zip((*phases.second.q, *phases.second.v), values, strict=True))
    return joined(phases.dwell, phases.second.phase, jump)


def meshes(intervals: Several[int]) -> Mesh:
    """Meshes of the three phases, those of the motions finer where the torque turns."""
    first, rest, second = intervals
    return Mesh((graded(first), uniform(rest, DEGREE), graded(second)))
