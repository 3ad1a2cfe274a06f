"""Motions that are planned on a satellite that turns, and caps of its wheels where it is held."""

import dataclasses
import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from ocp import Problem, solve
from studies.arm.config import ArmStudy
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import StatedMotion
from studies.arm.optimal.phase import arm_phase
from studies.arm.optimal.solve import check_caps, solve_stage
from studies.arm.optimal.solver import mesh_of, settings
from studies.arm.replay.full_model import CLOSE, replay
from studies.arm.replay.loads import loads
from studies.arm.report.quantities import wheel_checks
from studies.arm.stage import ELBOW, TorqueCaps, big_arm, small_arm
from studies.common.exit_codes import StudyError

H = 2000.0


def on_satellite(stage):
    return dataclasses.replace(stage, satellite_inertia=H)


def replay_of(motion):
    return replay(motion, settings=CLOSE)


def test_a_small_arm_that_is_planned_with_the_satellite_arrives_and_rests():
    """What a plan for a held satellite leaves on a free one, derived elsewhere: 0.4 J, 2 deg."""
    held, free = (solve_stage(stage) for stage in (small_arm(11.2), on_satellite(small_arm(11.2))))
    # the plan of the held arm on the satellite that turns
    unplanned = dataclasses.replace(held.motion("torque"), stage=on_satellite(held.stage))
    left = replay_of(unplanned)
    assert left.residual_energy == pytest.approx(0.524, rel=2e-3)
    assert math.degrees(left.miss) == pytest.approx(6.195, rel=2e-3)

    planned = replay_of(free.motion("torque"))
    assert planned.residual_energy < 1e-8
    assert math.degrees(planned.miss) < 1e-3
    # the joint's inertia is less where the satellite gives way
    assert free.peak_torque[ELBOW] / held.peak_torque[ELBOW] == pytest.approx(0.911, abs=2e-3)


@pytest.mark.parametrize(
    ("duration", "left"), [(11.2, 0.3931), pytest.param(8.0, 0.785, marks=pytest.mark.slow)]
)
def test_least_integral_of_the_torque_rate_squared(duration, left):
    """The plan for a held satellite leaves within 5 % of what was derived elsewhere.

    That was 0.4045 and 0.81 J. At 8 s it also was 10 % less torque. At 11.2 s it was 15.4 % more,
    which no rigid arm needs: it takes 9.2 % less in any time, see the next test.
    """
    plans = []
    for stage in (small_arm(duration), on_satellite(small_arm(duration))):
        arm = arm_phase(stage, TorqueCaps())
        rate = arm.drives.rate[ELBOW] * (duration / float(stage.torque_units[ELBOW]))
        least = arm.phase.integral(rate**2, "torque rate", "s") / duration
        stated = Problem("small arm", [arm.phase], minimise=least, bounds=arm.bounds)
        motion = StatedMotion(stated, (arm,), "smoothest")
        solution = solve(stated, settings=settings("adaptive"), mesh=mesh_of(motion, (200,)))
        plans.append(OptimalMotion("plan", motion, solution))
    held, free = plans
    unplanned = replay_of(dataclasses.replace(held.motion("torque"), stage=free.stage))
    assert unplanned.residual_energy == pytest.approx(left, rel=2e-3)
    planned = replay_of(free.motion("torque"))
    assert planned.residual_energy < 4e-5
    assert math.degrees(planned.miss) < 0.0128
    assert free.peak_torque[ELBOW] / held.peak_torque[ELBOW] == pytest.approx(0.9, abs=0.01)


def test_rigid_links_need_the_same_share_of_the_held_torque_in_any_time():
    """A collocation of its own: two rigid links of the arm's masses, by Runge-Kutta steps."""
    big, small, big_mass, small_mass, tip, steps = 3.0, 2.0, 0.58308, 0.365681, 30.0, 200
    about_elbow = small_mass * small**2 / 3 + tip * small**2
    lever = (small_mass * small / 2 + tip * small) * big
    about_root = big_mass * big**2 / 3 + (small_mass + tip) * big**2

    def peak_torque(duration, satellite):
        angle, speed, torque, rate = (ca.SX.sym(name) for name in "asut")
        coupled = about_elbow + lever * ca.cos(angle)
        whole = satellite + about_root + about_elbow + 2 * lever * ca.cos(angle)
        inertia = about_elbow - coupled**2 / whole  # the momentum about the root is zero
        slope = ca.jacobian(inertia, angle)
        state = ca.vertcat(angle, speed, torque)
        course = ca.vertcat(speed, (torque - slope * speed**2 / 2) / inertia, rate)
        f, h = ca.Function("f", [state, rate], [course]), duration / steps
        one = f(state, rate)
        two = f(state + h / 2 * one, rate)
        three = f(state + h / 2 * two, rate)
        four = f(state + h * three, rate)
        after = state + h / 6 * (one + 2 * two + 2 * three + four)
        step = ca.Function("step", [state, rate], [after]).map(steps)

        x, u = ca.MX.sym("x", 3, steps + 1), ca.MX.sym("u", 1, steps)
        gaps = ca.vec(step(x[:, :-1], u) - x[:, 1:])
        ends = ca.vertcat(x[:, 0] - ca.DM([math.pi, 0, 0]), x[:, -1])
        nlp = {"x": ca.veccat(x, u), "f": ca.sumsqr(u), "g": ca.vertcat(gaps, ends)}
        options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
        found = ca.nlpsol("plan", "ipopt", nlp, options)
        guess = np.zeros((steps + 1, 3))
        guess[:, 0] = np.linspace(math.pi, 0.0, steps + 1)
        best = found(x0=np.r_[guess.ravel(), np.zeros(steps)], lbg=0, ubg=0)
        assert found.stats()["success"]
        return np.abs(np.asarray(best["x"][2 : 3 * (steps + 1) : 3])).max()

    for duration in (8.0, 11.2):
        # a satellite of a million times the arm's inertia is held
        share = peak_torque(duration, H) / peak_torque(duration, 1e9)
        assert share == pytest.approx(0.9078, abs=2e-4)


def test_a_big_arm_that_is_planned_with_the_satellite_turns_its_joint_by_90_deg():
    motion = solve_stage(on_satellite(big_arm(8.6)))
    done = replay_of(motion.motion("torque"))
    assert done.residual_energy < 1e-8
    assert done.miss < 1e-5
    turned = done.fixed.before.joint_angles()[0, -1] - done.satellite.turn[-1]
    assert turned == pytest.approx(math.pi / 2, abs=1e-5)
    assert math.degrees(done.satellite.turn[-1]) == pytest.approx(-1.696, abs=1e-3)


@pytest.mark.parametrize(
    ("stage", "caps"),
    [
        (small_arm(11.2), TorqueCaps(momentum=75.0)),
        (small_arm(11.2), TorqueCaps(root_moment=40.0)),
        (big_arm(8.6), TorqueCaps(root_moment=4.0)),
    ],
    ids=["momentum", "moment under a locked root", "moment under a driven root"],
)
def test_the_wheels_caps_hold_on_the_full_model(stage, caps):
    motion = solve_stage(stage, caps=caps)
    done = replay_of(motion.motion("torque"))
    history = loads(done)
    assert done.residual_energy < 1e-7
    for values, cap in (
        (history.angular_momentum, caps.momentum),
        (history.moment[: history.until], caps.root_moment),
    ):
        if cap is not None:
            assert np.abs(values).max() == pytest.approx(cap, rel=1e-3)  # it acts, and is kept


def test_a_cap_of_the_wheels_that_is_broken_is_said():
    history = SimpleNamespace(
        moment=np.array([0.0, 2.0, 9.0]), until=2, angular_momentum=np.array([0.0, -7.0])
    )
    moment, momentum = wheel_checks(ArmStudy(wheel_torque=3.0, wheel_momentum=6.0), history)
    assert (moment.value, moment.passed) == (2.0, True)
    assert (momentum.value, momentum.passed) == (7.0, False)
    assert not wheel_checks(ArmStudy(), history)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"wheel_torque": 5.0}, "wheel_torque is 5, but the satellite of 2000 kg m.2 is free"),
        ({"wheel_momentum": 5.0}, "wheel_momentum is 5, but the satellite of 2000 kg m.2 is free"),
        ({"stage": "both"}, "the stage 'both' turns both joints.*give big or small"),
        ({"drive": "angle"}, "root with a given angle.*give drive = torque"),
        ({"satellite_inertia": 1e6}, "1e.06 kg m.2, more than 1.5.e.05 .* remove it"),
        ({"satellite_inertia": 0.0}, "satellite_inertia is 0.0; give a finite positive"),
    ],
)
def test_what_is_not_modelled_is_refused(stated, words):
    with pytest.raises(StudyError, match=words):
        ArmStudy(**{"satellite_inertia": H, **stated})


@pytest.mark.parametrize(
    ("stage", "caps", "words"),
    [
        (big_arm(8.6), TorqueCaps(momentum=7.0), "transfers more than 7.017 N m s in 8.6 s"),
        (big_arm(8.6), TorqueCaps(root_moment=3.0), "needs more than 3.264 N m in 8.6 s"),
    ],
)
def test_caps_that_even_a_rigid_arm_breaks_are_refused_with_the_least(stage, caps, words):
    with pytest.raises(StudyError, match=words):
        check_caps(stage, caps)
