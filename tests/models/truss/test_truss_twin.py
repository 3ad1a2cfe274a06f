"""The model agrees with an independently written truss that counts every part of the ring."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from models import truss

ANGLES = [math.radians(x) for x in (4.4, 20.0, 47.0, 79.0, 81.0, 86.0)]
JOINTS = truss.JointMasses(bar_end=0.02, middle=0.03, crank=0.005, slider=0.04)
TOLERANCE = 1e-10  # what differentiation by Cauchy's integral leaves, with a decade to spare


def truss_of(modules, mu=0.0, counting="once"):
    return dataclasses.replace(
        truss.DYNAMIC_SET,
        modules=modules,
        pulley_friction=mu,
        counting=counting,
        joint_masses=JOINTS,
    )


def close(value):
    return pytest.approx(value, rel=TOLERANCE, abs=1e-13)


@pytest.mark.parametrize("counting", ["once", "as printed"])
@pytest.mark.parametrize("modules", [3, 6, 24])
def test_inertia_and_momentum(twin, modules, counting):
    p = truss_of(modules, counting=counting)
    other = twin(p)
    assert truss.total_mass(p) == close(other.mass())
    for alpha in ANGLES:
        value, slope, momentum, rate = other.kinetics(alpha)
        assert truss.inertia(p, alpha) == close(value)
        assert truss.inertia_slope(p, alpha) == close(slope)
        centre = np.array([math.sin(math.pi / modules), math.cos(math.pi / modules), 0])
        # Directed to the centre: the sideways and vertical parts vanish.
        assert momentum == close(centre * truss.linear_momentum(p, alpha, 1.0))
        omega, acc = 0.3, -0.7
        force = momentum * acc + rate * omega**2
        assert force == close(centre * truss.reaction_force(p, alpha, omega, acc))


@pytest.mark.parametrize("modules", [3, 6, 24])
def test_potential_and_damping(twin, modules):
    p = truss_of(modules)
    other = twin(p)
    for alpha in ANGLES:
        value, slope = other.potential(alpha)
        assert truss.potential(p, alpha) == close(value)
        assert truss.potential_slope(p, alpha) == close(slope)
        for net in ("slack", "taut"):
            value, slope = other.potential(alpha, taut=net == "taut")
            assert truss.potential(p, alpha, net) == close(value)
            assert truss.potential_slope(p, alpha, net) == close(slope)
        assert truss.joint_damping(p, alpha) == close(other.damping(alpha))


@pytest.mark.parametrize("mu", [0.0, 1e-12, 1e-6, 0.01, 0.1])
@pytest.mark.parametrize("modules", [3, 6, 24])
def test_rope(twin, modules, mu):
    p = truss_of(modules, mu)
    other = twin(p)
    for alpha in ANGLES:
        ratios, rates, leverage = other.rope(alpha)
        assert truss.tension_ratios(p, alpha).full().ravel() == close(ratios)
        assert truss.far_end_ratio(p, alpha) == close(ratios[-1])
        assert truss.rope_leverage(p, alpha) == close(leverage)
        assert truss.rope_speed(p, alpha, 1.0) == close(rates.sum())
        # segment by segment: from slider to bar end, along the cross-bars, and back to the slider
        ends, half = float(truss.slider_distance(p, alpha)), p.half_cross_bar
        lengths = np.array([ends, half, half, ends] * p.modules)
        assert lengths.sum() == close(float(truss.rope_length(p, alpha)))
        assert truss.mean_tension_ratio(p, alpha) == close(ratios @ lengths / lengths.sum())


@pytest.mark.parametrize("mu", [0.0, 1e-12, 1e-6, 0.01])
@pytest.mark.parametrize("modules", [3, 24])
def test_pulley_loss(twin, modules, mu):
    p = truss_of(modules, mu)
    for alpha in ANGLES[::2]:
        pulley_by_pulley = twin(p).pulley_loss(alpha, 0.3, 12.0)
        assert truss.pulley_loss_by_sum(p, alpha, 0.3, 12.0)[0] == close(pulley_by_pulley)
        # The collapsed form is a difference of powers of up to 25 W: absolute rounding.
        collapsed = float(truss.pulley_loss(p, alpha, 0.3, 12.0))
        assert collapsed == pytest.approx(pulley_by_pulley, rel=1e-12, abs=1e-13)


def test_motion_is_the_lagrange_equation_of_the_twin(twin):
    p = truss_of(6, mu=0.01)
    other = twin(p)
    alpha, omega, acc = 1.45, 0.2, -0.4
    inertia, slope, _, _ = other.kinetics(alpha)
    torque = inertia * acc + slope * omega**2 / 2 + other.damping(alpha) * omega
    force = (torque + other.potential(alpha)[1]) / other.rope(alpha)[2]
    assert truss.rope_force(p, alpha, omega, acc) == close(force)
    assert truss.angular_acceleration(p, alpha, omega, force) == close(acc)


@pytest.mark.parametrize("module", [1, 2, 5, 6])
def test_node_positions(twin, module):
    p = truss_of(6)
    alpha = 0.8
    nodes = twin(p).module(alpha, module - 1)
    for node in range(1, 15):
        position = truss.node_position(p, node, alpha, module=module)
        assert position.full().ravel() == pytest.approx(nodes[node], abs=1e-13)


def test_module_frame_is_the_global_frame_of_module_1():
    for node in range(1, 15):
        local = truss.node_position(truss.DYNAMIC_SET, node, 0.7)
        assert ca.norm_inf(local - truss.node_position(truss.DYNAMIC_SET, node, 0.7, module=1)) == 0
