"""What the ring's reaction does to the arm that carries it: bending of the straight, locked arm.

The arm is B21 of `models.arm.reduced`, linear about rest, its root clamped and its elbow locked.
While the ring opens, its mass moves away from the tip: the force on the tip is the opposite of the
reaction on the ring. Only its part across the arm bends it. Each mode is integrated exactly for a
force that is linear between two samples.

Symbols: M [kg, ...], K [N/m, ...] mass and stiffness of q; phi mode shapes, orthonormal in M;
omega [rad/s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm
from ocp.arrays import Array

PERIODS = 3.0  # of the slowest mode that are followed after the ring has stopped


@dataclass(frozen=True, eq=False)
class ArmResponse:
    """The arm's answer to a force on its tip.

    Attributes
    ----------
    times : (m,) from the ring's start, and beyond its end [s].
    tip : (m,) displacement of the tip across the arm [m].
    peak : largest while the ring moves [m].
    amplitude : of the tip afterwards, all modes together [m].
    energy : of the vibration that is left [J].
    frequencies : of the modes (k,) [Hz].
    """

    times: Array
    tip: Array
    peak: float
    amplitude: float
    energy: float
    frequencies: Array


def arm_response(
    arm: ArmParameters, times: Array, reaction: Array, direction_deg: float
) -> ArmResponse:
    """What a reaction of the ring does to the arm.

    Parameters
    ----------
    arm : ArmParameters
        Its tip mass is that of the whole antenna.
    times, reaction : (m,)
        Even instants from rest to rest [s], and the force on the ring towards its centre [N].
    direction_deg : float
        Between the reaction and the straight arm.
    """
    from scipy.linalg import eigh
    from scipy.signal import lsim

    model = ReducedArm(arm, "B21", root_lock=0.0, elbow_lock=0.0)
    q = model.at()
    mass, stiffness = (matrix.full() for matrix in model.linear(q))
    squares, shapes = eigh(stiffness, mass)
    omega = np.sqrt(squares)

    # the part of the force that works on each mode, and what the mode moves the tip by
    symbol = ca.SX.sym("q", model.size)
    across = ca.Function("across", [symbol], [ca.jacobian(model.tip(symbol)[1], symbol)])
    at_tip = (across(q).full() @ shapes)[0]
    force = -reaction * math.sin(math.radians(direction_deg))

    step = times[1] - times[0]
    beyond = times[-1] + np.arange(1, math.ceil(PERIODS * 2 * math.pi / omega[0] / step) + 1) * step
    instants = np.concatenate([times, beyond])
    pushed = np.concatenate([force, np.zeros(beyond.size)])

    damping = arm.relaxation_time * squares
    tip, left, energy = np.zeros(instants.size), 0.0, 0.0
    for k, square in enumerate(squares):
        system = ([[0.0, 1.0], [-square, -damping[k]]], [[0.0], [at_tip[k]]], np.eye(2), [[0], [0]])
        _, state, _ = lsim(system, pushed, instants)
        tip += at_tip[k] * state[:, 0]
        at_rest = state[times.size - 1]
        amplitude = math.hypot(at_rest[0], at_rest[1] / omega[k])
        left += abs(at_tip[k]) * amplitude
        energy += square * amplitude**2 / 2
    peak = float(np.abs(tip[: times.size]).max())
    return ArmResponse(instants, tip, peak, left, energy, omega / (2 * math.pi))
