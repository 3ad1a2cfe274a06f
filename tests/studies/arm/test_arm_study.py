"""The arm study: laws and stages, one optimum replayed on both models, bad input."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from studies.arm.config import study_from
from studies.arm.laws.rigid import angle_drives, torque_drives
from studies.arm.laws.unit_laws import SHAPERS, shaped_bang_bang, unit_law
from studies.arm.optimal.refinement import FLOOR, refine
from studies.arm.optimal.solve import check_bending, solve_stage
from studies.arm.replay.full_model import Motion, replay
from studies.arm.replay.satellite import momenta
from studies.arm.stage import big_arm, both_arms, small_arm
from studies.cli import main
from studies.common.configuration import read_toml
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result

STEP5_BIG = 8.8e-6  # [J] left by Step5 after the big arm's 8.6 s, data to test against


def law(stage, name):
    if name in SHAPERS:
        return shaped_bang_bang(stage.duration, 2.178, name)
    return unit_law(name, stage.duration).law


@pytest.mark.parametrize("name", ["linear torque", "quintic", "Step5", "Bezier", "ZV", "ZVD"])
def test_every_baseline_turns_by_one_from_rest_to_rest(name):
    found = law(big_arm(8.6), name)
    motion = found.motion(np.array([0.0, 8.6]))
    assert found.duration == 8.6
    assert motion.angle == pytest.approx([0.0, 1.0], abs=1e-12)
    assert motion.speed == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "peak"), [("linear torque", 6.0), ("quintic", 5.77), ("Step5", 7.5), ("Bezier", 5.62)]
)
def test_peak_torques_in_their_unit(name, peak):
    stage = big_arm(8.6)
    t = np.linspace(0.0, 8.6, 4001)
    torque = torque_drives(stage, law(stage, name))[0].torque(t)
    assert np.abs(torque).max() / stage.torque_units[0] == pytest.approx(peak, abs=5e-3)


def test_the_shaper_cancels_its_own_mode():
    # residual of an oscillator under the law's acceleration: |integral a exp(i w t) dt|
    f = 2.178
    for kind in ("ZV", "ZVD"):
        shaped = shaped_bang_bang(8.6, f, kind)
        edges, w = np.array(shaped.edges), 2 * math.pi * f
        wave = np.diff(np.exp(1j * w * edges)) / (1j * w)
        assert abs((np.array(shaped.rates)[:, 0] * wave).sum()) < 1e-12


def test_rigid_torques_of_both_joints_at_once_balance_the_power():
    stage = both_arms(11.2)
    found = law(stage, "quintic")
    drives = torque_drives(stage, found)
    angles = angle_drives(stage, found)
    t = np.linspace(0.0, 11.2, 20001)
    power = sum(drives[k].torque(t) * angles[k].rate(t) for k in (0, 1))
    assert np.trapezoid(power, t) == pytest.approx(0.0, abs=1e-6)  # rest to rest, no losses


def test_step5_leaves_what_the_reference_left():
    stage = big_arm(8.6)
    motion = Motion("Step5", "torque", stage, torque_drives(stage, law(stage, "Step5")))
    done = replay(motion)
    assert done.residual_energy == pytest.approx(STEP5_BIG, rel=0.02)  # two digits given
    assert done.vibration.modal_energy.sum() == pytest.approx(done.residual_energy, rel=0.01)
    before = done.run.before
    _, angular = momenta(before.chain, before.q, before.v)
    torque = np.concatenate(
        [
            [0.0],
            np.cumsum(np.diff(before.times) * (before.torque[0, 1:] + before.torque[0, :-1]) / 2),
        ]
    )
    assert angular == pytest.approx(torque, abs=4e-5)  # trapezoidal rule: h^2/12 max |tau'|


@pytest.mark.slow
def test_the_optimum_leaves_less_than_a_hundredth_of_step5_under_either_drive():
    stage = big_arm(8.6)
    caps = stage.capped(7.5)
    found = refine(solve_stage(stage, caps=caps))
    assert found.resolved
    assert found.replay.peak_torque[0] <= 7.5 * stage.torque_units[0]
    assert found.replay.residual_energy < 0.01 * STEP5_BIG
    assert found.motion.replay("angle").residual_energy < FLOOR


@pytest.mark.slow
def test_at_the_papers_pace_nothing_measurable_is_left():
    for stage in (big_arm(), small_arm()):
        solved = solve_stage(stage)
        coarse, fine = solved.replay(), solved.replay(elements=16)
        assert max(coarse.residual_energy, fine.residual_energy) < 1e-9  # J: still


@pytest.mark.slow
def test_the_command_writes_what_reproduces_it(tmp_path: Path):
    out = tmp_path / "out"
    arguments = ["arm", "solve", "--stage", "big", "--torque-cap", "4.55", "--results", str(out)]
    assert main(arguments) == ExitCode.OK
    record = json.loads((out / "verification.json").read_text())
    assert record["passed"]
    assert record["values"]["residual_energy"] < 1e-7
    names = {path.name for path in out.iterdir()}
    assert {"profile.csv", "profile.json", "input.toml", "loads.csv", "fig10_torque.png"} <= names

    kept = Result.load(out)
    assert kept.passed
    assert kept.value("residual_energy", "Step5") == pytest.approx(STEP5_BIG, rel=0.02)
    assert study_from(read_toml(out / "input.toml")) == study_from(kept.configuration)
    assert main(["report", str(out), "--figures", "png", "--to", str(tmp_path)]) == ExitCode.OK
    drawn = {path.name for path in (tmp_path / "figures").glob("*.png")}
    assert drawn == {name for name in names if name.endswith(".png")}


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--torque-cap", "3.0"], ExitCode.INFEASIBLE, "even a rigid arm takes more than 8.97"),
        (["--rate-cap", "0.1"], ExitCode.INFEASIBLE, "more than 3.036 N m/s"),
        (["--stage", "bigg"], ExitCode.BAD_INPUT, "did you mean big?"),
        (
            ["--tip-mass", "-1"],
            ExitCode.BAD_INPUT,
            "--tip-mass is -1; give a finite non-neg",
        ),
        (
            ["--big-length", "0"],
            ExitCode.BAD_INPUT,
            "--big-length is 0; give a finite positive",
        ),
        (["--modulus", "-70"], ExitCode.BAD_INPUT, "modulus is -70; give a finite positive number"),
        (["--density", "0"], ExitCode.BAD_INPUT, "density is 0; give a finite positive number"),
        (["--density", "1e-300"], ExitCode.BAD_INPUT, "--density is 1e-300; give a number from"),
        (
            ["--density", "0.001", "--tip-mass", "1e12"],
            ExitCode.BAD_INPUT,
            "masses of the arm are too unlike",
        ),
        (["--duration", "1e-300"], ExitCode.BAD_INPUT, "--duration is 1e-300; give a number from"),
        (["--big-wall", "0.05"], ExitCode.BAD_INPUT, "give half the diameter or less"),
        (
            ["--damping-ratio", "-0.1"],
            ExitCode.BAD_INPUT,
            "--damping-ratio is -0.1; give a finite",
        ),
        (["--elements", "2", "--modes", "5"], ExitCode.BAD_INPUT, "too coarse for .* at least 4"),
        (["--modes", "67"], ExitCode.BAD_INPUT, "modes is 67, but the locked arm has 66 with 8 el"),
        (["--elements", "2.5"], ExitCode.BAD_INPUT, "elements is 2.5; give a whole number"),
        (["--sample-time", "9"], ExitCode.BAD_INPUT, "more than the stage's 8.6 s"),
        (["--duration", "-3"], ExitCode.BAD_INPUT, "duration is -3; give a finite positive number"),
        (["--duration", "soon"], ExitCode.BAD_INPUT, "duration is 'soon'"),
        (["--root-end-deg", "0"], ExitCode.BAD_INPUT, "turns no joint"),
        (["--modulus", "7e6"], ExitCode.INFEASIBLE, "would bend a link by about 11 rad"),
    ],
)
def test_bad_input_is_one_sentence(arguments, code, words, capsys, tmp_path):
    assert main(["arm", "solve", *arguments, "--results", str(tmp_path / "out")]) == code
    complaint = capsys.readouterr().err
    assert re.search(words, complaint)
    assert complaint.count("\n") == 1
    assert "Traceback" not in complaint


@pytest.mark.parametrize("question", ["baselines", "least-duration"])
def test_every_question_refuses_a_link_that_bends_too_far(question, capsys, tmp_path):
    asked = ["arm", question, "--modulus", "7e6", "--results", str(tmp_path / "out")]
    assert main(asked) == ExitCode.INFEASIBLE
    assert "would bend a link" in capsys.readouterr().err


def test_a_key_of_the_arm_has_its_place():
    with pytest.raises(StudyError, match=r"tip_mass is a key of arm; write it below a line"):
        study_from({"tip_mass": 10})


def test_bending_is_refused_up_to_the_duration_that_is_named():
    soft = study_from({"arm": {"modulus": 7e6}}).slew
    with pytest.raises(StudyError, match=r"give a duration of [\d.]+ s") as caught:
        check_bending(soft)
    least = float(re.search(r"duration of ([\d.]+) s", str(caught.value))[1])
    check_bending(soft.lasting(least))
    with pytest.raises(StudyError):
        check_bending(soft.lasting(least - 0.2))


def test_a_shaper_longer_than_the_motion_is_refused():
    with pytest.raises(StudyError, match="longer than the motion"):
        shaped_bang_bang(1.0, 0.4, "ZVD")


def test_angles_and_masses_are_read():
    study = study_from(
        {"stage": "small", "elbow_end_deg": 30, "arm": {"tip_mass": 10}, "duration": 9}
    )
    assert study.slew.end[1] == pytest.approx(math.radians(30))
    assert study.slew.arm.tip_mass == 10
    assert study.slew.duration == 9
