"""The ring on the clamped, locked arm a second time, by virtual work, in NumPy alone.

Derived without a look at the models, so that they can be checked. No kinetic energy and no mass
matrix is written down here.

- The place of each particle of links, tip and hoop is a function of the coordinates and of the
  ring's angle. Along a motion it is a Taylor polynomial of time: place, velocity and acceleration
  follow by the rules of products and chains.
- A virtual displacement is a complex step in one coordinate.
- d'Alembert: mass times acceleration times virtual displacement, summed over all particles, plus
  the gradient of the bending energy is the force that is applied, or zero.

A link is a cubic between two nodes, of which the second moves along the link by the foreshortening.
Gauss points integrate the products of its velocities without an error. Points of equal mass on a
circle have the moment of inertia of a thin hoop.

Symbols: delta [m], psi [-] transverse displacement and slope of a link's end in its own frame;
R [m] radius of the ring and distance of its centre from the tip; alpha [rad] the ring's angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of real or, for virtual displacements, complex numbers

COMPLEX_STEP = 1e-30  # a derivative by a complex step knows no cancellation
LINK_POINTS = 5  # Gauss points, exact for the square of a cubic
HOOP_POINTS = 7


@dataclass(frozen=True)
class Beam:
    """A link: length [m], mass over length [kg/m], bending stiffness [N m^2]."""

    length: float
    density: float
    bending: float


@dataclass(frozen=True)
class Antenna:
    """Arm and ring.

    Masses [kg] of the elbow, of what does not move at the tip, and of the hoop; the angle [rad]
    from the tip's tangent to the ring's centre; half cross-bar over sin(pi/n) [m]; eta [s], the
    damping over the stiffness.
    """

    big: Beam
    small: Beam
    elbow: float
    rest: float
    hoop: float
    towards: float
    open_radius: float
    eta: float = 0.0


class Jet:
    """A number, or an array of them, and its first two rates of time."""

    __array_ufunc__ = None  # an array times a jet is a jet of arrays

    def __init__(self, value: Any, rate: Any = 0.0, second: Any = 0.0) -> None:
        self.value, self.rate, self.second = value, rate, second

    def __add__(self, other: Any) -> Jet:
        o = _jet(other)
        return Jet(self.value + o.value, self.rate + o.rate, self.second + o.second)

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.rate, -self.second)

    def __sub__(self, other: Any) -> Jet:
        return self + (-_jet(other))

    def __rsub__(self, other: Any) -> Jet:
        return _jet(other) - self

    def __mul__(self, other: Any) -> Jet:
        o = _jet(other)
        return Jet(
            self.value * o.value,
            self.rate * o.value + self.value * o.rate,
            self.second * o.value + 2 * self.rate * o.rate + self.value * o.second,
        )

    __rmul__ = __mul__

    def _of(self, value: Any, first: Any, second: Any) -> Jet:
        return Jet(value, first * self.rate, second * self.rate**2 + first * self.second)

    def sin(self) -> Jet:
        """Sine."""
        s, c = np.sin(self.value), np.cos(self.value)
        return self._of(s, c, -s)

    def cos(self) -> Jet:
        """Cosine."""
        s, c = np.sin(self.value), np.cos(self.value)
        return self._of(c, -s, -c)

    def arctan(self) -> Jet:
        """Arc tangent."""
        x = self.value
        return self._of(np.arctan(x), 1 / (1 + x * x), -2 * x / (1 + x * x) ** 2)

    def inverse(self) -> Jet:
        """One over it."""
        x = self.value
        return self._of(1 / x, -1 / x**2, 2 / x**3)


Point = tuple[Jet, Jet]


def tip(antenna: Antenna, q: Sequence[float]) -> Array:
    """Place of the tip [m], along the straight arm and across it."""
    at, _ = _tip([Jet(value) for value in q], antenna, Jet(0.0))
    return np.array([at[0].value, at[1].value])


def energies(
    antenna: Antenna, q: Array, rate: Array, alpha: float, omega: float
) -> tuple[float, float]:
    """Kinetic energy of all particles, and bending energy [J]."""
    kinetic = 0.0
    for mass, at in _particles(antenna, _jets(q, rate), Jet(alpha, omega)):
        kinetic += float(np.sum(mass * (at[0].rate ** 2 + at[1].rate ** 2))) / 2
    return kinetic, float(q @ stiffness(antenna) @ q) / 2


def stiffness(antenna: Antenna) -> Array:
    """Second derivatives of the integral of EI v''^2/2, by Gauss points."""
    matrix = np.zeros((4, 4))
    for first, beam in ((0, antenna.big), (2, antenna.small)):
        block = slice(first, first + 2)
        s, weights = _gauss(beam.length)
        bend = np.array([6 - 12 * s / beam.length, 6 * s - 2 * beam.length]) / beam.length**2
        matrix[block, block] = beam.bending * (bend * weights) @ bend.T
    return matrix


def response(
    antenna: Antenna, q: Array, rate: Array, alpha: float, omega: float, acc: float
) -> tuple[Array, float, Array]:
    """Accelerations of the coordinates, what the arm adds to the torque on alpha, mass matrix.

    The last is the response of the generalised forces to accelerations of the coordinates.
    """
    ring = Jet(alpha, omega, acc)
    displaced = _displacements(antenna, q, alpha)
    bending = np.concatenate([stiffness(antenna) @ (q + antenna.eta * rate), [0.0, 0.0]])

    def forces(second: Array) -> Array:
        moving = _particles(antenna, _jets(q, rate, second), ring)
        return _inertia_forces(moving, displaced) + bending

    base = forces(np.zeros(4))
    columns = np.column_stack([forces(unit) - base for unit in np.eye(4)])
    second = np.linalg.solve(columns[:4], -base[:4])

    # What remains of the ring's inertia on an arm that stands still belongs to the ring alone.
    still = np.zeros(4)
    held = _particles(antenna, _jets(still, still), ring)
    own = _inertia_forces(held, _displacements(antenna, still, alpha))[4]
    return second, float(base[4] + columns[4] @ second - own), columns[:4]


def momentum(antenna: Antenna, q: Array, rate: Array, ring: Jet, base: Jet) -> float:
    """Angular momentum about the root [N m s] of all particles, on a root that turns as `base`."""
    moving = _particles(antenna, _jets(q, rate), ring, base)
    return sum(
        float(np.sum(mass * (at[0].value * at[1].rate - at[1].value * at[0].rate)))
        for mass, at in moving
    )


@dataclass(frozen=True)
class Free:
    """On a satellite that is free to turn and was at rest.

    Accelerations of the coordinates, seen from the satellite; what the arm adds to the torque on
    alpha [N m]; moment [N m] of the satellite on the arm; rate [rad/s] of the satellite.
    """

    second: Array
    torque: float
    moment: float
    rate: float


def free_response(
    antenna: Antenna,
    satellite: float,
    q: Array,
    rate: Array,
    alpha: float,
    omega: float,
    acc: float,
) -> Free:
    """The same with the angle of a satellite of this inertia [kg m^2] as a fifth coordinate."""
    ring = Jet(alpha, omega, acc)
    handed = momentum(antenna, q, rate, ring, Jet(0.0))
    inertia = momentum(antenna, q, rate, ring, Jet(0.0, 1.0)) - handed
    turning = -handed / (inertia + satellite)

    displaced = _displacements(antenna, q, alpha)
    bending = np.concatenate([stiffness(antenna) @ (q + antenna.eta * rate), [0.0, 0.0]])

    def forces(second: Array) -> Array:
        base = Jet(0.0, turning, second[4])
        moving = _particles(antenna, _jets(q, rate, second[:4]), ring, base)
        return _inertia_forces(moving, displaced) + bending

    still = forces(np.zeros(5))
    columns = np.column_stack([forces(unit) - still for unit in np.eye(5)])
    # the particles' moment about the root turns the satellite the other way
    moving = np.array([0, 1, 2, 3, 5])
    matrix = columns[moving].copy()
    matrix[4, 4] += satellite
    second = np.linalg.solve(matrix, -still[moving])

    zero = np.zeros(4)
    held = _particles(antenna, _jets(zero, zero), ring)
    own = _inertia_forces(held, _displacements(antenna, zero, alpha))[4]
    torque = float(still[4] + columns[4] @ second - own)
    return Free(second[:4], torque, -satellite * float(second[4]), turning)


def _displacements(antenna: Antenna, q: Array, alpha: float) -> list[list[tuple[Array, Array]]]:
    """Virtual displacements of all particles by each coordinate, alpha, and a turn of the root."""
    now = np.append(q, [alpha, 0.0])
    by_coordinate = []
    for step in 1j * COMPLEX_STEP * np.eye(6):
        there = [Jet(value) for value in now + step]
        moved = [point for _, point in _particles(antenna, there[:4], *there[4:])]
        by_coordinate.append(
            [tuple(np.imag(jet.value) / COMPLEX_STEP for jet in point) for point in moved]
        )
    return by_coordinate


def _inertia_forces(
    moving: list[tuple[Any, Point]], displaced: list[list[tuple[Array, Array]]]
) -> Array:
    """Sum of mass times acceleration times virtual displacement, by each coordinate."""
    return np.array(
        [
            sum(
                np.sum(mass * (at[0].second * by[0] + at[1].second * by[1]))
                for (mass, at), by in zip(moving, displacement, strict=True)
            )
            for displacement in displaced
        ]
    )


def _particles(
    antenna: Antenna, q: Sequence[Jet], alpha: Jet, base: Jet | None = None
) -> list[tuple[Any, Point]]:
    """Masses and places of all particles, those of a link or of the hoop as arrays.

    The root is turned by `base` [rad]; not at all if nothing is given.
    """
    delta1, psi1, delta2, psi2 = q
    big, small = antenna.big, antenna.small
    root, straight = (Jet(0.0), Jet(0.0)), base or Jet(0.0)
    elbow = _on_link(big, delta1, psi1, root, straight, big.length)
    bend = straight + _turn(psi1)

    s1, weights1 = _gauss(big.length)
    s2, weights2 = _gauss(small.length)
    end, turned = _tip(q, antenna, straight)

    # The hoop turns with the tip; each of its points moves outwards as it opens.
    radius = antenna.open_radius * alpha.sin()
    centre = _beside(end, radius, turned + antenna.towards)
    around = 2 * np.pi * np.arange(HOOP_POINTS) / HOOP_POINTS
    shares = np.full(HOOP_POINTS, antenna.hoop / HOOP_POINTS)
    return [
        (big.density * weights1, _on_link(big, delta1, psi1, root, straight, s1)),
        (antenna.elbow, elbow),
        (small.density * weights2, _on_link(small, delta2, psi2, elbow, bend, s2)),
        (antenna.rest, end),
        (shares, _beside(centre, radius, turned + around)),
    ]


def _tip(q: Sequence[Jet], antenna: Antenna, straight: Jet) -> tuple[Point, Jet]:
    """Place and turn of the tip."""
    delta1, psi1, delta2, psi2 = q
    root = (Jet(0.0), Jet(0.0))
    elbow = _on_link(antenna.big, delta1, psi1, root, straight, antenna.big.length)
    bend = straight + _turn(psi1)
    end = _on_link(antenna.small, delta2, psi2, elbow, bend, antenna.small.length)
    return end, bend + _turn(psi2)


def _on_link(beam: Beam, delta: Jet, psi: Jet, start: Point, angle: Jet, s: Any) -> Point:
    """Place of the material points s [m] of a link."""
    length, x = beam.length, s / beam.length
    a = 6 / length**2 * delta - 2 / length * psi
    b = 3 / length**2 * psi - 6 / length**3 * delta
    shortening = 0.5 * (length**3 / 3 * a * a + length**4 / 2 * a * b + length**5 / 5 * b * b)

    # the node at the start has the slope (1, 0), that at the end (1 - psi^2/2, psi)
    end, slope = 3 * x**2 - 2 * x**3, length * (x**3 - x**2)
    along = length * (x - 2 * x**2 + x**3) + end * (length - shortening)
    along = along + slope * (1 - 0.5 * psi * psi)
    across = end * delta + slope * psi
    cosine, sine = angle.cos(), angle.sin()
    return start[0] + cosine * along - sine * across, start[1] + sine * along + cosine * across


def _turn(psi: Jet) -> Jet:
    """Angle [rad] of the slope (1 - psi^2/2, psi)."""
    return (psi * (1 - 0.5 * psi * psi).inverse()).arctan()


def _beside(point: Point, distance: Jet, angle: Jet) -> Point:
    return point[0] + distance * angle.cos(), point[1] + distance * angle.sin()


def _gauss(length: float) -> tuple[Array, Array]:
    """Points and weights [m] of a link."""
    points, weights = np.polynomial.legendre.leggauss(LINK_POINTS)
    return length * (points + 1) / 2, length * weights / 2


def _jet(number: Any) -> Jet:
    return number if isinstance(number, Jet) else Jet(number)


def _jets(q: Array, rate: Array, second: Array | None = None) -> list[Jet]:
    seconds = np.zeros(4) if second is None else second
    return [Jet(*numbers) for numbers in zip(q, rate, seconds, strict=True)]
