"""The arm on a satellite that is free to turn: against the arm with the satellite's angle kept."""

from dataclasses import replace

import numpy as np
import pytest

from models.arm.lock import lock_reduced
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm
from models.errors import ModelError

ARM = ArmParameters(elbow_mass=2.0, hub_inertia=1.5, damping_ratio=0.01)
H = 2000.0
TORQUE = np.array([3.0, -2.0])
LOCKS = [(None, None), (None, 1.1), (0.3, None), (0.3, 1.1)]


def drawn(locks, variant="B21"):
    """A model on a free satellite, and a state in its frame."""
    model = ReducedArm(ARM, variant, *locks, satellite_inertia=H)
    rng = np.random.default_rng(59)
    return (
        model,
        model.at(0.3, 1.1) + 0.05 * rng.normal(size=model.size),
        rng.normal(size=model.size),
    )


def absolute(model, q, v, rate):
    """The same state of an arm on a root that turns, whose angles are counted from fixed axes."""
    free = replace(model, root_lock=None, satellite_inertia=None)
    place, speed = (dict(zip(model.coordinates, x, strict=True)) for x in (q, v))
    turns = np.array([name.startswith("theta") for name in free.coordinates], dtype=float)
    x = np.array([place.get(name, model.root_lock) for name in free.coordinates])
    y = np.array([speed.get(name, 0.0) for name in free.coordinates]) + rate * turns
    return free, turns, x, y


@pytest.mark.parametrize("variant", ["B21", "B22"])
@pytest.mark.parametrize("locks", LOCKS)
def test_arm_and_satellite_keep_no_momentum_and_their_energy_is_that_of_both(locks, variant):
    model, q, v = drawn(locks, variant)
    rate = float(model.satellite_rate(q, v))
    free, turns, x, y = absolute(model, q, v, rate)
    momentum = turns @ free.linear(x)[0].full() @ y
    assert momentum == pytest.approx(float(model.angular_momentum(q, v)), rel=1e-12)
    assert momentum + H * rate == pytest.approx(0.0, abs=1e-9)
    kinetic = float(free.energies(x, y)[0]) + H * rate**2 / 2
    assert float(model.energies(q, v)[0]) == pytest.approx(kinetic, rel=1e-12)


@pytest.mark.parametrize("locks", LOCKS)
def test_accelerations_are_those_with_the_satellites_angle_as_a_coordinate(locks):
    """H theta0'' = -tau where the root turns; where it is locked the hub has H as well."""
    model, q, v = drawn(locks)
    rate = float(model.satellite_rate(q, v))
    free, turns, x, y = absolute(model, q, v, rate)
    if model.root_lock is None:
        spin = -TORQUE[0] / H
        whole = free.dynamics(x, y, TORQUE).full()[:, 0]
    else:
        hub = replace(ARM, hub_inertia=ARM.hub_inertia + H)
        whole = replace(free, parameters=hub).dynamics(x, y, [0.0, TORQUE[1]]).full()[:, 0]
        spin = whole[free.coordinates.index("theta1")]
    seen = dict(zip(free.coordinates, whole - spin * turns, strict=True))
    found = model.dynamics(q, v, TORQUE).full()[:, 0]
    expected = np.array([seen[name] for name in model.coordinates])
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_a_lock_leaves_no_momentum_and_what_a_locked_root_joins():
    model, q, v = drawn((None, np.pi))
    rate = float(model.satellite_rate(q, v))
    locked, z, z_rate = lock_reduced(model, q, v, root=True)
    assert locked.satellite_inertia == H
    after = float(locked.satellite_rate(z, z_rate))
    # the momentum of arm and satellite that turn as one is what both had
    free, turns, x, y = absolute(locked, z, z_rate, after)
    assert turns @ free.linear(x)[0].full() @ y + H * after == pytest.approx(0.0, abs=1e-9)
    lost = float(sum(model.energies(q, v))) - float(sum(locked.energies(z, z_rate)))
    assert lost > 0.0
    assert abs(after) < abs(rate)


@pytest.mark.parametrize("locks", LOCKS)
def test_a_satellite_that_hardly_turns_is_as_good_as_held(locks):
    model, q, v = drawn(locks)
    held = replace(model, satellite_inertia=None)
    heavy = replace(model, satellite_inertia=1e12)
    expected = held.dynamics(q, v, TORQUE).full()
    scale = np.abs(expected).max()
    assert heavy.dynamics(q, v, TORQUE).full() == pytest.approx(expected, abs=1e-8 * scale)


def test_a_satellite_without_inertia_is_refused():
    with pytest.raises(ModelError, match="satellite inertia is 0; give a finite value above zero"):
        ReducedArm(ARM, satellite_inertia=0.0)
