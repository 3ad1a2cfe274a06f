"""Ropes that give, as a study states and refuses them."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from models.truss import DYNAMIC_SET
from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.drive.course import rope_course
from studies.drive.schema import Drive
from studies.drive.stopping import resume_course, stop_course
from studies.drive.stretch import stretched
from studies.truss.config import SolverOptions, TrussStudy, as_dictionary, study_from
from studies.truss.limits.caps import Caps
from studies.truss.motions.laws import paper_laws
from studies.truss.rope import rope_of
from studies.truss.rope_figure import rope_delay_figure, rope_mode_figure
from studies.truss.study import run

RUBBED = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)


def stated(stiffness: float, **drive) -> TrussStudy:
    drive = Drive(rope_stiffness=stiffness, **drive)
    return TrussStudy(minimise="peak-force", duration=10.0, truss=RUBBED, drive=drive)


def test_a_rope_on_which_the_truss_snaps_through_is_refused_with_one_that_works() -> None:
    with pytest.raises(StudyError, match=r"is 70 N/m, but below 71\.1 N/m") as refused:
        stated(70.0)
    enough = float(re.search(r"at least ([\d.]+) N/m", str(refused.value))[1])
    again = stated(enough)
    assert study_from(as_dictionary(again)) == again
    # a rope that gives along its length has only part of the motor's pull
    assert stated(40.0, rope_yields="along its length").drive.rope_stiffness == 40.0


def test_an_export_refuses_it_too_where_its_motion_passes_such_angles() -> None:
    law, _ = paper_laws(RUBBED, 10.0)
    whole, soft = rope_course(law.law, RUBBED), Drive(rope_stiffness=70.0)
    with pytest.raises(StudyError, match="snaps through"):
        stretched(whole, RUBBED, soft)
    # before the net is taut the springs alone are held; the last degrees need most
    assert stretched(stop_course(whole, 4.0, soft), RUBBED, soft).stretch is not None
    with pytest.raises(StudyError, match="snaps through"):
        stretched(resume_course(whole, 4.0, soft), RUBBED, soft)


def test_a_word_that_is_no_place_is_refused() -> None:
    with pytest.raises(StudyError, match=r"rope_yields is .*did you mean at the motor"):
        Drive(rope_yields="at motor")


def test_the_stretch_wound_in_is_that_of_the_pull_or_of_the_mean_tension() -> None:
    law, _ = paper_laws(RUBBED, 10.0)
    rigid = rope_course(law.law, RUBBED)
    k = 2e4
    more = []
    for yields in ("at the motor", "along its length"):
        drive = Drive(rope_stiffness=k, tension_ramp=1e-3, rope_yields=yields)
        course = stretched(rigid, RUBBED, drive)
        time = np.array([10.0])
        more.append(k * float((course.derivatives(time) - rigid.derivatives(time))[0, 0]))
    # at rest, 7.72 and 17.94 N at the motor; the mean of the tensions is what mu = 0 would need
    assert more[0] == pytest.approx(17.94 - 7.72, abs=0.02)
    assert more[1] == pytest.approx(9.41 - 2.52, abs=0.02)


def test_what_a_result_says_of_its_ropes() -> None:
    law, _ = paper_laws(RUBBED, 10.0, Drive(rope_stiffness=600.0))
    parts = rope_of(law)
    stability, modes, swing, slack, backward = parts.sentences
    assert "Below 71.1 N/m the truss would snap through" in stability
    assert "0.1346 Hz at 4.4 deg" in modes
    numbers = parts.details["rope"]
    assert f"{numbers['swing_angle_miss_deg']:.3g} deg" in swing
    assert numbers["swing_peak_force"] > 2 * law.values["peak-force"]
    assert "slack for" in slack
    assert "moves back" in backward
    assert rope_of(paper_laws(RUBBED, 10.0)[0]).sentences == ()


def test_the_figure_of_ropes_that_give() -> None:
    laws = paper_laws(RUBBED, 20.0, Drive(rope_stiffness=2e4))
    figure = rope_mode_figure(laws[0])
    mode, _, force = figure.axes
    shown = [line.get_label() for line in mode.lines]
    assert shown == ["5000 N/m", "2e+04 N/m", "8e+04 N/m", "3.2e+05 N/m"]
    swing = laws[0].rope_swing
    assert np.array_equal(force.lines[1].get_ydata(), swing.tension[0])


def test_one_motor_behind_the_other_in_words_and_in_a_figure() -> None:
    drive = Drive(rope_stiffness=600.0, rope_delay=0.1)
    law, _ = paper_laws(RUBBED, 10.0, drive)
    parts = rope_of(law)
    numbers, said = parts.details["rope"], parts.sentences[-1]
    assert "one motor is 0.1 s later than the other, the truss reaches 90 deg with" in said
    # the swing is damped when the ring is open, and the rope ahead has carried nearly all
    assert numbers["one_behind_swing_arrival_energy"] < 1e-8
    assert numbers["one_behind_swing_peak_force"] > 1.3 * law.values["peak-force"]
    assert numbers["one_behind_swing_slack_time"] > 1.0
    # the stretch of open ropes is not wound in where both follow rigid ropes
    assert numbers["swing_arrival_energy"] is None

    energy, force = rope_delay_figure(law).axes
    assert energy.get_title().startswith("90 deg is reached with")
    _, ahead, behind = (line.get_ydata() for line in force.lines)
    assert ahead.max() == numbers["one_behind_swing_peak_force"]
    assert behind.min() == 0.0


def test_planned_stretch_needs_ropes_that_give_and_a_jerk_cap() -> None:
    with pytest.raises(StudyError, match=r"give drive\.rope_stiffness"):
        Drive(plan_stretch=True)
    with pytest.raises(StudyError, match=r"rope_delay is .*give drive\.rope_stiffness"):
        Drive(rope_delay=0.1)
    with pytest.raises(StudyError, match=r"give caps\.jerk"):
        stated(600.0, plan_stretch=True)


@pytest.mark.slow
def test_an_optimum_that_plans_its_stretch_ends_at_rest_on_its_ropes() -> None:
    study = TrussStudy(
        minimise="peak-force",
        duration=10.0,
        truss=RUBBED,
        drive=Drive(rope_stiffness=2000.0, plan_stretch=True, acceleration=2.5),
        caps=Caps(jerk="200/T^3"),
        smooth=False,
        solver=SolverOptions(intervals=40, starts=("bezier",)),
    )
    result = run(study, silent())
    rope = result.details["rope"]
    # the truss is integrated anew on its ropes, with the rope that the motor winds in
    assert rope["swing_angle_miss_deg"] < 1e-3
    assert rope["swing_peak_force"] == pytest.approx(result.value("peak-force"), rel=1e-4)
    assert rope["swing_energy_left"] < 1e-9
    assert rope["wound_end_speed"] < 1e-6 * rope["wound_peak_speed"]
    # the stretch needs more than the drive has, and that is said
    assert result.value("peak-rope-acceleration") < 2.5 < rope["wound_peak_acceleration"]
    failed = [check.name for check in result.checks if not check.passed]
    assert failed == ["acceleration of the rope wound in"]
    # dearer than on rigid ropes, whose optimum is 39.68 N
    assert 39.68 < result.value("peak-force") < 1.03 * 39.68
