"""A stage of the arm's deployment: which joints turn, from where to where, under what caps.

Symbols: T duration [s], D turn of a joint [rad], J rigid inertia about a driven joint [kg m^2].
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from models.ancf import joints
from models.ancf.chain import Chain
from models.ancf.state import NodalState, posed
from models.arm.bulges import tied_to_first_modes
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm
from models.numerics import gauss_legendre
from ocp.arrays import Array
from studies.common.exit_codes import StudyError

ROOT, ELBOW = 0, 1
JOINT_NAMES = ("root", "elbow")
_POINTS = 20  # of a quadrature; J changes by a third over half a turn
_POSES = 9  # along the stage, whose first modes tie the bulges of the reduced model


@dataclass(frozen=True)
class TorqueCaps:
    """What the drives may not exceed at any time; None is no cap.

    Attributes
    ----------
    torque : (root, elbow) largest torques [N m].
    rate : (root, elbow) largest rates of the torques [N m/s].
    root_moment : largest moment about the root that a held satellite takes [N m].
    momentum : largest angular momentum that it takes [N m s].
    """

    torque: tuple[float | None, float | None] = (None, None)
    rate: tuple[float | None, float | None] = (None, None)
    root_moment: float | None = None
    momentum: float | None = None


@dataclass(frozen=True)
class Stage:
    """Joint angles before and after, and the duration.

    Attributes
    ----------
    name : str
    start, end : (root, elbow) joint angles [rad]; a joint whose angles agree is locked.
    duration : T [s].
    arm : ArmParameters
    tied : whether the bulges of its reduced model are tied, see `reduced`.
    satellite_inertia : H of a satellite that is free to turn about the root [kg m^2]; None for one
        that is held.

    Raises
    ------
    StudyError
        If nothing turns.
    """

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    duration: float
    arm: ArmParameters = field(default_factory=ArmParameters)
    tied: bool = True
    satellite_inertia: float | None = None

    def __post_init__(self) -> None:
        if not self.moving:
            raise StudyError(
                f"the stage '{self.name}' turns no joint; give it an end angle that differs from "
                "its start"
            )

    def __getstate__(self) -> dict[str, Any]:
        """For another process: the stage alone, without the models that were made of it."""
        return {one.name: getattr(self, one.name) for one in dataclasses.fields(self)}

    @property
    def moving(self) -> tuple[int, ...]:
        """Joints that turn, 0 the root and 1 the elbow."""
        return tuple(k for k in (ROOT, ELBOW) if self.start[k] != self.end[k])

    @property
    def turn(self) -> Array:
        """D of both joints (2,) [rad]."""
        return np.subtract(self.end, self.start)

    @cached_property
    def model(self) -> ReducedArm:
        """B21 with the joints that do not turn locked, its bulges tied to the first modes."""
        return self.reduced()

    @cached_property
    def _ties(self) -> tuple[float, float, float]:
        """Of the bulges to the other shapes, see `models.arm.bulges`."""
        shares = np.linspace(0.0, 1.0, _POSES)
        poses = [(float(r), float(e)) for r, e in np.add(self.start, np.outer(shares, self.turn))]
        plain = self.reduced(tied=False)
        return tied_to_first_modes(plain, poses).ties

    @property
    def _locks(self) -> tuple[float | None, float | None]:
        root, elbow = (None if k in self.moving else self.start[k] for k in (ROOT, ELBOW))
        return root, elbow

    def reduced(self, arm: ArmParameters | None = None, *, tied: bool = True) -> ReducedArm:
        """The reduced model of this or another arm while the stage runs.

        `tied` ties the bulges as in the modes with the joint free. On a given angle the joint is
        held, its modes are slower, and the links hardly bulge.
        """
        ties = self._ties if tied and self.tied else (0.0, 0.0, 0.0)
        return ReducedArm(arm or self.arm, "B21", *self._locks, ties, self.satellite_inertia)

    @property
    def inertias(self) -> Array:
        """J that each joint's torque unit is made of (2,) [kg m^2]; the root's at its largest.

        Of one joint on a free satellite it is what makes the rigid bound exact, see `_on_free`.
        """
        elbow = self.start[ELBOW] if ELBOW not in self.moving else 0.0
        held = np.array([self.arm.root_inertia(elbow), self.arm.elbow_inertia])
        return held if self.satellite_inertia is None else self._on_free(self.satellite_inertia)

    def _on_free(self, H: float) -> Array:
        """J of a rigid arm on a free satellite (2,) [kg m^2], where only one joint turns.

        Without momentum the joint has the energy J(phi) phidot^2 / 2. Under a torque of constant
        size it is that torque times the way from the nearer end, which gives T as an integral of
        sqrt(J). With phi - start = D s^2 / 2, or from the end, the integrand is smooth.
        """
        elbow, arm = self.start[ELBOW], self.arm
        root = arm.root_inertia(elbow) * H / (arm.root_inertia(elbow) + H)
        s, weights = gauss_legendre(_POINTS)
        roots = []
        for k, sign in ((0, 1.0), (1, -1.0)):
            phi = (self.start, self.end)[k][ELBOW] + sign * self.turn[ELBOW] * s**2 / 2
            whole = np.array([arm.root_inertia(float(angle)) for angle in phi])
            # the arm's momentum by the elbow's rate
            handed = arm.elbow_inertia + (whole - arm.root_inertia(math.pi / 2)) / 2
            roots.append(weights @ np.sqrt(arm.elbow_inertia - handed**2 / (H + whole)))
        return np.array([root, (sum(roots) / 2) ** 2])

    @property
    def inertia_turns(self) -> Array:
        """J |D| of both joints (2,) [N m s^2]; a torque unit is one of them over T^2."""
        return np.asarray(self.inertias * np.abs(self.turn))

    @property
    def torque_units(self) -> Array:
        """J |D| / T^2 of both joints (2,) [N m]; the rigid bound of one joint is 4 of them."""
        return self.inertia_turns / self.duration**2

    def least_duration(self, torque: float) -> float:
        """Least T [s] of a rigid arm with one driven joint under a cap [N m]: 2 sqrt(J D/cap)."""
        return 2.0 * math.sqrt(self.inertia_turns[self.moving[0]] / torque)

    def capped(self, factor: float) -> TorqueCaps:
        """Torque caps of a multiple of the torque units of the joints that turn."""
        units = self.torque_units
        root, elbow = (factor * float(units[k]) if k in self.moving else None for k in (0, 1))
        return TorqueCaps(torque=(root, elbow))

    def under(self, drive: str) -> Stage:
        """The same stage as B21 is best under a drive: on a given angle its bulges are not tied."""
        return dataclasses.replace(self, tied=drive == "torque")

    def lasting(self, duration: float) -> Stage:
        """The same stage in another time [s]."""
        return dataclasses.replace(self, duration=duration)

    @property
    def carried(self) -> bool:
        """Whether the root is locked to a free satellite, which is then part of the hub."""
        return self.satellite_inertia is not None and ROOT not in self.moving

    def chain(self, elements: int, *, locked: bool = False) -> Chain:
        """The full model until the lock, or after it: a locked root turns with the satellite."""
        chain = self.arm.chain(elements)
        H = self.satellite_inertia
        if H is None or not (locked or self.carried):
            return chain
        return dataclasses.replace(chain, hub_inertia=chain.hub_inertia + H)

    def start_state(self, elements: int) -> NodalState:
        """Rest at the start, full model."""
        return posed(self.chain(elements), list(self.start))

    def full_joints(self, drives: dict[int, joints.Joint]) -> list[joints.Joint]:
        """Joints of the full model in fixed axes: the drives given, the others locked.

        A root that is carried turns with the satellite.
        """
        others = [joints.Locked(angle) for angle in self.start]
        held = [joints.Free() if self.carried else others[ROOT], others[ELBOW]]
        return [drives.get(k, held[k]) for k in (ROOT, ELBOW)]


def big_arm(duration: float = 86.0, arm: ArmParameters | None = None) -> Stage:
    """Big arm by 90 deg with the small arm folded; 86 s is the paper's."""
    arm = arm or ArmParameters()
    return Stage("big", (0.0, math.pi), (math.pi / 2, math.pi), duration, arm)


def small_arm(duration: float = 112.0, arm: ArmParameters | None = None) -> Stage:
    """Small arm from folded to straight with the root clamped; 112 s is the paper's."""
    arm = arm or ArmParameters()
    return Stage("small", (math.pi / 2, math.pi), (math.pi / 2, 0.0), duration, arm)


def both_arms(duration: float = 112.0, arm: ArmParameters | None = None) -> Stage:
    """Both stages at once."""
    arm = arm or ArmParameters()
    return Stage("both", (0.0, math.pi), (math.pi / 2, 0.0), duration, arm)


STAGES = {"big": big_arm, "small": small_arm, "both": both_arms}
