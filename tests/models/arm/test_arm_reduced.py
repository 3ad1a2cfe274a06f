"""The reduced arm against mechanics it does not know: the node mass matrix, conservation."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.ancf.analysis import engage
from models.ancf.assembly import assemble, dense
from models.ancf.joints import Free, Torque, joint_angles, joint_rates
from models.ancf.state import NodalState
from models.arm.lock import energy_after_lock, lock_reduced, lock_terms, released
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm
from models.arm.reduced_simulation import simulate_reduced
from models.errors import ModelError

ARM = ArmParameters(elbow_mass=2.0, hub_inertia=1.5)
SMALL = st.floats(-0.05, 0.05)


def sample(model: ReducedArm, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return model.at(0.3, 1.1) + 0.05 * rng.normal(size=model.size), rng.normal(size=model.size)


@pytest.mark.parametrize("variant", ["B21", "B22"])
@pytest.mark.parametrize("locks", [(None, None), (None, 1.1), (0.3, None), (0.3, 1.1)])
def test_kinetic_energy_is_that_of_the_nodes(variant, locks):
    model = ReducedArm(ARM, variant, *locks)
    q, v = sample(model)
    nodes, rates = model.to_nodes(q[:, None], v[:, None], elements=1)
    mass = dense(assemble(ARM.chain(1), merged=False).mass).copy()
    mass[2, 2] -= ARM.hub_inertia  # the full model hangs the hub on the slope vector
    mass[3, 3] -= ARM.hub_inertia
    spin = joint_rates(ARM.chain(1), nodes, rates)[0, 0]
    wanted = 0.5 * rates[:, 0] @ mass @ rates[:, 0] + 0.5 * ARM.hub_inertia * spin**2
    assert float(model.energies(q, v)[0]) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("locks", [(None, None), (None, 1.1), (0.3, None), (0.3, 1.1)])
@pytest.mark.parametrize(
    ("variant", "ties"), [("B21", (0, 0, 0)), ("B21", (0.1, 0.2, -0.3)), ("B22", (0, 0, 0))]
)
def test_mass_and_force_are_those_of_coordinates_in_a_fixed_frame(variant, ties, locks):
    arm = ArmParameters(elbow_mass=2.0, hub_inertia=1.5, damping_ratio=0.05)
    model = ReducedArm(arm, variant, *locks, ties=ties)
    q, v, tau = (ca.SX.sym(name, n) for name, n in (("q", model.size), ("v", model.size), ("t", 2)))
    e, hub = model.mass_coordinates(q), ca.jacobian(model.embed(q)[0], q)
    J, M = ca.jacobian(e, q), model._mass
    angles = ca.vertcat(model.embed(q)[0], model.elbow_angle(q))
    elastic = ca.gradient(model.strain_energy(q), q)
    force = ca.jacobian(angles, q).T @ tau - elastic
    force -= arm.relaxation_time * ca.jtimes(elastic, q, v) + J.T @ M @ ca.jtimes(J @ v, q, v)
    fixed = ca.Function("f", [q, v, tau], [J.T @ M @ J + 1.5 * hub.T @ hub, force])
    moving = ca.Function("m", [q, v, tau], model.mass_and_force(q, v, tau))

    place = (*sample(model), np.array([3.0, -2.0]))
    for wanted, found in zip(fixed(*place), moving(*place), strict=True):
        scale = np.abs(wanted.full()).max()
        np.testing.assert_allclose(found.full(), wanted.full(), rtol=0, atol=1e-13 * scale)


@pytest.mark.parametrize("elbow_lock", [None, np.pi])
def test_mass_and_force_do_not_depend_on_where_the_arm_points_to(elbow_lock):
    model = ReducedArm(ARM, elbow_lock=elbow_lock, ties=(0.1, 0.2, -0.3))
    q, v, tau = (ca.SX.sym(name, n) for name, n in (("q", model.size), ("v", model.size), ("t", 2)))
    mass, force = model.mass_and_force(q, v, tau)
    by_angles = ca.jacobian(ca.vertcat(ca.vec(mass), force), q)[:, 0]
    assert (by_angles.nnz() == 0) == (elbow_lock is not None)
    free = ca.Function("free", [q, v, tau], [mass, force])
    place, rate = sample(model)
    turned = place + (model.at(1.0, 0.0) - model.at(0.0, 0.0))
    for here, there in zip(free(place, rate, [1, 2]), free(turned, rate, [1, 2]), strict=True):
        scale = np.abs(here.full()).max()
        np.testing.assert_allclose(there.full(), here.full(), rtol=0, atol=1e-13 * scale)


def test_strain_energy_is_nearly_that_of_the_nodes():
    model = ReducedArm(ARM)
    q = model.at(0.3, 1.1)
    q[1], q[2], q[4] = 0.01, 0.004, 0.006
    nodes, _ = model.to_nodes(q[:, None], 0 * q[:, None], elements=16)
    asm = assemble(ARM.chain(16), merged=False)
    strain = float(model.energies(q, 0 * q)[1])
    # the map drops fourth powers of the slope: a strain of v'^4/8 with EA h^2/EI of weight
    assert asm.strain_energy(nodes)[0] == pytest.approx(strain, rel=1e-3)


@given(theta=st.floats(-3, 3), delta=SMALL, psi=SMALL)
@settings(max_examples=20, deadline=None)
def test_elbow_angle_is_that_of_the_nodes(theta, delta, psi):
    model = ReducedArm(ARM)
    q = np.array([theta, delta, psi, theta + 1.0, 0.02])
    nodes, _ = model.to_nodes(q[:, None], 0 * q[:, None], elements=3)
    angle = float(ca.evalf(model.elbow_angle(ca.DM(q))))
    assert joint_angles(ARM.chain(3), nodes)[1, 0] == pytest.approx(angle, abs=1e-12)


def test_dynamics_conserve_energy_and_angular_momentum():
    model = ReducedArm(ARM)
    q, v = sample(model)
    times = np.linspace(0.0, 0.3, 4)
    run = simulate_reduced(model, q, times, v=0.3 * v, tolerance=1e-11)
    energy = [sum(map(float, model.energies(*y))) for y in zip(run.q.T, run.v.T, strict=True)]
    assert energy == pytest.approx([energy[0]] * 4, rel=1e-8)
    turn = np.array([1.0, 0, 0, 1.0, 0])  # both links turn together
    spin = [turn @ model.linear(a)[0].full() @ b for a, b in zip(run.q.T, run.v.T, strict=True)]
    assert spin == pytest.approx([spin[0]] * 4, rel=1e-8)


def test_torques_do_the_work():
    model, push = ReducedArm(ARM), np.array([3.0, -2.0])
    q, v = sample(model)
    qs, vs = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
    a = model.dynamics(q, v, push)
    kinetic, strain = model.energies(qs, vs)
    gain = ca.Function("gain", [qs, vs], [ca.jacobian(kinetic + strain, ca.vertcat(qs, vs))])
    power = (gain(q, v) @ ca.vertcat(v, a)).full()[0, 0]
    chain = ARM.chain(1)
    rates = joint_rates(chain, *model.to_nodes(q[:, None], v[:, None], 1))[:, 0]
    assert power == pytest.approx(push @ rates, rel=1e-9)


def test_residual_is_zero_at_the_acceleration():
    model = ReducedArm(ARM, elbow_lock=0.0)
    q, v = sample(model)
    tau = np.array([1.0, 0.0])
    symbols = [ca.SX.sym(name, size) for name, size in zip("qvat", (4, 4, 4, 2), strict=True)]
    residual = ca.Function("residual", symbols, [model.residual(*symbols)])
    left = residual(q, v, model.dynamics(q, v, tau), tau).full()
    assert np.abs(left).max() < 1e-9 * ARM.root_inertia()


def test_damping_takes_energy():
    damped = ReducedArm(ArmParameters(damping_ratio=0.05, damping_frequency=5.0))
    q, v = sample(damped)
    run = simulate_reduced(damped, q, np.array([0.0, 0.2]), v=0 * v)
    start, end = (sum(map(float, damped.energies(run.q[:, k], run.v[:, k]))) for k in (0, -1))
    assert end < 0.98 * start


def test_lock_is_the_inelastic_impulse_of_the_full_model():
    model = ReducedArm(ArmParameters())
    q = model.at(0.1, 0.8)
    v = np.array([0.2, 0.0, 0.0, -0.3, 0.0])  # rigid turning: both models know it alike
    locked, z, rate = lock_reduced(model, q, v, elbow=True)
    before = sum(map(float, model.energies(q, v)))
    lost = before - sum(map(float, locked.energies(z, rate)))
    chain = model.parameters.chain(8)
    nodes, rates = model.to_nodes(q[:, None], v[:, None], 8)
    impact = engage(chain, [Free(), Free()], NodalState(nodes[:, 0], rates[:, 0]), [1])
    assert locked.elbow_lock == pytest.approx(0.8, abs=1e-14)
    # the finer mesh yields more at the joint: it loses less energy
    assert 0 < impact.lost_energy < lost
    both = lock_reduced(model, q, v, root=True, elbow=True)[0]
    assert both.coordinates == ("delta1", "psi1", "delta2")


def test_breakpoints_are_met():
    model = ReducedArm(ARM, elbow_lock=0.0)
    step = Torque(lambda t: np.where(t < 0.1, 5.0, 0.0), breakpoints=(0.1,))
    times = np.linspace(0.0, 0.2, 5)
    run = simulate_reduced(model, model.at(), times, root=step)
    energy = [sum(map(float, model.energies(*y))) for y in zip(run.q.T, run.v.T, strict=True)]
    assert energy[2] == pytest.approx(energy[4], rel=1e-6)
    assert energy[2] == pytest.approx(5.0 * run.q[0, 2], rel=1e-6)


@pytest.mark.slow
def test_implicit_steps_follow_a_slow_torque_as_explicit_ones_do():
    model, duration = ReducedArm(ARM, elbow_lock=0.0), 20.0
    pull = Torque(lambda t: 0.1 * np.sin(2 * np.pi * t / duration))
    times = np.linspace(0.0, duration, 5)
    explicit, implicit = (
        simulate_reduced(model, model.at(), times, root=pull, tolerance=1e-10, method=method)
        for method in ("DOP853", "Radau")
    )
    turned = abs(explicit.q[0, -1])
    assert turned > 1e-3
    assert np.abs(implicit.q - explicit.q).max() < 1e-7 * turned


@pytest.mark.parametrize("joints", [(0,), (1,), (0, 1)])
def test_the_energy_after_a_lock_is_that_of_the_locked_arm(joints):
    model = ReducedArm(ArmParameters())
    rng = np.random.default_rng(3)
    q, v = model.at(0.4, 1.2) + 0.02 * rng.standard_normal(model.size), rng.standard_normal(5)
    x, y = ca.SX.sym("x", model.size), ca.SX.sym("y", model.size)
    energy = ca.Function("left", [x, y], [energy_after_lock(*lock_terms(model, joints, x, y))])
    locked, z, rate = lock_reduced(model, q, v, root=0 in joints, elbow=1 in joints)
    assert float(energy(q, v)) == pytest.approx(
        sum(map(float, locked.energies(z, rate))), rel=1e-12
    )


def test_what_is_released_leads_on_where_the_lock_held_it():
    free = ReducedArm(ArmParameters())
    locked, z, rate = lock_reduced(
        free, free.at(0.4, 1.2) + 0.01, np.linspace(-1.0, 1.0, 5), elbow=True
    )
    q, v = released(locked, free, z, rate)
    again, same, kept = lock_reduced(free, q, v, elbow=True)  # nothing moves against the lock
    assert again.elbow_lock == pytest.approx(locked.elbow_lock, abs=1e-14)
    assert same == pytest.approx(z, abs=1e-14)
    assert kept == pytest.approx(rate, rel=1e-10)  # of a mass matrix with condition 5e4


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda t: np.where(t > 1.0, np.nan, 0.0), "is nan at t = 1.* s; return finite numbers"),
        (lambda t: np.zeros(3), "values for 4001 instants; return one for each"),
        (lambda t: np.zeros(len(t) if len(t) == 4001 else 3), "values for 3072 instants; return"),
    ],
)
def test_a_law_that_is_no_number_is_refused(law, words):
    model = ReducedArm(ARM, "B21", elbow_lock=np.pi)
    with pytest.raises(ModelError, match=words):
        simulate_reduced(model, model.at(0.0, np.pi), np.array([0.0, 2.0]), root=Torque(law))


def test_the_motion_is_split_where_a_torque_jumps_unstated():
    model = ReducedArm(ARM, "B21", elbow_lock=np.pi)
    runs = [
        simulate_reduced(
            model,
            model.at(0.0, np.pi),
            np.array([0.0, 1.0]),
            root=Torque(lambda t: np.where(t > 0.7, 1.0, -1.0), stated),
        )
        for stated in ((), (0.7,))
    ]
    # both are split at 0.7 s to rounding: what differs is far below the tolerance of 1e-9
    assert np.abs(runs[0].q - runs[1].q).max() < 1e-12


def test_a_motion_that_ends_in_no_number_is_not_locked() -> None:
    model = ReducedArm(ARM)
    still, lost = np.zeros(model.size), np.full(model.size, np.nan)
    for q, v in ((still, lost), (lost, still)):
        with pytest.raises(ModelError, match="give a lower modulus"):
            lock_reduced(model, q, v, root=True)
