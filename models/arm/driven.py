"""The reduced arm with its one moving joint on a given angle.

Symbols: s, sdot, sddot angle of the joint [rad] and its rates; z the elastic coordinates, zdot
their rates; q = Q(z, s) all coordinates of the arm with the joint free, v their rates. The joint
does no work on z, so Q_z^T (M vdot - f) = 0 with vdot = Q_z zddot + Q_s sddot + bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from models.arm.lock import ELBOW, ROOT, all_coordinates, kept_by_lock
from models.arm.reduced import ReducedArm, solve_small
from models.errors import ModelError


@dataclass(frozen=True)
class DrivenArm:
    """The joint that moves in a reduced arm, driven or locked.

    Parameters
    ----------
    model : ReducedArm
        With one joint locked and the other free.

    Raises
    ------
    ModelError
        If not exactly one joint is free.
    """

    model: ReducedArm

    def __post_init__(self) -> None:
        locks = self.model.root_lock, self.model.elbow_lock
        if sum(lock is None for lock in locks) != 1:
            raise ModelError(
                f"DrivenArm: the locks (root, elbow) are {locks}; lock one joint and leave the "
                "other free."
            )

    @property
    def joint(self) -> int:
        """The joint that is driven, 0 the root and 1 the elbow."""
        return ROOT if self.model.root_lock is None else ELBOW

    @property
    def elastic(self) -> tuple[int, ...]:
        """Places of z in q."""
        return kept_by_lock(self.model, (self.joint,))

    def coordinates(self, z: Any, s: Any) -> Any:
        """Q: all coordinates (n, 1) from the elastic ones and the joint's angle."""
        return all_coordinates(self.model, (self.joint,), z, {self.joint: s})

    def angle(self, q: Any) -> Any:
        """Angle s of the joint [rad]."""
        return q[0] if self.joint == ROOT else self.model.elbow_angle(q)

    def motion(self, z: Any, rate: Any, s: Any, turn: Any) -> tuple[Any, Any]:
        """All coordinates q and rates v (n, 1).

        Parameters
        ----------
        z, rate : (n - 1, 1)
            Elastic coordinates and their rates.
        s, turn : scalars
            Angle of the joint and its rate [rad, rad/s].
        """
        Z, S = self._elastic_symbols("z"), ca.SX.sym("s")
        Zdot, Sdot = self._elastic_symbols("zdot"), ca.SX.sym("sdot")
        q = self.coordinates(Z, S)
        v = ca.jtimes(q, Z, Zdot) + ca.jtimes(q, S, Sdot)

        # Derivatives need symbols, arguments may be any expressions: a function joins the two.
        q_and_v: tuple[Any, Any] = ca.Function("motion", [Z, Zdot, S, Sdot], [q, v])(
            z, rate, s, turn
        )
        return q_and_v

    def balance(self, z: Any, rate: Any, s: Any, turn: Any, spin: Any) -> tuple[Any, Any]:
        """Mass matrix Q_z^T M Q_z and force on z, while the joint follows an angle.

        Parameters
        ----------
        z, rate : (n - 1, 1)
            Elastic coordinates and their rates.
        s, turn, spin : scalars
            Angle of the joint, its rate and its acceleration [rad, rad/s, rad/s^2].
        """
        Z, Zdot = self._elastic_symbols("z"), self._elastic_symbols("zdot")
        S, Sdot, Sddot = (ca.SX.sym(name) for name in ("s", "sdot", "sddot"))
        q = self.coordinates(Z, S)
        Qz, Qs = ca.jacobian(q, Z), ca.jacobian(q, S)

        # bias: the part of vdot that is there without zddot
        v = Qz @ Zdot + Qs * Sdot
        bias = ca.jtimes(v, Z, Zdot) + ca.jtimes(v, S, Sdot) + Qs * Sddot

        mass, force = self._mechanics(q, v)
        parts = [Qz.T @ mass @ Qz, Qz.T @ (force - mass @ bias)]
        driven = ca.Function("driven", [Z, Zdot, S, Sdot, Sddot], parts)
        mass_and_force: tuple[Any, Any] = driven(z, rate, s, turn, spin)
        return mass_and_force

    def acceleration(self, z: Any, rate: Any, s: Any, turn: Any, spin: Any) -> Any:
        """Elastic accelerations (n - 1, 1) while the joint follows an angle, see `balance`."""
        return ca.vertcat(*solve_small(*self.balance(z, rate, s, turn, spin)))

    def _elastic_symbols(self, name: str) -> Any:
        return ca.SX.sym(name, len(self.elastic))

    def _mechanics(self, q: Any, v: Any) -> tuple[Any, Any]:
        """M and f of the free arm without torque, for expressions q and v."""
        model = self.model
        x, rate = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
        outputs = model.mass_and_force(x, rate, ca.DM.zeros(2))
        return ca.Function("free", [x, rate], outputs)(q, v)
