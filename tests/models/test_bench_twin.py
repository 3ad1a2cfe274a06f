"""Weight and Coulomb friction on the test bench, by an author who has not read the models.

All rods and joints of the closed ring one by one, in its plane: weight is force times way of each
of them, friction is force times way, or torque times turn, of each joint, slider and vertical bar.
"""

import dataclasses
import math

import numpy as np
import pytest

from models import truss
from tests.models import drive_twin as twin
from tests.models.test_drive_twin_itself import random_truss

CLOSE = 1e-8


def weighed(p, alpha):
    """Masses of like parts, and their places (2, n): towards the ring's centre, and across."""
    n, b = p.modules, p.half_cross_bar
    at = 2 * np.pi * np.arange(n + 1) / n
    bars = b * np.sin(alpha) / np.sin(np.pi / n) * np.array([1 - np.cos(at), np.sin(at)])
    left, right = bars[:, :-1], bars[:, 1:]
    crank = p.crank / (2 * b)  # as a part of the way from bar to bar
    joints, rod = p.joint_masses, p.linear_density
    shared = 2 if p.counting == "as printed" else 1

    yield shared * (rod * p.bar_length + 2 * joints.bar_end + 2 * joints.slider), left
    yield 2 * joints.middle, (left + right) / 2
    for bar, other in ((left, right), (right, left)):
        yield 2 * rod * b, bar + (other - bar) / 4
        yield 2 * rod * p.link, bar + (other - bar) * crank / 2
        yield 2 * joints.crank, bar + (other - bar) * crank


@pytest.mark.parametrize("seed", range(50))
def test_weight_and_friction_of_all_parts(seed):
    draw = np.random.default_rng(seed)
    p, _, _ = random_truss(draw)
    gravity, off_load = draw.uniform(-10, 10, 3), draw.uniform(0, 1)
    p = dataclasses.replace(
        p,
        gravity=tuple(gravity),
        off_load=off_load,
        joint_coulomb=draw.uniform(0, 1),
        slider_coulomb=draw.uniform(0, 5),
        off_load_friction=draw.uniform(0, 2),
    )
    alpha = draw.uniform(0.1, math.pi / 2)

    def work(at):
        """Of the weight, from where all parts are at the fixed bar."""
        return sum(mass * np.sum(gravity[:2] @ place) for mass, place in weighed(p, at))

    slope = -(1 - off_load) * twin.derivative(work, np.asarray(alpha))
    assert float(truss.gravity_slope(p, alpha)) == pytest.approx(slope, rel=CLOSE, abs=1e-9)

    _, e1, turn = twin.slider(p, np.asarray(alpha))
    joints = [1] * 4 + [turn] * 4 + [1 + turn] * 4 + [2] * 2
    lost = p.modules * (p.joint_coulomb * sum(joints) + 2 * p.slider_coulomb * abs(e1))
    ways = abs(1 - np.exp(2j * np.pi * np.arange(p.modules) / p.modules))
    radius = p.half_cross_bar * np.cos(alpha) / np.sin(np.pi / p.modules)
    lost += p.off_load_friction * np.sum(ways * radius)
    assert float(truss.coulomb_torque(p, alpha)) == pytest.approx(lost, rel=CLOSE)


@pytest.mark.parametrize("seed", range(50))
def test_single_pulleys_that_differ(seed):
    """The tension falls pulley by pulley; the ropes' work is that of all segments."""
    draw = np.random.default_rng(seed)
    p, _, _ = random_truss(draw)
    # behind the last segment the rope ends
    places = draw.permutation(4 * p.modules - 1)[: draw.integers(1, 4)]
    others = [(int(at) // 4 + 1, int(at) % 4 + 1, draw.uniform(0, 0.5)) for at in places]
    alpha = draw.uniform(0.1, math.pi / 2)

    wraps = p.modules * [math.pi - alpha, math.pi - 2 * alpha, math.pi - alpha, math.pi]
    friction = np.full(4 * p.modules, p.pulley_friction)
    friction[places] = [mu for _, _, mu in others]
    drops = np.cumsum(friction * wraps)
    tension = np.exp(-np.concatenate([[0.0], drops[:-1]]))
    shortening = twin.segments(p, alpha)[1]
    lever = 2 * float(tension @ shortening)

    changed = dataclasses.replace(p, other_pulleys=tuple(others))
    acc = draw.uniform(0.5, 2)
    resists = sum(twin.loads(p, np.asarray(alpha), 0.3, acc).values())
    force = float(truss.rope_force(changed, alpha, 0.3, acc))
    assert force == pytest.approx(float(resists) / lever, rel=CLOSE)
    e, b = twin.slider(p, np.asarray(alpha))[0], p.half_cross_bar
    mean = tension @ np.array(p.modules * [e, b, b, e]) / (2 * p.modules * (e + b))
    assert float(truss.mean_tension_ratio(changed, alpha)) == pytest.approx(mean, rel=CLOSE)
