"""Derivatives stay finite and accurate through mu = 0 and alpha_c; size does not grow with n."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from models import truss
from models.truss.rope import decay_mean

MUS = [0.0, 1e-12, 1e-6, 1e-3, 0.01, 0.3]


def graph_size(expression, *symbols):
    return ca.Function("f", list(symbols), [expression]).n_nodes()


def series_derivatives(p, alpha, mu):
    """Leverage without -2 e', and its derivatives by mu and mu mu, term by term."""
    i = np.arange(p.modules, dtype=np.longdouble)
    exponents = np.concatenate(
        [4 * i * (math.pi - alpha), 4 * i * (math.pi - alpha) + 3 * math.pi - 4 * alpha]
    )
    terms = np.exp(-np.longdouble(mu) * exponents)
    return [float(np.sum((-exponents) ** k * terms)) for k in range(3)]


@pytest.mark.parametrize("modules", [3, 24, 200])
@pytest.mark.parametrize("mu", MUS)
def test_leverage_and_derivatives_by_friction(modules, mu):
    symbol = ca.SX.sym("mu")
    p = dataclasses.replace(truss.DYNAMIC_SET, modules=modules)
    q = truss.with_symbols(p, pulley_friction=symbol)
    alpha = 1.2
    f = truss.rope_leverage(q, alpha)
    values = [f, ca.jacobian(f, symbol), ca.hessian(f, symbol)[0]]
    got = [float(v) for v in ca.Function("f", [symbol], values)(mu)]
    scale = -2 * truss.slider_distance_slope(p, alpha)
    expected = [scale * v for v in series_derivatives(p, alpha, mu)]
    assert got == pytest.approx(expected, rel=1e-13)  # some ten roundings


@pytest.mark.parametrize("y", [0.0, 1e-300, 1e-12, 0.3, 1 - 1e-12, 1.0, 1 + 1e-12, 5.0, 800.0])
def test_decay_mean(y):
    s = ca.SX.sym("y")
    f = decay_mean(s)
    value, slope, curvature = (
        float(v) for v in ca.Function("f", [s], [f, ca.jacobian(f, s), ca.hessian(f, s)[0]])(y)
    )
    # Gauss quadrature of s^k exp(-y s) on [0, 1], split where the integrand decays.
    x, w = np.polynomial.legendre.leggauss(40)
    end = min(1.0, 50 / y) if y else 1.0
    x, w = (x + 1) / 2 * end, w / 2 * end
    moments = [float(np.sum(w * (-x) ** k * np.exp(-y * x))) for k in range(3)]
    assert [value, slope, curvature] == pytest.approx(moments, rel=2e-14)


@pytest.mark.parametrize("mu", [0.0, 1e-12, 1e-6, 0.01])
@pytest.mark.parametrize("net", ["by angle", "slack", "taut"])
@pytest.mark.parametrize("offset", [-1e-9, 0.0, 1e-9])
def test_force_derivatives_are_finite_at_the_net_angle(mu, net, offset):
    alpha, omega, acc, friction = (ca.SX.sym(s) for s in ("alpha", "omega", "acc", "mu"))
    p = truss.with_symbols(truss.DYNAMIC_SET, pulley_friction=friction)
    force = truss.rope_force(p, alpha, omega, acc, net)
    variables = ca.vertcat(alpha, omega, acc, friction)
    hessian, gradient = ca.hessian(force, variables)
    f = ca.Function("f", [variables], [force, gradient, hessian])
    for part in f(ca.DM([truss.DYNAMIC_SET.net_angle + offset, 0.01, 1e-4, mu])):
        assert np.isfinite(part.full()).all()


def test_derivatives_by_every_parameter_are_those_of_differences():
    names = [
        field.name
        for field in dataclasses.fields(truss.TrussParameters)
        if field.name
        not in (
            "modules",
            "counting",
            "joint_masses",
            "stowed_angle",
            "gravity",
            "other_pulleys",
            "measured_torque",
        )
    ]
    base = dataclasses.replace(
        truss.DYNAMIC_SET,
        pulley_friction=0.01,
        bar_length=1.1,
        joint_coulomb=0.02,
        measured_torque=((0.05, 5.0), (0.8, 30.0), (1.6, 10.0)),
        slider_coulomb=0.5,
        gravity=(-3.0, 0.0, 0.0),
        off_load=0.5,
        off_load_friction=0.1,
    )
    at = [getattr(base, name) for name in names]
    symbols = [ca.SX.sym(name) for name in names]
    p = truss.with_symbols(base, **dict(zip(names, symbols, strict=True)))
    force = truss.rope_force(p, 1.5, 0.3, -0.2)
    gradient = ca.Function("g", symbols, [ca.gradient(force, ca.vertcat(*symbols))])(*at)
    for name, value, slope in zip(names, at, gradient.full().ravel(), strict=True):
        step = 1e-5 * abs(value)
        high, low = (
            float(truss.rope_force(dataclasses.replace(base, **{name: value + h}), 1.5, 0.3, -0.2))
            for h in (step, -step)
        )
        # Central differences: rounding of T1 over the step, truncation of relative 1e-10.
        assert (high - low) / (2 * step) == pytest.approx(
            slope, rel=1e-7, abs=1e-13 * abs(high) / step
        )


def test_slopes_are_the_derivatives_of_their_functions():
    alpha = ca.SX.sym("alpha")
    p = dataclasses.replace(truss.DYNAMIC_SET, pulley_friction=0.01)
    pairs = [
        (truss.slider_distance(p, alpha), truss.slider_distance_slope(p, alpha)),
        (truss.slider_distance_slope(p, alpha), truss.slider_distance_curvature(p, alpha)),
        (truss.slider_distance_curvature(p, alpha), truss.slider_distance_third(p, alpha)),
        (truss.inertia(p, alpha), truss.inertia_slope(p, alpha)),
        (truss.potential(p, alpha), truss.potential_slope(p, alpha)),
    ]
    for whole, slope in pairs:
        difference = ca.Function("f", [alpha], [ca.jacobian(whole, alpha) - slope, slope])
        for at in np.linspace(0.0768, math.pi / 2, 30):
            gap, size = difference(at)
            assert abs(float(gap)) <= 1e-12 * max(1.0, abs(float(size)))


def test_rope_jerk_is_the_rate_of_the_rope_acceleration():
    symbols = [ca.SX.sym(name) for name in ("alpha", "omega", "acc", "jerk")]
    p, motion = truss.DYNAMIC_SET, ca.vertcat(*symbols[:3])
    acceleration = truss.rope_acceleration(p, *symbols[:3])
    rate = ca.jtimes(acceleration, motion, ca.vertcat(*symbols[1:]))
    both = ca.Function("f", symbols, [rate, truss.rope_jerk(p, *symbols)])
    for at in np.linspace(0.0768, math.pi / 2, 30):
        expected, found = map(float, both(at, 0.3, -0.2, 0.7))
        assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("mu", [0.0, 0.01])
def test_expressions_do_not_grow_with_the_ring(mu):
    sizes = []
    for modules in (24, 1000):
        p = dataclasses.replace(truss.DYNAMIC_SET, modules=modules, pulley_friction=mu)
        alpha, omega, acc = (ca.SX.sym(s) for s in ("alpha", "omega", "acc"))
        outputs = ca.vertcat(
            truss.rope_force(p, alpha, omega, acc),
            truss.angular_acceleration(p, alpha, omega, acc),
            truss.reaction_force(p, alpha, omega, acc),
            truss.rope_acceleration(p, alpha, omega, acc),
            truss.rope_jerk(p, alpha, omega, acc, acc),
            truss.pulley_loss(p, alpha, omega, acc),
        )
        sizes.append(graph_size(outputs, alpha, omega, acc))
    assert sizes[0] == sizes[1]


def test_rope_force_and_acceleration_invert_each_other_symbolically_in_mx():
    alpha, omega, acc = (ca.MX.sym(s) for s in ("alpha", "omega", "acc"))
    p = dataclasses.replace(truss.DYNAMIC_SET, pulley_friction=0.01)
    force = truss.rope_force(p, alpha, omega, acc)
    back = ca.Function(
        "back", [alpha, omega, acc], [truss.angular_acceleration(p, alpha, omega, force)]
    )
    assert float(back(1.0, 0.2, 0.3)) == pytest.approx(0.3, rel=1e-12)
