"""Forces in the bars of all modules against equilibria that their formulas do not use."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from models.truss import (
    DYNAMIC_SET,
    JointMasses,
    TrussParameters,
    bar_forces,
    buckling_shares,
    evaluate_motion,
    extreme_bar_forces,
    hoop_force,
    inertia_loads,
    largest_bar_force,
    module_shear,
    play_angle,
    ring_forces,
    rope_force,
    slider_distance,
    static_force,
    tension_ratios,
)
from tests.models.truss.ring_statics import of_all_joints
from tests.seeds import seeds

RIDGE = math.radians(84.34)


def three(truss: TrussParameters, alpha: float, tension: float) -> list[float]:
    """Link, outer and inner half of a cross-bar, at rest and in a module that stands for all."""
    forces = bar_forces(truss, alpha, 0.0, 0.0, tension, 1)
    return [float(forces[kind][0]) for kind in range(3)]


def rubbing(mu: float) -> TrussParameters:
    return dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)


def moving(seed: int) -> tuple[TrussParameters, tuple[float, float, float], int]:
    """A truss with all frictions and masses, a state of it, and a module."""
    draw = np.random.default_rng(seed)
    truss, _ = drawn(seed)
    truss = dataclasses.replace(
        truss,
        modules=int(draw.integers(3, 40)),
        joint_friction=draw.uniform(0, 1),
        slider_friction=draw.uniform(0, 9),
        pulley_friction=draw.uniform(0, 0.02),
        joint_coulomb=draw.uniform(0, 2),
        slider_coulomb=draw.uniform(0, 9),
        gravity=tuple(draw.uniform(-10, 10, 3)),
        off_load=draw.uniform(0, 1),
        off_load_friction=draw.uniform(0, 5),
        linear_density=draw.uniform(0.05, 2),
        joint_masses=JointMasses(*draw.uniform(0, 1, 4)),
        counting=draw.choice(["once", "as printed"]),
    )
    if seed % 2:  # some pulleys differ: a seized one, free ones, neighbours, and in the last module
        n = truss.modules
        places = {(1, 1), (n, 3), *((int(m), int(k)) for m, k in draw.integers(1, (n, 5), (3, 2)))}
        others = tuple((m, k, draw.choice([0.0, 0.05, 0.3])) for m, k in sorted(places))
        truss = dataclasses.replace(truss, other_pulleys=others)
    state = draw.uniform(0.1, 1.56), draw.uniform(0, 2), draw.uniform(-3, 3)
    return truss, state, int(draw.integers(1, truss.modules + 1))


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_half_a_cross_bar_does_not_turn_about_its_bar_end(seed: int) -> None:
    """At speed, too: only if rope, ring, inertia and friction fit the equation of motion (38)."""
    truss, state, module = moving(seed)
    alpha, omega, _ = state
    c, b, d = truss.crank, truss.half_cross_bar, truss.link
    sine, cosine = math.sin(alpha), math.cos(alpha)
    e = float(slider_distance(truss, alpha))
    h = e - c * cosine
    g = c * cosine / h

    tension = rope_force(truss, *state)
    links = bar_forces(truss, *state, tension, module).link
    loads, push = inertia_loads(truss, *state), hoop_force(truss, *state)
    turned = {name: float(x * cosine + z * sine) for name, (x, z) in loads._asdict().items()}
    of_crank = turned["inner"] + turned["outer"] + turned["crank"]
    twist = (truss.joint_friction * omega * (1 + 2 * g) + 2 * truss.joint_coulomb) / d
    of_joints = truss.joint_friction * omega * (1 + (1 + g) + 2) + 3 * truss.joint_coulomb
    shear = float(module_shear(truss, alpha, tension, module))
    for sign, link in zip((1, -1), links, strict=True):
        of_link = c * (float(link) * e * sine + twist * (c * sine**2 - h * cosine)) / d
        of_joint = b * (float(push) * cosine + sign * shear * sine - turned["middle"])
        moments = [of_link, c * of_crank, -of_joint, -of_joints]
        assert sum(moments) == pytest.approx(0.0, abs=1e-8 * max(map(abs, moments)))


@pytest.mark.parametrize("seed", range(10))
def test_sliders_pass_what_the_rope_pulls_more_than_on_average_as_shear(seed: int) -> None:
    """Round the ring, with the tensions of all segments one by one; the last slider closes it."""
    truss, (alpha, *_), _ = moving(seed)
    tension, n = 30.0, truss.modules
    ratios = tension * ca.DM(tension_ratios(truss, alpha)).full().ravel()
    pulls = np.array([ratios[4 * m + 3] + ratios[(4 * m + 4) % (4 * n)] for m in range(n)])
    shears = np.array([float(module_shear(truss, alpha, tension, m)) for m in range(1, n + 1)])

    e = float(slider_distance(truss, alpha))
    height = e - truss.crank * math.cos(alpha)
    step = truss.crank * e / (height * truss.half_cross_bar)
    expected = step * (pulls - pulls.mean())
    assert np.diff(np.append(shears, shears[0])) == pytest.approx(expected, abs=1e-10 * tension)
    assert shears.mean() == pytest.approx(0.0, abs=1e-10 * tension)


@pytest.mark.parametrize("seed", seeds(6, 20))
def test_no_module_has_a_larger_force_than_the_extremes(seed: int) -> None:
    truss, state, _ = moving(seed)
    largest = float(largest_bar_force(truss, *state, rope_force(truss, *state)))
    (found,) = ring_forces(truss, *([one] for one in state)).largest()
    assert found <= largest * (1 + 1e-12)


@pytest.mark.parametrize("mu", [0.0025, 0.005, 0.01])
def test_the_continuous_index_adds_at_most_half_a_percent(mu: float) -> None:
    shears = [float(module_shear(rubbing(mu), RIDGE, 1.0, m)) for m in range(1, 25)]
    forces = extreme_bar_forces(rubbing(mu), RIDGE, 0.0, 0.0, 1.0)
    at = {
        place: float(forces[f"left_link_{place}"] - forces[f"right_link_{place}"])
        for place in ("last", "between")
    }
    assert 1.0 <= at["between"] / at["last"] * shears[-1] / max(shears) < 1.005


# Two derivations by statics, one of which solved for all pin forces of all modules at once: motor
# force; least and largest force in a link; largest in a cross-bar; and the least that these can be
# over the self-stress, for links and for cross-bars. To the digits that were stated.
OF_ALL_MODULES = {
    0.0: (20.07, 14.93, 14.93, 47.18, 14.93, 47.18),
    0.0025: (24.26, -23, 53, 65, 45, 58.2),
    0.005: (28.94, -61, 91, 91, 74, 77.9),
    0.01: (39.64, -134, 164, 141, 132, 115.4),
}


@pytest.mark.parametrize("mu", OF_ALL_MODULES)
def test_forces_at_the_ridge_with_friction(mu: float) -> None:
    truss = rubbing(mu)
    forces = ring_forces(truss, [RIDGE], [0.0], [0.0])
    links, bars = forces.bars["link"], ("outer_cross_bar", "inner_cross_bar")
    found = [
        static_force(truss, RIDGE),
        links.min(),
        links.max(),
        *forces.largest(*bars),
        *forces.least_largest("link"),
        *forces.least_largest(*bars),
    ]
    for one, stated in zip(found, OF_ALL_MODULES[mu], strict=True):
        digits = len(str(stated).partition(".")[2])
        assert round(float(one), digits) == stated


def test_at_rest_few_links_are_both_pushed_and_pulled() -> None:
    angles = np.linspace(DYNAMIC_SET.stowed_angle, math.pi / 2, 2001)
    still = np.zeros_like(angles)
    forces = ring_forces(rubbing(0.01), angles, still, still)
    links = forces.bars["link"]
    both = (links.min(axis=0) < -1e-9) & (links.max(axis=0) > 1e-9)
    assert both.sum() == 6
    smaller = np.minimum(links.max(axis=0), -links.min(axis=0))
    assert forces.reversal() == smaller[both].max()
    assert np.abs(forces.crank_moment).max() == pytest.approx(10.4, abs=0.05)


def test_expressions_do_not_grow_with_the_ring() -> None:
    def size(modules: int) -> int:
        truss = dataclasses.replace(rubbing(0.01), modules=modules)
        symbols = [ca.SX.sym(name) for name in ("alpha", "omega", "acc", "tension")]
        forces = extreme_bar_forces(truss, *symbols)
        return ca.Function("f", symbols, [ca.vertcat(*forces.values())]).n_instructions()

    assert size(240) < 1.01 * size(6)  # constants that coincide are shared


def test_forces_are_smooth_where_friction_vanishes() -> None:
    """The slope by the friction, of the largest force in a link, from both formulas' ends."""
    at = [float(largest_bar_force(rubbing(mu), RIDGE, 0.0, 0.0, 20.0)) for mu in (0, 1e-8, 2e-8)]
    assert at[1] - at[0] == pytest.approx(at[2] - at[1], rel=1e-5)


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


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_forces_are_those_of_virtual_work(seed: int) -> None:
    truss, alpha = drawn(seed)
    tension, expected = by_virtual_work(truss, alpha)
    assert float(static_force(truss, alpha)) == pytest.approx(tension, rel=1e-9)
    found = three(truss, alpha, tension)
    assert found == pytest.approx(list(expected), rel=1e-8, abs=1e-8 * tension)


@pytest.mark.parametrize(
    ("degrees", "link", "outer", "inner"),
    [(82, 10.81, 31.07, 25.13), (84.34, 14.93, 47.18, 38.43), (88, 7.87, 53.60, 48.56)],
)
def test_forces_of_the_dynamic_set_at_rest(degrees, link, outer, inner) -> None:
    """To all digits of an independent derivation by statics."""
    alpha = math.radians(degrees)
    force = static_force(DYNAMIC_SET, alpha)
    assert three(DYNAMIC_SET, alpha, float(force)) == pytest.approx([link, outer, inner], abs=0.005)


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_those_of_all_joints_of_all_modules(seed: int) -> None:
    truss, alpha = drawn(seed)
    tension = float(static_force(truss, alpha))
    found = three(truss, alpha, tension)
    for forces in of_all_joints(truss, alpha, tension):
        assert forces == pytest.approx(found, rel=1e-8, abs=1e-8 * tension)


def test_links_carry_nothing_where_springs_and_ropes_balance() -> None:
    """While the net is slack and nothing moves, no part of the ring needs a force."""
    for alpha in np.radians([4.4, 40.0, 45.0, 79.0]):
        link, outer, inner = three(DYNAMIC_SET, alpha, float(static_force(DYNAMIC_SET, alpha)))
        assert link == pytest.approx(0.0, abs=1e-12)
        assert outer == pytest.approx(inner, rel=1e-12)


def test_the_open_net_presses_the_ring_together() -> None:
    """At 90 deg the cross-bars carry the rope's force and k2 b (1 - sin alpha_c) / (2 sin^2)."""
    truss = DYNAMIC_SET
    force = float(static_force(truss, math.pi / 2))
    net = truss.net_stiffness * truss.half_cross_bar * (1 - math.sin(truss.net_angle))
    push = net / (2 * math.sin(math.pi / truss.modules) ** 2)
    _, outer, _ = three(truss, math.pi / 2, force)
    assert outer == pytest.approx(force + push, rel=1e-12)


def test_a_motion_reports_the_largest_of_them() -> None:
    truss = rubbing(0.01)
    motion = evaluate_motion(truss, [1.0, 1.47], [0.1, 0.05], [0.2, -0.1])
    forces = ring_forces(truss, motion.angle, motion.speed, motion.acceleration)
    assert motion.bar_force == pytest.approx(forces.largest(), rel=1e-12)


@pytest.mark.parametrize("seed", seeds(6, 20))
def test_no_bar_of_any_module_is_closer_to_buckling_than_the_extremes(seed: int) -> None:
    """Of ropes that pull."""
    truss, (alpha, omega, acc), _ = moving(seed)
    state = (alpha, omega, abs(acc) + omega**2 * math.tan(alpha))
    tension = rope_force(truss, *state)
    assert tension > 0
    forces = ring_forces(truss, *([one] for one in state))
    pushes = [
        (truss.link, forces.bars["link"]),
        (truss.half_cross_bar, forces.bars["outer_cross_bar"]),
        (truss.half_cross_bar, forces.bars["inner_cross_bar"]),
        (truss.bar_length, forces.vertical_bar),
    ]
    # the tube of 20 and 18 mm, E = 70 GPa
    stiffness = 70e9 * math.pi / 64 * (0.020**4 - 0.018**4)
    share = max(push.max() * length**2 for length, push in pushes) / (math.pi**2 * stiffness)
    shares = buckling_shares(truss, *state, tension).values()
    found = max(float(one) for one in shares)
    assert share <= found * (1 + 1e-12)
    # only where the shear is largest between two modules may there be more
    assert found <= share + abs(share) * 0.05 * (truss.pulley_friction > 0)


def test_play_is_worth_more_where_the_slider_hardly_moves() -> None:
    """0.05 mm, by finite differences of the slider's way."""
    for degrees, worth in ((4.4, 0.22), (80.0, 0.025)):
        alpha, step = math.radians(degrees), 1e-6
        ends = [float(slider_distance(DYNAMIC_SET, alpha + s)) for s in (-step, step)]
        slope = abs(ends[1] - ends[0]) / (2 * step)
        found = float(play_angle(DYNAMIC_SET, alpha, 5e-5))
        assert found == pytest.approx(5e-5 / slope, rel=1e-6)
        assert math.degrees(found) == pytest.approx(worth, rel=0.03)
