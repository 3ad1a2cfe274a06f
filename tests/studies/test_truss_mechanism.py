"""Caps in the mechanism's own terms: rope, motor and arm, whoever states them."""

import dataclasses
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from models.truss import DYNAMIC_SET, rope_travel
from ocp import OcpError, Problem, Relaxation, Trial, relaxed
from studies.cli import main
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.drive import Drive
from studies.truss.config import SolverOptions, TrussStudy, as_dictionary, study_from
from studies.truss.limits.bounds import least_time_of_the_mechanism, lower_bounds
from studies.truss.limits.caps import CAPPED, Caps, without_cap
from studies.truss.limits.feasibility import check_feasible, force_cap, unattained
from studies.truss.motions.laws import paper_laws
from studies.truss.quantities import QUANTITIES
from studies.truss.search import from_starts, missed_cap, motion_search, relaxation
from studies.truss.search.missed_cap import CapsMissedError
from studies.truss.search.motion_search import best_motion
from studies.truss.search.proofs import check_some_optimum
from studies.truss.search.question import Question
from studies.truss.study import run

T = 10.0
DRUM = Drive(drum_radius=0.02, gear_ratio=20.0, efficiency=0.8)
LAWS = paper_laws(DYNAMIC_SET, T, DRUM)  # their values are worked out once


def stated(drive: Drive | None = None, minimise: str = "peak-acceleration", **caps: float):
    return TrussStudy(minimise=minimise, duration=T, caps=Caps(**caps), drive=drive)


def nothing() -> None:
    raise StudyError("no phase plane")


def first_problem(study: TrussStudy) -> Problem:
    return Question(study, Console()).problem_from_start("bezier")


def test_limits_of_the_drive_are_caps_and_the_lower_one_holds() -> None:
    drive = dataclasses.replace(DRUM, speed=1.0, acceleration=2.0, force=50.0, motor_torque=0.05)
    study = stated(drive, rope_speed=0.8, force=60.0)
    assert (study.caps.rope_speed, study.caps.rope_acceleration) == (0.8, 2.0)
    assert (study.caps.force, study.caps.motor_torque) == (50.0, 0.05)
    assert study_from(as_dictionary(study)) == study
    assert without_cap(study, "peak-force").caps.force is None
    # a torque of 0.05 N m pulls with 0.05 * 20 * 0.8 / 0.02 N
    assert force_cap(study) == pytest.approx(40.0)
    assert force_cap(without_cap(study, "peak-motor-torque")) == 50.0


@pytest.mark.parametrize(
    ("caps", "minimise", "said"),
    [
        ({"motor_torque": 1.0}, "energy", "caps.motor_torque needs the drive; add drum_radius"),
        ({"motor_speed": 1.0}, "energy", "caps.motor_speed needs the drive; add drum_radius"),
        ({}, "peak-motor-torque", "the objective peak-motor-torque needs the drive"),
        ({}, "peak-motor-load", "peak-motor-load needs the drive; add torque_speed"),
        ({"power": -1.0}, "energy", "caps.power is -1.0; give a finite positive number"),
    ],
)
def test_what_needs_a_drive_says_which_key(caps, minimise, said) -> None:
    with pytest.raises(StudyError, match=said):
        stated(None, minimise, **caps)


PROVEN = (
    "peak-rope-speed",
    "peak-rope-acceleration",
    "peak-rope-jerk",
    "peak-power",
    "peak-motor-speed",
    "peak-reaction",
)


@pytest.mark.parametrize("key", PROVEN)
def test_a_cap_below_the_least_possible_is_refused_by_its_proof(key: str) -> None:
    study = stated(DRUM, **{CAPPED[key]: 1e9})
    bound = lower_bounds(study, None)[key]
    check_feasible(stated(DRUM, **{CAPPED[key]: bound}), nothing)
    with pytest.raises(StudyError, match=f"{QUANTITIES[key].title} of at most") as refused:
        check_feasible(stated(DRUM, **{CAPPED[key]: 0.999 * bound}), nothing)
    assert refused.value.exit_code is ExitCode.INFEASIBLE
    # a bound is one: both laws of the paper are above it
    assert all(law.values[key] > bound for law in LAWS)


@pytest.mark.parametrize("key", PROVEN)
def test_the_least_time_is_the_duration_at_which_a_cap_is_the_least_possible(key: str) -> None:
    bound = lower_bounds(stated(DRUM, rope_jerk=1e9), None)[key]
    study = stated(DRUM, **{CAPPED[key]: bound})
    assert least_time_of_the_mechanism(study) == pytest.approx(T, rel=1e-9)


def test_caps_that_need_more_time_together_are_refused() -> None:
    mean = rope_travel(DYNAMIC_SET) / T
    # to 1.05 of the mean speed within T - T/1.05, at 22.05 times the mean speed per T
    with pytest.raises(StudyError, match=f"its minimum is {22.05 * mean / T:.6g} m/s"):
        check_feasible(stated(rope_speed=1.05 * mean, rope_acceleration=5 * mean / T), nothing)
    with pytest.raises(StudyError, match="they need at least"):
        check_feasible(stated(rope_speed=1.05 * mean, rope_jerk=40 * mean / T**2), nothing)


def test_the_least_rope_speed_alone_is_no_motion() -> None:
    limit = unattained(stated(minimise="peak-rope-speed"), nothing)
    assert limit is not None
    assert limit.value == pytest.approx(rope_travel(DYNAMIC_SET) / T, rel=1e-12)
    assert str(limit.refusal).startswith("no minimum exists: the peak rope speed")
    assert unattained(stated(minimise="peak-rope-speed", rope_acceleration=1.0), nothing) is None


def test_a_flag_and_a_drive_reach_the_study(tmp_path: Path, capsys) -> None:
    drive = tmp_path / "drive.toml"
    drive.write_text("[drive]\ndrum_radius = 0.02\ngear_ratio = 20.0\nmotor_speed = 600.0\n")
    words = ["truss", "--objective", "energy", "--duration", "10", "--drive", str(drive)]
    assert main(words) == ExitCode.INFEASIBLE
    said = " ".join(capsys.readouterr().err.split())
    assert "peak motor speed of at most 600 rad/s; its minimum is 660.987" in said


def solved(study: TrussStudy) -> dict[str, float]:
    """Own values of the result, all checks of which have passed."""
    result: Result = run(study)
    assert result.passed, [check.sentence for check in result.checks]
    return {row.key: row.values["optimal"] for row in result.table}


def test_a_cap_on_the_rope_is_kept_and_active_between_the_points() -> None:
    cap = 1.3 * lower_bounds(stated(), None)["peak-rope-acceleration"]
    study = stated(rope_acceleration=cap)
    solver = dataclasses.replace(study.solver, starts=("bezier",))
    values = solved(dataclasses.replace(study, solver=solver))
    assert values["peak-rope-acceleration"] == pytest.approx(cap, rel=1e-6)


THICK_ROPE = dataclasses.replace(DRUM, rope_diameter=0.003, layer_turns=10)
WEAK_WHEN_FAST = dataclasses.replace(DRUM, torque_speed=[[0, 0.04], [1000, 0.02], [1600, 0]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("minimise", "caps", "drive", "active"),
    [
        ("peak-force", {"power": 14.0, "rope_jerk": 1.0}, DRUM, "peak-power"),
        ("peak-rope-jerk", {}, None, "peak-rope-jerk"),
        ("peak-rope-speed", {"rope_acceleration": 0.5}, None, "peak-rope-acceleration"),
        ("peak-motor-torque", {"jerk": "200/T^3"}, THICK_ROPE, "peak-motor-torque"),
        ("energy", {"rope_jerk": 0.5}, WEAK_WHEN_FAST, "peak-motor-load"),
    ],
)
def test_mechanisms_are_solved_and_verified(minimise, caps, drive, active) -> None:
    study = stated(drive, minimise, **caps)
    solver = dataclasses.replace(study.solver, starts=("bezier",))
    values = solved(dataclasses.replace(study, solver=solver))
    limit = {"peak-power": 14.0, "peak-rope-acceleration": 0.5, "peak-motor-load": 1.0}.get(active)
    if limit is not None:
        assert values[active] == pytest.approx(limit, rel=1e-5)
    if drive is not None and drive.rope_diameter is None:
        torque = values["peak-force"] * 0.02 / (20 * 0.8)
        assert values["peak-motor-torque"] == pytest.approx(torque, rel=1e-9)
    # without a cap on a jerk the acceleration may jump
    assert math.isfinite(values["peak-rope-jerk"]) == study.jerk_limited


def test_where_nothing_is_found_under_a_torque_speed_curve_the_next_cap_is_relaxed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the curve there is no load, so that it cannot be the cap that is taken away."""

    def failing(*, starts: dict[str, Any], finished: Callable[[Trial], None], **_: Any) -> None:
        for name in list(starts)[:2]:  # the budget ended in the second start
            finished(Trial(name, None, OcpError("no motion"), math.nan, 0.0))
        raise OcpError("budget")

    monkeypatch.setattr(from_starts, "audit", failing)
    monkeypatch.setattr(motion_search, "solved_soon", lambda *_, **__: (None, False))
    drive = dataclasses.replace(DRUM, torque_speed=((50.0, 0.6), (150.0, 0.1)))
    study = stated(drive, "peak-motor-load", reaction=20.0, rope_jerk=3.0)
    told = io.StringIO()
    with pytest.raises(
        StudyError, match="from 2 of 5 starts, because the time limit was reached"
    ) as raised:
        best_motion(Question(study, Console(progress_to=told)))
    relaxed = [
        line for line in told.getvalue().splitlines() if "minimum under the other caps" in line
    ]
    assert relaxed[0].endswith("the other caps: peak rope jerk")
    assert raised.value.exit_code is ExitCode.NOT_SOLVED
    assert "a stronger motor, another gear ratio" in str(raised.value)


@pytest.mark.slow
def test_a_cap_below_the_least_found_ends_the_search_before_its_other_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The cap is above its proven bound of 1.32 m/s, so that nothing is proven."""
    monkeypatch.setattr(missed_cap, "SOON", 60)
    study = TrussStudy(
        minimise="peak-acceleration", duration=5.0, caps=Caps(jerk=1.6, rope_speed=1.75)
    )
    told = io.StringIO()
    console = Console(progress_to=told)
    planes = check_some_optimum(study, console)
    with pytest.raises(
        CapsMissedError, match=r"peak rope speed found under the other caps is 1\.81\d* m/s"
    ) as raised:
        best_motion(Question(study, console, planes))
    assert raised.value.exit_code is ExitCode.NOT_SOLVED
    assert "above its cap of 1.75 m/s" in str(raised.value)
    assert "no proof" in str(raised.value)
    assert "of 5 (dwell)" not in told.getvalue()


@pytest.mark.slow
def test_a_cap_above_the_least_found_is_searched_to_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(missed_cap, "SOON", 10)
    caps = Caps(jerk=1.6, rope_speed=2.0)
    options = SolverOptions(starts=("bezier",), intervals=12)
    study = TrussStudy(minimise="peak-acceleration", duration=5.0, caps=caps, solver=options)
    told = io.StringIO()
    values = best_motion(Question(study, Console(progress_to=told))).deployment.values
    assert "searching for the minimum under the other caps: peak rope speed" in told.getvalue()
    assert values["peak-rope-speed"] == pytest.approx(2.0, rel=1e-5)


@pytest.mark.parametrize(
    ("friction", "bars"),
    [
        (0.0, {"link", "outer cross bar", "inner cross bar"}),
        (0.01, {"left link last", "right outer cross bar first", "left link between"}),
    ],
)
def test_bars_are_named_in_bounds(friction: float, bars: set[str]) -> None:
    study = stated(bar_force=60.0)
    truss = dataclasses.replace(study.truss, pulley_friction=friction)
    problem = first_problem(dataclasses.replace(study, truss=truss))
    names = {bound.name for phase in problem.phases for bound in phase.bounds}
    assert {f"largest force in a bar ({bar})" for bar in bars} <= names


def test_where_the_truss_begins_and_ends_does_not_give_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kept: list[str] = []

    def noted(problem: Problem, *, keep: list[str], **others: Any) -> Relaxation:
        kept.extend(keep)
        return relaxed(problem, keep=keep, **others)

    monkeypatch.setattr(relaxation, "relaxed", noted)
    study = TrussStudy(
        minimise="peak-acceleration", duration=5.0, caps=Caps(jerk=1.6, rope_speed=1.5)
    )
    found = relaxation.relaxation_in_words(first_problem(study), str)
    assert "peak rope speed' from 1.5 to 1.8" in found
    assert {name.split(": ")[1] for name in kept} == {
        f"{state} {end}"
        for state in ("angle", "speed", "acceleration")
        for end in ("initial", "final")
    }


@pytest.mark.parametrize("others", [None, 0.3])
def test_caps_that_no_single_one_is_to_blame_for_name_no_number_that_was_not_found(
    others: float | None,
) -> None:
    caps = {"power": 6.0, "rope_speed": 0.1}
    study = TrussStudy(minimise="peak-acceleration", duration=60.0, caps=caps)
    alone = {"peak-power": 5.0, "peak-rope-speed": 0.1036461}

    def least(case: TrussStudy, quantity: str) -> float | None:
        caps = (case.caps.power, case.caps.rope_speed)
        return alone.get(quantity) if caps == (None, None) else others

    said = str(missed_cap.together(study, least, 1.0)).splitlines()
    assert said[-2].startswith("  peak rope speed [m/s]: 0.1, 0.103647, ")
    if others is None:  # no last number to raise a cap to
        remedy = "relax at least two of these caps, the cap on the peak rope speed to more than"
        assert said[-1] == f"{remedy} 0.103647 m/s"
    else:
        assert said[-1].startswith("raise a cap above the last number of its line")
