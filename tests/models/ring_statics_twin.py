"""Every pin force of the ring truss from one linear system, in NumPy alone.

The ring is cut into all its bodies, and the balance of each is a set of rows. Nothing is assumed
of symmetry, of virtual work or of the equation of motion, so they can be checked.

Bodies of module i (nodes as in Fig. 7 of DOI 10.1109/ACCESS.2019.2918614):

- four half cross-bars from a bar end over the crank to a middle joint, and four links: rods that
  move in the face of the module, three equations each (two forces, the moment about the normal);
- two middle joints, each a pin that carries a pulley, two equations each;
- its left vertical bar and the two sliders on it, shared with module i - 1, six equations each;
- the face, that is all its rods and pins together, for the three equations that lead out of it.

Unknowns: two components of the force in each pin, five of each slider guide (all but the force
along the bar), three that each face gives to either bar across itself, six at the fixed bar, and
the motor force T1. The rope turns about pulleys on sliders, bar ends and middle joints; T1 acts on
the slider of the fixed bar, as in (30). The inertia is that of the bodies as the ring opens from
its fixed bar; the friction is that of (27).

The rods' planes keep the angles between the faces, so the closed ring can hold stresses without
load, five of them (seven at 90 deg, where the half cross-bars are in line):

- a shear that runs one way through the upper middle joints and back through the lower ones;
- a force round the ring in any direction, and a moment round it about its axis. They bend the faces
  out of their planes.

Balance alone does not say how large they are. The forces across the faces are taken to be least (at
rest there are none: each face is plane), and then those of the links, by the sum of their squares.

Symbols: alpha [rad]; e [m] slider-to-end distance; t, y, z along, across (inwards) and up a face.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# the four quarters of a module, upper before lower and left before right
ENDS, MIDDLES = (1, 5, 2, 4), (6, 6, 3, 3)
CRANKS, SLIDERS = (7, 13, 9, 11), (8, 14, 10, 12)
ROPES = ((8, 1, 6, 5, 14), (10, 2, 3, 4, 12))

# bodies of a module: four half cross-bars, four links, and then
UPPER_PIN, LOWER_PIN, BAR, UPPER_SLIDER, LOWER_SLIDER, FACE, BODIES = 8, 9, 10, 11, 12, 13, 14
# what carries the pulley, spring or mass at a node, and whether it is of the next module
CARRIERS = {
    **{1: (BAR, 0), 2: (BAR, 0), 5: (BAR, 1), 4: (BAR, 1), 6: (UPPER_PIN, 0), 3: (LOWER_PIN, 0)},
    **{8: (UPPER_SLIDER, 0), 10: (LOWER_SLIDER, 0), 14: (UPPER_SLIDER, 1), 12: (LOWER_SLIDER, 1)},
}
UNKNOWNS = 48  # of a module: 32 in its pins, 10 in the guides of its left bar, 6 across its face

# A singular value is either of the order of the geometry or of rounding.
RANK_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class RingForces:
    """Forces in a ring of n modules; the columns of (n, 4) are the quarters 1, 5, 2, 4 by bar end.

    Attributes
    ----------
    motor_force : T1 [N] on each rope, for which the rows have a solution.
    link : (n, 4) [N] compression, the mean of both ends.
    inner, outer : (n, 4) [N] compression of the half cross-bar at the crank, on the side of the bar
        end and on the side of the middle joint.
    bending : (n, 4, 2) [N m] moment at the crank, on the side of the bar end and on that of the
        middle joint, positive if it would open the outer part further than the inner one.
    shear : (n, 2) [N] upward force of the right half on the left one through the upper and the
        lower middle joint, ropes included.
    reaction : (6,) [N, N m] force and moment on the truss about the middle of the fixed bar, in the
        axes of module 1.
    residual : greatest imbalance of a row [N or N m].
    stresses : number of independent stresses without load.
    """

    motor_force: float
    link: Array
    inner: Array
    outer: Array
    bending: Array
    shear: Array
    reaction: Array
    residual: float
    stresses: int


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions [m], velocities [m/s], accelerations [m/s^2], (n, 15, 3) each; axes (n, 3, 3).

    The second index is the node, 0 is not used. The rows of the axes of a module are t, y, z. The
    origin is node 1 of module 1, on the fixed bar.
    """

    position: Array
    velocity: Array
    acceleration: Array
    axes: Array


def ring_motion(parameters: Any, angle: float, rate: float, acceleration: float) -> Motion:
    """Motion of all nodes at alpha [rad], its rate [rad/s] and its acceleration [rad/s^2].

    Each face stands at its distance from the centre of the ring, and all is shifted by the way of
    the fixed bar.
    """
    n, a, b = parameters.modules, parameters.bar_length, parameters.half_cross_bar
    c, d = parameters.crank, parameters.link
    s, co = np.sin(angle), np.cos(angle)

    # e^2 - 2 e c cos(alpha) + c^2 = d^2, differentiated twice
    e = c * co + np.sqrt(d**2 - (c * s) ** 2)
    e1 = -e * c * s / (e - c * co)
    e2 = -(e1**2 + 2 * e1 * c * s + e * c * co) / (e - c * co)
    values, slopes = np.array([1, s, co, e]), np.array([0, co, -s, e1])
    curvatures = np.array([0, -s, -co, e2])

    # coordinates in the face as combinations of 1, sin, cos, e; the lower nodes mirror the upper
    face = np.zeros((15, 2, 4))
    for upper, lower, x, cosine, slide in (
        (1, 2, -b, 0, 0),
        (8, 10, -b, 0, -1),
        (7, 9, c - b, -c, 0),
        (6, 3, 0, -b, 0),
        (13, 11, b - c, -c, 0),
        (14, 12, b, 0, -1),
        (5, 4, b, 0, 0),
    ):
        face[upper] = (0, x, 0, 0), (0, 0, cosine, slide)
        face[lower] = (0, x, 0, 0), (-a, 0, -cosine, -slide)

    turn = 2 * np.pi / n * np.arange(n)
    zero, one = np.zeros(n), np.ones(n)
    along = np.stack([np.cos(turn), np.sin(turn), zero], axis=1)
    inwards = np.stack([-np.sin(turn), np.cos(turn), zero], axis=1)
    axes = np.stack([along, inwards, np.stack([zero, zero, one], axis=1)], axis=1)

    shapes = np.einsum("pkw,ikx->ipxw", face, axes[:, (0, 2)])
    shapes[..., 1] -= b / np.tan(np.pi / n) * inwards[:, None, :]
    shapes[..., 1] -= shapes[0, 1, :, 1].copy()

    return Motion(
        position=shapes @ values,
        velocity=shapes @ (rate * slopes),
        acceleration=shapes @ (acceleration * slopes + rate**2 * curvatures),
        axes=axes,
    )


def wrench(force: Array, point: Array) -> Array:
    """Force at a point and its moment about the origin, (..., 6)."""
    return np.concatenate([force, np.cross(point, force)], axis=-1)


def rod_inertia(density: float, first: Array, last: Array) -> Array:
    """Inertia of rods, (..., 6) about the origin; `first` and `last` are (2, ..., 3).

    They are position and acceleration of either end: both run linearly along the rod.
    """
    (r, a), (dr, da) = first, last - first
    mass = density * np.linalg.norm(dr, axis=-1, keepdims=True)
    moment = (
        np.cross(r, a) + (np.cross(r, da) + np.cross(dr, a)) / 2 + np.cross(dr, da) / 3
    )  # the mean of position x acceleration
    return -mass * np.concatenate([a + da / 2, moment], axis=-1)


def carrier(modules: int, node: int) -> NDArray[np.intp]:
    """Index of the body that carries a node, for each module, (n,)."""
    kind, next_module = CARRIERS[node]
    return BODIES * ((np.arange(modules) + next_module) % modules) + kind


def rope_headings(motion: Motion) -> Array:
    """Directions of the segments of both ropes, from the motor on, (2, n, 4, 3)."""
    points = np.stack([motion.position[:, rope] for rope in ROPES])
    segments = np.diff(points, axis=2)
    return segments / np.linalg.norm(segments, axis=-1, keepdims=True)


def rope_tensions(parameters: Any, motion: Motion) -> Array:
    """Tension of the segments per T1, (2, n, 4): exp(-mu wrap) at each pulley, (28).

    The wrap of the rope about a pulley is its turn there.
    """
    headings = rope_headings(motion).reshape(2, -1, 3)
    before, after = headings[:, :-1], headings[:, 1:]
    across = np.linalg.norm(np.cross(before, after), axis=-1)
    wraps = np.arctan2(across, np.sum(before * after, axis=-1))
    wrapped = np.concatenate([np.zeros((2, 1)), np.cumsum(wraps, axis=1)], axis=1)
    return np.exp(-parameters.pulley_friction * wrapped).reshape(2, -1, 4)


def rope_loads(parameters: Any, motion: Motion) -> Array:
    """Wrench of both ropes on each body per T1, (14 n, 6).

    A segment pulls the two bodies that carry its ends towards each other.
    """
    n = parameters.modules
    load = np.zeros((BODIES * n, 6))
    pulls = rope_headings(motion) * rope_tensions(parameters, motion)[..., None]
    for rope, pull in zip(ROPES, pulls, strict=True):
        for k, (first, last) in enumerate(pairwise(rope)):
            load[carrier(n, first)] += wrench(pull[:, k], motion.position[:, first])
            load[carrier(n, last)] -= wrench(pull[:, k], motion.position[:, last])
    return load


def spring_loads(parameters: Any, motion: Motion) -> Array:
    """Wrench of springs, slider friction and net on each body, (14 n, 6)."""
    n, place, speed = parameters.modules, motion.position, motion.velocity
    load = np.zeros((BODIES * n, 6))

    # between slider and bar end, once for each slider: spring (24), and friction of the slider (27)
    for slider, end in ((8, 1), (10, 2)):
        gap = place[:, slider] - place[:, end]
        e = np.linalg.norm(gap, axis=-1, keepdims=True)
        push = parameters.spring_stiffness * (parameters.spring_free_length - e) * gap / e
        push -= parameters.slider_friction * (speed[:, slider] - speed[:, end])
        load[carrier(n, slider)] += wrench(push, place[:, slider])
        load[carrier(n, end)] -= wrench(push, place[:, end])

    # the net pulls each bar end towards the axis of the ring, (25)
    taut = parameters.half_cross_bar * np.sin(parameters.net_angle) / np.sin(np.pi / n)
    for end in (1, 2):
        spoke = place[:, end].mean(axis=0) - place[:, end]
        radius = np.linalg.norm(spoke, axis=-1, keepdims=True)
        pull = parameters.net_stiffness * np.maximum(radius - taut, 0) * spoke / radius
        load[carrier(n, end)] += wrench(pull, place[:, end])
    return load


def friction_torques(parameters: Any, motion: Motion) -> Array:
    """Torque of the joints on each body, (14 n, 6): xi1 times the relative turn, (27)."""
    n = parameters.modules
    load = np.zeros((BODIES * n, 6))
    own, still = BODIES * np.arange(n), np.zeros((n, 3))
    halves = [_turn(motion, *nodes) for nodes in zip(ENDS, MIDDLES, strict=True)]
    links = [_turn(motion, *nodes) for nodes in zip(CRANKS, SLIDERS, strict=True)]

    joints = [(own + k, own + k + 1, halves[k] - halves[k + 1]) for k in (0, 2)]
    for k in range(4):
        joints += [
            (own + k, carrier(n, ENDS[k]), halves[k]),
            (own + k, own + 4 + k, halves[k] - links[k]),
            (own + 4 + k, carrier(n, SLIDERS[k]), links[k]),
        ]
    for first, last, turn in joints:
        torque = np.concatenate([still, -parameters.joint_friction * turn], axis=-1)
        load[first] += torque
        load[last] -= torque
    return load


def inertia_loads(parameters: Any, motion: Motion) -> Array:
    """Inertia of rods and joints on each body, (14 n, 6); each that exists is counted once."""
    n, rho, masses = parameters.modules, parameters.linear_density, parameters.joint_masses
    load = np.zeros((BODIES * n, 6))
    moved = np.stack([motion.position, motion.acceleration])
    own = BODIES * np.arange(n)

    # (22)-(23) as printed count twice what neighbours share
    shared = 1 if parameters.counting == "once" else 2
    load[own + BAR] += rod_inertia(shared * rho, moved[:, :, 1], moved[:, :, 2])
    for k in range(4):
        for body, first, last in ((k, ENDS[k], MIDDLES[k]), (4 + k, CRANKS[k], SLIDERS[k])):
            load[own + body] += rod_inertia(rho, moved[:, :, first], moved[:, :, last])
        load[own + k] -= masses.crank * wrench(*moved[::-1, :, CRANKS[k]])

    for node, mass in (
        *((node, shared * masses.bar_end) for node in (1, 2)),
        *((node, shared * masses.slider) for node in (8, 10)),
        *((node, masses.middle) for node in (6, 3)),
    ):
        load[carrier(n, node)] -= mass * wrench(*moved[::-1, :, node])
    return load


def _turn(motion: Motion, first: int, last: int) -> Array:
    """Angular velocity of the rod between two nodes in each module, (n, 3) [rad/s]."""
    rod = motion.position[:, last] - motion.position[:, first]
    speed = motion.velocity[:, last] - motion.velocity[:, first]
    return np.cross(rod, speed) / np.sum(rod**2, axis=-1, keepdims=True)


def unit_wrenches(parameters: Any, motion: Motion) -> tuple[Array, Array]:
    """Wrench of each unknown but T1, (48 n + 6, 6), and its sign on each body, (14 n, 48 n + 6).

    In each module come first the forces along t and z in the pins, by quarter: of the bar end on
    the half cross-bar, of the link on the half cross-bar, of the slider on the link, and of the
    middle joint on the half cross-bar. Then the guides of both sliders, and the face.
    """
    n = parameters.modules
    units = np.zeros((UNKNOWNS * n + 6, 6))
    signs = np.zeros((BODIES * n, len(units)))
    count = 0

    def join(first: int, last: int | None, forces: Any, moments: Any, point: Array) -> None:
        nonlocal count
        new = [wrench(f, point) for f in forces] + [np.concatenate([0 * m, m]) for m in moments]
        columns = slice(count, count + len(new))
        count = columns.stop
        units[columns] = new
        signs[first, columns] = 1
        if last is not None:
            signs[last, columns] = -1

    for i, (t, y, z) in enumerate(motion.axes):
        place, own = motion.position[i], BODIES * i
        for k in range(4):
            half, link = own + k, own + 4 + k
            for first, last, node in (
                (half, carrier(n, ENDS[k])[i], ENDS[k]),
                (half, link, CRANKS[k]),
                (link, carrier(n, SLIDERS[k])[i], SLIDERS[k]),
                (half, carrier(n, MIDDLES[k])[i], MIDDLES[k]),
            ):
                join(first, last, (t, z), (), place[node])
        for node in (8, 10):
            join(carrier(n, node)[i], own + BAR, (t, y), (t, y, z), place[node])
        for end in (1, 5):
            join(own + FACE, carrier(n, end)[i], (y,), (t, z), place[end])
    join(BAR, None, motion.axes[0], motion.axes[0], motion.position[0, (1, 2)].mean(axis=0))

    # the face is all rods and pins together
    by_module = signs.reshape(n, BODIES, -1)
    by_module[:, FACE] += by_module[:, : LOWER_PIN + 1].sum(axis=1)
    return units, signs


def balances(parameters: Any, motion: Motion) -> tuple[Array, NDArray[np.intp]]:
    """Equations of balance: what each takes of a wrench, (49 n, 6), and the body it is about."""
    rows: list[Array] = []
    about: list[int] = []

    def balance(body: int, forces: Any, moments: Any, point: Array) -> None:
        # u . (M - p x F) is the moment about the axis u through p
        new = [np.concatenate([u, 0 * u]) for u in forces]
        new += [np.concatenate([np.cross(point, u), u]) for u in moments]
        rows.extend(new)
        about.extend([body] * len(new))

    for i, (t, y, z) in enumerate(motion.axes):
        place, own = motion.position[i], BODIES * i
        for k in range(4):
            balance(own + k, (t, z), (y,), place[CRANKS[k]])
            balance(own + 4 + k, (t, z), (y,), place[CRANKS[k]])
        for pin, node in ((UPPER_PIN, 6), (LOWER_PIN, 3)):
            balance(own + pin, (t, z), (), place[node])
        for slider, node in ((UPPER_SLIDER, 8), (LOWER_SLIDER, 10)):
            balance(own + slider, (t, y, z), (t, y, z), place[node])
        balance(own + BAR, (t, y, z), (t, y, z), place[(1, 2), :].mean(axis=0))
        balance(own + FACE, (y,), (t, z), place[(1, 4), :].mean(axis=0))
    return np.array(rows), np.array(about)


def ring_forces(
    parameters: Any,
    angle: float,
    rate: float = 0.0,
    acceleration: float = 0.0,
    *,
    faces_bend: bool = False,
) -> RingForces:
    """Forces in the ring at alpha [rad], its rate [rad/s] and its acceleration [rad/s^2].

    If `faces_bend`, the stresses that bend the faces relieve the links, too.
    """
    motion = ring_motion(parameters, angle, rate, acceleration)
    rows, about = balances(parameters, motion)
    units, signs = unit_wrenches(parameters, motion)

    # the face bears the loads of all rods and pins together
    def on_rows(load: Array) -> Array:
        by_module = load.reshape(parameters.modules, BODIES, 6).copy()
        by_module[:, FACE] += by_module[:, : LOWER_PIN + 1].sum(axis=1)
        return np.sum(rows * by_module.reshape(-1, 6)[about], axis=1)

    load = on_rows(
        spring_loads(parameters, motion)
        + friction_torques(parameters, motion)
        + inertia_loads(parameters, motion)
    )
    rope = on_rows(rope_loads(parameters, motion))
    matrix = np.column_stack([(rows @ units.T) * signs[about], rope])
    left, sizes, right = np.linalg.svd(matrix, full_matrices=matrix.shape[0] < matrix.shape[1])
    rank = int(np.sum(sizes > RANK_TOLERANCE * sizes[0]))
    found = right[:rank].T @ (left[:, :rank].T @ -load / sizes[:rank])

    # of the stresses without load, first those that bend the faces, then all that are left
    stresses = free = right[rank:]
    for forces in (link_compression,) if faces_bend else (across_faces, link_compression):
        effects = forces(motion, free).reshape(len(free), -1)
        modes, strengths, _ = np.linalg.svd(effects)
        works = int(np.sum(strengths > RANK_TOLERANCE))
        used, free = modes.T[:works] @ free, modes.T[works:] @ free
        relief = np.linalg.lstsq((modes.T[:works] @ effects).T, -forces(motion, found).ravel())[0]
        found = found + relief @ used

    return RingForces(
        motor_force=float(found[-1]),
        link=link_compression(motion, found),
        **bar_forces(parameters, motion, found),
        shear=middle_shear(parameters, motion, found),
        reaction=found[-7:-1],
        residual=float(np.max(np.abs(matrix @ found + load))),
        stresses=len(stresses),
    )


def pin_forces(motion: Motion, found: Array) -> Array:
    """Forces in the pins of one or more solutions, (..., n, 4, 4, 3) [N]: quarter, pin, component.

    The pins are in the order of `unit_wrenches`.
    """
    n, kinds = len(motion.axes), found.shape[:-1]
    pins = found[..., : UNKNOWNS * n].reshape(*kinds, n, UNKNOWNS)[..., :32]
    forces = pins.reshape(*kinds, n, 4, 4, 2)
    return np.einsum("...ikpc,icx->...ikpx", forces, motion.axes[:, (0, 2)])


def link_compression(motion: Motion, found: Array) -> Array:
    """Compression of the links [N], (..., n, 4), the mean of both ends."""
    forces = pin_forces(motion, found)
    along = motion.position[:, CRANKS] - motion.position[:, SLIDERS]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    return np.sum((forces[..., 1, :] + forces[..., 2, :]) / 2 * along, axis=-1)


def across_faces(motion: Motion, found: Array) -> Array:
    """Forces [N] and moments [N m] by which each face is bent out of its plane, (..., n, 6)."""
    n, kinds = len(motion.axes), found.shape[:-1]
    return found[..., : UNKNOWNS * n].reshape(*kinds, n, UNKNOWNS)[..., -6:]


def bar_forces(parameters: Any, motion: Motion, found: Array) -> dict[str, Array]:
    """Axial forces and bending of the half cross-bars, each cut in two at the crank.

    On either part act the force of its pin, the friction torque there, and the part's inertia.
    """
    forces, moved = pin_forces(motion, found), np.stack([motion.position, motion.acceleration])
    end, crank, middle = (moved[:, :, nodes] for nodes in (ENDS, CRANKS, MIDDLES))
    along = (middle - end)[0] / parameters.half_cross_bar
    opening = np.outer((-1, 1, 1, -1), (1, 1, 1)) * motion.axes[:, None, 1]

    # by quarter, relative to the bar and to the other half
    turns = np.stack([_turn(motion, *ends) for ends in zip(ENDS, MIDDLES, strict=True)], axis=1)
    relative = turns, turns - turns[:, (1, 0, 3, 2)]

    axial, bending = [], []
    for side, pin, place, turn in zip((1, -1), (0, 3), (end, middle), relative, strict=True):
        part = wrench(forces[:, :, pin], place[0])
        part += rod_inertia(parameters.linear_density, place, crank)
        moment = part[..., 3:] - np.cross(crank[0], part[..., :3])
        moment -= parameters.joint_friction * turn
        axial.append(side * np.sum(part[..., :3] * along, axis=-1))
        bending.append(side * np.sum(moment * opening, axis=-1))
    return {"inner": axial[0], "outer": axial[1], "bending": np.stack(bending, axis=-1)}


def middle_shear(parameters: Any, motion: Motion, found: Array) -> Array:
    """Upward force of the right halves on the left ones, upper and lower, (n, 2) [N].

    Through a cut on either side of a middle joint pass the force of its pin on the half cross-bar
    and the segment of the rope on that side. The mean of both cuts shares the joint's own mass.
    """
    pull = rope_headings(motion) * rope_tensions(parameters, motion)[..., None] * found[-1]
    middle = pin_forces(motion, found)[:, :, 3, 2]
    left = middle[:, (0, 2)] + pull[:, :, 1, 2].T
    right = middle[:, (1, 3)] - pull[:, :, 2, 2].T
    return (left - right) / 2
