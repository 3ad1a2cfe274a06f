"""Rotor and margins of the studies against the twin of the drive, at random parameters."""

import math

import casadi as ca
import numpy as np
import pytest

from models import truss
from studies.drive.motor import motor_speed, motor_torque, rotor_force, rotor_mass
from studies.drive.schema import Drive
from studies.margin.loads import of_the_rotor
from studies.margin.schema import MarginRequirements
from studies.margin.travel import along
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.bounds import least_pull, lower_bounds
from tests.models import drive_limits_twin as limits
from tests.models import drive_twin as twin
from tests.models.test_drive_twin_itself import random_truss

SEEDS = range(50)
CLOSE = 1e-8  # relative to the largest of the values: two ways through the same mechanics
CURVE = [[0.0, 0.05], [2000.0, 0.035], [4000.0, 0.01]]  # [rad/s, N m]


def close(found, expected):
    size = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE * size)


def drawn(seed):
    """A truss, a drive of both kinds, and angles, rates and accelerations (9,)."""
    draw = np.random.default_rng(seed)
    parameters, twins, _ = random_truss(draw)
    drive = Drive(
        drum_radius=twins.drum_radius,
        gear_ratio=twins.gear,
        motor_inertia=twins.motor_inertia,
        efficiency=twins.efficiency,
        torque_speed=CURVE,
    )
    angle = draw.uniform(parameters.stowed_angle, DEPLOYED, 9)
    return parameters, twins, drive, (angle, draw.uniform(0, 1, 9), draw.uniform(-1, 1, 9)), draw


@pytest.mark.parametrize("seed", SEEDS)
def test_torque_speed_and_power(seed):
    parameters, twins, drive, motion, _ = drawn(seed)
    alpha, omega, acc = (ca.DM(row) for row in motion)
    rope = truss.rope_force(parameters, alpha, omega, acc)
    winding = -truss.rope_speed(parameters, alpha, omega)
    faster = -truss.rope_acceleration(parameters, alpha, omega, acc)
    force = rope + rotor_force(drive, winding, faster, 0.0)
    torque = motor_torque(drive, force, 0.0).full().ravel()
    speed = motor_speed(drive, winding, 0.0).full().ravel()
    close(torque, twin.shaft_torque(parameters, twins, *motion))
    close(speed, twin.motor_speed(parameters, twins, *motion[:2]))
    # power is that at the ropes, behind the gear
    power = (2 * force * winding).full().ravel() / drive.efficiency
    close(power, twin.power(parameters, twins, *motion))
    rotor = of_the_rotor(drive, parameters, (alpha, omega, acc)).full().ravel()
    close(rotor, rotor_mass(drive, 0.0) * twin.rope_acceleration(parameters, *motion))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_motion_under_a_force_of_the_motor(seed):
    parameters, twins, _, motion, draw = drawn(seed)
    force = draw.uniform(1, 100, 9)
    alpha, omega, _ = (ca.DM(row) for row in motion)
    acc = truss.angular_acceleration(
        parameters, alpha, omega, ca.DM(force), "by angle", twins.rope_mass
    )
    found = motion[0], motion[1], acc.full().ravel()
    close(twin.motor_force(parameters, twins, *found), force)


@pytest.mark.parametrize("seed", SEEDS)
def test_margins(seed):
    parameters, twins, drive, motion, draw = drawn(seed)
    names = {"inertia": "inertia", "joint_friction": "joints", "slider_friction": "sliders"}
    names |= {"springs": "springs", "net": "net", "holding": "holding"}
    names |= {"pulley_friction": "pulleys", "rotor": "rotor"}
    factors = {name: float(value) for name, value in zip(names, draw.uniform(1, 2, 8), strict=True)}
    parts = [float(value) for value in draw.uniform(0.5, 1, 3)]
    holding = float(draw.uniform(0, 5))
    derating = dict(zip(("voltage", "temperature", "ageing"), parts, strict=True))
    margin = MarginRequirements(factors=factors, derating=derating, holding=holding)

    travel = along(margin, parameters, drive, np.arange(9.0), motion)
    asked = limits.Requirement(
        torque_speed=CURVE,
        factors={names[name]: value for name, value in factors.items()},
        holding=holding,
        derating=tuple(parts),
    )
    speed = twin.motor_speed(parameters, twins, *motion[:2])
    available = limits.available_torque(asked, speed)
    pull = drive.gear_ratio * drive.efficiency / drive.drum_radius
    (case,) = travel.cases
    close(travel.available * case.case.derating.whole, available * pull)
    for kind, static in (("static", True), ("dynamic", False)):
        required = limits.required_torque(parameters, twins, asked, *motion, static=static)
        # a rope only pulls: what would need a push is no load
        pulls = twin.rope_force(parameters, *motion)
        taut = (limits.static_force(parameters, motion[0]) if static else pulls) > 0
        close(case.required[kind][taut], required[taut] * pull)
        taut &= required > 0
        close(case.margins[kind][taut], limits.margin(available, required)[taut])


@pytest.mark.parametrize("mu", [0.0, 0.01])
@pytest.mark.parametrize("duration", [3.0, 10.0, 140.0])
def test_the_bound_by_work(mu, duration):
    parameters = truss.TrussParameters(pulley_friction=mu)
    drive = Drive(drum_radius=0.02, gear_ratio=50.0, motor_inertia=2e-6)
    study = TrussStudy(minimise="energy", duration=duration, truss=parameters, drive=drive)
    found = least_pull(study, duration)
    assert found == pytest.approx(limits.work_bound(parameters, duration), rel=CLOSE)
    assert lower_bounds(study, None)["peak-motor-force"] == found
    restart = limits.restart_force(parameters, parameters.stowed_angle)
    # the twin's is the largest at 4001 angles
    assert truss.static_peak(parameters).force == pytest.approx(restart, rel=1e-6)
    assert math.degrees(truss.static_peak(parameters).angle) > 80
