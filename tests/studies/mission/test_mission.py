"""The whole deployment: the split of its time, the arm under the ring's reaction, its result."""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from models.arm.parameters import ArmParameters
from models.ring_on_arm import RingOnArm
from models.truss import DYNAMIC_SET
from models.turn import TurnParameters, stowed_ring_inertia, torsion_stiffness
from ocp import Interrupted
from studies.arm.stage import big_arm
from studies.cli import main
from studies.common.configuration import as_stated, toml_text
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.common.writers import outcome_text
from studies.mission import MissionStudy, figures, stages, study_from
from studies.mission import study as work
from studies.mission.split import EQUAL, StageCurve, durations_at_the_caps, equal_split
from studies.mission.stages import (
    ALLOWED,
    RING,
    TURN,
    ArmStart,
    StageMotion,
    Use,
    move,
    move_from,
    ring_history,
)
from studies.mission.vibration import ArmResponse, arm_response
from studies.report import words
from studies.truss.motions.laws import paper_laws
from tests.models.turn.test_turn import least_peak_by_program


def curves(*laws: tuple[float, float, float]) -> list[StageCurve]:
    """Stages that use size (T^power) and never less than a floor."""
    return [
        StageCurve(str(k), lambda t, s=size, p=power, f=floor: max(s * t**p, f))
        for k, (size, power, floor) in enumerate(laws)
    ]


def test_rigid_stages_share_the_time_as_the_roots_of_their_sizes() -> None:
    """u = s / T^2 is equal where T is in proportion to sqrt(s)."""
    stages = curves((4.0, -2.0, 0.0), (9.0, -2.0, 0.0), (1.0, -2.0, 0.0))
    durations = equal_split(stages, 12.0, (1.0, 1.0, 1.0))
    assert sum(durations) == pytest.approx(12.0, rel=1e-12)
    assert durations == pytest.approx([4.0, 6.0, 2.0], rel=EQUAL)


def test_stages_of_other_powers_end_up_equal_and_moving_time_loses() -> None:
    stages = curves((4.0, -2.0, 0.0), (30.0, -3.0, 0.0), (2.0, -1.2, 0.0))
    durations = equal_split(stages, 9.0, (1.0, 1.0, 1.0))
    used = [stage.at(d) for stage, d in zip(stages, durations, strict=True)]
    assert max(used) / min(used) <= 1 + EQUAL

    # 1 % of the time from any stage to any other
    for giver in range(3):
        for taker in {0, 1, 2} - {giver}:
            moved = list(durations)
            moved[giver] -= 0.09
            moved[taker] += 0.09
            assert max(s.evaluate(d) for s, d in zip(stages, moved, strict=True)) > max(used)


def test_a_stage_that_more_time_helps_no_further_gives_its_time_away() -> None:
    """Its floor is the least largest utilisation; the others use less, with what is left."""
    stages = curves((1.0, -2.0, 0.5), (1.0, -2.0, 0.0))
    durations = equal_split(stages, 20.0, (1.0, 1.0))
    assert stages[0].floor < math.inf
    assert max(s.at(d) for s, d in zip(stages, durations, strict=True)) == pytest.approx(0.5)
    assert stages[1].at(durations[1]) < 0.5


def test_least_time_uses_the_caps_and_no_more() -> None:
    stages, announced = curves((30.0, -2.3, 0.0), (10.0, -2.0, 0.0)), []
    durations = durations_at_the_caps(stages, (2.0, 3.0), announced.append)
    for stage, duration in zip(stages, durations, strict=True):
        assert 1 - EQUAL <= stage.at(duration) <= 1.0
        assert set(stage.known) <= {each for both in announced for each in both}


def test_the_arm_answers_as_the_integral_of_duhamel() -> None:
    """A ring that is a particle, by the first mode of the arm and the reaction of the law."""
    model = RingOnArm(ArmParameters(), DYNAMIC_SET, turns=False)
    bezier, _ = paper_laws(DYNAMIC_SET, 6.0)
    response = arm_response(model, bezier.law)
    omega = 2 * math.pi * model.frequencies(DYNAMIC_SET.stowed_angle)[0]

    # what moves with the tip, by the stiffness at the tip of both arms in line
    big, small = model.arm.big, model.arm.small
    flexibility = 0.0
    for length, beyond, link in (
        (big.length, small.length, big),
        (small.length, 0.0, small),
    ):
        bent = length**3 / 3 + length**2 * beyond + length * beyond**2
        flexibility += bent / link.bending_stiffness
    mass = 1 / (flexibility * omega**2)

    history = ring_history(bezier)
    swing = np.exp(-1j * omega * history["time"]) * history["reaction"]
    pushed = abs(np.trapezoid(swing, history["time"]))
    # the first mode's shape is that of a force on the tip to 1e-3, and the others have hardly any
    assert response.energy == pytest.approx(pushed**2 / (2 * mass), rel=0.01)
    amplitude = math.sqrt(2 * response.energy / mass) / omega
    assert response.amplitude == pytest.approx(amplitude, rel=0.01)
    # it swings on as it did where the ring stopped
    assert response.times[-1] > 6.0 + 2.9 * 2 * math.pi / omega


def test_a_ring_in_line_with_the_arm_bends_nothing() -> None:
    bezier, _ = paper_laws(DYNAMIC_SET, 5.0)
    along, across = (
        arm_response(RingOnArm(ArmParameters(), DYNAMIC_SET, angle), bezier.law)
        for angle in (0.0, math.pi / 2)
    )
    assert along.peak == pytest.approx(0.0, abs=1e-15)
    assert across.peak > 1e-3


# times 1/T^2: part of its cap that a stage uses in T
SIZES = {"big arm": 40.0, TURN: 10.0, "small arm": 40.0, RING: 20.0}
LEAST = sum(math.sqrt(size) for size in SIZES.values())  # [s] in which all use all of their caps
TURNED = {
    "big arm": -0.03,
    TURN: -0.003,
    "small arm": 0.14,
    RING: -0.05,
}  # of the satellite by a stage [rad]


def _rigid(study: MissionStudy, name: str, duration: float, console: Console) -> StageMotion:
    """Stages by laws in closed form, so that what is shared out is known."""
    del console
    time = np.linspace(0.0, duration, 11)
    # what it hands on, and by how much it turns a satellite that is free
    pulse = np.sin(math.pi * time / duration)
    turned = TURNED[name] if study.satellite_inertia else 0.0
    root = {"moment": 2 * pulse, "momentum": 9 * pulse, "turn": turned * time / duration}
    if name == RING:
        law = paper_laws(study.truss, duration)[0]
        history = ring_history(law)
        root = {key: np.interp(history["time"], time, x) for key, x in root.items()}
        peak = study.reaction * SIZES[RING] / duration**2
        use = Use("peak reaction on the arm", "N", peak, study.reaction)
        rope = Use("peak rope force", "N", 1.0, study.rope_force)
        return StageMotion(name, duration, (use, rope), True, history | root, law)
    cap = {"big arm": study.big_torque, TURN: study.turn_torque}.get(name, study.small_torque)
    use = Use("peak torque", "N m", cap * SIZES[name] / duration**2, cap)
    history = {"time": time, "angle": time, "drive": time, **root}
    return StageMotion(name, duration, (use,), True, history)


def _moved_by(monkeypatch: pytest.MonkeyPatch, motion: Callable[..., StageMotion]) -> None:
    """Let a mission find its stages by a function of study, name, duration and console."""
    monkeypatch.setattr(work, "move", motion)
    monkeypatch.setattr(
        work,
        "move_ring",
        lambda study, duration, _, console: motion(study, RING, duration, console),
    )
    monkeypatch.setattr(
        work, "move_ring_alone", lambda study, time, console: _rigid(study, RING, time, console)
    )


def _arm_still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the ring leave the arm at rest, where only the stages are looked at."""
    at_rest = ArmResponse(np.linspace(0.0, 9.0, 11), np.zeros(11), 0.0, 0.0, 0.0)
    monkeypatch.setattr(work, "arm_response", lambda model, law: at_rest)
    monkeypatch.setattr(work, "arm_motion", lambda model, law: SimpleNamespace(residual_energy=0.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mission") / "found"
    flags = f"--total 36 --dwell 2 --reaction 5 --results {path}"
    with pytest.MonkeyPatch.context() as patch:
        _moved_by(patch, _rigid)
        assert main(["mission", *flags.split()]) == 0
    return path


def test_the_result_is_a_timeline_of_the_whole_time(folder: Path) -> None:
    result = Result.load(folder)
    assert result.passed
    assert result.arrays["time"].values[-1] == pytest.approx(36.0, rel=1e-9)
    durations = {stage["stage"]: stage["duration"] for stage in result.details["stages"]}
    assert list(durations) == list(SIZES)
    for name, duration in durations.items():  # of 28 s beside the dwells
        assert duration == pytest.approx(28 * math.sqrt(SIZES[name]) / LEAST, rel=2 * EQUAL)
    assert any("All stages have the same utilisation" in remark for remark in result.remarks)
    assert any("The links bend the cross-bars" in remark for remark in result.remarks)
    assert any("buckling load" in check.name for check in result.checks)
    assert result.value("arm-energy", "ring by Step5") > 0.0
    assert result.value("arm-energy-particle", "ring by optimum without arm") > 0.0
    assert any("This needs a peak reaction of" in remark for remark in result.remarks)


def test_turns_about_different_axes_are_not_added(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _moved_by(monkeypatch, _rigid)
    path = tmp_path / "found"
    flags = f"--total 36 --dwell 2 --satellite-inertia 2000 --no-figures --results {path}"
    assert main(["mission", *flags.split()]) == 0
    result = Result.load(path)
    root, axis, elbow = (
        result.arrays[f"satellite_about_{joint}"].values for joint in ("root", "big_arm", "elbow")
    )
    assert root[-1] == pytest.approx(TURNED["big arm"])
    assert elbow[-1] == pytest.approx(TURNED["small arm"] + TURNED[RING])
    # the one turns while the big arm moves, the other begins where the small arm does
    time, starts = result.arrays["time"].values, [one["start"] for one in result.details["stages"]]
    assert axis[-1] == pytest.approx(TURNED[TURN])
    assert (axis[time <= starts[1]] == 0.0).all()
    assert (elbow[time <= starts[2]] == 0.0).all()
    assert root[time >= starts[1]] == pytest.approx(TURNED["big arm"])
    assert result.value("satellite-turn", "ring") == pytest.approx(math.degrees(TURNED[RING]))
    assert any(
        "-1.719 deg about the axis of the root, -0.1719 deg about the axis of the big arm, 5.157 "
        "deg about the axis of the elbow. " in remark
        for remark in result.remarks
    )
    # a locked joint hands nothing on
    for name, peak in (("root_moment", 2.0), ("root_momentum", 9.0)):
        values = result.arrays[name].values
        assert np.abs(values).max() == pytest.approx(peak, rel=1e-9)
        assert np.abs(values[-1]) < 1e-12
    (figure,) = [one for name, one in figures.draw(result) if name == "satellite"]
    assert len(figure.axes[-1].get_lines()) == 3
    (panel,) = next(one for name, one in figures.draw(result) if name == "caps").axes
    # what is used, in its unit, beside each cap
    assert [words.get_text() for words in panel.texts][-1].endswith(" of 60 N")
    assert len(panel.get_yticklabels()) == 5
    assert [panel.get_ylabel() for panel in figure.axes] == [
        "moment about the root [N m]",
        "momentum at the root [N m s]",
        "turn of the satellite [deg]",
    ]


def test_the_wheels_of_a_held_satellite_share_out_time() -> None:
    study = MissionStudy(wheel_momentum=30.0)
    history = {"moment": np.array([0.0, -3.0]), "momentum": np.array([0.0, 24.0, -12.0])}
    (use,) = stages._of_the_wheels(study, history)
    assert (use.value, use.cap, use.share, use.counts) == (24.0, 30.0, 0.8, True)
    with pytest.raises(StudyError, match="wheel_momentum is 30, but the satellite of 2000 kg"):
        MissionStudy(wheel_momentum=30.0, satellite_inertia=2000.0)


@pytest.mark.slow
def test_a_cap_on_the_momentum_shapes_the_motion_of_an_arm() -> None:
    """As a rigid arm that speeds up, goes on at its momentum and brakes, in closed form."""
    cap, T = 10.0, 9.0
    study = study_from({"wheel_momentum": cap})
    plain = move(study_from({"refine": False, "intervals": 100}), "big arm", T, Console())
    capped = move(study, "big arm", T, Console())
    turn = big_arm(T).inertia_turns[0]  # T = turn/h + h/tau, with equal parts of both caps
    part = turn / (cap * (T - cap / study.big_torque))
    torque, momentum = capped.uses[0], capped.uses[2]
    assert torque.share == pytest.approx(momentum.share, rel=0.01)
    # the torque starts and ends at zero, and so does its rate: with steps between both caps a
    # linear program of the beam's modes needs 1.001 of the rigid part
    assert part < torque.share < 1.012 * part
    assert np.abs(plain.history["momentum"]).max() > 1.25 * momentum.value


@pytest.mark.slow
def test_the_wheels_shape_the_turn_of_a_mission_as_a_linear_program_says() -> None:
    study = MissionStudy(wheel_torque=4.5, wheel_momentum=3.0)
    turned = move(study, TURN, 3.0, Console())
    # stage 2 from the physics: a quarter turn by a drive of at most 2 rad/s^2
    stage = TurnParameters(
        stowed_ring_inertia(study.truss, study.arm.tip_mass),
        torsion_stiffness(study.arm.parameters),
    )
    weight = 4.5 / 3.0
    by_program = least_peak_by_program(stage, math.pi / 2, 3.0, 2.0, 600, weight) / 4.5
    drive, _, _, torque, momentum = turned.uses
    assert momentum.share == pytest.approx(by_program, rel=1e-4)
    assert torque.share == pytest.approx(by_program, rel=1e-4)
    assert drive.value == pytest.approx(torque.value, rel=1e-12)
    assert turned.passed
    plain = move(MissionStudy(), TURN, 3.0, Console())
    assert plain.uses[0].value < 0.8 * torque.value
    assert np.abs(plain.history["momentum"]).max() > 1.2 * momentum.value


def test_the_page_sets_no_stage_beside_the_mission_as_another_law(folder: Path) -> None:
    (sentence,) = words.answer(Result.load(folder))
    assert sentence.startswith("The utilisation (largest fraction of a cap) is 0.52")
    assert all(f"{stage} 0.52" in sentence for stage in SIZES)
    assert "best of the other laws" not in sentence
    assert not words.compared(Result.load(folder))
    # nor does the command set their durations beside each other as baselines
    assert "baseline" not in outcome_text(Result.load(folder))


@pytest.mark.slow
def test_figure_report_and_columns(folder: Path) -> None:
    assert (folder / "timeline.png").stat().st_size > 20_000
    assert main(["report", str(folder)]) == 0
    table = folder.parent / "mission.csv"
    assert main(["export", str(folder), "--to", "csv", "--output", str(table)]) == 0
    assert "ring_drive" in table.read_text()


@pytest.mark.parametrize(("moves", "found"), [(1, 1), (2, 2), (3, 3), (5, 4)])
def test_what_was_found_is_kept_when_the_user_stops(
    moves: int, found: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the first round the stages that have a motion, later those of the last whole round."""
    left = iter(range(moves))

    def stopped(study: MissionStudy, name: str, duration: float, console: Console) -> StageMotion:
        if next(left, None) is None:
            raise KeyboardInterrupt
        # the stages differ, so that the first round is not the last
        return _rigid(study, name, duration, console)

    _moved_by(monkeypatch, stopped)
    _arm_still(monkeypatch)
    monkeypatch.setattr(work, "rigid_duration", lambda study, name: {"ring": 3.0}.get(name, 1.0))
    path = tmp_path / "found"
    assert main(["mission", "--total", "36", "--results", str(path)]) == ExitCode.INTERRUPTED
    result = Result.load(path)
    assert result.interrupted
    names = list(SIZES)[:found]
    assert [stage["stage"] for stage in result.details["stages"]] == names
    assert ("total time" in [check.name for check in result.checks]) == (found == 4)
    if found == 4:  # all of one round
        assert result.value("total") == pytest.approx(36.0, rel=1e-9)
    assert "small_arm_angle" in result.arrays or found < 3
    assert len(list(figures.draw(result))) == 3
    assert main(["report", str(path)]) == ExitCode.OK


def test_a_stop_in_the_ring_is_no_failure_of_its_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*arguments: object, **named: object) -> None:
        raise Interrupted("ring was stopped")

    monkeypatch.setattr(stages, "solve", stopped)
    with pytest.raises(KeyboardInterrupt):
        move(study_from({}), RING, 6.0, Console())


def test_least_time_uses_all_caps(monkeypatch: pytest.MonkeyPatch) -> None:
    _moved_by(monkeypatch, _rigid)
    _arm_still(monkeypatch)
    result = work.run(study_from({"least": "time"}))
    # and four dwells of 2 s
    assert result.value("total") == pytest.approx(LEAST + 8.0, rel=EQUAL)
    assert result.value("utilisation") <= 1.0


@pytest.mark.slow
def test_the_ring_of_a_mission_meets_both_caps_at_least_cost() -> None:
    """In 6 s the reaction governs: it is close above its bound 4 M dR / T^2 without a jerk cap."""
    study = study_from({"jerk": "500/T^3"})
    ring = move(study, RING, 6.0, Console())
    assert ring.passed
    force, reaction, left = ring.uses
    assert ring.governing is reaction
    assert left.value <= study.residual_energy
    # 5.693e-3 N at 140 s scales with T^-2; a cap on the jerk costs a little more
    bound = 5.693e-3 * (140.0 / 6.0) ** 2
    assert bound < reaction.value < 1.3 * bound
    assert force.value < study.rope_force


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        ({"total": 5.0}, "four dwells of 2 s leave no time for motions"),
        (
            {"least": "time", "total": 5.0},
            "total is 5 s, but with least = time the total is the result",
        ),
        ({"least": "tme"}, "did you mean time"),
        ({"big_torqe": 3.0}, "did you mean big_torque"),
        ({"rope_force": -1.0}, "rope_force is -1"),
        ({"jerk": "bezir"}, "jerk is 'bezir'; give a number in rad/s"),
        ({"jerk": "-5/T^3"}, "jerk times T.3 is -5; give a finite positive number"),
        ({"truss": {"crank": 0.2}}, "lengthen the link"),
        ({"arm": {"big_wall": 1.0}}, "wall"),
        ({"arm": {"tip_mass": 2.0}}, r"ring has 8\.763\d* kg, more than .* tip_mass of 2 kg"),
    ],
)
def test_bad_input_is_one_sentence(raw: dict[str, object], sentence: str) -> None:
    with pytest.raises(StudyError, match=sentence):
        study_from(raw)


def test_too_short_a_time_has_the_code_of_what_cannot_be() -> None:
    assert main(["mission", "--total", "6"]) == ExitCode.INFEASIBLE


def test_the_resolved_study_states_itself_again() -> None:
    study = study_from({"total": 40.0, "truss": {"pulley_friction": 0.01}})
    assert study_from(as_stated(study)) == study
    assert study.truss.crank == DYNAMIC_SET.crank
    # the least time has no total, and the file that states it again has none
    least = study_from({"least": "time"})
    assert least.total is None
    assert study_from(tomllib.loads(toml_text(as_stated(least)))) == least
    assert study_from({}).total == 36.0
    assert main(["mission", "--least", "time", "--total", "5"]) == ExitCode.BAD_INPUT


@pytest.mark.slow
def test_a_mission_of_flexible_arms_uses_all_stages_alike() -> None:
    """Coarse meshes: the small arm then leaves more, which its cap allows here.

    On 80 intervals it leaves 0.04 J, because the least part of all caps has sharper edges than the
    least torque.
    """
    raw = {"refine": False, "residual_energy": 0.01, "intervals": 160, "total": 38.0}
    result = work.run(study_from(raw))
    assert result.passed
    used = [stage["utilisation"] for stage in result.details["stages"]]
    assert max(used) / min(used) <= 1 + EQUAL


def test_a_total_in_which_no_split_keeps_the_caps_says_how_much_would_do(monkeypatch) -> None:
    _moved_by(monkeypatch, _rigid)
    _arm_still(monkeypatch)
    result = work.run(study_from({"total": 16.0}))
    assert result.verdict.kind == "unverified"
    # 20.3 s for the motions, and four dwells of 2 s
    assert "no split of 16 s was found that keeps all caps" in result.verdict.sentence
    assert "use a total of about 28.3 s" in result.verdict.sentence
    # or the caps that these motions keep
    for stage in result.details["stages"]:
        for use in stage["uses"]:
            words = rf"(\S+) {use['unit']} for the {use['title']} of the {stage['stage']}"
            named = re.search(words, result.verdict.sentence)
            assert (named is not None) == (use["share"] > 1.0)
            assert named is None or use["value"] <= float(named[1]) <= 1.01 * use["value"]


@pytest.mark.parametrize("asked", [{"total": 36.0}, {"least": "time"}])
def test_a_stage_that_no_time_helps_is_sent_to_its_caps(asked, monkeypatch) -> None:
    """The force of a slow ring is that of statics, and more time lowers it no further."""

    def move(study, name: str, duration: float, console) -> StageMotion:
        motion = _rigid(study, name, duration, console)
        if name != "ring":
            return motion
        static = Use("peak rope force", "N", 20.0 + 1e-3 / duration, 1.0)
        arm = Use("peak reaction on the arm", "N", 2.0, 1.0)
        slack = Use("peak angular jerk", "rad/s^3", 0.5, 1.0)
        return dataclasses.replace(motion, uses=(static, arm, slack))

    _moved_by(monkeypatch, move)
    _arm_still(monkeypatch)
    sentence = work.run(study_from(asked)).verdict.sentence
    assert "the ring uses 2000 % of its cap" in sentence
    assert sentence.endswith(
        "so raise its caps on the peak rope force and the peak reaction on the arm"
    )


def test_a_least_time_that_breaks_a_cap_does_not_send_the_user_to_itself() -> None:
    broken = SimpleNamespace(name="ring", shared_by=1.02, passed=True)
    mission = SimpleNamespace(
        stopped=False,
        motions=[broken],
        largest=broken,
        total=30.0,
        curves=[SimpleNamespace(duration_for=lambda used: 29.0, least=0.0)],
        study=SimpleNamespace(least="time", dwell=2.0),
    )
    sentence = work._verdict(mission).sentence
    assert "in the minimum time found, 30 s, a cap is exceeded: the ring uses 102 %" in sentence
    assert "use --total 31 or slightly more" in sentence


def test_what_an_unrefined_arm_leaves_is_checked_but_shares_out_no_time() -> None:
    torque = Use("peak torque", "N m", 2.0, 5.0)
    left = Use("residual energy", "J", 1e-5, 1e-6, counts=False)
    motion = StageMotion("big arm", 8.0, (torque, left), True, {})
    assert motion.governing is left
    assert motion.utilisation == pytest.approx(10.0)
    assert motion.shared_by == 0.4


@pytest.mark.slow
def test_a_neighbour_of_a_refined_motion_of_an_arm_is_as_good_as_one_refined_by_itself() -> None:
    study = study_from({})
    first = move(study, "small arm", 14.7, Console())
    assert first.start is not None
    assert first.start.near(14.5)
    assert not first.start.near(13.0)
    found = move_from(study, "small arm", 14.5, first.start, Console())
    alone = move(study, "small arm", 14.5, Console())
    assert found.passed
    # what half the smoothness and half the interval may change is a per cent
    assert found.utilisation == pytest.approx(alone.utilisation, rel=2e-3)
    assert found.uses[1].value <= ALLOWED * study.residual_energy
    assert found.start.refined_in == 14.7


def test_no_motion_begins_from_one_of_another_duration() -> None:
    found = work._FoundMotions(study_from({}), Console())
    start = ArmStart(9.0, 9.0, 1e-6, b"")
    found.latest["big arm"] = StageMotion("big arm", 9.0, (), True, {}, start=start)
    assert found._part("big arm", 9.4).function is move_from
    assert found._part("big arm", 9.6).function is move
    assert found._part("small arm", 9.0).function is move


def test_more_time_that_saves_nothing_is_said_in_words() -> None:
    assert (
        work._of_more_time("ring", -0.0)
        == "1 % more time for the ring hardly lowers its utilisation."
    )
    assert work._of_more_time("ring", -2.0).endswith("lowers its utilisation by 2 %.")
