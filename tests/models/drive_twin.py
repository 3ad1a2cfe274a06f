"""The drive of the ring truss with the rotors of its motors, in NumPy alone.

Derived from energy and virtual work, and not from the models, so that they can be checked.

- Kinetic energy: every rod and joint of the closed ring once, by the velocities of its ends, which
  follow from the place of each node. The derivatives of energies are complex steps.
- Rope: 4 n segments in a row. A pulley between two of them lets the tension fall by exp(-mu times
  the wrap). The ropes' generalised force is the virtual work of all tensions, and the loss at a
  pulley is the drop of the tension times the rope that runs over it.
- Drive: each of the two ropes has a motor with a gear and a drum. A motor turns by g s/r. Its gear
  loses a part of the power that goes to the rope.

Symbols: alpha [rad] deployment angle; e [m] slider-to-end distance; s [m] rope wound in, of one
rope; T1 [N] pull of the drum on one rope; r [m] drum, g [-] gear, eta [-] efficiency of the gear;
I [kg m^2] rotor of one motor, m = I (g/r)^2 [kg] its mass as the rope feels it. A prime is a
derivative by alpha. Angles, rates and accelerations are numbers or arrays of one shape.

The rope runs towards the motor: rates are not negative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]  # of real or, for derivatives, complex numbers

COMPLEX_STEP = 1e-30  # a derivative by a complex step knows no cancellation


@dataclass(frozen=True, eq=False)
class Drive:
    """Motor, gear and drum of one rope: r [m], g [-], I [kg m^2] of one motor, eta [-]."""

    drum_radius: float = 0.02
    gear: float = 1.0
    motor_inertia: float = 0.0
    efficiency: float = 1.0

    @property
    def rope_mass(self) -> float:
        """m [kg]: the rotor's energy is 1/2 I (g v/r)^2 = 1/2 m v^2 at the speed v of the rope."""
        return self.motor_inertia * (self.gear / self.drum_radius) ** 2


def derivative(function: Any, at: Array) -> Array:
    """Derivative of an analytic function at real numbers."""
    return np.imag(function(at + 1j * COMPLEX_STEP)) / COMPLEX_STEP


# --- the truss ------------------------------------------------------------------------------------


def slider(p: Any, alpha: Array) -> tuple[Array, Array, Array]:
    """(e [m], e' [m/rad], phi' [-]): d sin(phi) = c sin(alpha), phi between link and bar."""
    sine = p.crank * np.sin(alpha) / p.link
    cosine = np.sqrt(1 - sine**2)
    turn = p.crank * np.cos(alpha) / (p.link * cosine)
    e = p.crank * np.cos(alpha) + p.link * cosine
    return e, -p.crank * np.sin(alpha) - p.link * sine * turn, turn


def inertia(p: Any, alpha: ArrayLike) -> Array:
    """J [kg m^2]: twice the kinetic energy of the ring at a rate of 1 rad/s, without rotors."""
    alpha = np.asarray(alpha)[..., None]  # the last axis is the module
    n, b, c = p.modules, p.half_cross_bar, p.crank
    sin, cos, e1 = np.sin(alpha), np.cos(alpha), slider(p, alpha)[1]

    # The bars stand on a circle, whose radius grows; that of module 1 stays where it is.
    corner = np.exp(2j * np.pi * np.arange(n + 1) / n)
    bar_x, bar_y = (
        b * cos / np.sin(np.pi / n) * (part - part[0]) for part in (corner.real, corner.imag)
    )
    along = (corner[1:] - corner[:-1]) / (2 * np.sin(np.pi / n))  # direction of each face

    def velocity(side: int, x: Array, z: Array) -> tuple[Array, Array, Array]:
        """Velocity at 1 rad/s of a point in each face, from its left (0) or its right bar (1)."""
        bars = slice(side, n + side)
        return bar_x[..., bars] + x * along.real, bar_y[..., bars] + x * along.imag, z + 0 * x

    def product(one: tuple[Array, ...], other: tuple[Array, ...]) -> Array:
        return sum(u * v for u, v in zip(one, other, strict=True))

    def rods(one: tuple[Array, ...], other: tuple[Array, ...], length: float) -> Array:
        """Twice the energy of a rod in each face with these velocities of its ends."""
        mass = p.linear_density * length
        return mass / 3 * (product(one, one) + product(one, other) + product(other, other))

    def points(one: tuple[Array, ...], mass: float) -> Array:
        return mass * product(one, one)

    # what two modules share, twice if it is counted as the paper prints it
    masses, rest = p.joint_masses, np.zeros_like(sin)
    shared = 2 if p.counting == "as printed" else 1
    bar = velocity(0, rest, rest)
    total = shared * (rods(bar, bar, p.bar_length) + 2 * points(bar, masses.bar_end))
    total = total + shared * 2 * points(velocity(0, rest, -e1), masses.slider)

    # upper half of a module; the lower one is its mirror image
    middle = velocity(0, b * cos, b * sin)
    total = total + 2 * points(middle, masses.middle)
    for side, outwards in ((0, 1), (1, -1)):
        end = velocity(side, rest, rest)
        crank = velocity(side, outwards * c * cos, c * sin)
        total = total + 2 * rods(end, middle, b)
        total = total + 2 * rods(crank, velocity(side, rest, -e1), p.link)
        total = total + 2 * points(crank, masses.crank)
    return total.sum(axis=-1)


def spring_energy(p: Any, alpha: Array) -> Array:
    """Energy [J] of two springs a module between slider and bar end."""
    return p.modules * p.spring_stiffness * (p.spring_free_length - slider(p, alpha)[0]) ** 2


def net_energy(p: Any, alpha: Array) -> Array:
    """Energy [J] of two springs a module that are longer by what the radius grows behind alpha_c.

    It has no step in its first derivative, and one in its second.
    """
    growth = p.half_cross_bar / np.sin(np.pi / p.modules) * (np.sin(alpha) - np.sin(p.net_angle))
    return np.where(np.real(alpha) > p.net_angle, p.modules * p.net_stiffness * growth**2, 0.0)


def damping(p: Any, alpha: Array) -> tuple[Array, Array]:
    """D [N m s/rad] of the joints and of the sliders: power lost at 1 rad/s.

    A module has four joints each that turn by alpha (cross-bar on bar), by phi (link on slider) and
    by both (link on crank), two that turn by 2 alpha (middles), and two sliders.
    """
    _, e1, turn = slider(p, alpha)
    joints = 4 + 4 * turn**2 + 4 * (1 + turn) ** 2 + 2 * 2**2
    return p.modules * p.joint_friction * joints, 2 * p.modules * p.slider_friction * e1**2


# --- the ropes ------------------------------------------------------------------------------------


def wound(p: Any, alpha: Array) -> Array:
    """s' [m/rad]: the segments between slider and bar end, two of four, become shorter."""
    return -2 * p.modules * slider(p, alpha)[1]


def segments(p: Any, alpha: Array) -> tuple[Array, Array]:
    """Tension over T1 and shortening [m/rad] of the 4 n segments of one rope, on the last axis.

    From the motor's slider the rope runs along the bar to its end, over both halves of the
    cross-bar to the next end, and along that bar to the next slider, where it turns back.
    """
    alpha = np.asarray(alpha)[..., None]
    wraps = [np.pi - alpha, np.pi - 2 * alpha, np.pi - alpha, np.pi + 0 * alpha]
    turned = np.cumsum(np.concatenate(p.modules * wraps, axis=-1), axis=-1)
    before = np.concatenate([0 * alpha, turned[..., :-1]], axis=-1)
    shortening = -slider(p, alpha)[1] * np.tile([1.0, 0.0, 0.0, 1.0], p.modules)
    return np.exp(-p.pulley_friction * before), shortening


def leverage(p: Any, alpha: Array) -> Array:
    """f [m]: virtual work of both ropes at T1 = 1 N."""
    tension, shortening = segments(p, alpha)
    return 2 * np.sum(tension * shortening, axis=-1)


def pulley_losses(p: Any, alpha: Array) -> Array:
    """Power [W] that all pulleys of both ropes lose at T1 = 1 N and 1 rad/s.

    What runs over a pulley is what all segments behind it become shorter.
    """
    tension, shortening = segments(p, alpha)
    behind = np.cumsum(shortening[..., ::-1], axis=-1)[..., ::-1]
    return 2 * np.sum(-np.diff(tension, axis=-1) * behind[..., 1:], axis=-1)


# --- forces, torque and power ---------------------------------------------------------------------


def loads(p: Any, alpha: Array, rate: Array, acceleration: Array) -> dict[str, Array]:
    """Generalised forces [N m] that resist the motion, by what makes them."""
    joints, sliders = damping(p, alpha)
    slope = derivative(lambda at: inertia(p, at), alpha)
    return {
        "inertia": inertia(p, alpha) * acceleration + slope * rate**2 / 2,
        "joints": joints * rate,
        "sliders": sliders * rate,
        "springs": derivative(lambda at: spring_energy(p, at), alpha),
        "net": derivative(lambda at: net_energy(p, at), alpha),
    }


def rope_force(p: Any, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """T1 [N] of each rope at its drum, without the rotor's own torque."""
    return sum(loads(p, alpha, rate, acceleration).values()) / leverage(p, alpha)


def rope_acceleration(p: Any, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """Second derivative of s by time [m/s^2]."""
    bend = derivative(lambda at: wound(p, at), alpha)
    return wound(p, alpha) * acceleration + bend * rate**2


def motor_force(p: Any, drive: Drive, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """Force [N] at each drum with the rotor's own torque, before any loss in the gear."""
    rotor = drive.rope_mass * rope_acceleration(p, alpha, rate, acceleration)
    return rope_force(p, alpha, rate, acceleration) + rotor


def shaft_torque(p: Any, drive: Drive, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """Torque [N m] on the shaft of each motor."""
    pull = rope_force(p, alpha, rate, acceleration) / drive.efficiency
    rotor = drive.rope_mass * rope_acceleration(p, alpha, rate, acceleration)
    return (pull + rotor) * drive.drum_radius / drive.gear


def motor_speed(p: Any, drive: Drive, alpha: Array, rate: Array) -> Array:
    """Speed [rad/s] of each motor."""
    return wound(p, alpha) * rate * drive.gear / drive.drum_radius


def power(p: Any, drive: Drive, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """Power [W] of both motors."""
    torque = shaft_torque(p, drive, alpha, rate, acceleration)
    return 2 * torque * motor_speed(p, drive, alpha, rate)


def inertia_with_rotors(p: Any, drive: Drive, alpha: Array) -> Array:
    """J + 2 m s'^2 [kg m^2]: twice the energy of the ring and of both rotors at 1 rad/s."""
    return inertia(p, alpha) + 2 * drive.rope_mass * wound(p, alpha) ** 2


def energy(p: Any, drive: Drive, alpha: Array, rate: Array) -> Array:
    """Kinetic and potential energy [J] of the ring, its springs and net, and both rotors."""
    kinetic = inertia_with_rotors(p, drive, alpha) * rate**2 / 2
    return kinetic + spring_energy(p, alpha) + net_energy(p, alpha)


def dissipation(p: Any, drive: Drive, alpha: Array, rate: Array, acceleration: Array) -> Array:
    """Power [W] lost in joints, sliders, pulleys and both gears."""
    pull = rope_force(p, alpha, rate, acceleration)
    gears = 2 * pull * wound(p, alpha) * (1 / drive.efficiency - 1)
    return sum(damping(p, alpha)) * rate**2 + (pull * pulley_losses(p, alpha) + gears) * rate
