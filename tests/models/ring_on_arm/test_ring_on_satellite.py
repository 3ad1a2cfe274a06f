"""Arm and ring on the satellite: momenta by closed forms, turns under any law, Lagrange."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from models.arm.parameters import ArmParameters
from models.errors import ModelError
from models.laws import Bezier, Step5, paper_points
from models.ring_on_arm import RingOnArm, arm_motion, free_turn, held_moment, held_momentum
from models.truss import DYNAMIC_SET, ring_radius, total_mass

ARM, H, ACROSS, OPEN = ArmParameters(), 2000.0, math.pi / 2, math.pi / 2
RING = float(total_mass(DYNAMIC_SET))
HEAVY = replace(DYNAMIC_SET, linear_density=DYNAMIC_SET.linear_density * 30 / RING)
ALONE = replace(ARM, tip_mass=RING)
ROUNDED = replace(ARM, tip_mass=30.0 + 1e-9)


def bezier(duration):
    return Bezier(duration, paper_points(DYNAMIC_SET.stowed_angle, OPEN))


@pytest.mark.parametrize(("duration", "momentum"), [(140, 2.25), (10, 31.5), (6.5, 48.5)])
def test_momentum_that_the_ring_hands_to_a_held_root(duration, momentum) -> None:
    motion = bezier(duration).motion(np.linspace(0.0, duration, 4001))
    handed = np.array(held_momentum(ARM, DYNAMIC_SET, ACROSS, motion.angle, motion.speed)).ravel()
    assert handed.max() == pytest.approx(momentum, rel=2.5e-3)  # of three digits
    state = motion.angle, motion.speed, motion.acceleration
    moment = np.array(held_moment(ARM, DYNAMIC_SET, ACROSS, *state)).ravel()
    gained = np.cumsum((moment[1:] + moment[:-1]) / 2) * duration / 4000
    assert gained == pytest.approx(handed[1:], abs=1e-5 * momentum)  # the trapezoidal rule


@pytest.mark.parametrize(
    ("arm", "truss", "degrees", "digit"),
    [
        (ALONE, DYNAMIC_SET, 3.46, 0.005),
        (ARM, DYNAMIC_SET, 2.81, 0.005),
        (ROUNDED, HEAVY, 9.1, 0.05),
    ],
    ids=["8.764 kg", "30 kg with a ring of 8.764 kg", "a ring of 30 kg"],
)
def test_turn_of_a_free_satellite(arm, truss, degrees, digit) -> None:
    turned = -math.degrees(free_turn(arm, truss, ACROSS, H, OPEN))
    assert turned == pytest.approx(degrees, abs=1.01 * digit)
    # the same under any law that is so slow that the arm hardly bends
    for law in (bezier(40.0), Step5(50.0, truss.stowed_angle, OPEN)):
        moved = arm_motion(RingOnArm(arm, truss, satellite_inertia=H), law)
        reached = -math.degrees(moved.satellite_turn(law.duration)[0])
        assert reached == pytest.approx(turned, rel=1e-3)


def test_turn_with_the_ring_as_a_particle_at_the_tip() -> None:
    """3.6 deg of 2236 kg m^2: the momentum over an inertia that does not change."""
    inertia = H + ALONE.root_inertia(0.0)
    assert inertia == pytest.approx(2236, abs=0.5)
    grown = float(
        ring_radius(DYNAMIC_SET, OPEN) - ring_radius(DYNAMIC_SET, DYNAMIC_SET.stowed_angle)
    )
    assert math.degrees(5.0 * RING * grown / inertia) == pytest.approx(3.6, abs=0.05)


@pytest.mark.parametrize("gamma", [0.3, 1.2, 2.5])
def test_turn_is_the_integral_of_the_closed_forms_rate(gamma) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = (OPEN - DYNAMIC_SET.stowed_angle) / 2
    alpha = DYNAMIC_SET.stowed_angle + half * (1 + nodes)
    R = np.array(ring_radius(DYNAMIC_SET, alpha)).ravel()
    inertia = H + ARM.root_inertia(0.0) + 2 * RING * (5.0 * math.cos(gamma) * R + R**2)
    rate = np.array(held_momentum(ARM, DYNAMIC_SET, gamma, alpha, 1.0)).ravel() / inertia
    turned = free_turn(ARM, DYNAMIC_SET, gamma, H, OPEN)
    assert turned == pytest.approx(-half * weights @ rate, rel=1e-12)


@pytest.mark.parametrize("degrees", [90.0, 35.0])
def test_response_is_that_of_lagrange_with_the_satellites_angle(degrees) -> None:
    """By derivatives of the kinetic energy of a held arm that is turned, at random states."""
    gamma = math.radians(degrees)
    model = RingOnArm(ARM, DYNAMIC_SET, gamma, satellite_inertia=H)
    q, v, a = (ca.SX.sym(name, 5) for name in "qva")  # the satellite's angle is the first
    alpha, omega, acc = (ca.SX.sym(name) for name in ("alpha", "omega", "acc"))

    # places in fixed axes: the tip, and the centre with the hoop's turn
    free = replace(model.carrier, root_lock=None)
    shape = ca.vertcat(q[1:])
    turned = ca.vertcat(
        ca.horzcat(ca.cos(q[0]), -ca.sin(q[0])), ca.horzcat(ca.sin(q[0]), ca.cos(q[0]))
    )
    R, turn = ring_radius(DYNAMIC_SET, alpha), model.turn(shape)
    c = turned @ (model.tip(shape) + R * ca.vertcat(ca.cos(turn + gamma), ca.sin(turn + gamma)))
    moved = ca.jtimes(c, q, v) + ca.jtimes(c, alpha, omega)
    spin = ca.jtimes(turn + q[0], q, v)
    kinetic = free.kinetic_energy(q, v) + H * v[0] ** 2 / 2
    kinetic += RING * (ca.sumsqr(moved) + R**2 * spin**2) / 2
    momentum = ca.gradient(kinetic, v)
    rate = ca.jtimes(momentum, v, a) + ca.jtimes(momentum, q, v)
    rate += ca.jtimes(momentum, alpha, omega) + ca.jtimes(momentum, omega, acc)
    left = rate - ca.gradient(kinetic, q) + ca.gradient(free.strain_energy(q), q)
    lagrange = ca.Function("lagrange", [q, v, a, alpha, omega, acc], [left, momentum[0]])

    rng = np.random.default_rng(59)
    for _ in range(20):
        bent, rates = 0.05 * rng.standard_normal(4), 0.2 * rng.standard_normal(4)
        ring = rng.uniform(0.1, 1.5), rng.uniform(0.0, 1.0), rng.normal()
        state = bent, rates, *ring
        satellite = float(model.satellite_rate(*state[:4]))
        acceleration = model.response(*state)[0].full()[:, 0]
        moment = float(model.root_moment(*state))
        place = np.append(0.0, bent), np.append(satellite, rates)
        forces, total = lagrange(*place, np.append(-moment / H, acceleration), *ring)
        # what is left is rounding of terms of up to 1e4 N
        assert forces.full()[:, 0] == pytest.approx(np.zeros(5), abs=1e-8)
        assert float(total) == pytest.approx(0.0, abs=1e-9)


def test_moment_at_a_held_root_is_the_rate_of_the_momentum() -> None:
    moved = arm_motion(RingOnArm(ARM, DYNAMIC_SET), bezier(6.5))
    edges = np.linspace(0.0, 6.5, 1301)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = edges[1] / 2
    inside = (edges[:-1, None] + half * (1 + nodes)).ravel()
    gained = np.cumsum(moved.root_moment(inside).reshape(-1, 8) @ weights * half)
    handed = moved.angular_momentum(edges)
    assert handed[1:] - handed[0] == pytest.approx(gained, abs=1e-6 * np.abs(handed).max())
    assert moved.satellite_turn(edges) == pytest.approx(np.zeros(edges.size))


def test_arm_and_ring_on_a_heavy_satellite_move_as_on_a_held_one() -> None:
    held, heavy = (
        arm_motion(RingOnArm(ARM, DYNAMIC_SET, satellite_inertia=H), bezier(6.505))
        for H in (None, 1e10)
    )
    times = np.linspace(0.0, 6.505, 50)
    assert heavy.tip(times) == pytest.approx(held.tip(times), abs=1e-7)
    assert heavy.angular_momentum(times) == pytest.approx(held.angular_momentum(times), abs=1e-4)


def test_what_no_model_holds_for_is_refused() -> None:
    with pytest.raises(ModelError, match="2000 kg m\\^2 is free to turn, but the ring does not"):
        RingOnArm(ARM, DYNAMIC_SET, turns=False, satellite_inertia=H)
    with pytest.raises(ModelError, match="satellite inertia is -1; give a finite value"):
        free_turn(ARM, DYNAMIC_SET, ACROSS, -1.0, OPEN)
