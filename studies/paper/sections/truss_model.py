"""Rows of section IV: the ring truss, its energies and forces.

Each formula is written out here in NumPy as the paper prints it, and held against the models,
which are made of expressions.

Symbols: alpha deployment angle [rad], e slider distance [m], f rope leverage [m], J [kg m^2].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from models.truss import (
    DYNAMIC_SET,
    KINEMATIC_SET,
    TrussParameters,
    angular_acceleration,
    evaluate_motion,
    inertia,
    joint_damping,
    kinetic_energy,
    node_motion,
    potential,
    ring_positions,
    ring_radius,
    rope_length,
    rope_leverage,
    slider_distance,
    tension_ratios,
)
from models.truss.inertia import RODS
from ocp.arrays import Array
from studies.paper.cases import AS_PRINTED, WITH_FRICTION, Cases
from studies.paper.entries import FORMULA, Entry, apart, assumption, exact, formula, misprint

ANGLES = np.radians([4.4, 20.0, 45.0, 70.0, 79.0, 83.0, 86.0, 90.0])
BARS = RODS["bar_length"]  # the vertical ones of a module
LOOP = (*BARS, *RODS["half_cross_bar"])  # its closed mechanism
MODULE = (*LOOP, *RODS["link"])  # all its rods
ROPE = ((10, 2), (2, 3), (3, 4), (4, 12))  # segments of one rope in a module


def truss_entries(cases: Cases) -> list[Entry]:
    """The rows, in the order of the paper."""
    return [*_kinematics(), *_energies(), *_forces(cases)]


def values(function: Callable[..., Any], truss: TrussParameters, angles: Array = ANGLES) -> Array:
    """A model's function of the angle, (m,)."""
    return np.array([float(function(truss, ca.DM(angle))) for angle in angles])


def written_slider(truss: TrussParameters, alpha: Any) -> Any:
    """The slider distance e of (16) [m]."""
    c, d = truss.crank, truss.link
    return c * np.cos(alpha) + np.sqrt(d**2 - (c * np.sin(alpha)) ** 2)


def _kinematics() -> list[Entry]:
    truss = DYNAMIC_SET
    places = np.array([ring_positions(truss, angle) for angle in ANGLES])

    def between(j: int, k: int) -> Array:
        return np.asarray(np.linalg.norm(places[:, 0, j - 1] - places[:, 0, k - 1], axis=-1))

    e = written_slider(truss, ANGLES)
    pairs = ((1, 8), (2, 10), (4, 12), (5, 14))
    sliders = max(apart(between(j, k), e) for j, k in pairs)

    # the far bar of the last module is the near bar of the first one
    gap = np.linalg.norm(places[:, -1, 4] - places[:, 0, 0], axis=-1)
    centre = places[:, :, 0].mean(axis=1, keepdims=True)
    radius = np.linalg.norm(places[:, :, 0] - centre, axis=-1)
    rounded = apart(radius, np.repeat(values(ring_radius, truss)[:, None], truss.modules, axis=1))

    written = np.array([_written_places(truss, *pair) for pair in zip(ANGLES, places, strict=True)])

    along = truss.modules * np.sum([between(j, k) for j, k in ROPE], axis=0)
    last = 2 * truss.modules * (e + truss.half_cross_bar)
    middle = 2 * truss.modules * (2 * e + 2 * truss.half_cross_bar)
    length = float(values(rope_length, truss)[0])
    nodes = {node for rod in MODULE for node in rod}
    segments = ca.DM(tension_ratios(truss, math.radians(45.0))).numel()
    return [
        exact("II-B, Fig. 3: driving ropes", "2", _ropes(truss)),
        assumption(
            "II-B, Fig. 2: stages of the deployment that are modelled",
            4,
            "the drive of stage 2, the turn about the big arm's axis, is at the big arm's root",
            printed="4",
        ),
        exact("I: bars of a module's closed mechanism (six-bar)", "6", len(LOOP)),
        exact("Fig. 7: joint nodes of a module", "14", len(nodes)),
        exact("IV-A: full turn of the ring, n times beta [deg]", "360", _turn(places[-1])),
        formula("(16): slider distance e, also as distances of nodes", sliders),
        formula("(17)-(19): places of the nodes of all modules", apart(places, written)),
        formula(
            "(17)-(19): the ring of 24 modules closes",
            float(gap.max() / radius.max()),
            "required: gap between the last module and the first, over the radius",
        ),
        formula("(25): radius b sin(alpha)/sin(180 deg/n) of the vertical bars' ends", rounded),
        exact("IV-A: rope segments of a module", "4", segments / truss.modules),
        formula("(20): length of one rope, last expression", apart(along, last)),
        misprint(
            "(20): length of one rope when stowed, middle expression [m]",
            f"{middle[0]:.4f}",
            length,
            "the middle expression, evaluated, is twice the last one, which the nodes measure",
            shown=abs(middle[0] / length - 2.0) < 1e-12,
        ),
    ]


def _written_places(truss: TrussParameters, alpha: float, places: Array) -> Array:
    """Places (n, 14, 3) [m] by (17)-(19) of the nodes that the first module says."""
    beta, side = 2 * np.pi / truss.modules, 2 * truss.half_cross_bar * np.sin(alpha)
    found, corner = [], np.zeros(3)
    for turn in beta * np.arange(truss.modules):
        cos, sin = np.cos(turn), np.sin(turn)
        rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        found.append(corner + places[0] @ rotation.T)
        corner = corner + side * np.array([cos, sin, 0.0])
    return np.array(found)


def _ropes(truss: TrussParameters) -> float:
    """Motor power over the force on one rope times the speed at which that rope is wound in."""
    motion = evaluate_motion(truss, [0.5], [0.1], [0.0])
    return float(-motion.motor_power[0] / (motion.rope_force[0] * motion.rope_speed[0]))


def _turn(places: Array) -> float:
    """Sum of the angles between the sides of one module and the next [deg]."""
    sides = places[:, 4, :2] - places[:, 0, :2]
    headings = np.arctan2(sides[:, 1], sides[:, 0])
    steps = np.diff(np.append(headings, headings[0])) % (2 * np.pi)
    return float(np.degrees(steps.sum()))


def _energies() -> list[Entry]:
    truss, n = DYNAMIC_SET, DYNAMIC_SET.modules
    e = written_slider(truss, ANGLES)
    springs = 2 * n * truss.spring_stiffness / 2 * (truss.spring_free_length - e) ** 2
    below = truss.net_angle > ANGLES
    energy = values(potential, truss)

    # (25) as the integral it is: 2 n springs k2 from the critical radius to the radius
    critical = truss.half_cross_bar * math.sin(truss.net_angle) / math.sin(math.pi / n)
    stretch = np.maximum(values(ring_radius, truss) - critical, 0.0)
    net = 2 * n * truss.net_stiffness * stretch**2 / 2

    once, printed = (float(values(inertia, kind)[0]) for kind in (truss, AS_PRINTED))
    every = [(module, *rod) for module in range(n) for rod in MODULE]
    distinct = distinct_rods(truss)
    bars = sum(rod in BARS for _, *ends in distinct for rod in [tuple(ends)])
    stiffness = truss.spring_stiffness * (truss.spring_free_length - e) ** 2 / 2
    return [
        exact("(22)-(23): rods of a module", "10", len(MODULE)),
        exact("I, Fig. 13: vertical bars of the ring, by their places", "24", bars),
        formula(
            "(21)-(23): inertia, shared parts counted once",
            apart(values(inertia, truss), _summed_inertia(truss, distinct)),
            "the sum over the rods in different places gives the closed form of the models",
        ),
        misprint(
            "(22)-(23): inertia at 4.4 deg, all modules with all their parts [kg m^2]",
            f"{printed:.6g}",
            once,
            f"the modules have {len(every)} rods, but the ring has {len(distinct)}: neighbours "
            "share a vertical bar (I), which the printed sum counts twice; both values are based "
            "on our tubes",
            shown=apart(values(inertia, AS_PRINTED), _summed_inertia(truss, every)) < FORMULA,
        ),
        exact("IV-B: compression springs, 2 n", "48", float(energy[0] / stiffness[0])),
        formula("(24): energy of the springs", apart(energy[below], springs[below])),
        formula("(25), Fig. 8: energy of the net, as an integral", apart(energy - springs, net)),
        formula("(26): potential energy", apart(energy, springs + net)),
    ]


def distinct_rods(truss: TrussParameters) -> list[tuple[int, int, int]]:
    """Module and end nodes of each rod of the ring that lies in a place of its own."""
    places = ring_positions(truss, float(ANGLES[0]))
    middles = {
        tuple(np.round(places[module, [j - 1, k - 1]].mean(axis=0), 6)): (module, j, k)
        for module in range(truss.modules)
        for j, k in MODULE
    }
    return list(middles.values())


def _summed_inertia(truss: TrussParameters, rods: list[tuple[int, int, int]]) -> Array:
    """J (m,) [kg m^2] by (21)-(22) over rods of the ring, each by its module and end nodes."""
    total = np.zeros(len(ANGLES))
    unit = np.ones_like(ANGLES)
    places = ring_positions(truss, float(ANGLES[0]))
    for module, *ends in rods:
        u, v = (
            node_motion(truss, node, ANGLES, unit, 0 * unit, module=module + 1).velocity
            for node in ends
        )
        length = np.linalg.norm(np.subtract(*(places[0, node - 1] for node in ends)))
        total += truss.linear_density * length * (u * u + u * v + v * v).sum(axis=1) / 3
    return total


def _forces(cases: Cases) -> list[Entry]:
    truss, rubbing = DYNAMIC_SET, WITH_FRICTION
    deployment = cases.dynamic[0]
    energies = deployment.energies
    work = float(energies.motor[-1])
    joints = float(energies.joints[-1])

    # with the friction of (27) on the wrong side of (38) the motor is asked for 2 Q_f too little
    asked = work - 2 * joints
    miss = abs(asked - work) / asked
    wrap = ca.DM(tension_ratios(rubbing, math.radians(45.0))).full().ravel()
    sliding, turning = _damping_terms(truss, ANGLES)
    return [
        formula(
            "(27): friction of four kinds of rotating joints and one of sliding ones, from "
            "their angles",
            apart(values(joint_damping, truss), sliding + sum(turning)),
        ),
        formula(
            "(28)-(29), Fig. 9: tension of all segments at 45 deg, mu = 0.01",
            apart(wrap, _written_tensions(rubbing, math.radians(45.0))),
        ),
        formula(
            "(30)-(33): generalised force of the segments of module 5 under a unit tension",
            apart(_segment_forces(truss, module=5), _written_segments(truss)),
        ),
        formula(
            "(34): generalised force of both ropes, mu = 0.01",
            apart(values(rope_leverage, rubbing), _written_leverage(rubbing)),
        ),
        formula(
            "(34)-(35): the same without friction: work of both ropes as they shorten",
            apart(values(rope_leverage, truss)[:-1], _shortening(truss)[:-1]),
        ),
        formula(
            "(36)-(37): Lagrange's equation with Q_f + Q_T, mu = 0.01",
            _lagrange_gap(rubbing),
            "energies of the models, forces (27) and (34) as printed, acceleration of the models",
        ),
        misprint(
            "(38): work that the motor lacks at the end, over its work, Bezier",
            f"{miss:.3g}",
            energies.imbalance,
            "with the printed sign of Q_f the friction of (27) drives; the balance of energies "
            "closes only where it opposes the motion",
            shown=energies.imbalance < 1e-8 < miss,
        ),
    ]


def _lagrange_gap(truss: TrussParameters) -> float:
    """Relative difference of both sides of (37) under 20 N at 0.02 rad/s."""
    force, speed = 20.0, 0.02
    alpha, omega, acc = (ca.SX.sym(name) for name in ("alpha", "omega", "acc"))
    lagrangian = kinetic_energy(truss, alpha, omega) - potential(truss, alpha)
    momentum = ca.gradient(lagrangian, omega)
    rate = ca.gradient(momentum, alpha) * omega + ca.gradient(momentum, omega) * acc
    left = ca.Function("left", [alpha, omega, acc], [rate - ca.gradient(lagrangian, alpha)])

    found = [left(a, speed, angular_acceleration(truss, ca.DM(a), speed, force)) for a in ANGLES]
    sliding, turning = _damping_terms(truss, ANGLES)
    generalised = -(sliding + sum(turning)) * speed + force * _written_leverage(truss)
    return apart(np.array(found, float).ravel(), generalised)


def _damping_terms(truss: TrussParameters, alpha: Array) -> tuple[Array, list[Array]]:
    """The sliding term and the four rotating terms of (27), over the angular speed; (m,) each."""
    n, xi1, xi2, h = truss.modules, truss.joint_friction, truss.slider_friction, 1e-20

    def slope(angle: Callable[[Any], Any]) -> Array:
        # a complex step: the derivative of the printed expression, to rounding
        return np.asarray(angle(alpha + 1j * h).imag / h)

    def crank(a: Any) -> Any:
        return np.arcsin(truss.crank * np.sin(a) / truss.link)

    rates = (
        (4, slope(lambda a: a)),
        (4, slope(lambda a: np.pi - crank(a))),
        (4, slope(lambda a: a + crank(a))),
        (2, slope(lambda a: 2 * a)),
    )
    sliding = 2 * n * xi2 * slope(lambda a: written_slider(truss, a)) ** 2
    return sliding, [n * count * xi1 * rate**2 for count, rate in rates]


def _written_tensions(truss: TrussParameters, alpha: float) -> Array:
    """Tensions over T1 of the 4 n segments, pulley by pulley after (28)."""
    turns = (math.pi - alpha, math.pi - 2 * alpha, math.pi - alpha, math.pi)
    tensions = [1.0]
    for k in range(4 * truss.modules - 1):
        tensions.append(tensions[-1] * math.exp(-truss.pulley_friction * turns[k % 4]))
    return np.array(tensions)


def _segment_forces(truss: TrussParameters, module: int) -> Array:
    """Generalised force (4, m) [m] of a unit tension in each segment, by (30) and (31)."""
    unit = np.ones_like(ANGLES)
    forces = []
    for pair in ROPE:
        start, end = (
            node_motion(truss, node, ANGLES, unit, 0 * unit, module=module) for node in pair
        )
        pull = end.position - start.position
        closing = (pull * (start.velocity - end.velocity)).sum(axis=1)
        forces.append(closing / np.linalg.norm(pull, axis=1))
    return np.array(forces)


def _written_segments(truss: TrussParameters) -> Array:
    """The same by the last expressions of (32) and (33), (4, m) [m]."""
    c, d = truss.crank, truss.link
    root = np.sqrt(d**2 - (c * np.sin(ANGLES)) ** 2)
    front = c * np.sin(ANGLES) + c**2 * np.sin(2 * ANGLES) / (2 * root)
    return np.array([front, 0 * front, 0 * front, front])


def _written_leverage(truss: TrussParameters) -> Array:
    """The sum of (34) over T1, term by term, (m,) [m]."""
    mu, front = truss.pulley_friction, 2 * _written_segments(truss)[0]
    terms = sum(
        np.exp(-4 * mu * i * (np.pi - ANGLES)) * (1 + np.exp(-mu * (3 * np.pi - 4 * ANGLES)))
        for i in range(truss.modules)
    )
    return np.asarray(front * terms)


def _shortening(truss: TrussParameters) -> Array:
    """Minus the slope of both ropes' length by the angle, (m,) [m], by a complex step of (20)."""
    h = 1e-20
    slope = np.asarray(written_slider(truss, ANGLES + 1j * h)).imag / h
    return -2 * 2 * truss.modules * slope


def spring_force(truss: TrussParameters, angle: float) -> float:
    """Motor force that holds the springs alone without friction [N]: two share four segments."""
    squeeze = truss.spring_free_length - float(slider_distance(truss, angle))
    return truss.spring_stiffness * squeeze / 2


def diameter(angle: float) -> float:
    """Diameter of the ring of the kinematic set [m]."""
    return 2 * float(ring_radius(KINEMATIC_SET, angle))
