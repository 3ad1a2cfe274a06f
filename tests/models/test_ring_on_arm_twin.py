"""The ring on the arm against virtual work of every particle, by another author."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from models.arm.parameters import ArmParameters
from models.laws import Bezier, Step5, paper_points
from models.ring_on_arm import RingOnArm, arm_motion, free_turn, held_moment, held_momentum
from models.truss import DYNAMIC_SET, TrussParameters, total_mass
from tests.models import ring_on_arm_twin as twin
from tests.seeds import seeds

SHARE = 1e-8  # of the largest number of each kind


def twin_of(arm: ArmParameters, truss: TrussParameters, towards: float) -> twin.Antenna:
    """The same antenna for the twin; only parameters are taken over."""
    ring = float(total_mass(truss))
    beams = (
        twin.Beam(link.length, link.linear_density, link.bending_stiffness)
        for link in (arm.big, arm.small)
    )
    return twin.Antenna(
        *beams,
        elbow=arm.elbow_mass,
        rest=arm.tip_mass - ring,
        hoop=ring,
        towards=towards,
        open_radius=truss.half_cross_bar / math.sin(math.pi / truss.modules),
        eta=arm.relaxation_time,
    )


def drawn(seed: int) -> tuple[RingOnArm, twin.Antenna, np.random.Generator]:
    """An antenna with random links, masses, damping and direction."""
    draw = np.random.default_rng(seed)
    truss = replace(
        DYNAMIC_SET,
        modules=int(draw.integers(6, 40)),
        half_cross_bar=draw.uniform(0.3, 0.45),
        linear_density=draw.uniform(0.02, 0.2),
    )
    default = ArmParameters()
    big, small = (replace(link, length=draw.uniform(1, 4)) for link in (default.big, default.small))
    arm = ArmParameters(
        big=big,
        small=small,
        tip_mass=float(total_mass(truss)) * draw.uniform(1, 4),
        elbow_mass=draw.uniform(0, 3),
        damping_ratio=draw.uniform(0, 0.02),
    )
    towards = draw.uniform(-math.pi, math.pi)
    return RingOnArm(arm, truss, towards), twin_of(arm, truss, towards), draw


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_the_ring_on_the_arm_moves_as_all_its_particles_do(seed: int) -> None:
    model, other, draw = drawn(seed)
    big, small = model.arm.big.length, model.arm.small.length
    sizes = np.array([0.1 * big, 0.15, 0.1 * small, 0.15])
    q, v = draw.uniform(-1, 1, 4) * sizes, draw.uniform(-2, 2, 4) * sizes
    alpha, omega, acc = draw.uniform(0.05, math.pi / 2), draw.uniform(0, 1), draw.uniform(-2, 2)

    rate, torque = model.response(q, v, alpha, omega, acc)
    expected, expected_torque, mass = twin.response(other, q, v, alpha, omega, acc)

    rate = rate.full().ravel()
    assert rate == pytest.approx(expected, rel=SHARE, abs=SHARE * np.abs(expected).max())
    assert float(torque) == pytest.approx(expected_torque, rel=SHARE)
    assert model.mass_matrix(q, alpha).full() == pytest.approx(mass, rel=SHARE, abs=SHARE)
    assert model.tip(q).full().ravel() == pytest.approx(twin.tip(other, q), rel=SHARE)


@pytest.mark.parametrize("seed", range(50, 60))
def test_energies_are_those_of_all_particles(seed: int) -> None:
    model, other, draw = drawn(seed)
    q, v = draw.uniform(-0.1, 0.1, 4), draw.uniform(-0.3, 0.3, 4)
    alpha = draw.uniform(0.05, math.pi / 2)

    # with the ring at rest on the arm: what the ring itself does as it opens is no part of the twin
    kinetic, strain = twin.energies(other, q, v, alpha, 0.0)

    assert float(model.kinetic_energy(q, v, alpha, 0.0)) == pytest.approx(kinetic, rel=SHARE)
    assert float(model.strain_energy(q)) == pytest.approx(strain, rel=SHARE)


@pytest.mark.parametrize("towards_deg", [0.0, 90.0])
def test_frequencies_are_those_of_all_particles(towards_deg: float) -> None:
    towards = math.radians(towards_deg)
    model = RingOnArm(ArmParameters(), DYNAMIC_SET, towards)
    other = twin_of(model.arm, DYNAMIC_SET, towards)

    for alpha in (math.radians(4.4), 0.8, math.pi / 2):
        still = np.zeros(4)
        mass = twin.response(other, still, still, alpha, 0.0, 0.0)[2]
        squares = scipy.linalg.eigvalsh(twin.stiffness(other), mass)
        frequencies = np.sqrt(squares) / (2 * math.pi)
        assert np.ravel(model.frequencies(alpha)) == pytest.approx(frequencies, rel=SHARE)


@pytest.mark.parametrize(("name", "left"), [("Bezier", 0.036), ("Step5", 0.022)])
def test_the_motion_under_a_law_is_that_of_the_particles(name: str, left: float) -> None:
    duration, stowed = 6.505, DYNAMIC_SET.stowed_angle
    laws = {
        "Bezier": Bezier(duration, paper_points(stowed, math.pi / 2)),
        "Step5": Step5(duration, stowed, math.pi / 2),
    }
    model = RingOnArm(ArmParameters(), DYNAMIC_SET, math.pi / 2)
    other = twin_of(model.arm, DYNAMIC_SET, math.pi / 2)
    motion = arm_motion(model, laws[name])

    times = np.linspace(0.05, 0.99, 40) * duration
    half = 1e-4  # [s] of a central difference
    ring = laws[name].motion(times)
    q, v = motion.at(times)
    q_rate, v_rate = (
        (after - before) / (2 * half)
        for before, after in zip(motion.at(times - half), motion.at(times + half), strict=True)
    )
    expected = np.column_stack(
        [
            twin.response(other, q[:, k], v[:, k], *at)[0]
            for k, at in enumerate(zip(ring.angle, ring.speed, ring.acceleration, strict=True))
        ]
    )
    end, end_rate = (values[:, 0] for values in motion.at([duration]))
    kept = sum(twin.energies(other, end, end_rate, math.pi / 2, 0.0))

    # what is left is the integrator's tolerance in the fast modes that the law's first jerk excites
    largest = np.abs(expected).max(axis=1, keepdims=True)
    assert q_rate == pytest.approx(v, abs=1e-6 * np.abs(v).max())
    assert v_rate / largest == pytest.approx(expected / largest, abs=1e-3)
    assert motion.residual_energy == pytest.approx(kept, rel=1e-6)
    assert kept == pytest.approx(left, abs=0.0006)


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_on_a_free_satellite_it_moves_as_all_its_particles_do(seed: int) -> None:
    held, other, draw = drawn(seed)
    inertia = 10 ** draw.uniform(1.5, 4)
    model = replace(held, satellite_inertia=inertia)
    sizes = np.array([0.1 * held.arm.big.length, 0.15, 0.1 * held.arm.small.length, 0.15])
    q, v = draw.uniform(-1, 1, 4) * sizes, draw.uniform(-2, 2, 4) * sizes
    ring = draw.uniform(0.05, math.pi / 2), draw.uniform(0, 1), draw.uniform(-2, 2)

    expected = twin.free_response(other, inertia + held.arm.hub_inertia, q, v, *ring)
    rate, torque = model.response(q, v, *ring)

    rate = rate.full().ravel()
    largest = np.abs(expected.second).max()
    assert rate == pytest.approx(expected.second, rel=SHARE, abs=SHARE * largest)
    assert float(torque) == pytest.approx(expected.torque, rel=SHARE)
    assert float(model.satellite_rate(q, v, *ring[:2])) == pytest.approx(expected.rate, rel=SHARE)
    assert float(model.root_moment(q, v, *ring)) == pytest.approx(expected.moment, rel=SHARE)
    # what the arm has is what the satellite has the other way
    momentum = float(model.angular_momentum(q, v, *ring[:2]))
    assert momentum == pytest.approx(-inertia * expected.rate, rel=SHARE)


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_what_a_ring_on_a_rigid_arm_hands_to_the_root(seed: int) -> None:
    held, other, draw = drawn(seed)
    still = np.zeros(4)
    alpha, omega, acc = draw.uniform(0.2, math.pi / 2), draw.uniform(0, 1), draw.uniform(-2, 2)
    sources = held.arm, held.truss, held.reaction_angle

    handed = twin.momentum(other, still, still, twin.Jet(alpha, omega), twin.Jet(0.0))
    assert float(held_momentum(*sources, alpha, omega)) == pytest.approx(handed, rel=SHARE)

    # the moment is the rate of it: the momentum is linear in the ring's rate
    step = 1e-5
    faster, slower = (
        twin.momentum(
            other, still, still, twin.Jet(alpha + way * omega, omega + way * acc), twin.Jet(0.0)
        )
        for way in (step, -step)
    )
    size = abs(handed) + abs(faster - slower) / (2 * step)
    moment = float(held_moment(*sources, alpha, omega, acc))
    assert moment == pytest.approx((faster - slower) / (2 * step), abs=1e-8 * size)

    inertia = 10 ** draw.uniform(1.5, 4)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    start = held.truss.stowed_angle
    angles = start + (alpha - start) * (1 + nodes) / 2
    rates = [
        -twin.momentum(other, still, still, twin.Jet(at, 1.0), twin.Jet(0.0))
        / (inertia + twin.momentum(other, still, still, twin.Jet(at), twin.Jet(0.0, 1.0)))
        for at in angles
    ]
    turn = (alpha - start) / 2 * (weights @ rates)
    assert float(free_turn(*sources, inertia, alpha)) == pytest.approx(turn, rel=SHARE)
