"""Sizes of quantities: what a motion has where it rests, or else what no motion is below."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from models.ring_on_arm import RingOnArm
from models.truss import centre_travel, least_peak_reaction
from studies.drive.motor import motor_torque, shares_of_the_curve
from studies.truss.limits.bounds import LeastValues
from studies.truss.limits.feasibility import end_forces


@dataclass(frozen=True, eq=False)
class Sizes(LeastValues):
    """The same as `LeastValues`, and what holds the truss where it rests, or an arm does to it."""

    @cached_property
    def force_at_rest(self) -> float:
        """Of the rope [N]."""
        return max(force for _, force, _ in end_forces(self.study))

    @property
    def tension_at_rest(self) -> float:
        """Of the rope's last segment [N]."""
        return max(force * share for _, force, share in end_forces(self.study))

    @property
    def torque_at_rest(self) -> float:
        """Of one motor's shaft [N m]."""
        assert self.study.drive is not None
        return float(motor_torque(self.study.drive, self.force_at_rest, 0.0))

    @property
    def load_at_rest(self) -> float:
        """Share of the torque-speed curve."""
        assert self.study.drive is not None
        shares = shares_of_the_curve(self.study.drive, 0.0, self.torque_at_rest)
        return float(max(shares, default=1.0))

    @property
    def _model(self) -> RingOnArm:
        assert self.study.ring_on_arm is not None
        return self.study.ring_on_arm

    @property
    def _lever(self) -> float:
        """Of the ring's force about the root, by an arm that does not bend [m]."""
        arm = self._model.arm
        return (arm.big.length + arm.small.length) * abs(math.sin(self._model.reaction_angle))

    @property
    def root_moment(self) -> float:
        """That the ring hands to the root of an arm that does not bend [N m]."""
        opening = self.study.opening
        return self._lever * least_peak_reaction(self._model.truss, self.duration, opening)

    @property
    def root_momentum(self) -> float:
        """The same of the angular momentum [N m s]."""
        travel = centre_travel(self._model.truss, self.study.opening)
        return self._lever * self._model.ring_mass * travel / self.duration
