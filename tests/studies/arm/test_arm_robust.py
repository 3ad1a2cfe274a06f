"""One motion for a spread of arms: the many arms abreast, the driven joint, a robust motion."""

import dataclasses
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import PPoly

from models.ancf.integrate import StepControl
from models.ancf.joints import Torque
from models.arm.driven import DrivenArm
from models.arm.reduced import ReducedArm
from models.arm.reduced_simulation import simulate_reduced
from models.errors import ModelError
from studies.arm.config import RobustStudy
from studies.arm.optimal.motion import angle_joints, torque_joints
from studies.arm.questions.robust import comparison as robust_study
from studies.arm.questions.robust import problem as robust_problem
from studies.arm.questions.robust import trials as robust_trials
from studies.arm.questions.robust.copies import SampledMotion
from studies.arm.questions.robust.draws import draw_series, rates_in_words, rates_of
from studies.arm.questions.robust.problem import solve_nominal
from studies.arm.questions.robust.spread import SPREADS, Spread
from studies.arm.replay.full_model import Motion, replay
from studies.arm.replay.reduced_model import (
    arm_equations,
    paths,
    reduced_residual,
    residuals,
    varied,
)
from studies.arm.replay.sampled import SampledProfile, sampled_to
from studies.arm.stage import big_arm, both_arms, small_arm
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT
from studies.common.processes.side_by_side import side_by_side

STAGES = {"big": big_arm(0.5), "small": small_arm(0.5)}
OTHER = (0.7, 1.2, 1.4)  # big stiffness, small stiffness, tip mass


def pushed(stage, factors=(1.0, 1.0, 1.0)):
    """A wave of torque on an arm, and its motion on B21 by a method of order 8."""
    joint, T = stage.moving[0], stage.duration
    law = Torque(lambda t: 30.0 * np.sin(2 * np.pi * np.asarray(t) / T) ** 3)
    other = dataclasses.replace(stage, arm=varied(stage.arm, factors))
    laws = {("root", "elbow")[joint]: law}
    start = other.model.at(*stage.start)
    run = simulate_reduced(other.model, start, np.linspace(0, T, 201), tolerance=1e-9, **laws)
    return Motion("wave", "torque", stage, {joint: law}), run


@pytest.mark.parametrize("name", STAGES)
def test_arms_abreast_move_as_each_alone(name):
    stage = STAGES[name]
    motion, nominal = pushed(stage)
    run = pushed(stage, OTHER)[1]
    found = residuals(motion, [(1.0, 1.0, 1.0), OTHER], step=0.001)
    other = dataclasses.replace(stage, arm=run.model.parameters)
    wanted = [reduced_residual(stage, nominal), reduced_residual(other, run)]
    assert found == pytest.approx(wanted, rel=2e-3)
    assert abs(wanted[1] / wanted[0] - 1) > 0.05  # the arms differ


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"damping_ratio": 0.02}, {"tip_mass": 3.0}, {}])
@pytest.mark.parametrize("stiffness", [1.0, 4.0])
def test_steps_are_as_short_as_the_fastest_mode_needs(change, stiffness):
    stage = big_arm(1.0)
    stage = dataclasses.replace(stage, arm=dataclasses.replace(stage.arm, **change))
    other = (stiffness, stiffness, 0.9)
    motion = pushed(stage)[0]
    fine = residuals(motion, [other], step=1e-4)
    assert fine[0] > 1e-9
    assert residuals(motion, [other]) == pytest.approx(fine, rel=0.02)


@pytest.mark.parametrize("name", STAGES)
def test_arms_on_an_angle_move_as_the_full_model(name):
    stage = STAGES[name]
    motion, run = pushed(stage)
    joint = stage.moving[0]
    law = {joint: motion.joints[joint].torque}
    driven = Motion("wave", "angle", stage, dict(angle_joints(run, law)))
    found = residuals(driven, [(1.0, 1.0, 1.0), OTHER], step=0.001)
    other = dataclasses.replace(stage, arm=varied(stage.arm, OTHER))
    full = replay(
        dataclasses.replace(driven, stage=other), elements=4, settings=StepControl(1e-6, stages=7)
    )
    assert found[1] == pytest.approx(full.residual_energy, rel=0.02)
    assert abs(found[1] / found[0] - 1) > 0.05


@pytest.mark.parametrize("drive", ["torque", "angle"])
def test_a_motion_that_goes_to_another_process_is_the_same(drive):
    stage = STAGES["big"]
    run = pushed(stage)[1]
    torques = {0: PPoly(np.array([[-8.0], [4.0], [0.0]]), [0.0, 0.5])}
    of_drive = torque_joints(torques) if drive == "torque" else angle_joints(run, torques)
    given = Motion("wave", drive, stage, dict(of_drive))
    there = pickle.loads(pickle.dumps(given))
    assert there.stage == stage
    assert "model" not in vars(there.stage)  # what is made of a stage is made again

    t = np.linspace(0.0, 0.6, 50)
    for one, other in zip(
        vars(given.joints[0]).values(), vars(there.joints[0]).values(), strict=True
    ):
        assert callable(one) == callable(other)
        assert not callable(one) or np.array_equal(one(t), other(t))
    assert residuals(there, [OTHER], step=0.002) == residuals(given, [OTHER], step=0.002)


def test_a_replay_and_its_samples_come_back_from_another_process():
    curve = PPoly(np.array([[-8.0], [4.0], [0.0]]), [0.0, 0.5])
    given = Motion("wave", "torque", STAGES["big"], dict(torque_joints({0: curve})))
    profile = sampled_to(replay(given, elements=4), 1.0, step=0.05, elements=4)
    there = pickle.loads(pickle.dumps(profile))
    assert there.exact.residual_energy == profile.exact.residual_energy
    assert there.residual_energy == profile.residual_energy
    assert np.array_equal(there.values[0], profile.values[0])


@pytest.mark.parametrize("drive", ["torque", "angle"])
def test_paths_of_arms_end_where_their_residuals_are_taken(drive):
    stage = STAGES["big"]
    motion, run = pushed(stage)
    if drive == "angle":
        law = {0: motion.joints[0].torque}
        motion = Motion("wave", "angle", stage, dict(angle_joints(run, law)))
    factors = [(1.0, 1.0, 1.0), OTHER]
    path = paths(motion, factors, 51)
    equations = arm_equations(stage, drive)
    assert path.shape == (2, len(equations.start), 51)
    assert np.array_equal(path[0, :, 0], equations.start)
    if drive == "torque":
        assert path[0, :4] == pytest.approx(run.q[:, ::4], abs=1e-5)

    joint = motion.joints[0]
    last = joint.torque(np.array([0.5])) if drive == "torque" else np.ravel(joint.law(0.5))
    left = [float(equations.energy(path[k, :, -1], last, factors[k])) for k in range(2)]
    assert left == pytest.approx(residuals(motion, factors, step=0.0025), rel=1e-9)


def test_copies_on_an_angle_start_from_motions_of_their_own():
    stage, spread = STAGES["big"].under("angle"), SPREADS["angle"]
    run = pushed(stage)[1]
    times, size = run.times, 2 * len(DrivenArm(stage.reduced(tied=False)).elastic)
    own = np.random.default_rng(1).normal(size=(len(spread.design), size, len(times)))
    start = SampledMotion(times, run.q, run.v, 0 * times, 0 * times, own)
    phase = robust_problem.robust_statement(stage, start, spread, 40.0).problem.phases[0]
    of_last = [guess for signal, guess in phase.guess.items() if signal.name.endswith(" of copy 3")]
    assert np.array_equal([values for _, values in of_last], own[3])


def test_a_spread_puts_no_design_on_a_grid():
    for spread in SPREADS.values():
        points = {tuple(np.round(p, 9)) for p in spread.grid(21)}
        assert len(points) == 441
        assert not {tuple(np.round(spread.factors(*d), 9)) for d in spread.design} & points


def test_half_of_the_drawn_arms_are_left_with_more_than_the_median():
    factors = SPREADS["torque"].drawn(60, seed=3)
    assert factors == SPREADS["torque"].drawn(60, seed=3) != SPREADS["torque"].drawn(60, seed=4)
    assert all(0.9 <= x <= 1.1 and 0.9 <= y <= 1.1 and tip == 1.0 for x, y, tip in factors)
    assert not {(x, y) for x, y, _ in factors} & set(SPREADS["torque"].design)

    motion, _ = pushed(STAGES["big"])
    energies = residuals(motion, factors, step=0.002)
    study = RobustStudy(draws=60, allowed_energy=float(np.median(energies)))
    found = rates_of({"wave": energies}, study)["wave"]
    assert found.broken == 30
    assert found.low < 0.5 < found.high
    assert "has more residual energy in 50 %" in rates_in_words({"wave": energies}, study)[0]
    series = draw_series({"wave": energies})
    half = np.interp(study.allowed_energy, series["wave: draws"].values, series["draws"].values)
    assert half == pytest.approx(0.5, abs=1 / 60)


@pytest.mark.parametrize("drive", ["torque", "angle"])
def test_the_nominal_motion_is_solved_on_the_model_of_its_drive(drive, monkeypatch):
    stated = []
    monkeypatch.setattr(
        robust_problem, "solve_stage", lambda stage, **given: stated.append(stage) or "solved"
    )
    monkeypatch.setattr(
        robust_problem, "refine", lambda found, **given: SimpleNamespace(motion=found)
    )
    assert solve_nominal(STAGES["small"], drive) == "solved"
    # on a given angle the links hardly bulge: tied bulges left 2e-3 J of the small arm
    assert stated[0].tied == (drive == "torque")


@pytest.mark.parametrize(
    ("left", "intervals", "guesses"),
    [
        ([0.012], 60, [None]),  # near what the solver believes
        ([0.05, 0.012], 120, [None, 60]),
        ([0.5, 0.012], 120, [None, None]),  # more than the nominal motion: no guess
        ([0.5, 0.3], 120, [None, None]),  # the finest mesh there is
        ([0.2, 0.5], 60, [None, None]),  # the one that leaves least counts
        ([0.3, None], 60, [None, None]),  # the solver gives up on a finer one
    ],
)
def test_a_mesh_is_halved_until_a_replay_agrees_with_the_solver(
    left, intervals, guesses, monkeypatch
):
    remaining, console, guessed = iter(left), silent(), []

    def under_cap(sought, count, margin, guess, solver):
        given = next(remaining)
        guessed.append(guess)
        if given is None:
            raise StudyError("no motion")
        motion = SimpleNamespace(
            objective=1.0,
            left=given,
            trajectory=count,
            solution=count,
            stated=SimpleNamespace(problem=None),
        )
        return motion, margin

    monkeypatch.setattr(robust_problem, "_under_cap", under_cap)
    monkeypatch.setattr(
        robust_problem, "worst_of_its_arms", lambda motion, spread, live: motion.left
    )
    monkeypatch.setattr(robust_problem, "packed", lambda solution, known: solution)
    sought = robust_problem.SoughtMotion(STAGES["small"], None, SPREADS["angle"], 1.0, 10.0, 0.1)
    found = robust_problem._solved_robust(sought, 60, NOTHING_KEPT, console)
    assert found == (10.0, intervals)
    assert guessed == guesses
    assert next(remaining, "none") == "none"  # nothing is solved once both agree
    assert console.progress_to.getvalue().count("\n") == len(left)  # one line of each mesh


def test_the_nominal_arm_of_a_map_is_the_one_that_its_samples_are_held_against(monkeypatch):
    replayed = []

    def replay_(motion, settings=None):
        replayed.append(motion.stage.arm)
        left = 9.0 if settings is None else 4.0
        return SimpleNamespace(residual_energy=left, fixed=SimpleNamespace(residual_energy=left))

    def sampled_(exact, residual, kept):
        assert residual > exact.residual_energy
        return SampledProfile(exact, None, None, None)

    monkeypatch.setattr(robust_trials, "_ABREAST", 3)  # more than one group
    monkeypatch.setattr(robust_trials, "replay", replay_)
    monkeypatch.setattr(robust_trials, "sampled_to", sampled_)
    wave, _ = pushed(STAGES["big"])
    motion = SimpleNamespace(
        name="wave",
        stage=wave.stage,
        peak_torque=np.array([30.0, 0.0]),
        motion=lambda drive: dataclasses.replace(wave, drive=drive),
    )
    spread = SPREADS["torque"]
    arms = robust_trials.TriedArms(spread, 2, spread.drawn(3, seed=1))
    answers = side_by_side(robust_trials.parts_of(motion, arms), silent(), processes=1)
    said = []
    found = robust_trials.map_of(motion, arms, answers, said.append)

    assert np.array_equal(found.full, [[2.0, 2.0, 2.0], [2.0, 3.0, 2.0], [2.0, 2.0, 2.0]])
    assert found.at_nominal == 3.0
    assert sum(arm == wave.stage.arm for arm in replayed) == 1
    factors = [*spread.grid(2), *arms.drawn]
    left = residuals(wave, factors)
    assert np.concatenate([found.reduced.ravel() ** 2, found.drawn]) == pytest.approx(left)
    assert "2 x 2 arms" in said[0]
    assert next(answers, "none") == "none"


@pytest.mark.parametrize(
    ("worst", "left", "limit", "holds"),
    [
        (1e-2, 1.9e-3, 0.2, True),
        (1e-2, 2.1e-3, 0.2, False),
        (2e-4, 1.9e-4, 2.5, True),  # all arms are still, and no motion is asked to be stiller
        (1e-3, 4.9e-4, 0.5, True),
        (1e-3, 5.1e-4, 0.5, False),
    ],
)
def test_arms_that_are_still_need_not_be_left_with_less(worst, left, limit, holds):
    def left_with(root):
        grid = np.array([[0.1 * root, root]])
        motion = SimpleNamespace(name="wave")
        return robust_trials.ResidualMap(motion, 1.0, grid, 0.9 * grid, None, None)

    found = robust_study.Comparison(
        STAGES["big"], SPREADS["torque"], left_with(worst), (left_with(left),), (1.1,), {}
    )
    assert found.limit == pytest.approx(limit)
    assert found.holds == holds
    assert robust_study._criteria(found)[0].passed == holds
    assert any("counts as at rest" in remark for remark in robust_study._remarks(found)) == (
        limit > 0.2
    )


def coarse(drive, stage, copies, intervals, monkeypatch):
    """Nominal peak [N m] and ratios of the robust motion: few copies, coarse mesh, few arms."""
    spread = Spread(drive, SPREADS[drive].axes, copies)
    monkeypatch.setitem(robust_study.SPREADS, drive, spread)
    monkeypatch.setattr(robust_trials, "FULL", 2)
    found = robust_study.compare(stage, drive, 4, silent(), intervals=intervals, shares=(1.1,))
    assert found.holds
    assert 1.05 < found.robust[0].peak / found.nominal.peak <= 1.1
    return found.nominal.peak, *found.robust[0].ratios(found.nominal)


@pytest.mark.slow
def test_a_coarse_robust_motion_of_the_big_arm_stands_the_spread(monkeypatch):
    copies = ((0.925, 0.925), (1.075, 1.075))
    peak, reduced, full = coarse("torque", big_arm(4.3), copies, 50, monkeypatch)
    # this command's own: 13.314 N m was found as well, and leaves 1.4e-6 J where 1e-6 are allowed.
    # The rigid arm needs 3.2637 N m in 8.6 s, and four times that in half of it.
    assert peak == pytest.approx(13.342, rel=2e-3)
    assert peak > 4 * 3.2637
    assert reduced < 0.1  # a flat optimum: the floor of the residual, 0.008 and 0.018 were seen
    # so near to the rigid arm's peak the full arm keeps modes that B21 lacks: 0.042 was seen
    assert full < 0.1


@pytest.mark.slow
def test_a_coarse_robust_motion_of_the_small_arm_stands_the_spread(monkeypatch):
    copies = ((0.925, 0.925), (1.075, 1.075))
    peak, reduced, full = coarse("torque", small_arm(5.6), copies, 50, monkeypatch)
    assert peak == pytest.approx(52.04, rel=2e-3)
    assert reduced < 0.15  # one of several local optima: 0.052 to 0.116 were seen
    assert full == pytest.approx(reduced, rel=0.2)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--points", "1"], "points is 1"),
        (["--draws", "-1"], "draws is -1"),
        (["--confidence", "1"], "below 1"),
        (["--stage", "both"], "turns one joint, the stage 'both' both"),
        (["--stage", "smal"], "did you mean small?"),
        (["--duration", "-1"], "duration is -1; give a finite positive number"),
    ],
)
def test_bad_input_is_said(flags, said, capsys):
    assert main(["robust", "arm", *flags]) == ExitCode.BAD_INPUT
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("line", ["torque_cap = 3.0", "objective = 'energy'"])
def test_a_file_says_nothing_that_the_study_decides(line, tmp_path, capsys):
    file = tmp_path / "study.toml"
    file.write_text(f"{line}\n", "utf-8")
    assert main(["robust", "arm", str(file)]) == ExitCode.BAD_INPUT
    assert f"unknown key {line.split()[0]}" in capsys.readouterr().err


def test_one_joint_turns():
    with pytest.raises(ModelError, match="lock one joint"):
        DrivenArm(ReducedArm(big_arm().arm))
    with pytest.raises(StudyError, match="turns one joint"):
        solve_nominal(both_arms(), "torque")
