"""The ring as a thin hoop on the tip of the straight arm, root clamped and elbow locked.

The arm is B22 of `models.arm.reduced`. The ring is a hoop in the arm's plane, whose moment of
inertia about its centre is M R^2. Its centre is R from the tip, in a direction that turns with the
tip. The rest of the antenna's mass is a particle at the tip.

Symbols: q = (delta1, psi1, delta2, psi2) shapes of both links [m, -, m, -], v their rates; r(q) tip
[m], theta(q) turn of the tip [rad]; alpha, omega, acc angle of the ring and its rates [rad, rad/s,
rad/s^2]; R(alpha) radius [m], M mass of the ring [kg], J(alpha) its inertia by alpha where the tip
is held [kg m^2]; gamma angle of the reaction; u = (cos, sin) of theta + gamma; c = r + R u centre.
A prime is a derivative with respect to alpha, a dot with respect to time.

The hoop moves with M |cdot|^2 / 2 + M R^2 thetadot^2 / 2. Of that M R'^2 omega^2 / 2 is in
J omega^2 / 2 already. Lagrange's equations by q are those of the arm with

    c_q^T M cddot + theta_q^T d(M R^2 thetadot)/dt,

in which R changes with time. The equation of motion by alpha, (38) of DOI
10.1109/ACCESS.2019.2918614, gets M R' (u . rddot - 2 R thetadot^2) on its left.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from models.arm.parameters import ArmParameters
from models.arm.reduced import COORDINATES, ReducedArm, solve_small, tip_turn
from models.arrays import Array
from models.errors import require
from models.truss import TrussParameters, inertia, ring_radius, total_mass

_OPEN = math.pi / 2


@dataclass(frozen=True)
class RingOnArm:
    """A ring on the straight arm, root clamped and elbow locked.

    Parameters
    ----------
    arm : ArmParameters
        `tip_mass` is that of the whole antenna, the ring included.
    truss : TrussParameters
    reaction_angle : float
        gamma, from the straight arm to the direction from the tip to the ring's centre [rad].
    turns : bool
        Whether the ring turns with the tip. If not, its mass acts as a particle at the tip, with
        the reaction of the ring in a fixed direction.

    Raises
    ------
    ModelError
        If the ring is heavier than the antenna, or the angle is no number.
    """

    arm: ArmParameters
    truss: TrussParameters
    reaction_angle: float = math.pi / 2
    turns: bool = True

    def __post_init__(self) -> None:
        require(
            math.isfinite(self.reaction_angle),
            f"RingOnArm: reaction angle is {self.reaction_angle}; give a finite number.",
        )
        ring, antenna = self.ring_mass, self.arm.tip_mass
        require(
            ring <= antenna,
            f"the ring has {ring:.5g} kg, more than the whole antenna's tip_mass of {antenna:g} "
            "kg; raise tip_mass to that or more, or make the ring lighter.",
        )

    @property
    def ring_mass(self) -> float:
        """M [kg], of bars and joints."""
        return float(total_mass(self.truss))

    @cached_property
    def carrier(self) -> ReducedArm:
        """The arm without the ring: what is left of the antenna is a particle at its tip."""
        rest = dataclasses.replace(self.arm, tip_mass=self.arm.tip_mass - self.ring_mass)
        return ReducedArm(rest, "B22", root_lock=0.0, elbow_lock=0.0)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the entries of q."""
        return self.carrier.coordinates

    # expressions

    def tip(self, q: Any) -> Any:
        """r, position of the tip (2, 1) [m]; the straight arm lies along the first axis."""
        return self.carrier.tip(q)

    def turn(self, q: Any) -> Any:
        """theta, turn of the tip, or of a ring that does not turn [rad]."""
        if not self.turns:
            return ca.SX(1, 1)
        p = self.carrier.embed(q)
        return p[COORDINATES.index("theta2")] + tip_turn(p[COORDINATES.index("psi2")])

    def centre(self, q: Any, alpha: Any) -> Any:
        """c, position of the ring's centre (2, 1) [m]."""
        return self.tip(q) + ring_radius(self.truss, alpha) * self._direction(q)

    def _direction(self, q: Any) -> Any:
        """Direction u from the tip to the centre (2, 1)."""
        angle = self.turn(q) + self.reaction_angle
        return ca.vertcat(ca.cos(angle), ca.sin(angle))

    def kinetic_energy(self, q: Any, v: Any, alpha: Any, omega: Any) -> Any:
        """Kinetic energy of arm and ring [J]."""
        known: Any = self._energies(q, v, alpha, omega)[0]
        return known

    def strain_energy(self, q: Any) -> Any:
        """Bending energy of the arm [J]."""
        return self.carrier.strain_energy(q)

    def mass_matrix(self, q: Any, alpha: Any) -> Any:
        """Mass matrix of q with the ring held at an angle, (4, 4) [kg, kg m, kg m^2]."""
        known: Any = self._energies(q, ca.DM.zeros(4), alpha, 0.0)[1]
        return known

    def residual_energy(self, q: Any, v: Any) -> Any:
        """Energy that is left in the arm and the ring that is open and stands still [J]."""
        return self.kinetic_energy(q, v, _OPEN, 0.0) + self.strain_energy(q)

    def response(self, q: Any, v: Any, alpha: Any, omega: Any, acc: Any) -> tuple[Any, Any]:
        """What arm and ring do to each other while the ring moves.

        Parameters
        ----------
        q, v : (4, 1)
            Coordinates of the arm and their rates.
        alpha, omega, acc : scalars
            Angle of the ring and its rates [rad, rad/s, rad/s^2].

        Returns
        -------
        acceleration : (4, 1) of q.
        torque : M R' (u . rddot - 2 R thetadot^2) [N m], by which the ropes have to do more:
            T1 f is that of a ring on a tip that is held, and this.
        """
        found: tuple[Any, Any] = self._response(q, v, alpha, omega, acc)
        return found

    # numbers

    def frequencies(self, alpha: float) -> Array:
        """Natural frequencies of the undeformed arm with the ring held at an angle [Hz], (4,)."""
        from scipy.linalg import eigh

        still = np.zeros(4)
        mass, stiffness = self.mass_matrix(still, alpha), self.carrier.linear(still)[1]
        squares = eigh(stiffness.full(), mass.full(), eigvals_only=True)
        return np.asarray(np.sqrt(squares) / (2 * math.pi))

    # compiled functions

    @cached_property
    def _energies(self) -> ca.Function:
        """`(q, v, alpha, omega) -> (kinetic energy, mass matrix)`."""
        q, v, alpha, omega, _ = self._symbols()
        c, turn, R = self.centre(q, alpha), self.turn(q), ring_radius(self.truss, alpha)
        M, slope = self.ring_mass, ca.jacobian(R, alpha)
        c_q, turn_q = ca.jacobian(c, q), ca.jacobian(turn, q)

        moved, turned = ca.jtimes(c, q, v) + ca.jtimes(c, alpha, omega), turn_q @ v
        of_the_hoop = M * (ca.sumsqr(moved) + (R * turned) ** 2) / 2
        opening = (inertia(self.truss, alpha) - M * slope**2) * omega**2 / 2
        kinetic = self.carrier.kinetic_energy(q, v) + of_the_hoop + opening
        mass = self.carrier.mass_matrix(q) + M * (c_q.T @ c_q + R**2 * turn_q.T @ turn_q)
        return ca.Function("energies", [q, v, alpha, omega], [kinetic, mass])

    @cached_property
    def _response(self) -> ca.Function:
        """`(q, v, alpha, omega, acc) -> (acceleration of q, torque)`."""
        q, v, alpha, omega, acc = self._symbols()
        c, turn, R = self.centre(q, alpha), self.turn(q), ring_radius(self.truss, alpha)
        M, R_dot = self.ring_mass, ca.jacobian(R, alpha) * omega
        c_q, turn_q = ca.jacobian(c, q), ca.jacobian(turn, q)

        def rate(expression: Any) -> Any:
            """Its time derivative where no rate of q changes."""
            by_ring = ca.jtimes(expression, alpha, omega) + ca.jtimes(expression, omega, acc)
            return ca.jtimes(expression, q, v) + by_ring

        # accelerations are by_q vdot + at_rest
        turned = turn_q @ v
        c_at_rest, turn_at_rest = rate(rate(c)), rate(turned)
        mass, force = self.carrier.mass_and_force(q, v, ca.DM.zeros(2))
        mass += M * (c_q.T @ c_q + R**2 * turn_q.T @ turn_q)
        force -= M * c_q.T @ c_at_rest
        force -= M * turn_q.T @ (R**2 * turn_at_rest + 2 * R * R_dot * turned)
        acceleration = ca.vertcat(*solve_small(mass, force))

        tip = self.tip(q)
        tip_acceleration = ca.jacobian(tip, q) @ acceleration + rate(ca.jtimes(tip, q, v))
        felt = ca.dot(self._direction(q), tip_acceleration) - 2 * R * turned**2
        torque = M * ca.jacobian(R, alpha) * felt
        inputs = [q, v, alpha, omega, acc]
        return ca.Function("ring_on_arm", inputs, [acceleration, torque], {"cse": True})

    def _symbols(self) -> tuple[Any, ...]:
        q, v = ca.SX.sym("q", 4), ca.SX.sym("v", 4)
        return q, v, *(ca.SX.sym(name) for name in ("alpha", "omega", "acc"))
