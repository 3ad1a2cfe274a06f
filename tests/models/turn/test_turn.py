"""Stage 2: its parameters, its closed form against a linear program, and its response."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.linalg import expm
from scipy.optimize import linprog
from scipy.sparse import bmat, csr_matrix, diags, eye, kron

from models.arm.parameters import ArmParameters
from models.errors import ModelError
from models.laws import Bezier, paper_points
from models.truss import DYNAMIC_SET
from models.turn import (
    TurnParameters,
    least_torque_bound,
    least_torque_turn,
    least_turn_time_bound,
    stowed_ring_inertia,
    torque_limited_turn,
    torsion_stiffness,
    turn_response,
)

TURN = TurnParameters(stowed_ring_inertia(DYNAMIC_SET, 30.0), torsion_stiffness(ArmParameters()))
RIGHT = math.pi / 2


def least_peak_by_program(turn, angle, duration, acceleration, steps, weight=0.0):
    """Least peak torque of all drives whose acceleration is constant in each of many steps [N m].

    A linear program in the states at all times: nothing is said of the shape of the turn. With a
    weight [1/s] the largest of torque and weighted momentum of the antenna is least.
    """
    h, rate = duration / steps, turn.stiffness / turn.inertia
    matrix = np.zeros((5, 5))  # twist, its rate, drive angle, its rate; and the constant u
    matrix[0, 1], matrix[1, 0], matrix[2, 3] = 1.0, -rate, 1.0
    matrix[1, 4] = matrix[3, 4] = 1.0
    whole = expm(h * matrix)
    a, b = whole[:4, :4], whole[:4, 4:]

    # unknowns: states at 1..N, u of N steps, peak of the twist
    shift = diags([np.ones(steps - 1)], [-1], shape=(steps, steps))
    dynamics = bmat(
        [[eye(4 * steps) - kron(shift, a), -kron(eye(steps), b), csr_matrix((4 * steps, 1))]]
    )
    last = csr_matrix(
        (np.ones(4), (range(4), range(4 * (steps - 1), 4 * steps))), (4, 5 * steps + 1)
    )
    twists = csr_matrix(
        (np.ones(steps), (range(steps), range(0, 4 * steps, 4))), (steps, 5 * steps)
    )
    handed = weight * turn.inertia / turn.stiffness
    rates = kron(eye(steps), csr_matrix([[0.0, -handed, 0.0, handed]]))
    rates = bmat([[rates, csr_matrix((steps, steps))]])
    peak = csr_matrix(-np.ones((steps, 1)))
    cost = np.zeros(5 * steps + 1)
    cost[-1] = 1.0
    found = linprog(
        cost,
        A_ub=bmat([[twists, peak], [-twists, peak], [rates, peak], [-rates, peak]]),
        b_ub=np.zeros(4 * steps),
        A_eq=bmat([[dynamics], [last]]),
        b_eq=np.concatenate([np.zeros(4 * steps), [0.0, 0.0, angle, 0.0]]),
        bounds=[(None, None)] * (4 * steps) + [(-acceleration, acceleration)] * steps + [(0, None)],
        method="highs",
    )
    assert found.success, found.message
    return turn.stiffness * found.x[-1]


def test_parameters_are_those_derived_elsewhere() -> None:
    assert TURN.inertia == pytest.approx(4.20, abs=0.005)
    assert TURN.stiffness == pytest.approx(2754, abs=0.5)
    assert TURN.frequency / (2 * math.pi) == pytest.approx(4.08, abs=0.005)


def test_inertia_and_stiffness_by_integrals() -> None:
    # a hoop through the axis, point by point; the torsion of a tube by its shear flow
    radius = 0.45 * math.sin(math.radians(4.4)) / math.sin(math.pi / 24)
    hoop, _ = quad(
        lambda a: (radius + radius * math.cos(a)) ** 2 + (radius * math.sin(a)) ** 2, 0, math.tau
    )
    assert TURN.inertia == pytest.approx(30.0 * hoop / math.tau, rel=1e-12)
    polar, _ = quad(lambda r: math.tau * r**3, 0.028, 0.030)
    assert TURN.stiffness == pytest.approx(70e9 / 2.6 * polar / 3.0, rel=1e-9)


@pytest.mark.parametrize(("duration", "acceleration"), [(1.5, 6.0), (2.0, 6.0), (2.0, 3.0)])
def test_least_torque_is_that_of_a_linear_program(duration: float, acceleration: float) -> None:
    turn = least_torque_turn(TURN, RIGHT, duration, acceleration)
    by_program = least_peak_by_program(TURN, RIGHT, duration, acceleration, 1200)
    # steps of a millisecond hold switches to a millisecond, and peaks are limited at their ends
    assert turn.peak_torque == pytest.approx(by_program, rel=1e-4)
    assert turn.peak_torque > least_torque_bound(TURN, RIGHT, duration)


@pytest.mark.parametrize("seed", range(50))
def test_the_closed_form_turns_from_rest_to_rest(seed: int) -> None:
    draw = np.random.default_rng(seed)
    params = TurnParameters(draw.uniform(1, 50), draw.uniform(100, 5000))
    angle, duration = draw.uniform(0.2, 3.0), draw.uniform(40, 400) / params.frequency
    acceleration = draw.uniform(1.1, 6.0) * 4 * angle / duration**2
    turn = least_torque_turn(params, angle, duration, acceleration)
    assert turn is not None
    u = np.array(turn.accelerations)
    inner = np.sort(
        np.concatenate(
            [
                np.linspace(a, b, 40)[1:-1]
                for a, b in zip(turn.switches, turn.switches[1:], strict=False)
            ]
        )
    )
    time = np.union1d(turn.switches, inner)
    after = u[np.clip(np.searchsorted(turn.switches, time, "right") - 1, 0, u.size - 1)]
    before = u[np.clip(np.searchsorted(turn.switches, time) - 1, 0, u.size - 1)]
    moved = turn_response(params, time, before, after)
    assert moved.antenna_angle[-1] == pytest.approx(angle, rel=1e-8)
    assert abs(moved.antenna_rate[-1]) < 1e-8 * moved.antenna_rate.max()
    assert abs(moved.drive_rate[-1]) < 1e-8 * moved.drive_rate.max()
    assert np.abs(moved.torque).max() == pytest.approx(turn.peak_torque, rel=1e-8)
    assert moved.drive_rate.max() == pytest.approx(turn.peak_speed, rel=1e-8)
    # and back: that torque is reached no sooner
    again = torque_limited_turn(params, angle, turn.peak_torque, acceleration)
    assert again.duration == pytest.approx(duration, rel=1e-8)
    assert duration > least_turn_time_bound(params, angle, turn.peak_torque, acceleration)


def test_a_free_satellite_and_the_antenna_as_two_bodies() -> None:
    H, duration = 300.0, 3.0
    law = Bezier(duration, paper_points(0.0, RIGHT))
    time = np.linspace(0.0, duration, 8001)
    u = law.motion(time).acceleration
    moved = turn_response(TURN.on_free_satellite(H), time, u, u)

    def rates(t, y):  # angles of satellite and antenna in fixed axes; the drive's is seen from it
        satellite, antenna, *speeds = y
        drive = satellite + float(law.motion(t).angle[0])
        torque = TURN.stiffness * (drive - antenna)
        return [*speeds, -torque / H, torque / TURN.inertia]

    two = solve_ivp(rates, (0, duration), np.zeros(4), rtol=1e-11, atol=1e-13, method="DOP853")
    satellite, antenna, satellite_rate, antenna_rate = two.y[:, -1]
    # the law's acceleration as lines between 8001 samples leaves 2e-7 rad of it
    assert moved.antenna_angle[-1] == pytest.approx(antenna - satellite, abs=1e-6)
    # what the relative motion says of the satellite, in angle and momentum
    J = TURN.on_free_satellite(H).inertia
    assert satellite == pytest.approx(-J / H * moved.antenna_angle[-1], abs=1e-8)
    assert J * moved.antenna_rate[-1] == pytest.approx(TURN.inertia * antenna_rate, abs=1e-5)
    assert H * satellite_rate == pytest.approx(-TURN.inertia * antenna_rate, abs=1e-9)


def test_where_the_closed_form_does_not_hold_there_is_none() -> None:
    # the drive cannot turn so far, or could not keep such a twist
    assert least_torque_turn(TURN, RIGHT, 2.0, 1.5) is None
    assert torque_limited_turn(TURN, RIGHT, 5.0, 1.0) is None
    # so short a turn has no time to keep its torque
    assert torque_limited_turn(TURN, 1e-3, 5.0, 3.0) is None
    with pytest.raises(ModelError, match="duration"):
        least_torque_turn(TURN, RIGHT, 0.0, 1.0)


def test_the_response_is_that_of_another_integrator() -> None:
    law = Bezier(3.0, paper_points(0.0, RIGHT))
    time = np.linspace(0.0, 3.0, 6001)
    drive = law.motion(time)
    moved = turn_response(TURN, time, drive.acceleration, drive.acceleration)

    def rates(at, state):
        beta = law.motion(at).angle[0] - law.start_angle
        return [state[1], TURN.stiffness / TURN.inertia * (beta - state[0])]

    path = solve_ivp(rates, (0.0, 3.0), [0.0, 0.0], "DOP853", time, rtol=1e-10, atol=1e-12)
    # the acceleration is taken to be linear over half a millisecond
    assert np.abs(path.y[0] - moved.antenna_angle).max() < 1e-6
    kinetic = TURN.inertia * path.y[1] ** 2 / 2
    strain = TURN.stiffness * (drive.angle - law.start_angle - path.y[0]) ** 2 / 2
    assert np.abs(kinetic + strain - moved.energy).max() < 1e-4 * kinetic.max()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: TurnParameters(0.0, 1.0), "inertia"),
        (lambda: stowed_ring_inertia(DYNAMIC_SET, -1.0), "mass"),
        (lambda: torsion_stiffness(ArmParameters(), 0.6), "such as 0.3"),
        (lambda: turn_response(TURN, np.zeros(3), np.zeros(3), np.zeros(3)), "rising times"),
    ],
)
def test_what_makes_no_sense_is_refused(call, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        call()
