"""Nodes move as their positions say, rods keep their lengths and the ring closes."""

import dataclasses
import math

import numpy as np
import pytest

from models import laws, truss
from models.errors import ModelError
from models.truss.inertia import RODS

K = truss.KINEMATIC_SET
LAW = laws.Bezier(140.0)


def motion_at(time, node=5, module=7):
    m = LAW.motion(time)
    return truss.node_motion(K, node, m.angle, m.speed, m.acceleration, module=module)


@pytest.mark.parametrize("angle", [K.stowed_angle, 0.8, math.pi / 2])
def test_rods_keep_their_lengths_and_the_ring_closes(angle):
    places = truss.ring_positions(K, angle)
    assert places.shape == (24, 14, 3)
    for name, pairs in RODS.items():
        for j, k in pairs:
            lengths = np.linalg.norm(places[:, j - 1] - places[:, k - 1], axis=1)
            assert lengths == pytest.approx(getattr(K, name), rel=1e-13)
    following = np.roll(places, -1, axis=0)
    for right, left in ((5, 1), (4, 2), (14, 8), (12, 10)):  # shared by neighbours
        assert places[:, right - 1] == pytest.approx(following[:, left - 1], abs=1e-13)
    assert np.ptp(places[:, 0, :2], axis=0).max() == pytest.approx(
        2 * truss.ring_radius(K, angle), rel=1e-2
    )


def test_velocity_and_acceleration_are_rates():
    t, step = np.array([30.0, 80.0, 120.0]), 1e-3
    now, after, before = motion_at(t), motion_at(t + step), motion_at(t - step)
    # Central differences: truncation 1e-7 of the jerk's rate, rounding 1e-13/step.
    velocity = (after.position - before.position) / (2 * step)
    acceleration = (after.velocity - before.velocity) / (2 * step)
    assert velocity == pytest.approx(now.velocity, abs=1e-9)
    assert acceleration == pytest.approx(now.acceleration, abs=1e-9)


def test_the_fixed_bar_stays_and_the_opposite_bar_goes_furthest():
    for node in (1, 2):
        fixed = motion_at([0.0, 70.0, 140.0], node=node, module=1)
        assert np.ptp(fixed.position, axis=0).max() == 0
        assert np.abs(fixed.velocity).max() == 0
    opposite = motion_at([140.0], node=1, module=13).position[0, :2]
    # 24 is even, so the opposite bar is a diameter away: 7660 mm in the paper's text.
    assert np.linalg.norm(opposite) == pytest.approx(7.6613, abs=5e-5)


def test_unknown_nodes_and_modules():
    small = dataclasses.replace(K, modules=6)
    with pytest.raises(ModelError, match="1 to 14"):
        truss.node_motion(small, 0, 1.0, 0.0, 0.0)
    with pytest.raises(ModelError, match="1 to 6"):
        truss.node_motion(small, 1, 1.0, 0.0, 0.0, module=7)
