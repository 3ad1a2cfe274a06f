import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from models.ancf.element import (
    AXIAL_POINTS,
    BENDING_POINTS,
    element_kernel,
    mass_matrix,
    moment_force,
    shape_row,
)
from models.numerics import gauss_legendre

EA, EI, L = 3.0e4, 7.0, 0.6
ANGLE = st.floats(-3.0, 3.0)
SHIFT = st.floats(-5.0, 5.0)


def straight(angle: float = 0.0, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([x, y, c, s, x + L * c, y + L * s, c, s])


def bent(seed: int = 0) -> np.ndarray:
    return straight(0.4) + 0.1 * np.random.default_rng(seed).normal(size=8)


def twin_energy(e: np.ndarray) -> float:
    """(6)-(7) by adaptive quadrature, written without the module's rules."""
    nodes = e.reshape(4, 2)

    def density(x: float) -> float:
        slope, bend = (shape_row(x / L, L, d) @ nodes for d in (1, 2))
        return EA / 2 * ((slope @ slope - 1) / 2) ** 2 + EI / 2 * bend @ bend

    return quad(density, 0.0, L, epsabs=0, epsrel=1e-13)[0]


def secant_stiffness(e: np.ndarray) -> np.ndarray:
    """K_l + K_n of (8)-(9), (8, 8)."""
    nodes, k = e.reshape(4, 2), np.zeros((4, 4))
    for xi, weight in zip(*gauss_legendre(AXIAL_POINTS), strict=True):
        row = shape_row(xi, L, 1)
        slope = row @ nodes
        k += weight * L * EA * (slope @ slope - 1) / 2 * np.outer(row, row)  # K_n
    for xi, weight in zip(*gauss_legendre(BENDING_POINTS), strict=True):
        row = shape_row(xi, L, 2)
        k += weight * L * EI * np.outer(row, row)  # K_l
    return np.kron(k, np.eye(2))


def test_mass_is_the_integral_of_the_shape_functions():
    rows = [
        [
            quad(lambda x, i=i, j=j: shape_row(x / L, L)[i] * shape_row(x / L, L)[j], 0, L)[0]
            for j in range(4)
        ]
        for i in range(4)
    ]
    assert mass_matrix(L, 2.5) == pytest.approx(2.5 * np.kron(rows, np.eye(2)), abs=1e-14)


def test_mass_gives_the_rigid_inertia():
    turn = np.array([0, 0, 0, 1, 0, L, 0, 1.0])  # unit rate about node i of the straight element
    assert turn @ mass_matrix(L, 2.5) @ turn == pytest.approx(2.5 * L**3 / 3, rel=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_energy_is_that_of_adaptive_quadrature(seed):
    energy = float(element_kernel()(bent(seed), EA, EI, L)[0])
    assert energy == pytest.approx(twin_energy(bent(seed)), rel=1e-12)


def test_gradient_and_tangent_are_derivatives():
    # central differences with step 1e-6: truncation 1e-12 relative, round-off 1e-9
    kernel, e, h = element_kernel(), bent(), 1e-6
    _, gradient, tangent = (np.array(m) for m in kernel(e, EA, EI, L))
    for i, d in enumerate(h * np.eye(8)):
        up, down = kernel(e + d, EA, EI, L), kernel(e - d, EA, EI, L)
        assert float(up[0] - down[0]) / (2 * h) == pytest.approx(gradient[i, 0], rel=1e-6, abs=1e-3)
        column = np.array(up[1] - down[1])[:, 0] / (2 * h)
        assert column == pytest.approx(tangent[:, i], rel=1e-6, abs=1e-3)


def test_secant_times_e_is_the_gradient_but_not_the_tangent():
    e = bent()
    k = secant_stiffness(e)
    _, gradient, tangent = (np.array(m) for m in element_kernel()(e, EA, EI, L))
    assert k @ e == pytest.approx(gradient[:, 0], rel=1e-11)
    missing = np.linalg.eigvalsh(tangent - k)  # int EA (S'^T S' e)(S'^T S' e)^T
    assert missing.min() > -1e-9 * missing.max()
    assert missing.max() > 0.1 * EA * L


@given(angle=ANGLE, x=SHIFT, y=SHIFT)
@settings(max_examples=30, deadline=None)
def test_rigid_motion_stores_no_energy(angle, x, y):
    energy, gradient, _ = element_kernel()(straight(angle, x, y), EA, EI, L)
    assert float(energy) < 1e-20 * EA
    assert np.abs(np.array(gradient)).max() < 1e-10 * EA


@given(angle=ANGLE)
@settings(max_examples=20, deadline=None)
def test_force_turns_with_the_element(angle):
    e = bent()
    turn = np.kron(np.eye(4), [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    base, turned = (np.array(element_kernel()(q, EA, EI, L)[1])[:, 0] for q in (e, turn @ e))
    assert turned == pytest.approx(turn @ base, rel=1e-9, abs=1e-9 * EA)


@given(angle=ANGLE, stretch=st.floats(0.5, 2.0), moment=st.floats(-10, 10))
@settings(max_examples=30, deadline=None)
def test_moment_works_on_rotation_only(angle, stretch, moment):
    slope = stretch * np.array([np.cos(angle), np.sin(angle)])
    force = np.array(moment_force(*slope, moment))
    assert force @ slope == pytest.approx(0.0, abs=1e-12)  # stretching
    assert force @ np.array([-slope[1], slope[0]]) == pytest.approx(moment, abs=1e-12)  # turning
