from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain, Link
from models.ancf.element import element_kernel
from models.ancf.joints import joint_angles
from models.ancf.state import posed
from models.errors import ModelError

SOFT = Link(1.0, 2.0e3, 3.0, 0.5)
STIFF = Link(0.7, 5.0e4, 20.0, 0.8)
CHAIN = Chain((SOFT, STIFF), 3, masses=(0.0, 0.2, 1.5), hub_inertia=0.3, gravity=(0.5, -9.81))


def bent(chain: Chain) -> np.ndarray:
    asm = assemble(chain)
    x = asm.gather(posed(chain, [0.3, 0.8][: len(chain.links)]).q)
    return x + 0.02 * np.random.default_rng(1).normal(size=x.size)


def by_elements(chain: Chain, q: np.ndarray) -> tuple[float, np.ndarray]:
    kernel, energy, gradient = element_kernel(), 0.0, np.zeros(chain.size)
    for k, link in enumerate(chain.links):
        for i in range(chain.elements):
            at = chain.slots(k, i)[0] + np.arange(8)
            u, g, _ = kernel(
                q[at], link.axial_stiffness, link.bending_stiffness, link.length / chain.elements
            )
            energy += float(u)
            gradient[at] += np.array(g)[:, 0]
    return energy, gradient


@pytest.mark.parametrize("elements", [3, 40])  # dense and sparse storage
def test_chain_energy_is_the_sum_of_the_casadi_elements(elements):
    chain = replace(CHAIN, elements=elements)
    full, merged = assemble(chain, merged=False), assemble(chain)
    x = bent(chain)
    q = merged.spread(x)
    energy, _ = by_elements(chain, q)
    assert full.strain_energy(q[:, None])[0] == pytest.approx(energy, rel=1e-11)
    assert merged.strain_energy(x[:, None])[0] == pytest.approx(energy, rel=1e-11)


@pytest.mark.parametrize("elements", [3, 40])
def test_tangent_is_the_derivative_of_the_force_of_the_elements(elements):
    chain = replace(CHAIN, elements=elements)
    asm, x = assemble(chain), bent(chain)

    def force(x: np.ndarray) -> np.ndarray:
        total = np.zeros(asm.size + 1)  # the last one: where coordinates are fixed
        np.add.at(total, asm.place, by_elements(chain, asm.spread(x))[1])
        return total[:-1]

    tangent = asm.tangent(x)
    for step in 1e-6 * np.random.default_rng(2).normal(size=(3, x.size)):
        slope = (force(x + step) - force(x - step)) / 2e-6
        assert slope == pytest.approx(tangent @ step / 1e-6, abs=1e-7 * np.abs(tangent).max())


def test_mass_of_a_rigid_turn_is_the_rigid_inertia():
    asm = assemble(replace(CHAIN, pinned=True))
    q = posed(CHAIN).q
    turn = np.stack((-q[1::2], q[0::2]), axis=1).ravel()
    rate = asm.gather(turn)
    a, b = CHAIN.links
    inertia = (
        0.3 + a.linear_density / 3 + b.linear_density * ((1.7**3 - 1) / 3) + 0.2 + 1.5 * 1.7**2
    )
    assert rate @ dense(asm.mass) @ rate == pytest.approx(inertia, rel=1e-12)


def test_gravity_moves_the_whole_weight():
    flying = replace(CHAIN, pinned=False, masses=(0.4, 0.2, 1.5))
    asm = assemble(flying)
    weight = sum(k.length * k.linear_density for k in flying.links) + 2.1
    for axis in (0, 1):
        shift = np.zeros(flying.size)
        shift[axis::4] = 1.0
        assert asm.gravity @ asm.gather(shift) == pytest.approx(weight * flying.gravity[axis])


def test_gravity_on_a_pinned_chain_is_that_of_a_flying_one_but_for_the_root():
    fixed, flying = assemble(CHAIN), assemble(replace(CHAIN, pinned=False))
    assert fixed.gravity == pytest.approx(flying.gravity[2:], rel=1e-14)


def test_band_is_narrow_whatever_the_mesh():
    for elements in (1, 2, 9):
        mass = dense(
            assemble(replace(CHAIN, elements=elements)).tangent(
                bent(replace(CHAIN, elements=elements))
            )
        )
        rows, cols = np.nonzero(mass)
        assert np.abs(rows - cols).max() <= 7


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
@settings(max_examples=30, deadline=None)
def test_posed_chain_has_the_angles_asked_for_and_no_strain(angles):
    chain = Chain((SOFT, STIFF, SOFT), 2)
    state = posed(chain, angles)
    assert joint_angles(chain, state.q[:, None])[:, 0] == pytest.approx(angles, abs=1e-12)
    assert assemble(chain, merged=False).strain_energy(state.q[:, None])[0] < 1e-12


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Link(0.0, 1.0, 1.0, 1.0), "length is 0"),
        (lambda: Link(1.0, -2.0, 1.0, 1.0), "axial stiffness is -2"),
        (lambda: Link(1.0, 1.0, float("nan"), 1.0), "bending stiffness is nan"),
        (lambda: Link(1.0, 1.0, 1.0, -0.1), "linear density is -0.1"),
        (lambda: Link.from_section(1.0, area=0, second_moment=1, modulus=1, density=1), "area"),
        (lambda: Chain(()), "links is empty"),
        (lambda: Chain((SOFT,), 0), "elements is 0"),
        (lambda: Chain((SOFT,), 2.5), "elements is 2.5"),
        (lambda: Chain((SOFT,), True), "elements is True; give a whole number"),
        (lambda: Chain((SOFT,), "8"), "elements is '8'; give a whole number"),
        (lambda: Chain((SOFT,), gravity=("0", "-9.81")), "gravity is .*'-9.81'.*; give a tuple"),
        (lambda: Chain((SOFT,), gravity=(0.0,)), "gravity is .*; give a tuple of two finite"),
        (lambda: Chain((SOFT,), gravity=5), "gravity is 5; give a tuple"),
        (lambda: Chain((SOFT,), gravity=(0.0, float("nan"))), "two finite accelerations"),
        (lambda: Chain((SOFT,), masses=(1.0,)), "1 masses for 1 links"),
        (lambda: Chain((SOFT,), masses=(0.0, -1.0)), "mass 1 is -1"),
        (lambda: Chain((SOFT,), damping_ratio=-0.1), "damping ratio is -0.1"),
        (lambda: Chain((SOFT,), hub_inertia=-1), "hub inertia is -1"),
        (lambda: posed(CHAIN, [0.0]), "1 angles for 2 links"),
    ],
)
def test_bad_input_names_thing_value_and_remedy(build, words):
    with pytest.raises(ModelError, match=words) as caught:
        build()
    assert str(caught.value).count(". ") == 0  # one sentence
