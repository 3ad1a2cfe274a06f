"""Ropes that give: stability, frequency and swing, by means that share no formula with the model.

The twin below adds up all segments of a rope one by one, and knows no derivative in closed form but
those of the geometry.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from models.errors import ModelError
from models.laws import Bezier, JerkLimited, paper_points
from models.truss import (
    DYNAMIC_SET,
    TrussParameters,
    evaluate_motion,
    inertia,
    inertia_slope,
    jerk_step_at_net,
    joint_damping,
    least_rope_stiffness,
    rope_mode_frequency,
    rope_swing,
    wound_rope,
)
from tests.seeds import seeds

YIELDS = ("at the motor", "along its length")
RUBBED = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)


def slider(p, alpha):
    """e and e' [m, m/rad]."""
    s, c = np.sin(alpha), np.cos(alpha)
    height = np.sqrt(p.link**2 - (p.crank * s) ** 2)
    return p.crank * c + height, -p.crank * s - p.crank**2 * s * c / height


def torques(p, alpha):
    """By T1 and at all: what both ropes give the truss, and what springs and net take [m, N m]."""
    e, slope = slider(p, alpha)
    pulled, stretched, length = 0.0, 0.0, 0.0
    wraps = 0.0
    for segment in range(4 * p.modules):
        tension = np.exp(-p.pulley_friction * wraps)
        sliding = segment % 4 in (0, 3)
        pulled = pulled - 2 * tension * slope * sliding
        stretched = stretched + tension * (e if sliding else p.half_cross_bar)
        length = length + (e if sliding else p.half_cross_bar)
        # about the bar's end, two pulleys at the middle, and on to the next module
        wraps = (
            wraps + (math.pi - alpha, math.pi - 2 * alpha, math.pi - alpha, math.pi)[segment % 4]
        )
    taken = 2 * p.modules * p.spring_stiffness * (e - p.spring_free_length) * slope
    radius = p.half_cross_bar / math.sin(math.pi / p.modules)
    rise = (np.sin(alpha) - math.sin(p.net_angle)) * (np.real(alpha) >= p.net_angle)
    taken = taken + 2 * p.modules * p.net_stiffness * radius**2 * rise * np.cos(alpha)
    return pulled, taken, stretched / length


def ratio(p, alpha, yields):
    return 1.0 if yields == "at the motor" else torques(p, alpha)[2]


def taken_rope(p, alpha):
    return 2 * p.modules * (slider(p, p.stowed_angle)[0] - slider(p, alpha)[0])


def back(p, alpha, wound, k, yields):
    """What pulls the truss back while the motor stands [N m]."""
    lever, taken, _ = torques(p, alpha)
    return taken - k * (wound - taken_rope(p, alpha)) / ratio(p, alpha, yields) * lever


def wound_at_rest(p, alpha, k, yields):
    lever, taken, _ = torques(p, alpha)
    return taken_rope(p, alpha) + taken / lever * ratio(p, alpha, yields) / k


def random_truss(seed: int) -> TrussParameters:
    """A truss whose springs push from the start, so that its rope is taut."""
    draw = np.random.default_rng(seed)
    b = draw.uniform(0.3, 0.7)
    crank = draw.uniform(0.15, 0.35) * b
    link = crank * draw.uniform(1.2, 1.8)
    return TrussParameters(
        bar_length=2.2 * b,
        half_cross_bar=b,
        crank=crank,
        link=link,
        modules=int(draw.integers(6, 31)),
        stowed_angle=math.radians(draw.uniform(3, 8)),
        net_angle=math.radians(draw.uniform(70, 84)),
        spring_stiffness=draw.uniform(50, 300),
        net_stiffness=draw.uniform(20, 400),
        spring_free_length=(crank + link) * draw.uniform(1.05, 1.4),
        pulley_friction=draw.choice([0.0, draw.uniform(0, 0.02)]),
    )


@pytest.mark.parametrize("yields", YIELDS)
@pytest.mark.parametrize("seed", seeds(8, 25))
def test_frequency_is_that_of_the_segments_one_by_one(seed: int, yields: str) -> None:
    p = random_truss(seed)
    for alpha in (0.3, math.radians(60), (p.net_angle + math.pi / 2) / 2):
        k = 3 * least_rope_stiffness(p, yields).stiffness + 100.0
        wound = wound_at_rest(p, alpha, k, yields)
        # a complex step takes the derivative without a difference
        stiffness = np.imag(back(p, alpha + 1e-30j, wound, k, yields)) / 1e-30
        expected = math.sqrt(stiffness / float(inertia(p, alpha))) / (2 * math.pi)
        assert rope_mode_frequency(p, alpha, k, yields)[0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("yields", YIELDS)
@pytest.mark.parametrize("mu", [0.0, 0.01])
def test_below_the_least_stiffness_rope_has_to_be_let_out(mu: float, yields: str) -> None:
    # of the twin's equilibria, whatever their stability: a truss that snaps through stands farther
    # open with less rope wound in
    p = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
    least = least_rope_stiffness(p, yields)
    alpha = np.linspace(p.stowed_angle, math.pi / 2, 9001)
    step = 1e-6

    def slopes(k):
        below, above = (wound_at_rest(p, alpha[1:-1] + d, k, yields) for d in (-step, step))
        return (above - below) / (2 * step)

    assert slopes(1.001 * least.stiffness).min() > 0.0
    unstable = slopes(0.999 * least.stiffness)
    assert unstable.min() < 0.0
    assert alpha[1:-1][np.argmin(unstable)] == pytest.approx(least.angle, abs=1e-3)


@pytest.mark.parametrize(
    ("mu", "yields", "least"),
    # derived elsewhere, to the digits shown; a rope that gives along its length has less tension
    [(0.0, "at the motor", 37.0), (0.01, "at the motor", 71.0), (0.01, "along its length", 37.0)],
)
def test_least_stiffness_of_the_dynamic_set(mu: float, yields: str, least: float) -> None:
    p = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
    assert least_rope_stiffness(p, yields).stiffness == pytest.approx(least, abs=0.5)


def test_frequencies_of_the_dynamic_set() -> None:
    # derived elsewhere, to the digits shown; 80 deg is where the net becomes taut
    angles = np.radians([4.4, 45.0, 80.0])
    found = rope_mode_frequency(DYNAMIC_SET, angles, 600.0)
    assert found[:2] == pytest.approx([0.24, 2.8], rel=0.02)
    assert found[2] == pytest.approx(12.0, abs=0.5)
    assert math.isnan(rope_mode_frequency(DYNAMIC_SET, math.pi / 2, 30.0)[0])


@pytest.mark.parametrize("mu", [pytest.param(0.0, marks=pytest.mark.slow), 0.01])
def test_swing_is_that_of_another_integrator(mu: float) -> None:
    # nothing is slack here: 2e4 N/m in 20 s
    p = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
    law = Bezier(20.0, paper_points(p.stowed_angle, math.pi / 2))
    k = 2e4
    swing = rope_swing(p, law, k)
    assert swing.slack == 0.0

    at_first = wound_at_rest(p, p.stowed_angle, k, "at the motor")

    def rates(time, state):
        wound = at_first + taken_rope(p, law.motion(time).angle[0])
        alpha, omega = state
        pulled = back(p, alpha, wound, k, "at the motor")
        rest = 0.5 * float(inertia_slope(p, alpha)) * omega + float(joint_damping(p, alpha))
        return [omega, -(pulled + rest * omega) / float(inertia(p, alpha))]

    # half of the motion: later on an explicit method needs a step for each swing of 100 Hz
    end = int(np.searchsorted(swing.time, 10.0)) + 1
    times = swing.time[:end]
    start = [p.stowed_angle, 0.0]
    path = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-11)
    # of 1.5 rad: what the looser of the two integrators is allowed
    assert np.abs(path.y[0] - swing.angle[:end]).max() < 2e-7
    assert swing.angle_miss > 1e-4


@pytest.mark.parametrize("behind", [0.0, 0.1])
def test_energy_of_a_slack_and_swinging_truss(behind: float) -> None:
    # what the motors give goes into truss, ropes and joints; a slack rope holds no energy
    p, k = DYNAMIC_SET, 600.0
    law = Bezier(10.0, paper_points(p.stowed_angle, math.pi / 2))
    swing = rope_swing(p, law, k, behind=behind)
    assert swing.slack > 1.0
    inside = swing.time <= 10.0 + behind
    time, angle, speed = swing.time[inside], swing.angle[inside], swing.speed[inside]
    tension = swing.tension[:, inside]

    def winding(late):
        motion = law.motion(np.clip(time - late, 0.0, 10.0))
        return -2 * p.modules * slider(p, motion.angle)[1] * motion.speed

    def total(power):
        return np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time))])

    stored = evaluate_motion(p, np.minimum(angle, math.pi / 2), speed, 0 * angle)
    ropes = (tension**2).sum(axis=0) / (2 * k)
    kept = stored.kinetic_energy + stored.potential_energy + ropes
    lost = total(np.array([float(joint_damping(p, one)) for one in angle]) * speed**2)
    given = total(tension[0] * winding(0.0) + tension[1] * winding(behind))
    # trapezoids over 2.5 ms, at swings of up to 12 Hz
    assert np.abs(kept - kept[0] + lost - given).max() < 2e-4 * given[-1]


@pytest.mark.parametrize("late", [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1)])
def test_each_rope_early_or_late_is_the_swing_with_one_behind(late: tuple[float, float]) -> None:
    # another integrator, which stops where a rope becomes slack or taut; the truss swings past
    # 40 deg with 1 rad/s
    p, k, stop = RUBBED, 600.0, 4.1
    law = JerkLimited(4.0, p.stowed_angle, math.radians(40.0), jerk=2.0).profile
    swing = rope_swing(p, law, k, behind=0.1)
    time = swing.time[swing.time < stop] + min(late)
    at_first = wound_at_rest(p, p.stowed_angle, k, "at the motor")

    def stretch(time, alpha, rope):
        wound = law.motion(np.clip(time - late[rope], 0.0, 4.0)).angle[0]
        return at_first + taken_rope(p, wound) - taken_rope(p, alpha)

    def until_a_rope_changes(begin, state, taut):
        def rates(time, state):
            alpha, omega = state
            lever, taken, _ = torques(p, alpha)
            pulls = sum(k * stretch(time, alpha, rope) for rope in (0, 1) if taut[rope])
            slope, lost = 0.5 * float(inertia_slope(p, alpha)), float(joint_damping(p, alpha))
            resists = taken + (slope * omega + lost) * omega
            return [omega, (pulls * lever / 2 - resists) / float(inertia(p, alpha))]

        def changes(rope):
            def event(time, state):
                return stretch(time, state[0], rope)

            event.terminal, event.direction = True, -1 if taut[rope] else 1
            return event

        def arrives(time, state):
            return state[0] - law.end_angle

        events = [changes(0), changes(1), arrives]
        end = time[-1]
        asked = time[time >= begin]
        tolerances = {"rtol": 1e-10, "atol": 1e-12}
        return solve_ivp(rates, (begin, end), state, "DOP853", asked, events=events, **tolerances)

    begin, state, taut = time[0], [p.stowed_angle, 0.0], [True, True]
    angles, arrivals, changes = [], [], 0
    while True:
        path = until_a_rope_changes(begin, state, taut)
        angles.append(path.y[0])
        arrivals += list(path.y_events[2])
        if path.status == 0:
            break
        (rope,) = (rope for rope in (0, 1) if path.t_events[rope].size)
        begin, state = path.t_events[rope][0], path.y_events[rope][0]
        taut[rope], changes = not taut[rope], changes + 1

    assert changes >= 2
    assert np.abs(np.concatenate(angles) - swing.angle[swing.time < stop]).max() < 1e-6
    alpha, omega = arrivals[0]
    energy = 0.5 * float(inertia(p, alpha)) * omega**2
    assert energy > 1.0
    assert swing.arrival_energy == pytest.approx(energy, rel=1e-4)


def test_what_is_left_is_the_work_back_to_rest() -> None:
    # stopped halfway, where the truss swings slowly and is hardly damped
    p, k = DYNAMIC_SET, 600.0
    law = JerkLimited(4.0, p.stowed_angle, math.radians(40.0), jerk=2.0).profile
    swing = rope_swing(p, law, k)
    held = wound_at_rest(p, p.stowed_angle, k, "at the motor") + taken_rope(p, law.end_angle)
    rest = brentq(lambda a: back(p, a, held, k, "at the motor"), 0.6, 0.8, xtol=1e-14)
    assert swing.rest_angle == pytest.approx(rest, abs=1e-10)

    place = int(np.searchsorted(swing.time, 4.0))
    angle, speed = swing.angle[place], swing.speed[place]

    def energy(alpha):
        spring = p.modules * p.spring_stiffness * (slider(p, alpha)[0] - p.spring_free_length) ** 2
        return spring + k * max(held - taken_rope(p, alpha), 0.0) ** 2

    kinetic = 0.5 * float(inertia(p, angle)) * speed**2
    # in one cell of the quadrature the rope becomes slack
    assert swing.energy_left == pytest.approx(kinetic + energy(angle) - energy(rest), rel=1e-5)
    assert swing.energy_left > 1.0


@pytest.mark.slow
def test_a_stiff_rope_follows_its_law() -> None:
    law = JerkLimited(20.0, RUBBED.stowed_angle, math.radians(60.0), jerk=0.05).profile
    soft, stiff = (rope_swing(RUBBED, law, k, "along its length") for k in (2e4, 2e5))
    assert stiff.angle_miss < 0.1 * soft.angle_miss < 3e-5


def test_a_truss_that_finds_no_rest_near_its_end_is_refused() -> None:
    law = JerkLimited(20.0, DYNAMIC_SET.stowed_angle, math.radians(40.0), jerk=0.05).profile
    with pytest.raises(ModelError, match=r"no rest within .* of 40 deg.*give a stiffer rope"):
        rope_swing(DYNAMIC_SET, law, 1.0)


@pytest.mark.parametrize("yields", YIELDS)
def test_a_truss_keeps_to_its_law_if_its_stretch_is_wound_in(yields: str) -> None:
    # with the motor's rope of the rigid law alone, it would be off by degrees
    law = Bezier(10.0, paper_points(RUBBED.stowed_angle, math.pi / 2))
    planned = rope_swing(RUBBED, law, 600.0, yields, winds_stretch=True)
    assert planned.slack == 0.0
    assert (
        math.degrees(planned.angle_miss) < 1e-3 < rope_swing(RUBBED, law, 600.0, yields).angle_miss
    )
    assert planned.rest_angle == pytest.approx(law.end_angle, abs=1e-8)


def test_rope_is_wound_in_without_a_step_if_the_jerk_steps_at_the_net() -> None:
    p, k, omega, acc, jerk = RUBBED, 900.0, 0.3, 0.1, -0.05

    def wound(time, step):
        """From the net angle on, or up to it, by Taylor."""
        after = jerk + step * (time > 0)
        alpha = p.net_angle + omega * time + acc * time**2 / 2 + after * time**3 / 6
        motion = (alpha, omega + acc * time + after * time**2 / 2, acc + after * time)
        return float(wound_rope(p, *motion, k))

    h = 1e-6

    def step_of_speed(step):
        ends = [(wound(s * 2 * h, step) - wound(s * h, step)) / (s * h) for s in (1, -1)]
        return abs(ends[0] - ends[1])

    step = jerk_step_at_net(p, omega)
    # of about 1 m/s; differences over a microsecond are good to 1e-5
    assert step_of_speed(step) < 1e-3 * step_of_speed(0.0)
    assert step < 0.0
