"""Both stages as one optimal control problem: big arm, locked dwell, small arm, split free.

Three phases of B21 with their own coordinates. The root's lock is the jump map from the first to
the second: positions continuous, rates projected by the inelastic impulse. The elbow's release
leads on without a jump. Each lock must meet an arm at rest.

Symbols: J rigid inertia [kg m^2], D turn [rad], T total time of both motions [s].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from models.arm.lock import kept_by_lock, lock_terms, release
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm, solve_small
from ocp import Between, Bound, Constant, Phase, Problem, State, joined, peak
from studies.arm.optimal.objectives import StatedMotion
from studies.arm.optimal.phase import (
    ArmPhase,
    Drives,
    accelerations,
    arm_phase,
    column,
    equations_of_motion,
    smoothness,
    starting_law,
)
from studies.arm.search_limits import LONGEST_DWELL, SEQUENCE_WINDOW
from studies.arm.stage import ROOT, Stage, TorqueCaps, big_arm, small_arm
from studies.common.exit_codes import StudyError

Least = Literal["peak-torque", "time"]
SMOOTHING = 1e-5  # weight of the smoothness of both torques beside the objective


@dataclass(frozen=True)
class Sequence:
    """Two stages one after the other.

    Attributes
    ----------
    first, second : stages, stated in guessed durations; the second begins where the first ends.
    dwell : time that the arm stays locked between them, on top of the motions [s].
    """

    first: Stage
    second: Stage
    dwell: float

    @property
    def durations(self) -> tuple[float, float, float]:
        """Of the first motion, the dwell and the second motion [s]."""
        return self.first.duration, self.dwell, self.second.duration

    @property
    def moving_time(self) -> float:
        """Time of both motions [s]."""
        return self.first.duration + self.second.duration

    @property
    def rigid_bound(self) -> float:
        """Least common peak torque of the rigid arm, 4 (sum sqrt(J D))^2 / T^2 [N m]."""
        roots = sum(np.sqrt(turning(stage)) for stage in (self.first, self.second))
        return float(4.0 * roots**2 / self.moving_time**2)


def turning(stage: Stage) -> float:
    """J D of the joint that turns [N m s^2]."""
    return float(stage.inertia_turns[stage.moving[0]])


def sequence(total: float, dwell: float, arm: ArmParameters | None = None) -> Sequence:
    """Big and small arm in a total time [s], split as the rigid bound has it.

    Raises
    ------
    StudyError
        If the dwell is too long.
    """
    if dwell > LONGEST_DWELL:
        raise StudyError(f"the dwell is {dwell:g} s; give up to {LONGEST_DWELL:g} s")
    first, second = big_arm(arm=arm), small_arm(arm=arm)
    roots = np.sqrt([turning(first), turning(second)])
    shares = total * roots / roots.sum()
    return Sequence(first.lasting(shares[0]), second.lasting(shares[1]), dwell)


def sequence_problem(
    case: Sequence,
    least: Least = "peak-torque",
    cap: float | None = None,
    left: float | None = None,
) -> StatedMotion:
    """The three phases, linked, with least common peak torque or least time under a cap [N m].

    `left` is the energy [J] that the first lock may meet; None demands rest there too.
    """
    big, dwell, small = _phases(case, cap, least == "time", left)

    # both goals are near one: the smoothness beside them keeps its share
    if least == "time":
        goal = (small.phase.end_time - case.dwell) / case.moving_time
    else:
        torques = [(arm.phase, tau) for arm in (big, small) for tau in arm.torque.values()]
        goal = peak(*((phase, tau / case.rigid_bound) for phase, tau in torques), absolute=True)
    smooth = smoothness(big) + smoothness(small)
    weight = Constant("weight of the smoothness", "1", SMOOTHING)

    dwell_time = Bound("dwell", dwell.duration, "s", case.dwell, case.dwell)
    stated = Problem(
        "big arm, dwell, small arm",
        [big.phase, dwell, small.phase],
        minimise=goal + weight * smooth,
        bounds=[dwell_time, *big.bounds, *small.bounds],
        links=(*lock_links(big, dwell), *release_links(dwell, small, case)),
    )
    return StatedMotion(stated, (big, small), least, weight)


def stage_alone(stage: Stage, cap: float, moving_time: float) -> StatedMotion:
    """Least time of one stage under a cap [N m], stated as within the sequence."""
    caps = TorqueCaps((cap, cap))
    end = window(stage.duration, stage.duration)
    arm = arm_phase(stage, caps, end=end, law=starting_law(stage, caps))
    goal = arm.phase.duration / moving_time + SMOOTHING * smoothness(arm)
    stated = Problem(f"{stage.name} arm alone", [arm.phase], minimise=goal, bounds=arm.bounds)
    return StatedMotion(stated, (arm,), "time")


def _phases(
    case: Sequence, cap: float | None, free: bool, left: float | None
) -> tuple[ArmPhase, Phase, ArmPhase]:
    """The phases; `free` leaves the last instant to the optimiser."""
    caps = TorqueCaps((cap, cap))
    lock = case.first.duration
    release_time = lock + case.dwell
    end = release_time + case.second.duration

    # the small arm starts as the lock leaves the arm, by links and not by values
    first = arm_phase(
        case.first,
        caps,
        end=window(lock, lock),
        law=starting_law(case.first, caps),
        suffix=", big",
        left=left,
    )
    second = arm_phase(
        case.second,
        caps,
        start=window(release_time, lock),
        end=window(end, case.second.duration) if free else end,
        law=starting_law(case.second, caps),
        suffix=", small",
        linked=True,
    )
    return first, _dwell(case, first, (lock, release_time)), second


def window(guess: float, span: float) -> Between:
    """Where the optimiser may put an instant, by the length of the motion before it [s]."""
    shortest, longest = SEQUENCE_WINDOW
    return Between(guess - (1 - shortest) * span, guess + (longest - 1) * span, guess)


def locked(case: Sequence) -> ReducedArm:
    """B21 with both joints locked, as during the dwell."""
    root, elbow = case.first.end
    return ReducedArm(case.first.arm, root_lock=root, elbow_lock=elbow)


def _dwell(case: Sequence, before: ArmPhase, times: tuple[float, float]) -> Phase:
    """The locked arm, nothing driven."""
    model = locked(case)
    # scaled as the coordinates of the motion that the dwell follows
    old = {s.name.split(",")[0]: s for s in (*before.q, *before.v)}
    q, v = (
        tuple(
            State(f"{name}, dwell", old[name].unit, scale=old[name].scale)
            for name in (f"{prefix}{coordinate}" for coordinate in model.coordinates)
        )
        for prefix in ("", "rate of ")
    )

    undriven = Drives(torque={}, rate={}, bend={})
    dynamics: dict[State, Any] = equations_of_motion(q, v, accelerations(model, q, v, undriven))
    span = times[0]
    return Phase(
        "dwell",
        dynamics=dynamics,
        start=window(times[0], span),
        end=window(times[1], span),
        guess=dict.fromkeys((*q, *v), 0.0),
    )


def lock_links(first: ArmPhase, dwell: Phase) -> tuple[Bound, ...]:
    """Jump map of the root's lock: M (v+ - v-) = Phi_q^T Lambda, in the locked coordinates.

    B21 is aimed beside rest so that the full model rests. The dwell is the full model's: it begins
    with what is left without the aim.
    """
    free = first.model
    q, v = column(first.q), column(first.v)
    aims = ca.vertcat(*[0.0 if aim is None else aim.symbol for aim in first.aims])
    q, v = q - aims[: free.size], v - aims[free.size :]
    # derivatives need symbols: a function takes the arguments that are none
    place, rate = ca.SX.sym("q", free.size), ca.SX.sym("v", free.size)
    mass, momentum, _ = lock_terms(free, (ROOT,), place, rate)
    kept = [place[k] for k in kept_by_lock(free, (ROOT,))]
    jump = ca.Function("jump", [place, rate], [ca.vertcat(*kept, *solve_small(mass, momentum))])
    values = ca.vertsplit(jump(q, v))
    return joined(first.phase, dwell, dict(zip(dwell.states, values, strict=True)))


def release_links(dwell: Phase, second: ArmPhase, case: Sequence) -> tuple[Bound, ...]:
    """The elbow's release: positions and rates lead on."""
    model = locked(case)
    states = dwell.states
    z, rate = column(states[: model.size]), column(states[model.size :])
    q, v = release(model, second.model)(z, rate)
    values = [*ca.vertsplit(q), *ca.vertsplit(v)]
    jump = dict(zip((*second.q, *second.v), values, strict=True))
    return joined(dwell, second.phase, jump)
