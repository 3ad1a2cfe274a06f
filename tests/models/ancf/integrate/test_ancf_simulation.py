import logging
from dataclasses import replace

import numpy as np
import pytest

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain, Link
from models.ancf.integrate import StepControl, integrator, simulate
from models.ancf.joints import Driven, Free, Locked, Torque, breakpoints
from models.ancf.state import NodalState, posed
from models.errors import ModelError

LINK = Link(1.0, 2.0e4, 2.0, 0.5)
PAIR = Chain((LINK, LINK), 4, masses=(0.0, 0.1, 0.5))
TIMES = np.linspace(0.0, 0.5, 21)


def quarter(q: np.ndarray) -> np.ndarray:
    """Rate of a unit turn about the origin."""
    return np.stack((-q[1::2], q[0::2]), axis=1).reshape(q.shape)


def angular_momentum(chain: Chain, q: np.ndarray, v: np.ndarray) -> float:
    mass = dense(assemble(chain, merged=False).mass)
    return float(quarter(q) @ mass @ v)


def spun(chain: Chain, angles=(0.2, 0.6), rate=2.0) -> NodalState:
    state = posed(chain, angles)
    return NodalState(state.q, rate * quarter(state.q))


def test_flying_chain_keeps_momentum_and_energy():
    chain = replace(PAIR, pinned=False, masses=())
    state = posed(chain, [0.2, 0.6])
    rng = np.random.default_rng(3)
    asm = assemble(chain)
    state = NodalState(state.q, asm.spread(0.3 * rng.normal(size=asm.size)))
    run = simulate(chain, [Free(), Free()], state, TIMES / 5, settings=StepControl(1e-9))
    mass = dense(assemble(chain, merged=False).mass)
    for axis in (0, 1):
        shift = np.zeros(chain.size)
        shift[axis::4] = 1.0
        momentum = shift @ mass @ run.v
        assert momentum == pytest.approx(np.full(21, momentum[0]), abs=1e-9)
    spin = [angular_momentum(chain, q, v) for q, v in zip(run.q.T, run.v.T, strict=True)]
    assert spin == pytest.approx(np.full(21, spin[0]), abs=1e-7)  # random start: stiff modes ring
    # Radau damps the stiffest of them: energy may only fall
    assert run.energy[-1] <= run.energy[0] * (1 + 1e-9)


def test_torque_work_equals_energy_gained():
    torque = Torque(lambda t: np.where(t < 0.2, 1.0, -0.5), breakpoints=(0.2,))
    run = simulate(
        PAIR, [torque, Free()], posed(PAIR, [0.0, 2.0]), TIMES, settings=StepControl(1e-8)
    )
    gained = run.energy - run.energy[0]
    assert run.work[0] == pytest.approx(gained, abs=1e-6 * run.kinetic.max())
    assert run.work[1] == pytest.approx(np.zeros(21), abs=0)
    assert run.torque[0] == pytest.approx(np.where(TIMES < 0.2, 1.0, -0.5))
    assert run.drift < 1e-6 * run.kinetic.max()


def test_elbow_torque_keeps_angular_momentum_of_a_pinned_chain():
    run = simulate(
        PAIR,
        [Free(), Torque(lambda t: np.sin(5 * t))],
        posed(PAIR),
        TIMES,
        settings=StepControl(1e-9),
    )
    assert run.work[1, -1] > 1e-3
    assert angular_momentum(PAIR, run.q[:, -1], run.v[:, -1]) == pytest.approx(0.0, abs=1e-8)


def test_damping_balances_and_leaves_rigid_motion_alone():
    damped = replace(PAIR, damping_ratio=0.05, damping_frequency=5.0)
    kick = Torque(lambda t: 20 * np.sin(20 * t))
    run = simulate(damped, [kick, Free()], posed(damped), TIMES, settings=StepControl(1e-9))
    assert run.dissipated[-1] > 1e-2 * run.work[0, -1]
    balance = run.energy + run.dissipated - run.work.sum(axis=0)
    assert balance == pytest.approx(np.zeros(21), abs=1e-6 * run.kinetic.max())
    single = Chain((LINK,), 4, damping_ratio=0.5)
    free = replace(single, pinned=False)
    state = posed(free)
    spin = NodalState(state.q, 1e-3 * quarter(state.q))  # slow: no stretch worth the name
    turning = simulate(free, [Free()], spin, TIMES, settings=StepControl(1e-10))
    assert turning.dissipated[-1] < 1e-6 * turning.kinetic[0]


def test_damping_has_the_ratio_stated():
    # logarithmic decrement of a clamped beam in its first mode
    from models.ancf.analysis import natural_modes

    chain = Chain((LINK,), 4)
    mode = natural_modes(chain, [Locked(0.0)], posed(chain), count=1)
    f = float(mode.frequencies[0])
    damped = replace(chain, damping_ratio=0.02, damping_frequency=f)
    start = NodalState(posed(chain).q, 1e-4 * mode.shapes[:, 0])
    times = np.array([0.0, 5 / f])
    run = simulate(damped, [Locked(0.0)], start, times, settings=StepControl(1e-12))
    ratio = np.log(run.energy[0] / run.energy[-1]) / (2 * 5 * 2 * np.pi)
    assert ratio == pytest.approx(0.02, rel=2e-3)  # zeta^2 and the kinetic-strain swing


def test_driven_joint_follows_and_its_reaction_does_the_work():
    angle = Driven(lambda t: 0.5 * t**3, lambda t: 1.5 * t**2, lambda t: 3.0 * t)
    run = simulate(PAIR, [Locked(0.0), angle], posed(PAIR), TIMES, settings=StepControl(1e-9))
    assert run.joint_angles()[1] == pytest.approx(0.5 * TIMES**3, abs=1e-12)
    assert run.work.sum(axis=0) == pytest.approx(run.energy - run.energy[0], abs=1e-8)
    assert run.work[0] == pytest.approx(np.zeros(21), abs=1e-14)  # the clamp does none


@pytest.mark.parametrize(
    "joints",
    [
        [Free(), Free()],
        [Locked(0.2), Free()],
        [Torque(lambda t: 1 + t), Locked(0.6)],
        [Free(), Driven(lambda t: 0.6 + t**3, lambda t: 3 * t**2, lambda t: 6 * t)],
    ],
)
def test_both_forms_move_alike(joints):
    chain = replace(PAIR, elements=2, gravity=(0.0, -9.81))
    runs = [
        simulate(
            chain,
            joints,
            posed(chain, [0.2, 0.6]),
            TIMES[:9],
            form=form,
            settings=StepControl(1e-10),
        )
        for form in ("minimal", "index-1")
    ]
    assert runs[1].q == pytest.approx(runs[0].q, abs=1e-9)
    assert runs[1].torque == pytest.approx(runs[0].torque, abs=1e-4)
    assert runs[1].violation.max() < 1e-9
    assert runs[0].violation.max() < 1e-13


def test_locked_elbow_turns_as_one_rigid_body_when_stiff():
    stiff = Link(1.0, 1e8, 1e6, 0.5)
    chain = Chain((stiff, stiff), 1)
    run = simulate(
        chain,
        [Torque(lambda t: 0 * t + 0.7), Locked(np.pi / 2)],
        posed(chain, [0.0, np.pi / 2]),
        TIMES,
        settings=StepControl(1e-8),
    )
    inertia = 0.5 / 3 + 0.5 * (1 + 0.25 + 1 / 12)
    assert run.joint_angles()[0, -1] == pytest.approx(0.5 * 0.7 / inertia * 0.25, rel=1e-4)


def test_statistics_and_progress(monkeypatch, caplog):
    monkeypatch.setattr(integrator, "_PROGRESS", 0.0)
    with caplog.at_level(logging.INFO):
        run = simulate(PAIR, [Free(), Free()], spun(PAIR), TIMES, settings=StepControl(1e-6))
    assert "s, 1 steps" in caplog.text
    count = run.statistics
    assert count.iterations >= count.steps > 5
    assert count.factorizations >= 3
    assert count.seconds > 0


def test_the_integration_is_split_where_a_torque_jumps_without_saying_so():
    jump = 0.1234567
    law = Torque(lambda t: np.where(t < jump, 0.5, -0.3))
    assert breakpoints([law, Free()], 0.0, 0.5) == pytest.approx([jump], abs=1e-12)
    assert breakpoints([Torque(np.sin), Free()], 0.0, 0.5) == []

    told = Torque(law.torque, breakpoints=(jump,))
    runs = [simulate(PAIR, [joint, Free()], posed(PAIR), TIMES) for joint in (law, told)]
    assert runs[0].q[:, -1] == pytest.approx(runs[1].q[:, -1], abs=1e-12)


def moved(chain: Chain, slot: int, by: float) -> NodalState:
    state = posed(chain, [0.2, 0.6])
    q = state.q.copy()
    q[slot] += by
    return NodalState(q, state.v)


def simulate_law(law):
    return simulate(PAIR, [Torque(law), Free()], posed(PAIR), TIMES)


def narrow_nan(t):
    """No number, but only where the integrator asks: laws are looked at in thousands at once."""
    return np.full_like(t, np.nan if len(t) < 4000 else 0.0)


def wrong_shape(t):
    """Three values whatever is asked, but only where the integrator asks."""
    return np.zeros(3 if len(t) < 4000 else len(t))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: simulate(PAIR, [Free()], posed(PAIR), TIMES), "1 given for 2 links"),
        (lambda: simulate(PAIR, [Free(), Locked(1.0)], posed(PAIR), TIMES), "joint 1 starts at 0"),
        (lambda: simulate(PAIR, [Free(), Free()], posed(PAIR), TIMES[::-1]), "do not increase"),
        (lambda: simulate(PAIR, [Free(), Free()], moved(PAIR, 0, 0.01), TIMES), "open by 1.00e-02"),
        (
            lambda: simulate(PAIR, [Locked(0.2), Free()], spun(PAIR), TIMES),
            "velocities break the constraints",
        ),
        (
            lambda: simulate(
                replace(PAIR, pinned=False), [Locked(0.0), Free()], posed(PAIR), TIMES
            ),
            "root flies",
        ),
        (
            lambda: simulate(
                PAIR, [Torque(lambda t: np.where(t > 0.1, np.nan, 0.0)), Free()], posed(PAIR), TIMES
            ),
            r"the law of joint 0 is nan at t = 0.1\d* s; return finite numbers",
        ),
        (
            lambda: simulate(
                PAIR,
                [Torque(lambda t: 1e5 + 0 * t), Free()],
                posed(PAIR),
                TIMES,
                settings=StepControl(fixed_step=0.1),
            ),
            "smaller fixed_step",
        ),
        (lambda: simulate_law(narrow_nan), r"law of a joint is nan at t = .* s; return finite"),
        (lambda: simulate_law(wrong_shape), r"returns \(3,\) values for \d+ instants; return one"),
        (lambda: simulate_law(lambda t: "x"), "returns 'x'; return a number for each instant"),
        (lambda: StepControl(tolerance=0.0), "tolerance is 0"),
        (
            lambda: simulate(PAIR, [Free(), Free()], posed(PAIR), TIMES, form="lagrange"),
            "form is 'lagrange'; choose 'minimal' or 'index-1'",
        ),
        (
            lambda: simulate(PAIR, [Free(), Free()], posed(PAIR), TIMES, form="minimum"),
            "form is 'minimum'; choose 'minimal' or 'index-1'",
        ),
    ],
)
def test_bad_input_names_thing_value_and_remedy(call, words):
    with pytest.raises(ModelError, match=words):
        call()
