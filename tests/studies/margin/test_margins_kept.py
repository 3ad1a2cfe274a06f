"""Margins as limits: what they need of a motor whose torque falls, optima under them, refusals."""

from __future__ import annotations

import dataclasses

import pytest

from models.truss import (
    DYNAMIC_SET,
    rope_acceleration,
    rope_force,
    rope_speed,
    static_force,
)
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.drive.schema import Drive
from studies.margin.available import stall_force
from studies.margin.schema import MarginRequirements
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.caps import Caps, without_cap
from studies.truss.motions.deployment import travel_of
from studies.truss.motions.laws import paper_laws
from studies.truss.search.proofs import check_some_optimum
from studies.truss.study import run
from tests.studies.plain_collocation import least_peak, least_time

ROPES = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
DRIVE = Drive(
    drum_radius=0.02,
    gear_ratio=50.0,
    efficiency=0.7,
    torque_speed=[[0, 0.05], [2000, 0.035], [4000, 0]],
)
ROTOR = dataclasses.replace(DRIVE, motor_inertia=2e-6)
PULL = 50.0 * 0.7 / 0.02  # [N] on the rope for each N m of the shaft
STALL = 0.05 * PULL
KEPT = MarginRequirements(preset="aiaa-s-114", keep=True)
ASKED = dataclasses.replace(KEPT, keep=False)
JERK = 0.2  # [rad/s^3]: 200/T^3 in 10 s


def stated(minimise, margin=KEPT, drive=DRIVE, duration=10.0, **caps):
    return TrussStudy(
        minimise=minimise,
        duration=duration,
        truss=ROPES,
        margin=margin,
        drive=drive,
        caps=Caps(jerk=JERK, **caps),
    )


def lacking(rotor=0.0):
    """Stall force that the margins need [N], for each line of the curve, by hand."""

    def needs(*motion):
        angle, speed, _ = motion
        dynamic = 1.25 * (rope_force(ROPES, *motion) - rotor * rope_acceleration(ROPES, *motion))
        shaft = -rope_speed(ROPES, angle, speed) * 50.0 / 0.02
        lines = [0.05 - 7.5e-6 * shaft, 0.035 - 1.75e-5 * (shaft - 2000)]
        needed = (dynamic, 2 * static_force(ROPES, angle))
        return [one + STALL - line * PULL for one in needed for line in lines]

    return needs


def slack(*motion):
    return [-rope_force(ROPES, *motion)]


def beyond(*motion):
    return [*(need - STALL for need in lacking()(*motion)), *slack(*motion)]


@pytest.mark.parametrize("drive", [DRIVE, ROTOR, dataclasses.replace(DRIVE, force=60.0)])
@pytest.mark.parametrize("keys", [{}, {"derating": {"voltage": 0.8}, "factors": {"inertia": 1.5}}])
def test_the_stall_force_is_what_the_margins_lack_at_each_speed(drive, keys) -> None:
    margin = MarginRequirements(preset="aiaa-s-114", **keys)
    law = paper_laws(ROPES, 20.0, drive, margin)[0]
    travel = travel_of(law)
    spare = (travel.available - travel.needed()).min()
    # rows of the profile: its peak between them is of second order
    found = stall_force(margin, drive) - law.values["peak-stall-force"]
    assert found == pytest.approx(spare, abs=1e-3)


def test_a_motor_that_has_the_same_at_any_speed_needs_no_other_force() -> None:
    margin = MarginRequirements(preset="aiaa-s-114", available=120.0)
    values = paper_laws(ROPES, 10.0, DRIVE, margin)[0].values
    assert values["peak-stall-force"] == values["peak-factored-force"]


def test_kept_margins_are_a_cap_that_comes_back_from_its_file() -> None:
    study = stated("time", duration=[5.0, 20.0])
    assert study.caps.stall_force == pytest.approx(STALL, rel=1e-15)
    assert study_from(as_dictionary(study)) == study
    free = without_cap(study, "peak-stall-force")
    assert free.caps.stall_force is None
    assert study_from(as_dictionary(free)) == free
    assert stated("energy", stall_force=50.0).caps.stall_force == 50.0


def test_margins_need_a_motor_to_be_kept() -> None:
    with pytest.raises(
        StudyError, match=r"margin.keep needs the force of the motor; give margin.av"
    ):
        stated("energy", drive=None)
    with pytest.raises(StudyError, match="peak-stall-force needs the margins"):
        stated("peak-stall-force", margin=None)


def test_a_margin_that_statics_break_is_refused_with_the_number_to_ask_for() -> None:
    refused = stated("energy", dataclasses.replace(KEPT, static=1.3))
    # 2.3 times the static 39.6438 N
    with pytest.raises(
        StudyError, match=r"needs a motor of 91\.18\d* N .*has 87\.5 N; require"
    ) as error:
        check_some_optimum(refused, silent())
    most = float(str(error.value).split("at most ")[1].split(" %")[0])
    assert most == pytest.approx(100 * (STALL / 39.6438 - 1), abs=0.01)
    kept = dataclasses.replace(KEPT, static=0.99 * most / 100)
    check_some_optimum(stated("energy", kept), silent())


@pytest.mark.slow
def test_a_margin_that_no_motion_was_found_to_keep_comes_with_what_one_keeps() -> None:
    """At rest 2.14 times the static force is 84.8 N of 87.5, but the motor has to move, too."""
    asked = dataclasses.replace(KEPT, static=1.14)
    with pytest.raises(StudyError, match="the motion with this minimum keeps") as error:
        run(stated("energy", asked), silent())
    assert error.value.exit_code is ExitCode.NOT_SOLVED
    words = str(error.value).split("keeps margins of ")[1]
    static, dynamic = (float(part.split(" %")[0]) for part in words.split(" and "))
    assert 0.0 < static < 114.0
    assert dynamic > 0.0
    kept = dataclasses.replace(KEPT, static=static / 100, dynamic=dynamic / 100)
    assert run(stated("energy", kept), silent()).passed


@pytest.mark.slow
@pytest.mark.parametrize(("drive", "mass"), [(DRIVE, 0.0), (ROTOR, 0.7 * 12.5)])
def test_the_largest_margin_is_that_of_a_plain_collocation(drive, mass: float) -> None:
    """A motion of 10 s with 1.506 N to spare was derived elsewhere: this one has a little more."""
    result = run(stated("peak-stall-force", drive=drive), silent())
    assert result.passed
    plain = least_peak(ROPES, 10.0, JERK, lacking(mass), slack, intervals=160, points=4, even=True)
    assert result.value("peak-stall-force") == pytest.approx(plain, rel=1e-4)
    if mass == 0.0:
        assert STALL - result.value("peak-stall-force") == pytest.approx(1.51, abs=0.01)
        assert any("1.511 N more than needed" in remark for remark in result.remarks)
    margins = {check.name: check for check in result.checks if "margin" in check.name}
    assert margins["static margin (least)"].value > 1.0
    assert margins["dynamic margin (least)"].value > 0.25


@pytest.mark.slow
def test_least_time_and_least_torque_under_margins() -> None:
    result = run(stated("time", duration=[5.0, 12.0]), silent())
    assert result.passed
    assert result.value("time") == pytest.approx(
        least_time(ROPES, (5.0, 12.0), JERK, beyond), rel=1e-4
    )
    result = run(stated("peak-motor-torque"), silent())
    assert result.passed
    plain = least_peak(ROPES, 10.0, JERK, lambda *motion: [rope_force(ROPES, *motion)], beyond)
    assert result.value("peak-motor-torque") == pytest.approx(plain / PULL, rel=1e-4)


def test_the_flag_keeps_the_margins(tmp_path, capsys) -> None:
    drive = tmp_path / "drive.toml"
    drive.write_text("drum_radius = 0.02\ntorque_speed = [[0, 0.5], [300, 0]]\n")
    words = "truss --objective energy --friction 0.01 --margin aiaa-s-114 --keep-margins"
    found = main([*words.split(), "--drive", str(drive), "--results", str(tmp_path / "out")])
    assert found == ExitCode.INFEASIBLE
    # 0.5 N m on 20 mm are 25 N
    assert "no motion keeps a static margin of 100 %" in capsys.readouterr().err
