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
from tests.models.truss.ring_statics import of_all_joints

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


def rods(alpha, tension, lengths, at=DYNAMIC_SET, net_radius=None):
    """Potential of springs, net and ropes for any lengths of crank, half cross-bar and link [J]."""
    crank, half, link = lengths
    n, sine = at.modules, np.sin(alpha)
    slider = crank * np.cos(alpha) + np.sqrt(link**2 - crank**2 * sine**2)
    radius = half * sine / math.sin(math.pi / n)
    springs = n * at.spring_stiffness * (at.spring_free_length - slider) ** 2
    net = n * at.net_stiffness * (radius - net_radius) ** 2
    return springs + net + 4 * n * tension * (slider + half)


def by_virtual_work(truss, alpha):
    """Tension at rest, and compression of link, outer and inner cross-bar: dPi / dlength.

    Derivatives by complex steps, which round nothing; the tension makes that by alpha vanish.
    """
    lengths = np.array([truss.crank, truss.half_cross_bar, truss.link])
    radius = truss.half_cross_bar * math.sin(truss.net_angle) / math.sin(math.pi / truss.modules)

    def slope(tension, by):
        step = 1e-30
        moved = lengths + (1j * step * np.eye(3)[by] if by >= 0 else 0)
        angle = alpha + (1j * step if by < 0 else 0)
        return rods(angle, tension, moved, truss, radius).imag / step

    held, one = slope(0.0, -1), slope(1.0, -1)
    tension = held / (held - one)
    by_crank, by_half, by_link = (slope(tension, k) / (4 * truss.modules) for k in range(3))
    return tension, (by_link, by_half, by_crank + by_half)


def drawn(seed):
    """A truss and an angle at which link, spring and net all act."""
    draw = np.random.default_rng(seed)
    crank = draw.uniform(0.06, 0.14)
    truss = dataclasses.replace(
        DYNAMIC_SET,
        modules=int(draw.integers(6, 40)),
        bar_length=draw.uniform(0.9, 1.4),
        half_cross_bar=draw.uniform(0.3, 0.44),
        crank=crank,
        link=crank * draw.uniform(1.2, 2.0),
        spring_stiffness=draw.uniform(20, 400),
        spring_free_length=draw.uniform(0.43, 0.5),
        net_stiffness=draw.uniform(50, 500),
        net_angle=math.radians(draw.uniform(60, 80)),
    )
    return truss, draw.uniform(truss.net_angle + 0.02, math.radians(89.5))


@pytest.mark.parametrize("seed", range(50))
def test_forces_are_those_of_virtual_work(seed: int) -> None:
    truss, alpha = drawn(seed)
    tension, expected = by_virtual_work(truss, alpha)
    assert float(static_force(truss, alpha)) == pytest.approx(tension, rel=1e-9)
    found = [float(force) for force in bar_forces(truss, alpha, 0.0, 0.0, tension)]
    assert found == pytest.approx(list(expected), rel=1e-8, abs=1e-8 * tension)


@pytest.mark.parametrize(
    ("degrees", "link", "outer", "inner"),
    [(82, 10.81, 31.07, 25.13), (84.34, 14.93, 47.18, 38.43), (88, 7.87, 53.60, 48.56)],
)
def test_forces_of_the_dynamic_set_at_rest(degrees, link, outer, inner) -> None:
    """To all digits of an independent derivation by statics."""
    alpha = math.radians(degrees)
    force = static_force(DYNAMIC_SET, alpha)
    found = [float(one) for one in bar_forces(DYNAMIC_SET, alpha, 0.0, 0.0, force)]
    assert found == pytest.approx([link, outer, inner], abs=0.005)


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_those_of_all_joints_of_all_modules(seed: int) -> None:
    truss, alpha = drawn(seed)
    tension = float(static_force(truss, alpha))
    found = [float(force) for force in bar_forces(truss, alpha, 0.0, 0.0, tension)]
    for forces in of_all_joints(truss, alpha, tension):
        assert forces == pytest.approx(found, rel=1e-8, abs=1e-8 * tension)


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
