from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from models.ancf.analysis import equilibrium, natural_modes
from models.ancf.chain import Chain, Link
from models.ancf.joints import Free, Locked, Torque
from models.ancf.state import NodalState, posed
from models.errors import ModelError

BEAM = Link(2.0, 1.0e7, 500.0, 0.8)
OMEGA = np.sqrt(500.0 / 0.8) / 2.0**2  # sqrt(EI / rho A) / L^2


def exact(characteristic, brackets) -> np.ndarray:
    roots = np.array([brentq(characteristic, *b, xtol=1e-14) for b in brackets])
    return roots**2 * OMEGA / (2 * np.pi)


def clamped_exact() -> np.ndarray:
    return exact(lambda k: np.cos(k) * np.cosh(k) + 1, [(1, 3), (4, 6), (7, 9)])


def pinned_exact() -> np.ndarray:
    return exact(lambda k: np.tan(k) - np.tanh(k), [(3.2, 4.6), (6.5, 7.8), (9.6, 10.9)])


@pytest.mark.parametrize(
    ("root", "wanted"), [(Locked(0.3), clamped_exact()), (Free(), pinned_exact())]
)
def test_frequencies_of_one_beam_are_those_of_euler_bernoulli(root, wanted):
    chain = Chain((BEAM,), 24)
    modes = natural_modes(chain, [root], posed(chain, [0.3]), count=3)
    assert modes.frequencies == pytest.approx(wanted, rel=3e-5)  # cubic element, 8 a half wave
    assert modes.axial_fraction.max() < 1e-6


def test_frequency_converges_with_order_four():
    errors = []
    for elements in (4, 8):
        chain = Chain((BEAM,), elements)
        modes = natural_modes(chain, [Locked(0.0)], posed(chain), count=2)
        errors.append(modes.frequencies[1] / clamped_exact()[1] - 1)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_axial_mode_is_told_apart():
    chain = Chain((replace(BEAM, axial_stiffness=2.0e5),), 16)
    modes = natural_modes(chain, [Locked(0.0)], posed(chain), count=6)
    wave = np.sqrt(2.0e5 / 0.8) / (4 * 2.0)
    # |r''| of (7) also sees stretch: EI k^2 / EA = 1.5e-3 in the stiffness
    assert modes.axial[0] == pytest.approx(wave, rel=1e-3)
    assert modes.bending[:3] == pytest.approx(clamped_exact(), rel=1e-4)


def test_static_deflection_of_a_cantilever():
    chain = Chain((BEAM,), 8, gravity=(0.0, -0.05))
    tip = equilibrium(chain, [Locked(0.0)], posed(chain)).q[-3]
    assert tip == pytest.approx(-0.8 * 0.05 * 2.0**4 / (8 * 500.0), rel=1e-5)


def test_equilibrium_of_a_mechanism_is_refused():
    chain = Chain((BEAM, BEAM), 4)
    with pytest.raises(ModelError, match="can move without force"):
        equilibrium(chain, [Locked(0.0), Torque(lambda t: 1.0 + 0 * t)], posed(chain))


def test_large_sag_balances_and_keeps_its_length():
    chain = Chain((BEAM,), 12, gravity=(0.0, -300.0))
    rest = equilibrium(chain, [Locked(0.0)], posed(chain))
    modes = natural_modes(chain, [Locked(0.0)], rest, count=2)  # balanced, or this raises
    assert rest.q[-3] < -0.5
    ends = rest.q.reshape(-1, 4)[:, :2]
    assert np.hypot(*np.diff(ends, axis=0).T).sum() == pytest.approx(2.0, rel=2e-3)
    assert modes.frequencies[0] > 0


def test_hanging_chain_swings_like_a_pendulum():
    stiff = Link(1.0, 1e8, 1e5, 1e-3)
    chain = Chain((stiff,), 2, masses=(0.0, 10.0), gravity=(0.0, -9.81))
    hanging = equilibrium(chain, [Free()], posed(chain, [-np.pi / 2]))
    modes = natural_modes(chain, [Free()], hanging, count=1)
    assert modes.frequencies[0] == pytest.approx(
        np.sqrt(9.81) / (2 * np.pi), rel=1e-3
    )  # stiff: round-off


def test_upright_pendulum_is_refused():
    chain = Chain((BEAM,), 2, gravity=(0.0, -9.81))
    upright = equilibrium(chain, [Free()], posed(chain, [np.pi / 2]))
    with pytest.raises(ModelError, match="unstable"):
        natural_modes(chain, [Free()], upright, count=1)


def test_shapes_have_unit_modal_mass():
    from models.ancf.assembly import assemble, dense

    chain = Chain((BEAM, BEAM), 4)
    modes = natural_modes(chain, [Free(), Locked(0.5)], posed(chain, [0, 0.5]), count=3)
    mass = dense(assemble(chain, merged=False).mass)
    assert modes.shapes.T @ mass @ modes.shapes == pytest.approx(np.eye(3), abs=1e-9)


def test_modes_that_a_mesh_does_not_resolve_may_be_left_out():
    coarse, fine = Chain((BEAM,), 3), Chain((BEAM,), 12)
    few = natural_modes(coarse, [Locked(0.0)], posed(coarse), count=6, resolved=True)
    asked = natural_modes(fine, [Locked(0.0)], posed(fine), count=6, resolved=True)
    assert 1 <= len(few.frequencies) < 6
    assert few.shapes.shape[1] == len(few.axial_fraction) == len(few.frequencies)
    assert few.frequencies == pytest.approx(asked.frequencies[: len(few.frequencies)], rel=1e-2)
    assert len(asked.frequencies) == 6


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: natural_modes(c, [Locked(0.0)], posed(c), count=6), "too coarse .* at least"),
        (lambda c: natural_modes(c, [Locked(0.0)], posed(c), count=60), "60 modes asked"),
        (
            lambda c: natural_modes(replace(c, gravity=(0, -9.81)), [Locked(0.0)], posed(c)),
            "no equilibrium",
        ),
        (
            lambda c: natural_modes(c, [Locked(0.0)], NodalState(posed(c, [0.1]).q, posed(c).v)),
            "starts at 0.1",
        ),
    ],
)
def test_bad_input_names_thing_value_and_remedy(call, words):
    with pytest.raises(ModelError, match=words):
        call(Chain((BEAM,), 3))
