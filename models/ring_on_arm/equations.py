"""The ring as a thin hoop on the tip of the straight arm, root and elbow locked.

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

The root turns with the satellite, by theta0 [rad]. Where that is held, the equation by theta0 tells
the moment on the arm at the root. Where it is free, with an inertia H about the root [kg m^2], it
is an equation of motion whose first integral is that arm, ring and satellite keep no angular
momentum. So theta0' follows from the other rates, and q is measured in the satellite's frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from models.arm.parameters import ArmParameters
from models.arm.reduced import COORDINATES, ReducedArm, solve_small, tip_turn
from models.arrays import Array
from models.errors import require, require_positive
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
    satellite_inertia : float or None
        H of a satellite that is free to turn about the root [kg m^2]; None for one that is held.

    Raises
    ------
    ModelError
        If the ring is heavier than the antenna, the angle is no number, the inertia is not
        positive, or the ring does not turn with a tip that the satellite turns.
    """

    arm: ArmParameters
    truss: TrussParameters
    reaction_angle: float = math.pi / 2
    turns: bool = True
    satellite_inertia: float | None = None

    def __post_init__(self) -> None:
        if self.satellite_inertia is not None:
            require_positive("RingOnArm", satellite_inertia=self.satellite_inertia)
            require(
                self.turns,
                f"the satellite of {self.satellite_inertia:g} kg m^2 is free to turn, but the ring "
                "does not turn with the tip; let it turn, or leave satellite_inertia out.",
            )
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
        return replace(self._turned, root_lock=0.0)

    @cached_property
    def _turned(self) -> ReducedArm:
        """The same on a root that turns by theta0, its first coordinate."""
        rest = replace(self.arm, tip_mass=self.arm.tip_mass - self.ring_mass)
        return ReducedArm(rest, "B22", elbow_lock=0.0)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the entries of q."""
        return self.carrier.coordinates

    # expressions

    def tip(self, q: Any) -> Any:
        """r, position of the tip (2, 1) [m]; the straight arm lies along the first axis."""
        return self.carrier.tip(q)

    def turn(self, q: Any) -> Any:
        """theta, turn of the tip against the satellite, or of a ring that does not turn [rad]."""
        return self._turn(self.carrier, q)

    def _turn(self, arm: ReducedArm, q: Any) -> Any:
        if not self.turns:
            return ca.SX(1, 1)
        p = arm.embed(q)
        return p[COORDINATES.index("theta2")] + tip_turn(p[COORDINATES.index("psi2")])

    def kinetic_energy(self, q: Any, v: Any, alpha: Any, omega: Any) -> Any:
        """Kinetic energy of arm and ring, and of a satellite that is free [J]."""
        return self._energies(q, v, alpha, omega)[0]

    def strain_energy(self, q: Any) -> Any:
        """Bending energy of the arm [J]."""
        return self.carrier.strain_energy(q)

    def mass_matrix(self, q: Any, alpha: Any) -> Any:
        """Mass matrix of q with the ring held at an angle, (4, 4) [kg, kg m, kg m^2]."""
        return self._energies(q, ca.DM.zeros(4), alpha, 0.0)[1]

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
        acceleration, torque, _ = self._response(q, v, alpha, omega, acc)
        return acceleration, torque

    def root_moment(self, q: Any, v: Any, alpha: Any, omega: Any, acc: Any) -> Any:
        """Of the satellite on the arm about the root, rate of the angular momentum [N m]."""
        return self._response(q, v, alpha, omega, acc)[2]

    def angular_momentum(self, q: Any, v: Any, alpha: Any, omega: Any) -> Any:
        """Of arm and ring about the root, which is what they hand to the satellite [N m s]."""
        return self._energies(q, v, alpha, omega)[2]

    def satellite_rate(self, q: Any, v: Any, alpha: Any, omega: Any) -> Any:
        """theta0', at which the satellite turns [rad/s]."""
        if self.satellite_inertia is None:
            return ca.SX(1, 1)
        return -self.angular_momentum(q, v, alpha, omega) / self.satellite_inertia

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
    def _momenta(self) -> ca.Function:
        """`(x, y, alpha, omega) -> (kinetic energy, mass matrix, momentum by theta0)`, root turned.

        x = (theta0, q) and y its rates; energy and momentum are of arm and ring.
        """
        x, y, alpha, omega, _ = self._symbols(5)
        c, turn, R = self._centre(x, alpha), self._turn(self._turned, x), self._radius(alpha)
        M, slope = self.ring_mass, ca.jacobian(R, alpha)
        c_x, turn_x = ca.jacobian(c, x), ca.jacobian(turn, x)

        moved, turned = c_x @ y + ca.jacobian(c, alpha) * omega, turn_x @ y
        of_the_hoop = M * (ca.sumsqr(moved) + (R * turned) ** 2) / 2
        opening = (inertia(self.truss, alpha) - M * slope**2) * omega**2 / 2
        kinetic = self._turned.kinetic_energy(x, y) + of_the_hoop + opening
        mass = self._turned.mass_matrix(x) + M * (c_x.T @ c_x + R**2 * turn_x.T @ turn_x)
        outputs = [kinetic, mass, ca.jacobian(kinetic, y)[0]]
        return ca.Function("momenta", [x, y, alpha, omega], outputs)

    def _rate(self, q: Any, v: Any, alpha: Any, omega: Any) -> Any:
        """theta0' from no angular momentum of arm, ring and satellite."""
        if self.satellite_inertia is None:
            return ca.SX(1, 1)
        _, mass, handed = self._momenta(ca.vertcat(0, q), ca.vertcat(0, v), alpha, omega)
        return -handed / (self.satellite_inertia + mass[0, 0])

    @cached_property
    def _energies(self) -> ca.Function:
        """`(q, v, alpha, omega) -> (kinetic energy, mass matrix, momentum handed on)`."""
        q, v, alpha, omega, _ = self._symbols(4)
        rate, H = self._rate(q, v, alpha, omega), self.satellite_inertia
        state = ca.vertcat(0, q), ca.vertcat(rate, v), alpha, omega
        kinetic, mass, handed = self._momenta(*state)
        own = mass[1:, 1:]
        if H is not None:
            kinetic += H * rate**2 / 2
            own -= mass[1:, 0] @ mass[0, 1:] / (H + mass[0, 0])
        return ca.Function("energies", [q, v, alpha, omega], [kinetic, own, handed])

    @cached_property
    def _response(self) -> ca.Function:
        """`(q, v, alpha, omega, acc) -> (acceleration of q, torque, moment at the root)`."""
        q, v, alpha, omega, acc = self._symbols(4)
        H = self.satellite_inertia
        state = ca.vertcat(0, q), ca.vertcat(self._rate(q, v, alpha, omega), v), alpha, omega, acc
        mass, force, by_x, at_rest = self._balance(*state)

        # the root's row: theta0'' from what the others have, or none
        row, own, on_q = mass[0, 1:], mass[1:, 1:], force[1:]
        if H is not None:
            whole = H + mass[0, 0]
            own, on_q = own - row.T @ row / whole, on_q - row.T * force[0] / whole
        acceleration = ca.vertcat(*solve_small(own, on_q))
        needed = row @ acceleration - force[0]  # to keep the root from turning
        spin = ca.SX(1, 1) if H is None else -needed / whole
        moment = needed + mass[0, 0] * spin

        torque = by_x @ ca.vertcat(spin, acceleration) + at_rest
        inputs = [q, v, alpha, omega, acc]
        outputs = [acceleration, torque, moment]
        return ca.Function("ring_on_arm", inputs, outputs, {"cse": True})

    @cached_property
    def _balance(self) -> ca.Function:
        """`(x, y, alpha, omega, acc)` to the equations of motion on a root that turns.

        Outputs are mass matrix and force of x, and of the ropes' torque what it has for each
        acceleration of x (1, 5), and where there is none.
        """
        x, y, alpha, omega, acc = self._symbols(5)
        c, turn, R = self._centre(x, alpha), self._turn(self._turned, x), self._radius(alpha)
        M, R_dot = self.ring_mass, ca.jacobian(R, alpha) * omega
        c_x, turn_x = ca.jacobian(c, x), ca.jacobian(turn, x)

        def rate(expression: Any) -> Any:
            """Its time derivative where no rate of x changes."""
            by_ring = ca.jtimes(expression, alpha, omega) + ca.jtimes(expression, omega, acc)
            return ca.jtimes(expression, x, y) + by_ring

        # accelerations are by_x ydot + at_rest
        turned = turn_x @ y
        c_at_rest, turn_at_rest = rate(rate(c)), rate(turned)
        mass, force = self._turned.mass_and_force(x, y, ca.DM.zeros(2))
        mass += M * (c_x.T @ c_x + R**2 * turn_x.T @ turn_x)
        force -= M * c_x.T @ c_at_rest
        force -= M * turn_x.T @ (R**2 * turn_at_rest + 2 * R * R_dot * turned)

        tip, u = self._turned.tip(x), self._direction(x)
        pull = M * ca.jacobian(R, alpha)
        by_x = pull * u.T @ ca.jacobian(tip, x)
        at_rest = pull * (ca.dot(u, rate(ca.jtimes(tip, x, y))) - 2 * R * turned**2)
        return ca.Function("balance", [x, y, alpha, omega, acc], [mass, force, by_x, at_rest])

    def _radius(self, alpha: Any) -> Any:
        return ring_radius(self.truss, alpha)

    def _centre(self, x: Any, alpha: Any) -> Any:
        """c, position of the ring's centre (2, 1) [m]."""
        return self._turned.tip(x) + self._radius(alpha) * self._direction(x)

    def _direction(self, x: Any) -> Any:
        """Direction u from the tip to the centre (2, 1)."""
        angle = self._turn(self._turned, x) + self.reaction_angle
        return ca.vertcat(ca.cos(angle), ca.sin(angle))

    def _symbols(self, size: int) -> tuple[Any, ...]:
        q, v = ca.SX.sym("q", size), ca.SX.sym("v", size)
        return q, v, *(ca.SX.sym(name) for name in ("alpha", "omega", "acc"))
