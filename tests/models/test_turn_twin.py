"""Stage 2, the turn about the big arm, by an author who has not read the models.

The ring is summed from its particles, the tube's torsion from rings of its wall. A drive whose
acceleration is constant in each step moves the antenna by a matrix exponential, so that the least
torque is a linear program in these accelerations.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import linprog

from models.arm.parameters import ArmParameters, tube
from models.truss import DYNAMIC_SET
from models.turn import (
    TurnParameters,
    least_torque_turn,
    stowed_ring_inertia,
    torsion_stiffness,
    turn_response,
)

QUARTER = math.pi / 2
WALLS = (1, 8), (0.05, 0.2), (0.001, 0.02), (1e10, 2e11)  # m, m, m, Pa


@pytest.mark.parametrize("seed", range(50))
def test_inertia_of_all_particles_and_torsion_of_the_wall(seed):
    draw = np.random.default_rng(seed)
    truss = replace(
        DYNAMIC_SET, modules=int(draw.integers(3, 40)), stowed_angle=draw.uniform(0.05, 0.3)
    )
    mass, poisson = draw.uniform(1, 50), draw.uniform(0, 0.45)

    # a side of the polygon is as long as a cross-bar, and the axis touches the hoop about it
    radius = truss.half_cross_bar * math.sin(truss.stowed_angle) / math.sin(math.pi / truss.modules)
    around = np.exp(2j * np.pi * np.arange(7) / 7)
    inertia = np.sum(mass / 7 * np.abs(radius * (1 + around)) ** 2)
    assert stowed_ring_inertia(truss, mass) == pytest.approx(inertia, rel=1e-8)

    length, outer, wall, young = (draw.uniform(*ends) for ends in WALLS)
    arm = replace(ArmParameters(), big=tube(length, outer, wall, young, 2700.0))
    # rings of the wall, each strained by its radius over the length
    node, weight = np.polynomial.legendre.leggauss(4)
    at = outer / 2 - wall / 2 * (1 - node)
    polar = np.sum(weight * wall / 2 * math.tau * at**3)
    expected = young / (2 * (1 + poisson)) * polar / length
    assert torsion_stiffness(arm, poisson) == pytest.approx(expected, rel=1e-8)


def steps_of(turn, duration, count):
    """Matrix and column of one step: (psi, psi', beta, beta') under a constant beta''."""
    square = turn.stiffness / turn.inertia
    flow = np.zeros((5, 5))
    flow[0, 1] = flow[2, 3] = flow[3, 4] = 1
    flow[1, 0], flow[1, 2] = -square, square
    step = expm(flow * duration / count)
    return step[:4, :4], step[:4, 4]


@pytest.mark.parametrize("seed", range(2))
def test_the_least_torque_by_a_linear_program(seed):
    draw = np.random.default_rng(seed)
    turn = TurnParameters(draw.uniform(2, 8), draw.uniform(1000, 4000))
    duration, cap, count = draw.uniform(4, 7), draw.uniform(1.5, 3), 400
    matrix, column = steps_of(turn, duration, count)

    # twist = row of effects @ accelerations, by powers of the matrix
    effect = np.empty((count, 4))
    effect[0] = column
    for at in range(1, count):
        effect[at] = matrix @ effect[at - 1]
    twist = effect[:, 2] - effect[:, 0]
    rows = np.array(
        [np.concatenate([twist[at::-1], np.zeros(count - at - 1)]) for at in range(count)]
    )
    last = effect[::-1].T

    ones = np.ones((count, 1))
    best = linprog(
        [0.0] * count + [1.0],
        A_ub=np.block([[rows, -ones], [-rows, -ones]]),
        b_ub=np.zeros(2 * count),
        A_eq=np.hstack([last, np.zeros((4, 1))]),
        b_eq=[QUARTER, 0.0, QUARTER, 0.0],
        bounds=[(-cap, cap)] * count + [(0, None)],
    )
    found = least_torque_turn(turn, QUARTER, duration, cap)
    assert turn.stiffness * best.fun == pytest.approx(found.peak_torque, rel=5e-4)


@pytest.mark.parametrize("seed", range(20))
def test_the_antennas_answer_by_a_matrix_exponential(seed):
    draw = np.random.default_rng(seed)
    turn = TurnParameters(draw.uniform(2, 8), draw.uniform(1000, 4000))
    acceleration = draw.uniform(-2, 2, 50)
    matrix, column = steps_of(turn, 5.0, 50)
    states = [np.zeros(4)]
    for one in acceleration:
        states.append(matrix @ states[-1] + column * one)
    psi, psi_rate, beta, beta_rate = np.array(states).T

    before, after = np.append(0.0, acceleration), np.append(acceleration, 0.0)
    found = turn_response(turn, np.linspace(0, 5, 51), before, after)
    for name, expected in (
        ("antenna_angle", psi),
        ("antenna_rate", psi_rate),
        ("drive_angle", beta),
        ("drive_rate", beta_rate),
        ("torque", turn.stiffness * (beta - psi)),
        ("energy", turn.inertia * psi_rate**2 / 2 + turn.stiffness * (beta - psi) ** 2 / 2),
    ):
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(found, name), expected, rtol=0, atol=1e-8 * size)
