"""Motions of flexible links: energies, both forms, locks and latches, results."""

import dataclasses
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import studies.flex
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from studies.flex import run, study_from
from studies.flex.build import build
from studies.flex.measures import fitted_frequency, vibration
from studies.flex.motion import move

ROOT = Path(studies.flex.__path__[0])
REFERENCE = Path(__file__).parents[2] / "models" / "arm" / "data"

# short and stiff: hardly more than rigid, so that closed forms hold
ROD = {"length": 1.0, "diameter": 0.05, "modulus": 2e11, "density": 8000.0}
SOFT = {"length": 1.0, "width": 0.03, "height": 0.005, "modulus": 7e10, "density": 2700.0}


def load(folder, name):
    """A committed case."""
    return study_from(tomllib.loads((ROOT / folder / f"{name}.toml").read_text("utf-8")))


def case(**changes):
    """A study of coarse links."""
    return study_from({"duration": 1.0, "elements": 3, "samples": 201, **changes})


def moved(study, form="minimal"):
    """The motion of a study."""
    return move(build(study), form, silent())


def test_the_presets_follow_the_reference_runs():
    """Table 1's pendulums against an independent code; the mesh leaves 1.7e-4 m."""
    data = np.loadtxt(REFERENCE / "single_pendulum.csv", delimiter=",", skiprows=1).T
    result = run(load("presets", "single-pendulum"))
    for name, wanted in zip(("x_0", "y_0"), data[1:3], strict=True):
        ours = np.interp(data[0], result.arrays["time"].values, result.arrays[name].values)
        assert np.abs(ours - wanted).max() < 3e-4
    assert result.passed


def test_a_driven_rod_needs_the_rigid_torque():
    joint = {"kind": "angle", "law": "quintic", "turn_deg": 90.0}
    motion = moved(case(link=[ROD], joint=[joint], tolerance=1e-9))
    assert math.degrees(motion.angles[0, -1]) == pytest.approx(90.0, abs=1e-9)

    # rho A L^3/3 times the quintic's acceleration; vibration lies about it, 4 % of it at most
    t, inertia = motion.times, 8000.0 * math.pi / 4 * 0.05**2 / 3
    rigid = inertia * (math.pi / 2) * (60 * t - 180 * t**2 + 120 * t**3)
    assert motion.torques[0] @ rigid / (rigid @ rigid) == pytest.approx(1.0, rel=1e-2)
    assert motion.kinetic.max() == pytest.approx(inertia * (1.875 * math.pi / 2) ** 2 / 2, rel=1e-2)
    # what the drive puts in is what moves: rest to rest leaves vibration only
    assert motion.work[0, -1] == pytest.approx(0.0, abs=1e-2 * motion.kinetic.max())
    assert np.abs(motion.balance - motion.balance[0]).max() < 1e-6 * motion.scale


def test_the_rigid_torque_law_turns_a_stiff_rod_by_its_angle():
    joint = {"kind": "torque", "law": "bezier", "turn_deg": -60.0, "over": 0.8, "start_deg": 10.0}
    motion = moved(case(link=[ROD], joint=[joint]))
    assert math.degrees(motion.angles[0, -1]) == pytest.approx(-50.0, abs=0.05)


def test_a_pace_of_two_halves_the_time_and_keeps_the_way():
    joint = {"kind": "torque", "law": "quintic", "turn_deg": 60.0}
    plain = moved(case(link=[ROD], joint=[joint]))
    fast = moved(case(link=[ROD], joint=[joint], pace=2.0))
    assert fast.times[-1] == pytest.approx(0.5)
    assert fast.angles[0, -1] == pytest.approx(plain.angles[0, -1], abs=2e-3)


def test_a_free_chain_that_starts_turning_keeps_energy_and_angular_momentum():
    joints = [{"start_rate": 3.0}, {"start_deg": 40.0, "start_rate": -5.0}]
    motion = moved(case(link=[SOFT, SOFT], joint=joints, tolerance=1e-9))
    assert np.ptp(motion.balance) < 1e-7 * motion.scale
    assert np.abs(motion.work).max() == 0.0


@pytest.mark.parametrize("form", ["minimal", pytest.param("index-1", marks=pytest.mark.slow)])
def test_a_latch_catches_the_elbow_and_the_root_goes_on(form):
    study = case(
        duration=1.5,
        link=[ROD, ROD],
        joint=[
            {"kind": "angle", "law": "quintic", "turn_deg": 45.0},
            {"start_deg": 120.0, "start_rate": -4.0, "latch_deg": 0.0},
        ],
        damping_ratio=0.01,
        damping_frequency=20.0,
    )
    motion = moved(study, form)
    (event,) = motion.events
    assert (event.joint, event.by) == (1, "latch")
    assert event.angle == pytest.approx(0.0, abs=1e-7)
    assert 0.0 < event.time < 1.5

    after = motion.times > event.time
    assert np.abs(motion.angles[1, after]).max() < 1e-6
    assert math.degrees(motion.angles[0, -1]) == pytest.approx(45.0, abs=1e-6)
    # the balance counts what the lock took
    assert np.abs(motion.balance - motion.balance[0]).max() < 1e-4 * motion.scale


def test_the_latch_comes_when_the_rigid_chain_reaches_it():
    """A single rod under gravity, caught as it hangs: its time is that of the rigid pendulum."""
    study = case(
        link=[ROD],
        joint=[{"latch_deg": -90.0}],
        gravity=[0.0, -9.81],
        damping_ratio=0.01,
        damping_frequency=20.0,
    )
    motion = moved(study)

    def swing(t, y):
        return [y[1], -1.5 * 9.81 * math.cos(y[0])]

    def hanging(t, y):
        return y[0] + math.pi / 2

    hanging.terminal = True
    rod = solve_ivp(swing, (0, 1), [0, 0], events=hanging, rtol=1e-10, atol=1e-10)
    assert motion.events[0].time == pytest.approx(rod.t_events[0][0], rel=1e-3)


def test_a_latch_that_catches_nothing_fails_the_result():
    joint = {"kind": "angle", "law": "quintic", "turn_deg": 45.0}
    result = run(case(link=[ROD, ROD], joint=[joint, {"latch_deg": 200.0}]))
    assert not result.passed
    (failed,) = [check for check in result.checks if not check.passed]
    assert failed.sentence.startswith("FAILED: no latch catches joint 1 at 200 deg")


def test_a_time_lock_holds_the_angle_reached():
    joint = {"kind": "torque", "law": "quintic", "turn_deg": 90.0, "over": 0.5, "lock_time": 0.5}
    motion = moved(case(link=[ROD], joint=[joint], damping_ratio=0.01, damping_frequency=20.0))
    (event,) = motion.events
    assert (event.time, event.by) == (pytest.approx(0.5), "time")
    held = motion.angles[0, motion.times > 0.5]
    assert np.ptp(held) < 1e-9


def test_measures_find_a_known_vibration():
    t = np.linspace(0.0, 20.0, 2001)
    history = 0.3 * (t / 20) ** 3 + 1e-3 * np.sin(2 * np.pi * 2.178 * t)
    # the polynomial takes a little of the sine near the ends: measured 7 %
    assert vibration(t, history) == pytest.approx(1e-3, rel=0.1)
    assert fitted_frequency(t, history, 2.2) == pytest.approx(2.178, rel=1e-6)


def test_the_command_leaves_a_result_that_loads_and_draws(tmp_path, capsys):
    folder = tmp_path / "out"
    arguments = ["flex", "--preset", "single-pendulum", "--form", "both", "--elements", "4"]
    assert main([*arguments, "--results", str(folder)]) == ExitCode.OK
    assert "both forms agree to" in capsys.readouterr().out
    result = Result.load(folder)
    assert result.laws == ("minimal", "index-1")
    for name in ("motion", "joints", "ends", "energies", "forms"):
        assert (folder / f"{name}.png").stat().st_size > 10_000

    # run again from its own input
    again = ["flex", str(folder / "input.toml"), "--no-figures", "--results", str(tmp_path / "two")]
    assert main(again) == ExitCode.OK
    first, second = (r.arrays["y_0"].values for r in (result, Result.load(tmp_path / "two")))
    assert np.array_equal(first, second)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["three-links", "two-materials", "latch"])
def test_an_example_conserves_energy_and_both_forms_agree(name):
    result = run(load("examples", name))
    assert [check.sentence for check in result.checks if not check.passed] == []
    assert result.laws[:2] == ("minimal", "index-1")


@pytest.mark.slow
def test_the_big_arm_swings_more_the_faster_and_softer_it_is():
    study = dataclasses.replace(load("presets", "big-arm"), frequencies=1)
    result = run(study)
    swing = {law: result.value("vibration_1", law) for law in result.laws}
    assert swing["minimal"] < swing["speed x 2"] < swing["speed x 4"]
    assert swing["modulus x 2"] < swing["minimal"] < swing["modulus x 0.5"]
    tone = {law: result.value("frequency", law) for law in result.laws}
    assert tone["length x 1.25"] < tone["minimal"] < tone["length x 0.8"]
