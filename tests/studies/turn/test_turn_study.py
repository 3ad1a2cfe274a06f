"""Stage 2 as a study: optima, refusals, what is stored, drawn, reported and exported."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from models.turn import least_torque_turn, torque_limited_turn, turn_response
from studies.cli import main
from studies.common.configuration import as_stated
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.report.page import page
from studies.turn import TurnStudy, run, study_from
from studies.turn.figures import turn_figure
from studies.turn.study import check
from tests.models.turn.test_turn import least_peak_by_program


@pytest.fixture(scope="module")
def result() -> Result:
    return run(TurnStudy(), silent())


def test_least_torque_is_its_closed_form(result: Result) -> None:
    study = TurnStudy()
    known = least_torque_turn(study.parameters, study.angle, 5.0, 2.0)
    assert result.value("peak_torque") == pytest.approx(known.peak_torque, rel=1e-6)
    assert result.verdict.kind == "global"
    assert result.passed
    # all switches of the closed form, and no other
    arcs = re.search(r"Acceleration of the drive .*: (.*)\.", " ".join(result.remarks))[1]
    ends = [float(end) for end in re.findall(r"until ([\d.]+) s", arcs)]
    assert ends == pytest.approx(known.switches[1:], rel=1e-4)


def test_least_time_is_its_closed_form() -> None:
    study = TurnStudy(minimise="time")
    known = torque_limited_turn(study.parameters, study.angle, 5.0, 2.0)
    found = run(study, silent())
    assert found.value("duration") == pytest.approx(known.duration, rel=1e-6)
    assert found.value("peak_torque") <= 5.0 * (1 + 1e-6)
    assert found.verdict.kind == "global"


def test_without_a_closed_form_a_linear_program_finds_the_same() -> None:
    # so short a turn that its torque is not kept
    study = TurnStudy(duration=0.4, drive_acceleration=60.0, torque=400.0)
    assert least_torque_turn(study.parameters, study.angle, 0.4, 60.0) is None
    found = run(study, silent())
    by_program = least_peak_by_program(study.parameters, study.angle, 0.4, 60.0, 1200)
    assert found.value("peak_torque") == pytest.approx(by_program, rel=1e-3)
    assert found.value("peak_torque") > found.bounds["peak_torque"]
    assert found.verdict.kind == "local"


@pytest.mark.slow
def test_the_caps_of_the_wheels_are_shared_as_a_linear_program_shares_them() -> None:
    study = TurnStudy(minimise="utilisation", duration=2.6, wheel_torque=4.0, wheel_momentum=3.5)
    found = run(study, silent())
    by_program = least_peak_by_program(study.parameters, study.angle, 2.6, 2.0, 600, 4.0 / 3.5)
    # steps of four milliseconds, and peaks between them, are good to 7e-5
    assert found.value("utilisation") == pytest.approx(by_program / 4.0, rel=1e-4)
    assert found.value("peak_momentum") / 3.5 == pytest.approx(by_program / 4.0, rel=1e-4)
    # of a momentum that is no more than the torque there is a closed form
    loose = run(dataclasses.replace(study, wheel_momentum=30.0), silent())
    known = least_torque_turn(study.parameters, study.angle, 2.6, 2.0)
    assert loose.value("utilisation") == pytest.approx(known.peak_torque / 4.0, rel=1e-6)
    assert loose.verdict.kind == "global"


@pytest.mark.slow
def test_a_cap_on_the_momentum_limits_a_turn() -> None:
    found = run(TurnStudy(minimise="time", wheel_momentum=3.0), silent())
    assert found.passed
    assert found.value("peak_momentum") == pytest.approx(3.0, rel=1e-5)
    assert found.value("duration") > found.bounds["duration"]


def test_a_free_satellite_turns_the_other_way() -> None:
    found = run(TurnStudy(satellite_inertia=2000.0), silent())
    turned = float(re.search(r"turns by (\S+) deg", " ".join(found.remarks))[1])
    assert turned == pytest.approx(-90 * 4.198 / 2004.198, rel=1e-3)
    with pytest.raises(StudyError, match="is free to turn, so its wheels take nothing"):
        TurnStudy(satellite_inertia=2000.0, wheel_torque=3.0)


def test_what_the_laws_leave_breaks_the_cap(result: Result) -> None:
    rows = {row.key: row for row in result.table}
    left = rows["energy_left"]
    assert left.values["optimum"] < 1e-12
    assert left.values["Bezier"] > 1e-6
    assert left.broken_by == ("Bezier",)

    # the same swing from what is stored of the law, by a Fourier integral of its acceleration
    study = TurnStudy()
    w = study.parameters.frequency
    time, u = (result.arrays[f"Bezier-{name}"].values for name in ("time", "drive_acceleration"))
    stirred = u * np.exp(1j * w * time)
    moment = ((stirred[1:] + stirred[:-1]) / 2 * np.diff(time)).sum()
    energy = study.parameters.inertia / 2 * abs(moment) ** 2
    assert left.values["Bezier"] == pytest.approx(energy, rel=1e-3)


def test_the_stored_drive_gives_the_stored_motion(result: Result) -> None:
    study = TurnStudy()
    column = {name: result.arrays[name].values for name in ("time", "drive_acceleration")}
    before = np.append(0.0, column["drive_acceleration"][:-1])
    again = turn_response(study.parameters, column["time"], before, column["drive_acceleration"])
    antenna = result.arrays["antenna_angle"].values
    assert np.abs(again.antenna_angle - antenna).max() < 1e-9
    assert antenna[-1] == pytest.approx(math.pi / 2, abs=1e-7)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"torque": 1.0}, r"torque is 1 N m, .* at least (\S+) N m"),
        ({"wheel_torque": 1.0}, r"wheel_torque is 1 N m, .* at least (\S+) N m"),
        ({"wheel_momentum": 1.0}, r"wheel_momentum is 1 N m s, .* at least (\S+) N m s"),
        ({"drive_acceleration": 0.2}, r"drive_acceleration is 0.2 .* more than (\S+), or"),
        ({"minimise": "time", "duration": 2.0}, r"duration is 2 s, .* more than (\S+) s"),
    ],
)
def test_what_cannot_be_is_refused_with_the_number_to_ask_for(stated, words: str) -> None:
    with pytest.raises(StudyError, match=words) as refused:
        check(TurnStudy(**stated))
    assert refused.value.exit_code is ExitCode.INFEASIBLE
    *_, key = stated
    enough = 1.001 * float(re.search(words, str(refused.value))[1])
    check(TurnStudy(**{**stated, key: enough}))


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"angle_deg": 400}, "angle_deg is 400 deg; give at most 360"),
        ({"poisson": 0.7}, "poisson is 0.7; give a ratio"),
        ({"arm": {"tip_mass": 0.0}}, "mass"),
        ({"minimise": "torque"}, "minimise is 'torque'"),
        ({"truss": {"link": 0.05}}, "link"),
        ({"angel_deg": 90}, "did you mean angle_deg"),
    ],
)
def test_bad_input_is_said_in_one_sentence(stated, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        study_from(stated)


def test_a_study_is_repeated_from_its_dictionary() -> None:
    study = TurnStudy(angle_deg=60, duration=3.0, truss={"stowed_angle_deg": 5})
    assert study_from(as_stated(study)) == study
    heavier = dataclasses.replace(study, arm={"tip_mass": 60.0})
    assert heavier.parameters.inertia == pytest.approx(2 * study.parameters.inertia)


def test_figure_and_page_show_the_turn(result: Result) -> None:
    angle, torque, acceleration, swing = turn_figure(result).axes
    assert [line.get_label() for line in angle.lines] == ["optimum", "Bezier", "Step5"]
    assert (
        np.abs(swing.lines[0].get_ydata()).max() < 1e-3 * np.abs(swing.lines[1].get_ydata()).max()
    )
    assert "N m" in torque.get_ylabel()
    assert "rad/s²" in acceleration.get_ylabel()
    html = page(result)
    assert "torsion spring" in html
    assert "bending of the arm" in html


def test_the_command_writes_what_an_export_takes(tmp_path, capsys) -> None:
    folder = tmp_path / "turn"
    assert main(["turn", "--angle-deg", "45", "--results", str(folder), "--no-figures"]) == 0
    assert "verdict: global" in capsys.readouterr().out
    table = tmp_path / "table.csv"
    words = ["export", str(folder), "--to", "csv", "--signal", "drive", "--step", "0.01"]
    assert main([*words, "--output", str(table)]) == 0
    assert "antenna_angle" in table.read_text("utf-8")
