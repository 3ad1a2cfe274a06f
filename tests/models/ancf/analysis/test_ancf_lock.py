import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.ancf.analysis import engage, latch_time, residual_energy, run_and_lock
from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain, Link
from models.ancf.integrate import StepControl, simulate
from models.ancf.joints import Driven, Free, Locked, Torque, joint_rates
from models.ancf.state import NodalState, posed
from models.errors import ModelError

LINK = Link(1.0, 1.0e5, 50.0, 0.5)
CHAIN = Chain((LINK, LINK), 3, masses=(0.0, 0.0, 1.0))
MASS = dense(assemble(CHAIN, merged=False).mass)
FAST = StepControl(1e-6)


def turning(root: float, elbow: float, angles=(0.0, 1.0)) -> NodalState:
    """Rigid turning with the given joint rates [rad/s]."""
    state = posed(CHAIN, angles)
    half = CHAIN.size // 2
    about = np.tile(state.q[half : half + 2], CHAIN.size // 4)
    about[1::2], about[0::2] = state.q[half + 1], state.q[half]
    arm = state.q.copy().reshape(-1, 4)
    v = root * np.stack((-arm[:, 1], arm[:, 0], -arm[:, 3], arm[:, 2]), axis=1)
    outer = arm[CHAIN.nodes :] - np.array([*state.q[half : half + 2], 0, 0])
    v[CHAIN.nodes :] += elbow * np.stack(
        (-outer[:, 1], outer[:, 0], -outer[:, 3], outer[:, 2]), axis=1
    )
    return NodalState(state.q, v.ravel())


def spin(state: NodalState) -> float:
    turn = np.stack((-state.q[1::2], state.q[0::2]), axis=1).ravel()
    return float(turn @ MASS @ state.v)


def kinetic(state: NodalState) -> float:
    return 0.5 * float(state.v @ MASS @ state.v)


@given(root=st.floats(-2, 2), elbow=st.floats(-2, 2))
@settings(max_examples=25, deadline=None)
def test_elbow_lock_keeps_spin_and_loses_what_it_says(root, elbow):
    state = turning(root, elbow)
    lock = engage(CHAIN, [Free(), Free()], state, [1])
    assert lock.state.q == pytest.approx(state.q, abs=1e-14)
    assert spin(lock.state) == pytest.approx(spin(state), abs=1e-10)
    assert kinetic(state) - kinetic(lock.state) == pytest.approx(lock.lost_energy, abs=1e-10)
    assert lock.lost_energy >= -1e-12
    rate = joint_rates(CHAIN, lock.state.q[:, None], lock.state.v[:, None])[1, 0]
    assert rate == pytest.approx(0.0, abs=1e-10)
    # the impulse takes out the relative rate, on average over before and after:
    assert lock.impulse[1] * elbow / 2 == pytest.approx(-lock.lost_energy, abs=1e-9)


def test_lock_of_both_joints_takes_the_spin_at_the_root():
    state = turning(0.7, -0.4)
    lock = engage(CHAIN, [Free(), Free()], state, [0, 1])
    assert lock.impulse[0] == pytest.approx(spin(lock.state) - spin(state), rel=1e-9)


def test_lock_at_rest_changes_nothing():
    lock = engage(CHAIN, [Free(), Free()], posed(CHAIN, [0.2, 0.5]), [0, 1], targets={1: 0.4})
    assert lock.lost_energy == 0.0
    assert lock.joints == (Locked(pytest.approx(0.2)), Locked(pytest.approx(0.5)))
    assert lock.miss == {1: pytest.approx(0.1)}
    assert residual_energy(CHAIN, lock.joints, lock.state) < 1e-20


def test_residual_energy_is_above_the_equilibrium_under_gravity():
    from dataclasses import replace

    chain = replace(CHAIN, gravity=(0.0, -1.0))
    joints = (Locked(0.0), Locked(0.0))
    left = residual_energy(chain, joints, posed(chain))
    # a straight clamped chain let go: m g times half the static sag of a heavy tip, roughly
    sag = 1.0 * 2.0**3 / (3 * 50.0) + 1.0 * 2.0**4 / (8 * 50.0)
    assert left == pytest.approx(0.5 * 1.0 * sag, rel=0.35)


def test_run_and_lock_goes_on_with_the_energy_left():
    push = Torque(lambda t: 2.0 * np.cos(4 * t))
    run = run_and_lock(
        CHAIN,
        [Locked(0.0), push],
        posed(CHAIN, [0.0, 1.0]),
        np.linspace(0, 0.2, 6),
        [1],
        after=np.linspace(0.2, 0.3, 4),
        targets={1: 1.2},
        settings=FAST,
    )
    assert run.after is not None
    assert run.after.energy[0] == pytest.approx(run.residual_energy, rel=1e-9)
    assert run.after.energy[-1] == pytest.approx(run.residual_energy, rel=1e-3)
    assert run.engagement.joints[0] == Locked(0.0)
    assert run.engagement.angle[1] == pytest.approx(run.before.joint_angles()[1, -1])
    assert run.after.joint_angles()[1] == pytest.approx(np.full(4, run.engagement.angle[1]))


def drive() -> Driven:
    return Driven(lambda t: 0.5 + t**2, lambda t: 2 * t, lambda t: 2 + 0 * t)


def test_latch_catches_at_its_angle():
    joints = [Locked(0.0), drive()]
    motion = simulate(CHAIN, joints, posed(CHAIN, [0.0, 0.5]), np.linspace(0, 1, 5), settings=FAST)
    t, state = latch_time(CHAIN, joints, motion, 1, 0.5 + 0.37**2, settings=FAST)
    assert t == pytest.approx(0.37, abs=2e-6)
    lock = engage(CHAIN, joints, state, [1], targets={1: 0.5 + 0.37**2}, tolerance=2e-6)
    assert abs(lock.miss[1]) < 2e-6


def test_law_that_does_not_arrive_fails_at_the_latch():
    joints = [Locked(0.0), drive()]
    motion = simulate(CHAIN, joints, posed(CHAIN, [0.0, 0.5]), np.linspace(0, 1, 5), settings=FAST)
    with pytest.raises(ModelError, match=r"comes no nearer than 5.00e-01 rad .* at 2 rad"):
        latch_time(CHAIN, joints, motion, 1, 2.0)


def test_missed_lock_fails_with_the_miss():
    with pytest.raises(ModelError, match=r"misses the lock at 1.1 rad by -1.00e-01 rad"):
        engage(CHAIN, [Free(), Free()], turning(0, 0), [1], targets={1: 1.1}, tolerance=0.01)
    with pytest.raises(ModelError, match="joint 2 cannot lock"):
        engage(CHAIN, [Free(), Free()], turning(0, 0), [2])
