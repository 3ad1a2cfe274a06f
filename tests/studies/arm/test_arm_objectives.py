"""Objectives of the arm, and both stages as one problem."""

import math
import re

import casadi as ca
import numpy as np
import pytest

from models.ancf.joints import Torque
from models.arm.lock import released
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm
from ocp import NumericalTrouble
from ocp.mesh.initial_guess import initial_guess
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from studies.arm.config import SequenceStudy
from studies.arm.optimal.objectives import OBJECTIVES, first_duration, problem
from studies.arm.optimal.refinement import refine
from studies.arm.optimal.solve import in_words, solve_stage, solved
from studies.arm.optimal.solver import graded
from studies.arm.questions.sequence.problem import SMOOTHING, locked, sequence, sequence_problem
from studies.arm.replay.full_model import Motion, replay, steps_for
from studies.arm.replay.loads import deflections, loads, mean_square
from studies.arm.report.quantities import latched
from studies.arm.stage import TorqueCaps, big_arm, both_arms, small_arm
from studies.arm.study import check as check_study
from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError


def test_first_moment_of_the_straight_arm():
    arm = ArmParameters(elbow_mass=2.0)
    model = ReducedArm(arm)
    q = ca.SX.sym("q", model.size)
    found = ca.Function("first", [q], [model.first_moment(q)])(model.at(0.0, 0.0)).full()[:, 0]
    big, small = arm.big, arm.small
    wanted = big.linear_density * 3.0**2 / 2 + 2.0 * 3.0
    wanted += small.linear_density * 2.0 * 4.0 + 30.0 * 5.0
    assert found == pytest.approx([wanted, 0.0], abs=1e-9)


def test_rigid_bound_and_split_of_the_sequence():
    case = sequence(198.0, 10.0)
    assert case.rigid_bound == pytest.approx(0.0758, abs=5e-5)
    assert case.first.duration == pytest.approx(56.4, abs=0.05)
    assert case.second.duration == pytest.approx(141.6, abs=0.05)


def test_a_sequence_is_one_of_the_arm_given():
    heavy = sequence(198.0, 10.0, ArmParameters(tip_mass=60.0))
    assert heavy.first.arm.tip_mass == heavy.second.arm.tip_mass == 60.0
    assert heavy.rigid_bound > 1.5 * sequence(198.0, 10.0).rigid_bound


def test_released_elbow_keeps_positions_and_rates():
    case = sequence(19.8, 1.0)
    still, free = locked(case), case.second.reduced(tied=False)
    q, v = np.array([0.01, -0.004, 0.002]), np.array([0.1, 0.05, -0.02])
    place, rate = released(still, free, q, v)
    before = still.to_nodes(q[:, None], v[:, None], 2)
    after = free.to_nodes(place[:, None], rate[:, None], 2)
    assert after[0] == pytest.approx(before[0], abs=1e-14)
    assert after[1] == pytest.approx(before[1], abs=1e-14)


def test_graded_mesh_is_finest_where_the_torque_turns():
    steps = np.diff(graded(100).breakpoints)
    assert steps[[0, 49, 50, 99]].max() < steps.min() * 1.02
    assert steps.max() > 15 * steps.min()


@pytest.mark.slow
def test_the_smoothest_torque_under_a_cap_is_found_on_the_mesh_that_is_fine_where_it_turns():
    # 2.5 per cent above the rigid arm's least torque: full torque one way, then the other. On 150
    # even intervals none is found
    stage, factor = big_arm(8.6), 4.1
    assert not problem(stage, TorqueCaps()).capped
    capped = solve_stage(stage, caps=stage.capped(factor))
    assert capped.stated.capped
    assert capped.intervals == 150
    assert capped.peak_torque[0] <= factor * stage.torque_units[0] * (1 + 1e-9)
    assert capped.replay().residual_energy < 1e-6


@pytest.mark.parametrize(("cap", "rate"), [(12.0, 30.0), (12.0, 8.0), (12.0, 3.0)])
def test_least_time_starts_where_a_rigid_arm_can_turn(cap, rate):
    # the least time of a rigid arm by bisection over triangles and trapezoids of torque
    stage = small_arm(11.2)
    turn, low, high = stage.inertias[1] * math.pi, 1.0, 100.0
    for _ in range(60):
        T = 0.5 * (low + high)
        peak = min(cap, rate * T / 4)  # mirrored about T/2: momentum up until then, to zero after
        ramp = peak / rate
        turned = peak * (T / 2 - ramp) * T / 2
        low, high = (low, T) if turned >= turn else (T, high)
    caps = TorqueCaps((None, cap), (None, rate))
    assert first_duration(stage, caps) == pytest.approx(1.1 * high, rel=1e-9)
    with pytest.raises(StudyError, match="torque_cap and rate_cap"):
        first_duration(stage, TorqueCaps())


@pytest.mark.slow
def test_least_time_only_shortens_a_motion_that_is_possible():
    stage = small_arm(11.2)
    cap = 5.62 * float(stage.torque_units[1])  # the Bezier law's peak
    caps = TorqueCaps((None, cap), (None, 40.0))
    done = solve_stage(stage, caps=caps, objective="time", intervals=90)
    assert stage.least_duration(cap) < done.stage.duration < first_duration(stage, caps)
    assert done.peak_torque[1] <= cap * (1 + 1e-3)  # the command's own check


@pytest.mark.slow
def test_least_mean_square_torque_is_resolved_by_the_graded_mesh():
    # in the rigid arm's; this solve's own on a mesh of 200 intervals
    stage = small_arm(11.2)
    law = solve_stage(stage, objective="energy", intervals=100).torques[1]
    t = np.linspace(0.0, stage.duration, 40001)
    square = np.trapezoid(law(t) ** 2, t) / stage.duration
    assert square / (12.0 * stage.torque_units[1] ** 2) == pytest.approx(1.069, abs=0.02)


def test_a_torque_that_is_no_number_says_when_and_what_to_change(monkeypatch, capsys, tmp_path):
    # the solver is left out: a torque that is no number after 1 s stands for its motion
    stage = big_arm(8.6)
    law = Torque(lambda t: np.where(t > 1.0, np.nan, 0.0))
    with_it = lambda *_, **__: replay(Motion("broken", "torque", stage, {0: law}))  # noqa: E731
    monkeypatch.setattr("studies.arm.questions.one_motion.solve_stage", with_it)
    code = main(["arm", "solve", "--results", str(tmp_path / "out")])
    complaint = capsys.readouterr().err
    assert code == ExitCode.NOT_SOLVED
    assert "the law of joint 0 is nan at t = 1.0" in complaint
    assert "return finite numbers up to 8.6 s" in complaint
    said = [line for line in complaint.splitlines() if line[0] not in "[ "]
    assert len(said) == 1  # beside the lines of progress


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["solve", "--objective", "peak-torqe"], "did you mean peak-torque?"),
        (["solve", "--objective", "time"], "needs torque_cap and rate_cap"),
        (["solve", "--latch", "0"], "latch is 0"),
        (["sequence", "--least", "time"], "needs torque_cap"),
        (["sequence", "--torque-cap", "1"], "remove torque_cap, or minimise the time"),
        (["sequence", "--dwell", "-1"], "dwell is -1"),
        (["sequence", "--dwell", "1e-9"], "fastest mode; give at least 0.0114 s"),
        (["sequence", "--lock-energy", "1e9"], "shortest time tried"),
        (["solve", "--modulus", "7e20"], "lower modulus or thinner tubes\n"),
        (["solve", "--duration", "1e6"], "lower modulus or thinner tubes, or at most"),
        (["solve", "--modulus", "7e20"], "periods in 8.6 s, but the mesh resolves up to 200000"),
        (["solve", "--residual-energy", "0"], "--residual-energy is 0"),
        (["sequence", "--total", "long"], "total is 'long'"),
        (["sequence", "--lock-energy", "-1"], "--lock-energy is -1"),
        (["sequence", "--modulus", "0"], "modulus is 0; give a finite positive number"),
        (["sequence", "--least", "time", "--stage", "big"], "unknown flag --stage"),
        (["baselines", "--torque-cap", "3"], "unknown flag --torque-cap"),
        (["solve", "--dwell", "3"], "unknown flag --dwell"),
        (["solve", "--elements", "1e12"], "elements is 1e+12; give a whole number from 1 to 1000"),
        (["least-duration", "--stage", "both"], "turns one joint, the stage 'both' both"),
        (["--stage", "big"], "needs a sub-command before --stage: solve, baselines"),
    ],
)
def test_bad_input_is_one_sentence(arguments, words, capsys, tmp_path):
    assert main(["arm", *arguments, "--results", str(tmp_path / "out")]) == ExitCode.BAD_INPUT
    complaint = capsys.readouterr().err
    assert words in complaint
    assert complaint.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["--total", "2"],
        ["--least", "time", "--torque-cap", "1e6"],
        ["--total", "198", "--modulus", "1e5"],
    ],
)
def test_a_sequence_that_cannot_be_is_refused_at_once(arguments, capsys, tmp_path):
    code = main(["arm", "sequence", *arguments, "--results", str(tmp_path / "out")])
    assert code == ExitCode.INFEASIBLE
    assert "would bend a link" in capsys.readouterr().err


def test_a_cap_so_low_that_no_mesh_resolves_the_sequence_is_refused_with_the_least_cap(
    capsys, tmp_path
):
    words = ["arm", "sequence", "--least", "time", "--results", str(tmp_path / "out")]
    assert main([*words, "--torque-cap", "1e-9"]) == ExitCode.BAD_INPUT
    told = capsys.readouterr().err
    least = re.search(r"give a torque cap of at least ([0-9.]+) N m", told)
    study = SequenceStudy(least="time", torque_cap=float(least[1]))
    check_study(study)  # what is advised is accepted


def test_numerical_trouble_is_told_in_words_for_who_has_an_arm():
    failure = NumericalTrouble("IPOPT got into trouble; state sizes by `scale`", None)
    assert "longer duration" in in_words(failure)
    assert "scale" not in in_words(failure)


@pytest.mark.slow
def test_least_peak_torque_comes_near_the_rigid_bound_and_the_full_model_rests():
    # the rigid arm's is a bound; half the smoothness and half the interval change it by 1 % at most
    stage = big_arm(8.6)
    found = refine(solve_stage(stage, objective="peak-torque"))
    assert found.resolved
    assert 1.0 < found.motion.peak_torque[0] / (4.0 * stage.torque_units[0]) < 1.02
    assert found.replay.residual_energy <= 1e-6
    assert 0.0 < found.motion.smoothness_share < 0.01


@pytest.mark.slow
def test_least_mean_square_torque_is_nearly_the_rigid_arms():
    stage = big_arm(8.6)
    done = solve_stage(stage, objective="energy").replay()
    rigid = 12.0 * stage.torque_units[0] ** 2  # linear torque, closed form
    quintic = 120.0 / 7.0 * stage.torque_units[0] ** 2
    assert rigid < mean_square(done) < 0.5 * (rigid + quintic)
    assert done.residual_energy < 1e-6


MEASURES = {
    "peak-torque": lambda done: done.peak_torque[1],
    "peak-tip-acceleration": lambda done: loads(done).tip_acceleration.max(),
    "peak-root-reaction": lambda done: np.linalg.norm(loads(done).force, axis=0).max(),
    "deflection": lambda done: deflections(done).max(),
}


@pytest.fixture(scope="module")
def smoothest():
    return solve_stage(small_arm(11.2), intervals=100).replay()


@pytest.mark.slow
@pytest.mark.parametrize("objective", sorted(MEASURES))
def test_every_peak_is_lower_than_the_smoothest_motions_on_the_full_model(objective, smoothest):
    done = solve_stage(small_arm(11.2), objective=objective, intervals=100).replay()
    assert MEASURES[objective](done) < 0.98 * MEASURES[objective](smoothest)


@pytest.mark.slow
def test_a_least_peak_of_both_joints_is_found_from_the_motion_of_least_energy():
    # from a rigid arm's motion the solver finds none
    solved = solve_stage(both_arms(11.2), objective="deflection")
    assert solved.objective == pytest.approx(0.2174, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("duration", [9.0, 14.0])
def test_the_smoothest_torque_of_both_joints_is_one_for_all_durations(duration):
    # in units of the rigid arm it does not depend on the duration; from a rigid arm's motion none
    # was found in 9 s, and a far rougher one in 14 s
    solved = solve_stage(both_arms(duration))
    assert solved.objective == pytest.approx(0.0889, rel=3e-3)


@pytest.mark.slow
def test_both_stages_in_one_problem_come_near_the_rigid_bound():
    case = sequence(198.0, 10.0)
    found = solved("sequence", sequence_problem(case), SMOOTHING, None, (100, 8, 120))
    root, elbow = found.peak_torque
    assert root == pytest.approx(elbow, rel=1e-3)
    assert 1.0 < max(root, elbow) / case.rigid_bound < 1.06
    big, small = (stage.duration for stage in found.stages)
    assert big == pytest.approx(case.first.duration, abs=0.5)
    assert big + small + sum(found.dwells) == pytest.approx(208.0, abs=1e-6)
    assert found.replay(settings=steps_for(1e-6)).residual_energy < 1e-7


def test_a_latch_that_is_missed_fails():
    sentence, passed = latched("elbow", 1e-3, 1e-6)
    assert not passed
    assert sentence == (
        "the elbow misses its latch by 0.001 rad, more than 1e-06 rad; allow a wider latch, "
        "a longer duration or another law"
    )
    assert latched("elbow", 1e-7, 1e-6)[1]


def test_caps_of_a_multiple_of_the_unit():
    stage = big_arm(8.6)
    assert stage.capped(5.0).torque[0] == pytest.approx(
        5.0 * 38.417 * math.pi / 2 / 8.6**2, rel=1e-4
    )


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("stage", [big_arm(8.6), small_arm(11.2)], ids=["big", "small"])
def test_the_size_of_what_is_least_is_that_of_a_rigid_arm(stage, objective):
    # A link that bends by its whole typical size would throw the tip with 5000 times the square of
    # a rigid arm's acceleration: sized by that, the solver's barrier hides the objective.
    caps = TorqueCaps((100.0, 100.0), (100.0, 100.0))
    stated = problem(stage, caps, objective).problem
    parameters = parameters_of(stated, {})
    scales = scales_of(stated, initial_guess(stated, parameters, None), parameters)
    assert 0.1 <= scales.objective <= 30.0
