"""What a motion of the arm may be best in, and the problem that states it.

Each objective is divided by its size for the rigid arm and joined by a small part of the
smoothness, which makes the law unique and keeps it from ringing what the mesh does not resolve.

Symbols: J rigid inertia [kg m^2], D turn [rad], T duration [s].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp import Between, Constant, Functional, Problem, State, peak
from ocp.arrays import Array
from studies.arm.optimal.phase import (
    ArmPhase,
    angular_momentum,
    arm_phase,
    column,
    root_moment,
    smoothness,
    starting_law,
)
from studies.arm.search_limits import SPARE_DURATION, TIME_WINDOW
from studies.arm.stage import Stage, TorqueCaps
from studies.common.exit_codes import StudyError

_QUADRATIC = 12.0  # least mean square torque of a rigid arm in (J D/T^2)^2, linear in time
SMOOTHING = 1e-4  # light enough to come near, heavy enough to start from a rigid arm's motion
RESIDUAL = 1e-6  # [J] that a motion may leave, unless the user says otherwise
_CONSTANT = 4.0  # least peak torque of a rigid arm in J D/T^2


@dataclass(frozen=True)
class Objective:
    """Something to be least.

    Attributes
    ----------
    title : what is least, for a table.
    build : the expression, in units of the rigid arm's, from a phase.
    smoothing : first weight of the smoothness beside it; refinement makes it lighter.
    power : of the quantity in the expression: the largest square is least where the largest is.
    """

    title: str
    build: Callable[[ArmPhase], Any]
    smoothing: float = SMOOTHING
    power: int = 1


def peak_torque(arm: ArmPhase) -> Functional:
    """Largest torque of any joint, in units of the largest joint's."""
    unit = _CONSTANT * float(max(arm.stage.torque_units[k] for k in arm.torque))
    return peak(*((arm.phase, tau / unit) for tau in arm.torque.values()), absolute=True)


def largest_part(arm: ArmPhase, caps: TorqueCaps) -> Functional:
    """Largest part of the caps on torque, and on moment and momentum at the root, of one joint.

    In units of the rigid arm's torque, as `peak_torque`, which it is where no other part is larger.
    """
    k = arm.stage.moving[0]
    unit, cap = _CONSTANT * float(arm.stage.torque_units[k]), caps.torque[k]
    assert cap is not None
    parts = [arm.torque[k] / unit]
    if caps.momentum is not None:
        parts.append(angular_momentum(arm.model, arm.q, arm.v) * (cap / caps.momentum / unit))
    if caps.root_moment is not None:
        moment = root_moment(arm.model, arm.q, arm.v, arm.acceleration)
        parts.append(moment * (cap / caps.root_moment / unit))
    return peak(*((arm.phase, part) for part in parts), absolute=True)


def energy(arm: ArmPhase) -> Any:
    """Mean square torque: the heat of motors that recover what they brake.

    From rest to rest the mechanical work is zero; what is lost is the resistance's.
    """
    stage = arm.stage
    total = sum((tau / stage.torque_units[k]) ** 2 for k, tau in arm.torque.items())
    return arm.phase.integral(total, "heat", "s") / (_QUADRATIC * stage.duration)


def tip_acceleration(arm: ArmPhase) -> Functional:
    """Largest square of the tip's acceleration."""
    stage, k = arm.stage, arm.stage.moving[0]
    size = _CONSTANT * abs(stage.turn[k]) * _length(arm) / stage.duration**2
    return _largest_square(arm.model.tip(column(arm.q)), arm, size)


def root_reaction(arm: ArmPhase) -> Functional:
    """Largest square of the root's force, the rate of the arm's momentum."""
    size = float(_CONSTANT * arm.stage.torque_units[arm.stage.moving[0]] / _length(arm))
    return _largest_square(arm.model.first_moment(column(arm.q)), arm, size)


def deflection(arm: ArmPhase) -> Functional:
    """Largest transverse deflection of a link's end from the tangent at its start."""
    ends = [s for s in arm.q if s.name.startswith("delta")]
    size = max(float(s.scale or 1.0) for s in ends)
    return peak(*((arm.phase, s / size) for s in ends), absolute=True)


def peak_root_moment(arm: ArmPhase) -> Functional:
    """Largest moment that the satellite gives about the root."""
    moment = root_moment(arm.model, arm.q, arm.v, arm.acceleration)
    unit = _CONSTANT * float(arm.stage.torque_units[arm.stage.moving[0]])
    return peak((arm.phase, moment / unit), absolute=True)


def peak_momentum(arm: ArmPhase) -> Functional:
    """Largest angular momentum that it takes."""
    stage = arm.stage
    unit = float(stage.inertia_turns[stage.moving[0]]) / stage.duration
    return peak((arm.phase, angular_momentum(arm.model, arm.q, arm.v) / unit), absolute=True)


def _length(arm: ArmPhase) -> float:
    """Of the link behind the joint that turns [m]."""
    links = arm.stage.arm.big, arm.stage.arm.small
    return float(links[arm.stage.moving[0]].length)


def _largest_square(place: Any, arm: ArmPhase, size: float) -> Functional:
    """Largest square of the second derivative of a place, over that of its size."""
    second = _second(place, arm)
    return arm.phase.peak(ca.dot(second, second) / size**2, scale=1.0)


def _second(place: Any, arm: ArmPhase) -> Any:
    """Second time derivative of a place (2, 1) by q, in fixed axes that the satellite's are at."""
    q, v = column(arm.q), column(arm.v)

    def rate(expression: Any) -> Any:
        by_rates = ca.jtimes(expression, v, ca.vertcat(*arm.acceleration))
        return ca.jtimes(expression, q, v) + by_rates

    moved, w = rate(place), arm.model.satellite_rate(q, v)
    across, moved_across = (ca.vertcat(-x[1], x[0]) for x in (place, moved))
    return rate(moved) + rate(w) * across + 2 * w * moved_across - w**2 * place


OBJECTIVES: dict[str, Objective] = {
    "smoothest": Objective("smoothest torque", smoothness, 0.0),
    "peak-torque": Objective("minimum peak torque", peak_torque),
    "peak-tip-acceleration": Objective(
        "minimum peak acceleration of the tip", tip_acceleration, power=2
    ),
    "energy": Objective("minimum energy (mean square torque)", energy),
    "time": Objective("least time", lambda arm: arm.phase.duration / arm.stage.duration),
    "peak-root-reaction": Objective("minimum peak force at the root", root_reaction, power=2),
    "peak-root-moment": Objective("minimum peak moment about the root", peak_root_moment),
    "peak-root-momentum": Objective("minimum peak angular momentum at the root", peak_momentum),
    "deflection": Objective("minimum peak elastic deflection", deflection),
}


@dataclass(frozen=True, eq=False)
class StatedMotion:
    """The problem of a motion, and what its refinement changes: constants of it.

    A motion is a list of phases in which joints turn, each with a lock behind it. A stage is one.

    Attributes
    ----------
    problem : Problem
    arms : the phases in which joints turn, in order; each joint turns in one of them.
    objective : what is least.
    weight : of the smoothness; None where none is to be changed.
    power : of the quantity in what is least.
    """

    problem: Problem
    arms: tuple[ArmPhase, ...]
    objective: str
    weight: Constant | None = None
    power: int = 1

    @property
    def arm(self) -> ArmPhase:
        """The first phase; that of a stage."""
        return self.arms[0]

    @property
    def stage(self) -> Stage:
        """Its stage as it was stated; a least time ends in another duration."""
        return self.arm.stage

    @property
    def size(self) -> int:
        """Length of an aim: coordinates and rates of all phases."""
        return sum(2 * arm.model.size for arm in self.arms)

    @property
    def drives(self) -> dict[int, tuple[ArmPhase, State]]:
        """Phase and torque of each joint that turns."""
        return {k: (arm, state) for arm in self.arms for k, state in arm.torque.items()}

    @property
    def capped(self) -> bool:
        """Whether a torque has a limit."""
        return any(np.isfinite(state.upper) for _, state in self.drives.values())

    def constants(self, weight: float, aim: Array | None) -> dict[Constant, float]:
        """Values of the constants at a weight and an aim (`size`,) beside rest, see `aim`."""
        values = {} if self.weight is None else {self.weight: weight}
        if aim is not None:
            aims = [constant for arm in self.arms for constant in arm.aims]
            pairs = zip(aims, aim.tolist(), strict=True)
            values |= {constant: value for constant, value in pairs if constant is not None}
        return values


def problem(
    stage: Stage,
    caps: TorqueCaps,
    objective: str = "smoothest",
    *,
    left: float | None = None,
    shared: TorqueCaps | None = None,
) -> StatedMotion:
    """The best motion of a stage under its caps: the one statement of all questions to the arm.

    For least time the stage must last long enough for its caps: the duration is only shortened.
    Left more room, the solver lengthens it first and creeps back.

    Parameters
    ----------
    left : energy that the lock may meet instead of rest [J], see `arm_phase`.
    shared : further caps, which are no limits: their largest part is least instead of the peak
        torque.
    """
    chosen, duration = OBJECTIVES[objective], stage.duration
    end = None
    if objective == "time":
        shortest, longest = TIME_WINDOW
        end = Between(shortest * duration, longest * duration, duration)
    arm = arm_phase(stage, caps, law=starting_law(stage, caps), end=end, left=left)

    least = chosen.build(arm) if shared is None else largest_part(arm, shared)
    weight = None
    if chosen.smoothing:
        weight = Constant("weight of the smoothness", "1", chosen.smoothing)
        least = least + weight * smoothness(arm)
    stated = Problem(f"{stage.name} arm", [arm.phase], minimise=least, bounds=arm.bounds)
    return StatedMotion(stated, (arm,), objective, weight, chosen.power)


def first_duration(stage: Stage, caps: TorqueCaps) -> float:
    """A duration in which the rigid arm can turn well within its caps [s].

    Torque of a joint that turns alone: up at the rate cap, on at the torque cap, down through
    zero to its mirror image; half the least duration x solves `J D = cap (x - cap / rate) x`, or
    `4 J D = rate x^3` where the torque cap is not reached.

    Raises
    ------
    StudyError
        Without a cap on the torque and on its rate.
    """
    durations = []
    for k in stage.moving:
        cap, rate = caps.torque[k], caps.rate[k]
        if cap is None or rate is None:
            raise StudyError("minimum time needs torque_cap and rate_cap; give both")

        turn, ramp = stage.inertia_turns[k], cap / rate
        half = (ramp + np.sqrt(ramp**2 + 4.0 * turn / cap)) / 2.0
        cap_is_reached = half > 2.0 * ramp
        durations.append(2.0 * (half if cap_is_reached else np.cbrt(4.0 * turn / rate)))
    return SPARE_DURATION * float(max(durations))
