"""The lock and the release of joints in the reduced arm.

A lock is an inelastic impulse. It keeps the momentum of the coordinates that go on moving:
J^T M J z'+ = J^T M v-, with J = dQ/dz the tangent of all coordinates q = Q(z, s) in those kept.

Symbols: q, v coordinates of the arm before the lock and their rates; z those of them that the lock
leaves, s angles of the joints that lock [rad], Q(z, s) all coordinates, M mass matrix.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from models.arm.reduced import COORDINATES, ReducedArm, solve_small, tip_turn
from models.arrays import Array
from models.errors import require

ROOT, ELBOW = 0, 1
_ANGLES = ("theta1", "theta2")  # what a lock of the root, of the elbow takes away


def kept_by_lock(model: ReducedArm, joints: tuple[int, ...]) -> tuple[int, ...]:
    """Places in q of the coordinates z that a lock of joints (0 root, 1 elbow) leaves."""
    gone = {_ANGLES[joint] for joint in joints}
    return tuple(i for i, name in enumerate(model.coordinates) if name not in gone)


def all_coordinates(model: ReducedArm, joints: tuple[int, ...], z: Any, s: Any) -> Any:
    """Q: all coordinates (n, 1) from those kept; `s[joint]` is the angle of a joint that locks."""
    places = kept_by_lock(model, joints)
    values = {model.coordinates[place]: z[i] for i, place in enumerate(places)}

    if ROOT in joints:
        values["theta1"] = s[ROOT]
    if ELBOW in joints:
        big_arm_angle = values["theta1"] if model.root_lock is None else model.root_lock
        values["theta2"] = big_arm_angle + tip_turn(values["psi1"]) + s[ELBOW]

    return ca.vertcat(*(values[name] for name in model.coordinates))


def lock_terms(model: ReducedArm, joints: tuple[int, ...], q: Any, v: Any) -> tuple[Any, Any, Any]:
    """Mass matrix of z, its momentum and the strain energy [J] if joints locked now.

    Parameters
    ----------
    model : ReducedArm
        With these joints free.
    joints : those that lock, 0 the root and 1 the elbow.
    q, v : (n, 1)
        Coordinates and rates.

    Returns
    -------
    mass : (n_z, n_z) J^T M J.
    momentum : (n_z, 1) J^T M v.
    strain : bending energy [J], which a lock does not change.
    """
    places = kept_by_lock(model, joints)
    z, s = ca.SX.sym("z", len(places)), ca.SX.sym("s", 2)
    slope = ca.Function("slope", [z, s], [ca.jacobian(all_coordinates(model, joints, z, s), z)])

    angles = ca.vertcat(model.embed(q)[0], model.elbow_angle(q))
    tangent = slope(ca.vertcat(*(q[k] for k in places)), angles)
    mass = model.mass_matrix(q)
    return tangent.T @ mass @ tangent, tangent.T @ (mass @ v), model.strain_energy(q)


def energy_after_lock(mass: Any, momentum: Any, strain: Any) -> Any:
    """E_res = 1/2 p^T (J^T M J)^-1 p + strain energy [J], from the terms of a lock."""
    rates = ca.vertcat(*solve_small(mass, momentum))
    return 0.5 * ca.dot(momentum, rates) + strain


def lock_reduced(
    model: ReducedArm, q: Array, v: Array, *, root: bool = False, elbow: bool = False
) -> tuple[ReducedArm, Array, Array]:
    """Lock joints at the angles reached: the locked model, its coordinates and its rates.

    Raises
    ------
    ModelError
        If the motion ends in what is no number.
    """
    from scipy.linalg import solve

    require(
        bool(np.isfinite(q).all() and np.isfinite(v).all()),
        "the reduced model ends in values that are no numbers, so that nothing can be locked; the "
        "arm is too stiff for its steps: give a lower modulus or thinner tubes.",
    )
    joints = tuple(joint for joint, locks in ((ROOT, root), (ELBOW, elbow)) if locks)
    mass, momentum = (term.full() for term in _lock_function(model, joints)(q, v))

    locked = replace(
        model,
        root_lock=float(model.embed(q)[0]) if root else model.root_lock,
        elbow_lock=float(model.elbow_angle(q)) if elbow else model.elbow_lock,
    )
    z = q[list(kept_by_lock(model, joints))]
    return locked, z, solve(mass, momentum[:, 0], assume_a="pos")


@lru_cache(maxsize=32)
def _lock_function(model: ReducedArm, joints: tuple[int, ...]) -> ca.Function:
    """Compiled `(q, v) -> (mass, momentum)` of a lock."""
    q, v = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
    mass, momentum, _ = lock_terms(model, joints, q, v)
    return ca.Function("lock", [q, v], [mass, momentum])


def release(locked: ReducedArm, free: ReducedArm) -> ca.Function:
    """`(z, z') -> (q, v)`: positions and rates lead on where joints of the locked arm go free."""
    z, rate = ca.SX.sym("z", locked.size), ca.SX.sym("rate", locked.size)
    p = locked.embed(z)
    places = [COORDINATES.index(name) for name in free.coordinates]
    return ca.Function("release", [z, rate], [p[places], ca.jtimes(p, z, rate)[places]])


def released(locked: ReducedArm, free: ReducedArm, z: Array, rate: Array) -> tuple[Array, Array]:
    """Coordinates and rates (n,) of the free arm, from those of the locked one."""
    q, v = (np.asarray(part.full())[:, 0] for part in release(locked, free)(z, rate))
    return q, v
