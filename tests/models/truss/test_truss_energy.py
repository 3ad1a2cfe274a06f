"""Motor work equals stored energy and losses along a motion, at every time."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from models import laws, truss

DURATION = 140.0
STOWED = truss.DYNAMIC_SET.stowed_angle
LAW = laws.Bezier(DURATION, laws.paper_points(STOWED, math.pi / 2))
TIMES = np.linspace(0, DURATION, 22)[1:]  # twenty inside and the end

BENCH = {
    "joint_coulomb": 0.02,
    "slider_coulomb": 0.5,
    "gravity": (-9.81, 1.0, 2.0),
    "off_load": 0.9,
    "off_load_friction": 0.1,
    "measured_torque": ((0.05, 5.0), (0.8, 30.0), (1.6, 10.0)),
    "other_pulleys": ((5, 2, 0.3), (24, 3, 0.0)),
}


def evaluate(parameters, law, time):
    m = law.motion(time)
    return truss.evaluate_motion(parameters, m.angle, m.speed, m.acceleration)


def time_of(law, angle):
    low, high = 0.0, law.duration
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if law.motion(middle).angle[0] < angle else (low, middle)
    return (low + high) / 2


def integrals(parameters, law, times):
    """Integrals to each time of motor, joint and pulley power, split where the net tightens."""
    edges = np.unique(np.concatenate([[0.0], times, [time_of(law, parameters.net_angle)]]))
    x, w = np.polynomial.legendre.leggauss(24)
    sums = {0.0: np.zeros(3)}
    total = np.zeros(3)
    for low, high in itertools.pairwise(edges):
        h = evaluate(parameters, law, (low + high) / 2 + (high - low) / 2 * x)
        powers = np.stack([h.motor_power, h.joint_power, h.pulley_power])
        total = total + (high - low) / 2 * powers @ w
        sums[float(high)] = total
    return np.array([sums[float(t)] for t in times])


@pytest.mark.parametrize("counting", ["once", "as printed"])
@pytest.mark.parametrize("mu", [0.0, 0.01])
@pytest.mark.parametrize("duration", [DURATION, 5.0])
@pytest.mark.parametrize("bench", [{}, BENCH])
def test_energy_balance(mu, duration, counting, bench):
    p = dataclasses.replace(truss.DYNAMIC_SET, pulley_friction=mu, counting=counting, **bench)
    law = dataclasses.replace(LAW, duration=duration)
    times = TIMES * duration / DURATION
    motor, joints, pulleys = integrals(p, law, times).T
    start, later = evaluate(p, law, 0.0), evaluate(p, law, times)
    kinetic = later.kinetic_energy - start.kinetic_energy
    stored = later.potential_energy - start.potential_energy
    residual = motor - kinetic - stored - joints - pulleys
    assert np.abs(residual).max() <= 1e-8 * motor[-1]
    assert (pulleys[-1] > 0) == (mu > 0 or bool(bench))
    # Both ends are at rest, so that at the end the kinetic energy has come back.
    assert kinetic[-1] == pytest.approx(0, abs=1e-20)


def test_reaction_is_the_rate_of_the_momentum():
    t, step = np.array([20.0, 70.0, 120.0]), 1e-3
    after, before = (evaluate(truss.DYNAMIC_SET, LAW, t + h).momentum for h in (step, -step))
    force = evaluate(truss.DYNAMIC_SET, LAW, t).reaction_force
    assert (after - before) / (2 * step) == pytest.approx(force, rel=1e-6, abs=1e-10)
