"""The elimination of ties and the constraints of the same joints, against differences."""

import numpy as np
import pytest

from models.ancf.chain import Chain, Link
from models.ancf.joints import Driven, Locked
from models.ancf.joints.constraints import Constraints
from models.ancf.motion import MinimalCoordinates

LINK = Link(1.0, 2.0e4, 2.0, 0.5)
CHAIN = Chain((LINK, LINK, LINK), 2)
JOINTS = [
    Locked(0.2),
    Driven(lambda t: 0.6 + t**2, lambda t: 2 * t, lambda t: 2 + 0 * t),
    Locked(-0.4),
]
FORM = MinimalCoordinates(CHAIN, JOINTS)
TIES = FORM.elimination
TIME = np.array([0.7])
STEP = 1e-6


def places(seed: int = 0) -> np.ndarray:
    """Some z (n_z, 1): the map is no less defined where the links are badly stretched."""
    return 1.0 + 0.3 * np.random.default_rng(seed).normal(size=(FORM.size, 1))


def x_of(z: np.ndarray) -> np.ndarray:
    return TIES.motion(TIME, z, 0 * z, 0 * z)[0]


def differences(function, z: np.ndarray) -> np.ndarray:
    """Central differences of a vector by the entries of z."""
    shifts = STEP * np.eye(len(z))
    columns = [(function(z + s[:, None]) - function(z - s[:, None])) / (2 * STEP) for s in shifts]
    return np.hstack(columns)


def test_jacobian_is_the_derivative_of_the_map():
    z = places()
    jacobian = TIES.jacobian(0.7, x_of(z)[:, 0])
    # x is at most of second degree in z: differences are exact but for rounding
    assert jacobian == pytest.approx(differences(x_of, z), abs=1e-8)


def test_forces_and_matrices_are_those_of_the_jacobian():
    z, rng = places(1), np.random.default_rng(2)
    x, n = x_of(z), TIES.size
    jacobian = TIES.jacobian(0.7, x[:, 0])
    force, matrix = rng.normal(size=(n, 1)), rng.normal(size=(n, n))
    matrix = matrix + matrix.T
    assert TIES.force(TIME, x, force) == pytest.approx(jacobian.T @ force, abs=1e-12)
    assert TIES.reduce(0.7, x[:, 0], matrix) == pytest.approx(
        jacobian.T @ matrix @ jacobian, abs=1e-11
    )


def test_geometric_stiffness_is_the_derivative_of_the_reduced_force():
    z, force = places(3), np.random.default_rng(4).normal(size=(TIES.size, 1))
    stiffness = TIES.geometric_stiffness(0.7, force[:, 0])
    reduced = differences(lambda z: TIES.force(TIME, x_of(z), force), z)
    assert stiffness == pytest.approx(reduced, abs=1e-8)


def test_rates_follow_the_coordinates_and_restriction_undoes_the_map():
    z, v, a = places(5), places(6) - 1, places(7) - 1
    h = 1e-4

    def at(dt: float) -> tuple[np.ndarray, ...]:
        return TIES.motion(TIME + dt, z + dt * v + dt**2 / 2 * a, v + dt * a, a)

    x, xd, xdd = at(0.0)
    before, after = at(-h), at(h)
    assert xd == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-6)  # of order h^2
    assert xdd == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-6)
    again = TIES.restrict(0.7, x[:, 0], xd[:, 0])
    assert again[0] == pytest.approx(z[:, 0], abs=1e-13)
    assert again[1] == pytest.approx(v[:, 0], abs=1e-13)


def test_eliminated_coordinates_keep_the_constraints_and_their_rates():
    z, v = places(8), places(9) - 1
    q, rate = FORM.nodes(TIME, z, v)
    constraints = Constraints(CHAIN, JOINTS)
    assert constraints.value(TIME, q) == pytest.approx(np.zeros((9, 1)), abs=1e-12)
    # without stabilisation gamma is -d(Phi_q v)/dt; with it, only what is violated comes in
    plain = constraints.acceleration_bias(TIME, q, rate, 0.0, 0.0)
    stabilised = constraints.acceleration_bias(TIME, q, rate, 20.0, 20.0)
    assert stabilised == pytest.approx(plain, abs=1e-9)


def test_constraint_jacobian_is_the_derivative_of_the_constraints():
    q = 1.0 + 0.3 * np.random.default_rng(10).normal(size=(CHAIN.size, 1))
    constraints = Constraints(CHAIN, JOINTS)
    jacobian = constraints.jacobian(0.7, q[:, 0])
    assert jacobian == pytest.approx(differences(lambda q: constraints.value(TIME, q), q), abs=1e-8)
    rng = np.random.default_rng(11)
    a, multipliers = rng.normal(size=q.shape), rng.normal(size=(constraints.rows, 1))
    assert constraints.times(TIME, q, a) == pytest.approx(jacobian @ a, abs=1e-12)
    assert constraints.force(TIME, q, multipliers) == pytest.approx(
        jacobian.T @ multipliers, abs=1e-12
    )
