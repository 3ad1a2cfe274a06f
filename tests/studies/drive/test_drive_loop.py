"""The loop is the low-pass that it claims to be, and stops are what they claim to be."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from models.laws import JerkLimited
from models.truss import DYNAMIC_SET, evaluate_motion
from studies.common.exit_codes import StudyError
from studies.drive import Drive
from studies.drive.course import rope_course, with_dwells
from studies.drive.loop import Loop, followed
from studies.drive.playback import on_the_truss
from studies.drive.setpoints import sampled, uniform_times
from studies.drive.stopping import least_jerk_stop, resume_course, stop_course
from studies.drive.stretch import stretched

OPEN = math.pi / 2


def law(duration: float = 10.0) -> JerkLimited:
    return JerkLimited(duration, DYNAMIC_SET.stowed_angle, OPEN, jerk=200 / duration**3)


@pytest.mark.parametrize("damping", [0.3, 0.7, 1.0, 2.5])
def test_the_loop_is_the_differential_equation(damping: float) -> None:
    curve = CubicSpline([0.0, 0.4, 1.0, 1.3], [0.0, 1.0, -0.5, 2.0])
    loop = Loop(7.0, damping)
    output = followed(curve, loop, 2.0)

    def equation(t: float, state: np.ndarray) -> list[float]:
        command = float(curve(t))
        return [state[1], 49.0 * (command - state[0]) - 14.0 * damping * state[1]]

    times = np.linspace(0.0, 1.3, 50)
    run = solve_ivp(equation, (0.0, 1.3), [0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    found = output.derivatives(times)
    # the integrator's own tolerance, over about ten time constants
    np.testing.assert_allclose(found[:2], run.y, rtol=0, atol=1e-7)
    acceleration = 49.0 * (curve(times) - found[0]) - 14.0 * damping * found[1]
    np.testing.assert_allclose(found[2], acceleration, rtol=0, atol=1e-10)
    assert output.derivatives(np.array([output.edges[-1]]))[0, 0] == pytest.approx(2.0, abs=1e-3)


def test_the_gains_of_a_loop_are_those_of_its_step_response() -> None:
    damping = 0.7
    step = 1 + math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    gain = (step) / (2 - step)  # the ups and downs of a decaying oscillation are a geometric row
    # the trapezoidal rule on 200,001 points, and e^-12 cut off
    assert Loop(3.0, damping).overshoot == pytest.approx(gain, rel=1e-5)


def test_rounding_keeps_every_count_and_the_bound_of_second_differences() -> None:
    course = rope_course(law().profile, DYNAMIC_SET)
    count = 2 * math.pi * 0.02 / 4096
    for step in (0.01, 0.1):
        points = sampled(course, uniform_times(course, step), count)
        exact = sampled(course, uniform_times(course, step))
        off = np.diff(points.positions, 2) - np.diff(exact.positions, 2)
        assert np.abs(off).max() <= 2 * count * (1 + 1e-9)
        assert np.abs(off).max() > 1.5 * count  # and it comes close to that
        assert np.diff(points.counts).sum() == round(course.travel / count)


def test_the_replay_is_the_model() -> None:
    profile = law().profile
    course = rope_course(profile, DYNAMIC_SET)
    time = np.linspace(0.01, 9.99, 500)
    motion = profile.motion(time)
    exact = evaluate_motion(DYNAMIC_SET, motion.angle, motion.speed, motion.acceleration)
    found = on_the_truss(course.derivatives(time), DYNAMIC_SET)
    # splines of 2001 angles: 1e-10 of their size; the angle by an arc cosine
    for ours, theirs in (
        (found.angle, motion.angle),
        (found.force, exact.rope_force),
        (found.far_end, exact.far_end_tension),
        (found.power, exact.motor_power),
        (found.reaction, exact.reaction_force),
        (found.energy, exact.kinetic_energy),
    ):
        assert np.abs(ours - theirs).max() <= 1e-9 * np.abs(theirs).max()


def test_the_course_has_the_rates_that_it_says() -> None:
    course = with_dwells(
        stretched(rope_course(law().profile, DYNAMIC_SET), DYNAMIC_SET, Drive(rope_stiffness=2e4)),
        1.0,
        2.0,
    )
    assert course.duration == 13.0
    time, h = np.linspace(1.5, 10.5, 37), 1e-4
    rows = course.derivatives(time)
    slope = (course.derivatives(time + h)[0] - course.derivatives(time - h)[0]) / (2 * h)
    # the difference's own error, and the steps of its two rates
    assert np.abs(slope - rows[1]).max() < 1e-5 * np.abs(rows[1]).max()
    assert not course.derivatives(np.array([0.5, 12.0]))[1:].any()


@pytest.mark.parametrize("at", [0.0, 1.0, 4.0, 5.0, 8.0, 9.5])
def test_a_stop_ends_at_rest_within_time_and_travel(at: float) -> None:
    course = rope_course(law().profile, DYNAMIC_SET)
    stop = stop_course(course, at, Drive())
    end = stop.derivatives(np.array([stop.duration]))[:3, 0]
    left = course.derivatives(np.array([10.0]))[0, 0]
    assert stop.duration <= 10.0 + 1e-9
    assert end[0] <= left + 1e-9
    assert abs(end[1]) < 1e-9
    grid = stop.derivatives(stop.grid(2000))
    assert grid[1].min() > -1e-9  # a rope cannot be pushed: it never pays out
    # without a jump of position, speed or acceleration where the stop begins
    near = stop.derivatives(np.array([max(at - 1e-9, 0.0), min(at + 1e-9, stop.duration)]))
    assert np.abs(near[:3, 1] - near[:3, 0]).max() < 1e-6


def test_no_stop_of_less_jerk_fits() -> None:
    speed, acceleration, time, travel = 1.0, 0.3, 4.0, 3.0
    phases = least_jerk_stop(speed, acceleration, time, travel, Drive())
    jerk = max(abs(j) for _, j in phases)
    with pytest.raises(StudyError, match="no stop within the drive's limits"):
        least_jerk_stop(speed, acceleration, time, travel, Drive(jerk=0.999 * jerk))
    assert least_jerk_stop(speed, acceleration, time, travel, Drive(jerk=1.001 * jerk))


@pytest.mark.parametrize("drive", [Drive(acceleration=0.25), Drive(acceleration=0.25, jerk=0.5)])
def test_a_stop_that_needs_more_time_names_a_time_that_is_enough(drive: Drive) -> None:
    with pytest.raises(StudyError, match=r"within 2 s and 9 m .* --stop-within ") as refused:
        least_jerk_stop(1.0, 0.1, 2.0, 9.0, drive)
    named = float(str(refused.value).split("--stop-within ")[1].split(",")[0])
    phases = least_jerk_stop(1.0, 0.1, named, 9.0, drive)
    assert sum(time for time, _ in phases) <= named * (1 + 1e-9)

    # more time is no help if the travel is too short
    with pytest.raises(StudyError, match=r"0\.5 m of travel; stop at an earlier time"):
        least_jerk_stop(1.0, 0.1, 2.0, 0.5, drive)


def test_a_stop_keeps_the_limit_of_acceleration() -> None:
    phases = least_jerk_stop(1.0, 0.0, 100.0, 3.0, Drive(acceleration=0.25))
    deepest = sum(dt * j for dt, j in phases[:1])
    assert deepest == pytest.approx(-0.25, rel=1e-9)
    assert phases[1][1] == 0.0
    with pytest.raises(StudyError, match="no stop"):  # v^2/(2 a) alone is 2 m
        least_jerk_stop(1.0, 0.0, 100.0, 1.9, Drive(acceleration=0.25))


def test_the_way_on_leads_to_the_end_within_the_limits() -> None:
    course = rope_course(law().profile, DYNAMIC_SET)
    way = resume_course(course, 5.0, Drive(speed=0.8, acceleration=4.0), within=1.0)
    speed, acceleration, _ = way.peaks
    assert speed <= 0.8 * (1 + 1e-9)
    assert acceleration <= 4.0 * (1 + 1e-9)
    end = way.derivatives(np.array([way.duration]))[0, 0]
    assert end == pytest.approx(course.travel, abs=1e-9)


def test_a_yielding_rope_is_wound_in_by_its_tension() -> None:
    rigid, k, w = rope_course(law().profile, DYNAMIC_SET), 2e4, 1e-3
    course = stretched(rigid, DYNAMIC_SET, Drive(rope_stiffness=k, tension_ramp=w))
    time = np.linspace(0.5, 9.5, 181)
    time = time[np.abs(time[:, None] - np.array(rigid.switches)).min(axis=1) > 4 * w]
    ends = np.array([0.0, 10.0])

    # (38) of the law itself; the average's times are off by up to w
    motion, rest = law().profile.motion(time), law().profile.motion(ends)
    pull = evaluate_motion(DYNAMIC_SET, motion.angle, motion.speed, motion.acceleration).rope_force
    held = evaluate_motion(DYNAMIC_SET, rest.angle, 0 * rest.speed, 0 * rest.angle).rope_force
    more = course.derivatives(time)[0] - rigid.derivatives(time)[0]
    steepest = np.abs(np.diff(pull) / np.diff(time)).max()
    assert np.abs(k * more - (pull - held[0])).max() < 2 * w * steepest
    assert k * (course.travel - rigid.travel) == pytest.approx(held[1] - held[0], rel=1e-6)
    assert course.stretch is not None
    assert course.stretch.missed < 2 * w * steepest + 1e-3 * pull.max()


def test_a_ramp_longer_than_the_motion_bears_is_refused() -> None:
    drive = Drive(rope_stiffness=2e4, tension_ramp=3.0)
    with pytest.raises(StudyError, match=r"takes 10 s; give at most 2\.5 s"):
        stretched(rope_course(law().profile, DYNAMIC_SET), DYNAMIC_SET, drive)
