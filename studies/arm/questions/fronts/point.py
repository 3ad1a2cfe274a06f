"""What a point of a front of the arm has to keep, and what is kept of it.

Symbols: w weight of the smoothness, S smoothness, T duration [s], J inertia [kg m^2], D turn [rad].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ocp import slopes_by_multipliers
from ocp.arrays import Array
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import StatedMotion, problem
from studies.arm.optimal.phase import MARGIN
from studies.arm.replay.full_model import LockedMotion
from studies.arm.replay.loads import deflections
from studies.arm.search_limits import OF_TURNING
from studies.arm.stage import Stage, TorqueCaps
from studies.arm.trade_off import RESIDUAL_ENERGY
from studies.fronts.columns import FrontAxis

AXES = {
    "time": FrontAxis("time", "duration", "s"),
    RESIDUAL_ENERGY: FrontAxis(RESIDUAL_ENERGY, "residual energy", "J"),
    "peak-torque": FrontAxis("peak-torque", "peak torque", "N m"),
    "deflection": FrontAxis("deflection", "peak deflection", "m"),
}
# in fixed units smoothness falls as T^-7, torque and deflection as T^-2; of a weight that is kept
# in the units of each duration, the one in fixed units grows as T^5
_WEIGHT_GROWS = 5.0
# of a limit on the energy, which the reduced model is asked for at most: the full one then mostly
# keeps the limit at once
ASKED_ENERGY = 0.98


@dataclass(frozen=True, eq=False)
class Demand:
    """What a motion of a front has to keep.

    Attributes
    ----------
    stage : in its duration.
    caps : on the torque.
    left : energy that the lock may meet [J]; None where it has to find the arm at rest.
    """

    stage: Stage
    caps: TorqueCaps
    left: float | None

    @classmethod
    def of(cls, stage: Stage, limits: Mapping[str, float]) -> Demand:
        """What limits on quantities ask for."""
        torque = limits.get("peak-torque")
        return cls(
            stage.lasting(limits.get("time", stage.duration)),
            TorqueCaps(torque=(torque, torque)),
            limits.get(RESIDUAL_ENERGY),
        )

    def stated(self, least: str) -> StatedMotion:
        """The problem of the motion that is best in a quantity."""
        return problem(self.stage, self.caps, least, left=self.left)


@dataclass(frozen=True, eq=False)
class ArmPoint:
    """What is kept of a point.

    Attributes
    ----------
    motion : as it was solved, from which neighbours start.
    replay : on the full model, with the torque that was added to it.
    aim : (2 n,), where a neighbour's is begun.
    values : of all quantities of `AXES`.
    slopes : of what is least by each limit, without the smoothness's share.
    """

    motion: OptimalMotion
    replay: LockedMotion
    aim: Array
    values: Mapping[str, float]
    slopes: Mapping[str, float]


def unit_of(motion: OptimalMotion) -> float:
    """What one of the objective as it was solved is in the unit of what is least."""
    stated = motion.stated
    if stated.objective == "peak-torque":
        return 4.0 * float(stated.stage.torque_units[stated.stage.moving[0]])
    return max(float(q.scale or 1.0) for q in stated.arm.q if q.name.startswith("delta"))


def slopes_of(
    motion: OptimalMotion, limits: Mapping[str, float], asked: float | None = None
) -> dict[str, float]:
    """Slope of what is least by each limit, by the multipliers, without the smoothness's share.

    Parameters
    ----------
    asked : energy that B21 was asked to leave at most, where that is limited [J].
    """
    by, phase = slopes_by_multipliers(motion.solution), motion.stated.arm.phase.name
    found = {}
    for name, limit in limits.items():
        if name == "time":
            weighted = motion.smoothness_share * motion.solution.objective  # w S
            slope = by[f"{phase}: end"] + _WEIGHT_GROWS * weighted / motion.stage.duration
        elif name == RESIDUAL_ENERGY:
            # stated in parts of what was asked, whose root is the limit's but for what models miss
            assert asked is not None
            slope = by[f"energy left by {phase} upper"] * math.sqrt(ASKED_ENERGY / (asked * limit))
        else:
            caps = [state.name for state in motion.stated.arm.torque.values()]
            slope = (1.0 - MARGIN) * sum(by[f"{name} upper"] - by[f"{name} lower"] for name in caps)
        found[name] = float(slope * (1.0 - motion.smoothness_share) * unit_of(motion))
    return found


def most_left(stage: Stage) -> float:
    """Highest limit on the energy left that is looked at where none is stated [J].

    A part of J (D/T)^2 / 2, the energy of a rigid arm at its mean rate.
    """
    joint = stage.moving[0]
    rate = abs(float(stage.turn[joint])) / stage.duration
    return OF_TURNING * 0.5 * float(stage.inertias[joint]) * rate**2


def values_of(replayed: LockedMotion, torque: Array) -> dict[str, float]:
    """All quantities of `AXES` of a motion whose joints have largest torques (2,) [N m]."""
    stage = replayed.motion.stage
    return {
        "time": stage.duration,
        RESIDUAL_ENERGY: replayed.residual_energy,
        # of the joint that turns: the lock bears that of the other one
        "peak-torque": float(torque[stage.moving[0]]),
        "deflection": float(deflections(replayed).max()),
    }
