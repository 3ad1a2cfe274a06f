"""The reduced arm with its one moving joint on a given angle, and what a lock of it leaves.

Symbols: s, sdot, sddot angle of the joint [rad] and its rates; z the elastic coordinates, zdot
their rates; q = Q(z, s) all coordinates of the arm with the joint free, v their rates. The joint
does no work on z, so Q_z^T (M vdot - f) = 0 with vdot = Q_z zddot + Q_s sddot + bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.arm.reduced import ReducedArm, solve_small, tip_turn
from models.arrays import Array
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
    def elastic(self) -> tuple[int, ...]:
        """Places of z in q."""
        names = self.model.coordinates
        return tuple(k for k, name in enumerate(names) if not name.startswith("theta"))

    def coordinates(self, z: Any, s: Any) -> Any:
        """Q: all coordinates (n, 1) from the elastic ones and the joint's angle."""
        model = self.model
        values = {model.coordinates[k]: z[i] for i, k in enumerate(self.elastic)}
        if model.root_lock is None:
            values["theta1"] = s
        else:
            # the tangent before the elbow turns with the bent big arm
            values["theta2"] = model.root_lock + tip_turn(values["psi1"]) + s
        return ca.vertcat(*(values[name] for name in model.coordinates))

    def angle(self, q: Any) -> Any:
        """Angle s of the joint [rad]."""
        return q[0] if self.model.root_lock is None else self.model.elbow_angle(q)

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

    def tangent(self, q: Array) -> Array:
        """Q_z (n, n - 1) at coordinates (n,)."""
        x = ca.SX.sym("q", len(q))
        angle = float(ca.Function("angle", [x], [self.angle(x)])(q))
        return np.asarray(self._tangent_function()(q[list(self.elastic)], angle).full())

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

    def locked(self, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Mass matrix of z, its momentum and the strain energy [J] if the joint locked now.

        The inelastic impulse keeps the momentum p = Q_z^T M v of coordinates q and rates v, so
        that E_res = 1/2 p^T (Q_z^T M Q_z)^-1 p + strain energy.
        """
        z = ca.vertcat(*(q[k] for k in self.elastic))
        tangent = self._tangent_function()(z, self.angle(q))
        mass = self.model.mass_matrix(q)
        return tangent.T @ mass @ tangent, tangent.T @ (mass @ v), self.model.strain_energy(q)

    def _elastic_symbols(self, name: str) -> Any:
        return ca.SX.sym(name, len(self.elastic))

    def _tangent_function(self) -> ca.Function:
        """(z, s) -> Q_z."""
        Z, S = self._elastic_symbols("z"), ca.SX.sym("s")
        return ca.Function("Qz", [Z, S], [ca.jacobian(self.coordinates(Z, S), Z)])

    def _mechanics(self, q: Any, v: Any) -> tuple[Any, Any]:
        """M and f of the free arm without torque, for expressions q and v."""
        model = self.model
        x, rate = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
        outputs = [model.mass_matrix(x), model.force(x, rate, ca.DM.zeros(2))]
        return ca.Function("free", [x, rate], outputs)(q, v)
