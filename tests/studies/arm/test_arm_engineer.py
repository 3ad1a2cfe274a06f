"""Loads, a satellite that is free, sequences without rest, figures: each against an estimate."""

import dataclasses
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from models.ancf.integrate import StepControl
from models.ancf.joints import Torque
from models.ancf.state import posed
from models.arm.parameters import ArmParameters
from models.errors import ModelError
from models.laws.unit_turns import quintic
from studies.arm.config import BaselinesStudy
from studies.arm.laws.rigid import feed_forward, inertias
from studies.arm.laws.unit_laws import unit_law
from studies.arm.optimal.phase import arm_phase
from studies.arm.optimal.refinement import FLOOR, Refined
from studies.arm.optimal.rounds import Round
from studies.arm.questions.baselines import Pair, compare_baselines, replay_law
from studies.arm.questions.one_motion import duration_to_try
from studies.arm.replay.full_model import Motion, replay
from studies.arm.replay.loads import loads, modal_ratios, settling_time
from studies.arm.replay.satellite import momenta
from studies.arm.report.figures import Scene, figures_of, snapshot_figure
from studies.arm.report.quantities import latch_checks
from studies.arm.report.traces import Trace, snapshots_of
from studies.arm.stage import ELBOW, ROOT, TorqueCaps, big_arm, both_arms, small_arm
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import ExitCode

COARSE = StepControl(1e-6)


def quintic_replay(stage, until=0.2):
    """Two elements a link and coarse steps: enough for the balances below."""
    t = np.linspace(0.0, stage.duration, 401)
    torque = CubicSpline(t, feed_forward(stage, quintic(stage.duration))(t)[stage.moving[0]])
    motion = Motion("quintic", "torque", stage, {stage.moving[0]: Torque(torque)})
    after = stage.duration + np.linspace(0.0, until, 201)
    done = replay(motion, elements=2, settings=COARSE, after=after, modes=1)
    return done, loads(done)


@pytest.fixture(scope="module")
def big():
    return quintic_replay(big_arm(8.6))


def test_momentum_balance(big):
    done, history = big
    n, t = history.until, history.times
    # the given torque, and the reaction of the locked root afterwards, against d/dt of momentum
    assert history.imbalance < 1e-4  # differences over 2000 steps
    torque = np.trapezoid(history.reaction[:n], t[:n])
    assert history.angular_momentum[n - 1] == pytest.approx(torque, abs=1e-5)
    assert t[n - 1] == t[n] == 8.6
    jump = history.angular_momentum[n] - history.angular_momentum[n - 1]
    assert history.moment_impulse == pytest.approx(jump, abs=1e-9)
    assert done.run.engagement.impulse[ROOT] == pytest.approx(jump, abs=1e-9)


def test_momenta_of_an_arm_that_turns_rigidly():
    arm = ArmParameters(elbow_mass=2.0, hub_inertia=5.0)
    chain, rate = arm.chain(2), 0.3
    q = posed(chain, [0.0, np.pi / 2]).q
    v = np.empty_like(q)
    v[0::2], v[1::2] = -rate * q[1::2], rate * q[0::2]
    linear, angular = momenta(chain, q[:, None], v[:, None])
    big, small = arm.big, arm.small
    m1, m2 = big.linear_density * big.length, small.linear_density * small.length
    x = m1 * big.length / 2 + (2.0 + m2 + 30.0) * big.length
    y = m2 * small.length / 2 + 30.0 * small.length
    assert linear[:, 0] == pytest.approx([-rate * y, rate * x], rel=1e-12)
    assert angular[0] == pytest.approx(rate * arm.root_inertia(np.pi / 2), rel=1e-12)


def on_satellite(stage, inertia):
    return dataclasses.replace(stage, satellite_inertia=inertia)


def test_a_free_satellite_turns_by_the_momentum_of_the_arm(big):
    held, H = big[0], 500.0
    stage = on_satellite(held.motion.stage, H)
    done, history = quintic_replay(stage)
    J = stage.arm.root_inertia(math.pi)
    turned = done.satellite.turn
    assert turned[-1] == pytest.approx(
        -J * np.pi / 2 / (H + J),  # the joint turns by 90 deg
        rel=1e-4,
    )
    assert done.miss < held.miss  # of a rigid arm's torque, of which it needs less
    assert history.imbalance < 1e-4
    until = history.until
    assert history.angular_momentum[until - 1] + H * done.satellite.rate[-1] == pytest.approx(0)
    assert H * done.satellite.rate_after + history.angular_momentum[until:] == pytest.approx(
        np.zeros(len(history.times) - until), abs=1e-4 * np.abs(history.angular_momentum).max()
    )

    # the lock leaves all momentum where it was
    assert history.moment_impulse == pytest.approx(done.run.engagement.impulse[ROOT], abs=1e-6)
    assert done.vibration.frequencies[0] > held.vibration.frequencies[0]
    heavy, _ = quintic_replay(on_satellite(stage, 1e6))  # against 60 kg m^2
    assert heavy.residual_energy == pytest.approx(held.residual_energy, rel=1e-3)


@pytest.mark.parametrize("make", [big_arm, small_arm])
def test_a_rigid_arm_on_a_free_satellite_needs_what_its_bound_says(make):
    """The least time of the rigid arm under a torque, by its equation of motion in small steps."""
    stage = on_satellite(make(10.0), 800.0)
    k, cap = stage.moving[0], 20.0
    T = stage.least_duration(cap)
    turn = stage.turn[k]
    sign = math.copysign(cap, turn)

    def rate(phi, speed, torque):
        """Of the joint: torques of the joints that do not turn keep these from turning."""
        A, B, C = inertias(stage.arm)
        c = C * math.cos(phi if k == ELBOW else math.pi)
        whole, a1 = A + B + 2 * c + 800.0, B + c
        if k == ROOT:
            return torque * (1 / (A + B + 2 * c) + 1 / 800.0)
        reduced, slope = B - a1**2 / whole, C * math.sin(phi)
        by_angle = 2 * a1 * slope / whole - 2 * slope * a1**2 / whole**2
        return (torque - by_angle * speed**2 / 2) / reduced

    # full torque until half of the way, and as much against it from there on
    phi, speed, steps = stage.start[k], 0.0, 20_000
    h = T / steps
    for _ in range(steps):
        half = abs(phi - stage.start[k]) < abs(turn) / 2
        torque = sign if half else -sign
        middle = speed + h / 2 * rate(phi, speed, torque)
        phi, speed = (
            phi + h * middle,
            speed + h * rate(phi + h / 2 * speed, middle, torque),
        )
    assert phi == pytest.approx(stage.end[k], abs=1e-3)  # of one step at the switch
    assert speed == pytest.approx(0.0, abs=2e-3)


@pytest.mark.slow
def test_a_small_arm_on_a_free_satellite_arrives_as_planned():
    stage = on_satellite(small_arm(11.2), 2000.0)
    done, history = quintic_replay(stage)
    assert done.motion.stage.moving == (ELBOW,)
    assert history.imbalance < 1e-4
    assert done.miss < 5e-3  # of a rigid arm's torque
    # the rigid arm turns the satellite by what its momentum says, under any law
    arm, phi = stage.arm, np.linspace(np.pi, 0.0, 4001)
    reach = arm.small.linear_density * arm.small.length**2 / 2 + arm.tip_mass * arm.small.length
    share = (arm.elbow_inertia + arm.big.length * reach * np.cos(phi)) / np.array(
        [arm.root_inertia(p) + 2000.0 for p in phi]
    )
    assert done.satellite.turn[-1] == pytest.approx(-np.trapezoid(share, phi), rel=0.02)


def test_instants_are_drawn_whatever_the_duration(big):
    done, _ = big
    stage = done.motion.stage
    scene = Scene(stage.name, stage.duration, stage.start, stage.end, "torque")
    # a shade of 0.8 - 0.8 T / T would be below zero
    duration = next(T for T in np.linspace(5.0, 50.0, 451) if 0.8 * T / T > 0.8)
    instants = [
        dataclasses.replace(snapshot, time=duration * k / 8)
        for k, snapshot in enumerate(snapshots_of(done))
    ]
    panel, bending = snapshot_figure(scene, instants).axes
    assert bending.get_lines()[8].get_color() == "0.0"
    assert panel.get_lines()[-2].get_color() == "0.0"


def test_figures_name_their_axes_and_motions(big):
    done, _ = big
    stage = done.motion.stage
    scene = Scene(stage.name, stage.duration, stage.start, stage.end, "torque")
    trace = Trace.of(done)
    found = dict(figures_of(scene, [trace, trace], snapshots=snapshots_of(done)))
    low, high = found["after_lock"].axes[1].get_xlim()
    assert high / low >= 10  # a decade at least, or the ticks' labels run into each other
    assert set(found) == {"fig10_torque", "fig15_arm", "after_lock", "snapshots"}
    for figure in found.values():
        assert all(panel.get_xlabel().endswith("]") for panel in figure.axes)


def test_without_rest_only_angle_and_energy_are_fixed_at_the_lock():
    stage = big_arm(8.6)
    at_rest, freed = arm_phase(stage, TorqueCaps()), arm_phase(stage, TorqueCaps(), left=1e-3)
    names = [{s.name for s in arm.phase.final} for arm in (at_rest, freed)]
    assert names[0] - names[1] == {s.name for s in (*freed.q, *freed.v)} - {"theta1"}
    assert [b.name for b in (*at_rest.bounds, *freed.bounds)] == ["energy left by big"]


def test_a_cap_too_low_for_both_joints_names_a_duration_to_try():
    stage = both_arms(11.2)
    t = np.linspace(0.0, 11.2, 1001)
    peaks = np.abs(feed_forward(stage, quintic(11.2))(t)).max(axis=1)
    words = duration_to_try(stage, TorqueCaps((peaks[0] / 4, None)))
    assert "22.4 s with the quintic step: give such a duration" in words  # torques fall as 1/T^2
    enough = duration_to_try(stage, TorqueCaps((1.01 * peaks[0], 1.01 * peaks[1])))
    assert "rigid arm" not in enough


def test_baselines_that_miss_a_latch_are_named(big):
    done, _ = big
    miss = done.miss
    assert all(check.passed for check in latch_checks(done, 1.1 * miss))
    (check,) = latch_checks(done, 0.5 * miss)
    assert not check.passed
    assert check.sentence.startswith("FAILED: quintic: the root misses its latch by")


def test_a_law_that_jumps_takes_the_longest_fixed_step_that_converges(monkeypatch):
    tried = []

    def short_steps_only(motion, settings, after):
        tried.append(settings.fixed_step)
        if settings.fixed_step > 0.001:
            raise ModelError("the Newton iteration does not converge")
        return motion

    monkeypatch.setattr("studies.arm.questions.baselines.replay", short_steps_only)
    law = unit_law("linear torque", 8.6)
    assert replay_law(big_arm(8.6), law, "torque").name == "linear torque"
    assert tried == [0.004, 0.002, 0.001]


def leave_series_out(monkeypatch):
    """Neither profiles nor traces, whose replays take long."""
    for name in ("_arrays", "_profiles"):
        monkeypatch.setattr(f"studies.arm.questions.baselines.{name}", lambda *_: {})


def test_a_latch_missed_beside_baselines_fails_the_command(big, monkeypatch, capsys, tmp_path):
    # the laws' solves are left out: one replay stands for baseline and optimum
    done, _ = big
    refined = Refined(
        SimpleNamespace(reduced_energy=0.0),
        (done,),
        (Round(100, 0.0, 0.0, done.residual_energy),),
        1.0,
    )
    pairs = [Pair(done, refined, 1.0)]
    monkeypatch.setattr("studies.arm.questions.baselines.compare", lambda *_, **__: pairs)
    monkeypatch.setattr("studies.arm.questions.baselines.baseline_names", lambda _: ["quintic"])
    leave_series_out(monkeypatch)
    asked = ["arm", "baselines", "--no-figures", "--results"]
    wide, tight = (["--latch", str(share * done.miss)] for share in (1.1, 0.9))
    assert main([*asked, str(tmp_path / "wide"), *wide]) == ExitCode.OK
    assert main([*asked, str(tmp_path / "tight"), *tight]) == ExitCode.NOT_VERIFIED
    assert "FAILED: quintic: the root misses its latch" in capsys.readouterr().out
    record = json.loads((tmp_path / "tight" / "verification.json").read_text())
    assert not record["passed"]
    missed = [check for check in record["checks"] if not check["passed"]]
    assert len(missed) == 2  # the baseline's and the optimum's


@pytest.mark.parametrize(
    ("asked", "share", "change", "kind"),
    [
        (2.0, 0.5, 0.0, "local"),
        (0.5, 1.0, 0.0, "local"),  # less was asked for a stiller law, and its own has its share
        (0.5, 0.5, 0.0, "unverified"),
        (2.0, 1.0, 0.1, "unverified"),  # a finer mesh changes it
    ],
)
def test_an_optimum_is_judged_beside_its_own_law(big, monkeypatch, asked, share, change, kind):
    done, _ = big
    left = done.residual_energy
    refined = Refined(
        SimpleNamespace(reduced_energy=0.0), (done,), (Round(100, 0.0, 0.0, left),), asked * left
    )
    pairs = [Pair(done, dataclasses.replace(refined, change=change), share)]
    monkeypatch.setattr("studies.arm.questions.baselines.compare", lambda *_, **__: pairs)
    monkeypatch.setattr("studies.arm.questions.baselines.baseline_names", lambda _: ["quintic"])
    leave_series_out(monkeypatch)
    verdict = compare_baselines(BaselinesStudy(), silent()).verdict
    assert verdict.kind == kind
    if kind == "unverified":
        assert "for quintic, no optimum was found" in verdict.sentence


def test_optima_that_were_found_are_kept_when_the_user_stops(big, monkeypatch):
    done, _ = big
    refined = Refined(
        SimpleNamespace(reduced_energy=0.0), (done,), (Round(100, 0.0, 0.0, 0.0),), 1.0
    )
    asked = []

    def found(*_):
        asked.append(1)
        if len(asked) > 1:
            raise KeyboardInterrupt
        return refined

    room = "studies.arm.questions.baselines"
    monkeypatch.setattr(f"{room}.baseline_names", lambda _: ["quintic", "Bezier"])
    monkeypatch.setattr(f"{room}.motion_along", lambda *_: done.motion)
    monkeypatch.setattr(f"{room}.replay_law", lambda *_, **__: done)
    # of two modes, as few elements show
    monkeypatch.setattr(f"{room}.LockedMotion", lambda *_: done)
    monkeypatch.setattr(f"{room}.motion_under", found)
    result = compare_baselines(BaselinesStudy(), silent())
    assert result.interrupted
    assert "stopped with an optimum for 1 of 2 laws" in result.verdict.sentence
    assert result.laws == ("quintic",)


def test_at_a_slow_pace_an_optimum_has_a_floor_to_stay_under(big, monkeypatch):
    done, _ = big
    refined = Refined(
        SimpleNamespace(reduced_energy=0.0),
        (done,),
        (Round(100, 0.0, 0.0, done.residual_energy),),
        1.0,
    )
    room = "studies.arm.questions.baselines"
    monkeypatch.setattr(f"{room}.compare", lambda *_, **__: [Pair(done, refined, None)])
    monkeypatch.setattr(f"{room}.baseline_names", lambda _: ["quintic"])
    monkeypatch.setattr(f"{room}.is_slow", lambda _: True)
    monkeypatch.setattr(f"{room}.numerical_floor", lambda _: "the floor")
    leave_series_out(monkeypatch)
    found = compare_baselines(BaselinesStudy(), silent())
    (check,) = found.checks
    assert (check.unit, check.limit) == ("J", FLOOR)
    assert check.passed == (done.residual_energy <= FLOOR)
    assert math.isnan(found.value("ratio"))
    assert "the floor" in found.remarks


def test_the_tip_settles_when_a_damped_arm_is_simulated_to():
    # the links' damping at 1 Hz is what counts, 0.09 at the locked arm's 0.445 Hz
    stage = small_arm(11.2, ArmParameters(damping_ratio=0.2))
    done, _ = quintic_replay(stage, until=9.0)
    ratios = modal_ratios(done, 0.5)
    assert ratios[0] == pytest.approx(0.2 * 0.445, rel=2e-3)
    after = done.run.after
    end = list(after.chain.slots(1, -1)[:2])
    rest = posed(after.chain, [joint.angle for joint in done.run.engagement.joints]).q[end]
    off = np.linalg.norm(after.q[end] - rest[:, None], axis=0)
    settled = after.times[np.flatnonzero(off > 4e-4)[-1]] - stage.duration
    expected = settling_time(done, 4e-4, ratios)
    assert expected == pytest.approx(settled, abs=1.2)  # an envelope: within half a period
    assert expected > 2.0
