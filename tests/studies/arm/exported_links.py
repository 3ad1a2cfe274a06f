"""An exported motion of the arm, replayed by SciPy on equations that are written anew.

The columns are interpolated as the export's head says, and drive an ANCF model of its own.

Symbols: e node coordinates of both links (x, y and the slope of each node); z coordinates that the
joints leave, e = E(z, s); s angle of a joint that is locked or driven [rad]; M mass matrix of e.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from models.arm.parameters import ArmParameters
from ocp.arrays import Array

ELEMENTS = 8  # of a link, as the command has it
NODES = ELEMENTS + 1
TOLERANCES = (3e-6, 3e-8)  # relative and absolute, of SciPy's Radau method
POSES = {"big": ((0.0, np.pi), (np.pi / 2, np.pi)), "small": ((np.pi / 2, np.pi), (np.pi / 2, 0.0))}


def left_by(columns: Mapping[str, Array], stage: str, drive: str) -> float:
    """Energy [J] after the lock that exported columns leave, under a torque or on an angle."""
    start, _ = POSES[stage]
    joint = 0 if stage == "big" else 1
    name = ("root", "elbow")[joint]
    curve = CubicSpline(columns["time"], columns[f"{name}_{drive}"], bc_type="clamped")
    driven = drive == "angle"

    model = Links(ArmParameters(), held=(joint != 0 or driven, joint != 1 or driven))
    fixed = np.array(start)

    def given(t: float) -> Array:
        """Angles of both joints with two derivatives, (3, 2), and the torque below, (4, 2)."""
        rows = np.zeros((4, 2))
        rows[0] = fixed
        if driven:
            rows[:3, joint] = [float(curve(t, order)) for order in range(3)]
        else:
            rows[3, joint] = float(curve(t))
        return rows

    z, v = model.moved(given, float(columns["time"][-1]), fixed)
    return model.left_after_lock(z, v, given(float(columns["time"][-1])), fixed)


@dataclass(frozen=True, eq=False)
class Links:
    """Two links of ANCF elements, hinged end to end at the origin.

    Attributes
    ----------
    arm : its sections and masses, undamped.
    held : whether root and elbow are on an angle, locked or driven; else they turn freely.
    """

    arm: ArmParameters
    held: tuple[bool, bool]

    @cached_property
    def mass(self) -> Array:
        """M (8 n, 8 n) with n nodes a link."""
        whole = np.zeros((8 * NODES, 8 * NODES))
        for link, beam in enumerate((self.arm.big, self.arm.small)):
            length = beam.length / ELEMENTS
            points, weights = _gauss(4)
            element = np.zeros((8, 8))
            for x, weight in zip(points, weights, strict=True):
                row = np.kron(_hermite(x, length, 0), np.eye(2))
                element += weight * length * beam.linear_density * row.T @ row
            for k in range(ELEMENTS):
                at = 4 * (link * NODES + k)
                whole[at : at + 8, at : at + 8] += element
        tip = 4 * (2 * NODES - 1)
        whole[tip : tip + 2, tip : tip + 2] += self.arm.tip_mass * np.eye(2)
        return whole

    def _places(self, z: Any, s: Any) -> Any:
        """E(z, s), (8 n, 1)."""
        used = 0

        def take(count: int) -> Any:
            nonlocal used
            used += count
            return z[used - count : used]

        def slope(held: bool, s: Any, along: Any) -> Any:
            if not held:
                return take(2)
            # on an angle only the length of the slope is free
            turn = ca.vertcat(ca.horzcat(ca.cos(s), -ca.sin(s)), ca.horzcat(ca.sin(s), ca.cos(s)))
            return take(1) * (turn @ along)

        parts = [ca.SX.zeros(2), slope(self.held[0], s[0], ca.DM([1.0, 0.0])), take(4 * ELEMENTS)]
        end = parts[-1][-4:]
        parts += [end[:2], slope(self.held[1], s[1], end[2:] / ca.norm_2(end[2:]))]
        parts.append(take(4 * ELEMENTS))
        return ca.vertcat(*parts)

    @property
    def size(self) -> int:
        """Length of z."""
        return 8 * ELEMENTS + sum(1 if held else 2 for held in self.held)

    def _strain(self, e: Any) -> Any:
        """Strain energy [J] of axial strain (r'^2 - 1)/2 and curvature |r''|."""
        energy = 0.0
        for link, beam in enumerate((self.arm.big, self.arm.small)):
            length = beam.length / ELEMENTS
            for k in range(ELEMENTS):
                at = 4 * (link * NODES + k)
                own = e[at : at + 8]
                for order, count in ((1, 5), (2, 2)):
                    for x, weight in zip(*_gauss(count), strict=True):
                        r = np.kron(_hermite(x, length, order), np.eye(2)) @ own
                        square = ca.dot(r, r)
                        if order == 1:
                            term = beam.axial_stiffness * ((square - 1.0) / 2.0) ** 2
                        else:
                            term = beam.bending_stiffness * square
                        energy += 0.5 * weight * length * term
        return energy

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """`(z, v, given) -> mass, force, its slopes`, `(z, s) -> e, E_z, U`, and rates of e."""
        z, v, s = ca.SX.sym("z", self.size), ca.SX.sym("v", self.size), ca.SX.sym("s", 2)
        turn, spin, torque = (ca.SX.sym(name, 2) for name in ("turn", "spin", "torque"))
        e, M = self._places(z, s), ca.DM(self.mass)
        tangent = ca.jacobian(e, z)
        rate = ca.jtimes(e, z, v) + ca.jtimes(e, s, turn)
        bias = ca.jtimes(rate, z, v) + ca.jtimes(rate, s, turn) + ca.jtimes(e, s, spin)

        load = self._load(e)
        for joint, (onto, back) in enumerate(((2, None), (4 * NODES + 2, 4 * NODES - 2))):
            for at, sign in ((onto, 1.0), (back, -1.0)):
                if at is not None:
                    x, y = e[at], e[at + 1]
                    push = sign * torque[joint] / (x**2 + y**2)
                    load[at] += -push * y
                    load[at + 1] += push * x
        force = tangent.T @ (load - M @ bias)
        mass = tangent.T @ M @ tangent
        terms = ca.Function(
            "terms", [z, v, s, turn, spin, torque], [mass, force, ca.jacobian(force, z)]
        )
        shape = ca.Function("shape", [z, s], [e, tangent, self._strain(e)])
        rates = ca.Function("rates", [z, v, s, turn], [rate])
        return terms, shape, rates

    def _load(self, e: Any) -> Any:
        """Minus the gradient of the strain energy by e."""
        x = ca.SX.sym("e", e.numel())
        gradient = ca.Function("load", [x], [-ca.gradient(self._strain(x), x)])
        return gradient(e)

    def straight(self, angles: Array) -> Array:
        """Z of unbent links at joint angles (2,)."""
        values: list[float] = []
        place, heading = np.zeros(2), 0.0
        for link, beam in enumerate((self.arm.big, self.arm.small)):
            heading += float(angles[link])
            along = np.array([np.cos(heading), np.sin(heading)])
            values += [1.0] if self.held[link] else along.tolist()
            for k in range(1, NODES):
                values += [*(place + k / ELEMENTS * beam.length * along), *along]
            place = place + beam.length * along
        return np.array(values)

    def moved(
        self, given: Callable[[float], Array], end: float, start: Array
    ) -> tuple[Array, Array]:
        """Z and its rates at the end of a motion from rest at joint angles (2,)."""
        terms, _, _ = self._functions
        n = self.size

        def parts(t: float, y: Array) -> list[Array]:
            return [x.full() for x in terms(y[:n], y[n:], *given(t))]

        def rate(t: float, y: Array) -> Array:
            mass, force, _ = parts(t, y)
            return np.concatenate([y[n:], np.linalg.solve(mass, force[:, 0])])

        def slopes(t: float, y: Array) -> Array:
            # what the velocities change is slow beside the links' stiffness, and left out
            mass, _, stiffness = parts(t, y)
            jacobian = np.zeros((2 * n, 2 * n))
            jacobian[:n, n:] = np.eye(n)
            jacobian[n:, :n] = np.linalg.solve(mass, stiffness)
            return jacobian

        first = np.concatenate([self.straight(start), np.zeros(n)])
        relative, absolute = TOLERANCES
        done = solve_ivp(rate, (0.0, end), first, "Radau", jac=slopes, rtol=relative, atol=absolute)
        if not done.success:
            raise RuntimeError(done.message)
        return done.y[:n, -1], done.y[n:, -1]

    def left_after_lock(self, z: Array, v: Array, given: Array, start: Array) -> float:
        """Kinetic and strain energy [J] right after both joints lock at the angles reached."""
        _, shape, rates = self._functions
        e = shape(z, given[0])[0].full()[:, 0]
        speed = rates(z, v, given[0], given[1]).full()[:, 0]

        # the same arm with both joints held: the lock keeps its momentum on what is left to move
        slopes = [e[at : at + 2] for at in (2, 4 * NODES - 2, 4 * NODES + 2)]
        headings = [np.arctan2(*slope[::-1]) for slope in slopes]
        angles = np.array([headings[0], headings[2] - headings[1]])
        locked = Links(self.arm, (True, True))
        inner = e[4 : 4 * NODES], e[4 * (NODES + 1) :]
        lengths = [np.hypot(*slopes[0]), np.hypot(*slopes[2])]
        z = np.concatenate([lengths[:1], inner[0], lengths[1:], inner[1]])

        place, tangent, strain = (x.full() for x in locked._functions[1](z, angles))
        assert np.allclose(place[:, 0], e, atol=1e-9)
        mass = tangent.T @ self.mass @ tangent
        after = tangent @ np.linalg.solve(mass, tangent.T @ self.mass @ speed)
        return float(0.5 * after @ self.mass @ after + strain[0, 0])


def _gauss(count: int) -> tuple[Array, Array]:
    """Points and weights on the unit interval."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return (1.0 + points) / 2.0, weights / 2.0


def _hermite(x: float, length: float, order: int) -> Array:
    """Cubic shape functions of an element at a share x of it, (1, 4), or their derivatives."""
    cubics = ([2, -3, 0, 1], [1, -2, 1, 0], [-2, 3, 0, 0], [1, -1, 0, 0])
    row = [np.polyval(np.polyder(np.array(c, float), order), x) for c in cubics]
    sizes = np.array([1.0, length, 1.0, length]) / length**order
    return np.array([row]) * sizes
