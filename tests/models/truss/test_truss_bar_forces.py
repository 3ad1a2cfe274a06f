"""Forces in the bars against equilibria that their formulas do not use."""

import dataclasses
import math

import numpy as np
import pytest

from models.truss import (
    DYNAMIC_SET,
    bar_forces,
    evaluate_motion,
    slider_distance,
    static_force,
)

ANGLES = np.radians([6.0, 30.0, 60.0, 79.0, 81.0, 84.5, 88.0])


@pytest.mark.parametrize("alpha", ANGLES)
def test_moments_of_half_a_cross_bar_balance_about_the_bar_end(alpha: float) -> None:
    """F c e / d = N b cos / sin holds only if link, net and rope fit the potential's own force."""
    truss = DYNAMIC_SET
    tension = float(static_force(truss, alpha))
    forces = [float(force) for force in bar_forces(truss, alpha, 0.0, 0.0, tension)]

    push = (forces[1] - tension) / math.sin(alpha)
    of_link = forces[0] * truss.crank * float(slider_distance(truss, alpha)) / truss.link
    of_ring = truss.half_cross_bar * math.cos(alpha) / math.sin(alpha) * push
    assert of_link == pytest.approx(of_ring, rel=1e-10, abs=1e-12)  # rounding


def test_links_carry_nothing_where_springs_and_ropes_balance() -> None:
    """While the net is slack and nothing moves, no part of the ring needs a force."""
    alpha = math.radians(40.0)
    link, outer, inner = bar_forces(DYNAMIC_SET, alpha, 0.0, 0.0, static_force(DYNAMIC_SET, alpha))
    assert float(link) == pytest.approx(0.0, abs=1e-12)
    assert float(outer) == pytest.approx(float(inner), rel=1e-12)


def test_the_open_net_presses_the_ring_together() -> None:
    """At 90 deg the cross-bars carry the rope's force and k2 b (1 - sin alpha_c) / (2 sin^2)."""
    truss = DYNAMIC_SET
    force = float(static_force(truss, math.pi / 2))
    net = truss.net_stiffness * truss.half_cross_bar * (1 - math.sin(truss.net_angle))
    push = net / (2 * math.sin(math.pi / truss.modules) ** 2)
    outer = float(bar_forces(truss, math.pi / 2, 0.0, 0.0, force).outer_cross_bar)
    assert outer == pytest.approx(force + push, rel=1e-12)


def test_a_motion_reports_the_largest_of_them() -> None:
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
    motion = evaluate_motion(truss, [1.0, 1.47], [0.1, 0.05], [0.2, -0.1])
    for k in range(2):
        state = (motion.angle[k], motion.speed[k], motion.acceleration[k], motion.rope_force[k])
        forces = [float(force) for force in bar_forces(truss, *state)]
        assert motion.bar_force[k] == pytest.approx(max(forces), rel=1e-12)


def test_acceleration_outward_pushes_the_sides() -> None:
    """By the momentum of the ring: n sides carry 2 pi / n of its radial inertia each."""
    truss, alpha = DYNAMIC_SET, math.radians(45.0)
    still, moved = (
        float(bar_forces(truss, alpha, 0.0, acc, 5.0).outer_cross_bar) for acc in (0.0, 1.0)
    )
    # M R'' / n acts on each corner of two faces; a corner's two sides hold it by 2 N sin(pi/n)
    mass = 0.1074 * 24 * (1.0 + 4 * 0.45 + 4 * 0.15)
    outward = 0.45 / math.sin(math.pi / 24) * math.cos(alpha)
    push = mass / 24 / 2 * outward / (2 * math.sin(math.pi / 24))
    assert moved - still == pytest.approx(push * math.sin(alpha), rel=1e-9)
