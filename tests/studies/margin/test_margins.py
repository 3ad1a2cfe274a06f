"""Margins: loads that add up to the force, factors, cases, a measured curve, and what governs."""

import dataclasses
import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from models.truss import TrussParameters, rope_force, static_peak
from models.truss.measured import MOST_ROWS, thinning_error
from studies.cli import main
from studies.common.configuration import toml_text
from studies.common.exit_codes import ExitCode, StudyError
from studies.drive import Drive
from studies.margin import MarginRequirements, read_margin
from studies.margin.loads import CONTRIBUTIONS, least_static_need, needed_of_the_motor
from studies.margin.presets import PRESETS
from studies.margin.travel import along, criteria, records, sentences
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.caps import Caps
from studies.truss.margins import margins_of
from studies.truss.motions.deployment import travel_of
from studies.truss.motions.laws import paper_laws
from studies.truss.study import run

TRUSS = TrussParameters(pulley_friction=0.01)
HUNG = dataclasses.replace(
    TRUSS,
    other_pulleys=((9, 2, 0.2),),
    measured_torque=((0.07, 0.5), (1.0, 2.0), (1.6, 1.0)),
    joint_coulomb=0.02,
    slider_coulomb=0.5,
    gravity=(-9.81, 0.0, 0.0),
    off_load=0.9,
)
OPEN = math.pi / 2
PLAIN = MarginRequirements()
ROTOR = Drive(drum_radius=0.02, gear_ratio=50.0, motor_inertia=2e-6)
CURVE = [[0.07, 0.5], [1.0, 2.0], [1.6, 1.0]]


def travel(
    margin: MarginRequirements,
    drive: Drive | None = None,
    duration: float = 5.0,
    truss: TrussParameters = TRUSS,
):
    law, _ = paper_laws(truss, duration)
    time = np.linspace(0.0, duration, 801)
    motion = law.law.motion(time)
    found = along(margin, truss, drive, time, (motion.angle, motion.speed, motion.acceleration))
    return found, law.at(time)[1]


@pytest.mark.parametrize("duration", [5.0, 60.0, 140.0])
def test_the_least_margin_is_looked_for_between_the_rows(duration: float) -> None:
    for law in paper_laws(TRUSS, duration):
        deployment = dataclasses.replace(law, margin=PLAIN)
        needed = [line["motor_N"] for line in margins_of(deployment).details["margins"]]
        # its extremes are located by other samples, and refined in another way
        assert max(needed) == pytest.approx(deployment.values["peak-factored-force"], rel=1e-10)


def test_contributions_add_up_to_the_force_of_the_model() -> None:
    for drive, mass in ((None, 0.0), (ROTOR, 12.5)):
        found, truth = travel(PLAIN, drive, truss=HUNG)
        (case,) = found.cases
        total = sum(case.parts[name] for name in CONTRIBUTIONS)
        # two ways through the same formulas: rounding of forces of 100 N
        force = truth.rope_force - mass * truth.rope_acceleration
        assert total == pytest.approx(force, rel=1e-11, abs=1e-11)
        assert case.required["dynamic"] == pytest.approx(force, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("name", [one for one in CONTRIBUTIONS if one != "holding"])
def test_a_factor_acts_on_its_contribution_and_on_its_friction_in_the_pulleys(name: str) -> None:
    factors = MarginRequirements(factors={name: 2.0})
    (plain,), (case,) = (travel(one, ROTOR, truss=HUNG)[0].cases for one in (PLAIN, factors))
    resisting = plain.parts[name] > 0
    assert case.parts[name][resisting] == pytest.approx(2 * plain.parts[name][resisting], rel=1e-9)
    # what helps is as it was: the truss brakes, and inertia pulls the rope
    helping = plain.parts[name] < 0
    assert case.parts[name][helping] == pytest.approx(plain.parts[name][helping], rel=1e-9)
    assert helping.any() == (name in ("inertia", "rotor"))
    gained = case.required["dynamic"] - plain.required["dynamic"]
    # with pulleys between, a load costs more at the motor than it is
    extra = 1.0 if name == "pulley_friction" else 1.0 + 1e-9
    assert (gained[resisting] >= plain.parts[name][resisting] * (2 - extra) - 1e-9).all()


def test_numbers_by_hand() -> None:
    truss = dataclasses.replace(TRUSS, pulley_friction=0.0, net_stiffness=0.0)
    margin = MarginRequirements(
        static=1.0,
        dynamic=0.5,
        holding=3.0,
        factors={"springs": 2.0, "holding": 1.5, "inertia": 1.2},
        derating={"voltage": 0.8, "ageing": 0.5},
    )
    alpha, omega, acc = 1.0, 0.2, 0.3
    springs = float(rope_force(truss, alpha, 0.0, 0.0))
    whole = float(rope_force(truss, alpha, omega, acc))
    viscous = (
        float(rope_force(truss, alpha, omega, 0.0) - rope_force(truss, alpha, -omega, 0.0)) / 2
    )
    inertia = whole - springs - viscous
    dynamic = 1.5 * (1.2 * inertia + 2 * springs + viscous + 4.5) / 0.4
    motion = ca.DM(alpha), ca.DM(omega), ca.DM(acc)
    at_rest, *moving = (float(need) for need in needed_of_the_motor(margin, truss, motion))
    assert max(moving) == pytest.approx(dynamic, rel=1e-12)

    angles = np.linspace(truss.stowed_angle, OPEN, 2001)
    peak = max(float(rope_force(truss, angle, 0.0, 0.0)) for angle in angles)
    assert at_rest == pytest.approx(2.0 * (2 * peak + 4.5) / 0.4, rel=1e-6)


def test_the_static_need_is_that_of_the_ridge() -> None:
    margin = MarginRequirements(preset="aiaa-s-114")
    assert least_static_need(margin, TRUSS) == pytest.approx(2 * static_peak(TRUSS).force, rel=1e-9)


def test_the_worst_case_governs_and_is_named() -> None:
    cases = {
        "hot": {"derating": {"temperature": 0.9}},
        "cold": {"joint_friction": 0.5, "derating": {"temperature": 0.95}},
    }
    found, _ = travel(MarginRequirements(preset="aiaa-s-114", available=500.0, cases=cases))
    static, dynamic = found.worst("static")[0], found.worst("dynamic")[0]
    assert (static.case.name, dynamic.case.name) == ("hot", "cold")
    lines = records(found)
    assert [line["governs"] for line in lines] == ["yes", "no", "no", "yes"]
    expected = 500.0 * 0.9 / static_peak(TRUSS).force - 1.0
    assert lines[0]["least"] == pytest.approx(expected, rel=1e-4)  # at rows of the profile
    passed = {check.name: check.passed for check in criteria(found)}
    assert passed == {"static margin (least)": True, "dynamic margin (least)": True}
    assert "case 'cold'" in sentences(found)[1]


def test_what_the_drive_can_do_is_what_is_available() -> None:
    drive = Drive(drum_radius=0.02, gear_ratio=10.0, torque_speed=[[0, 0.5], [400, 0.5], [2000, 0]])
    found, truth = travel(PLAIN, drive, truss=HUNG)
    assert found.available is not None
    speed = 10 * -truth.rope_speed / 0.02
    torque = np.where(speed < 400, 0.5, np.maximum(0.5 * (2000 - speed) / 1600, 0.0))
    assert found.available == pytest.approx(torque * 10 / 0.02, abs=1e-9)
    assert found.available.min() < 100.0 < found.available.max()
    assert travel(PLAIN)[0].available is None


def test_a_measured_curve_is_a_further_load(tmp_path: Path) -> None:
    path = tmp_path / "measured.csv"
    rows = "\n".join(f"{math.degrees(angle)},{torque}" for angle, torque in CURVE)
    path.write_text(f"angle [deg],torque [N m]\n{rows}\n")
    margin = MarginRequirements(resistance=str(path), factors={"measured": 3.0})
    (plain,), (case,) = travel(PLAIN)[0].cases, travel(margin)[0].cases
    assert (case.parts["measured"] > 0).all()
    assert (case.required["static"] > plain.required["static"]).all()
    again = MarginRequirements(resistance=CURVE, factors={"measured": 3.0})
    assert np.asarray(margin.resistance) == pytest.approx(np.asarray(again.resistance), rel=1e-12)

    dense = [[a, 1 + math.sin(5 * a)] for a in np.linspace(0.07, 1.6, 500)]
    fine = MarginRequirements(resistance=dense)
    # 40 cubic pieces of 0.04 rad: a fourth of h^2 f'' at a top of the curve
    assert 0 < thinning_error(fine.resistance) < 0.25 * (1.53 / (MOST_ROWS - 1)) ** 2 * 25
    assert "used at 40 angles" in sentences(travel(fine)[0])[-1]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"factors": {"inertia": 0.9}}, "margin.factors.inertia is 0.9; an uncertainty factor"),
        ({"factors": {"spring": 1.1}}, "unknown key margin.factors.spring; did you mean"),
        ({"derating": {"voltage": 1.1}}, "margin.derating.voltage is 1.1; a derating factor"),
        ({"preset": "ecss"}, "margin.preset is 'ecss'"),
        ({"cases": {"cold": {"crank": 0.2}}}, "unknown key margin.cases.cold.crank"),
        ({"cases": {"cold": {"factors": {"net": 0.5}}}}, "an uncertainty factor"),
        ({"cases": {"cold": {"joint_friction": -1.0}}}, "margin.cases.cold.joint_friction is -1"),
        ({"resistance": [[0.0, 1.0]]}, "give rows"),
        ({"resistance": [[0.5, 1.0], [0.5, 2.0]]}, "sort it by rising angles"),
        ({"resistance": "nowhere.csv"}, "cannot be read"),
    ],
)
def test_margins_that_cannot_be_are_refused(keys, said) -> None:
    with pytest.raises(StudyError, match=said):
        study_from({"minimise": "energy", "margin": keys})


def test_a_curve_that_ends_inside_the_travel_is_refused() -> None:
    with pytest.raises(StudyError, match="measure the whole travel"):
        travel(MarginRequirements(resistance=[[0.5, 1.0], [1.6, 2.0]]))


def test_every_number_of_a_preset_has_its_source() -> None:
    lines = MarginRequirements(preset="aiaa-s-114").sources()
    assert [line["value"] for line in lines] == [1.0, 0.25, *[1.0] * 14]
    assert all("Mission Assurance Baseline" in line["source"] for line in lines)
    own = MarginRequirements(preset="aiaa-s-114", dynamic=0.5, factors={"net": 1.2}).sources()
    stated = [line["number"] for line in own if line["source"] == "stated"]
    assert stated == ["dynamic margin", "factor on net"]
    assert set(PRESETS) == {"aiaa-s-114"}  # of no other standard the text could be read


def test_a_study_with_margins_comes_back_from_its_file(tmp_path: Path, capsys) -> None:
    margin = MarginRequirements(
        preset="aiaa-s-114",
        cases={"end of life": {"factors": {"net": 1.2}, "spring_stiffness": 120.0}},
        resistance=CURVE,
    )
    study = TrussStudy(minimise="peak-factored-force", duration=10.0, margin=margin)
    assert study_from(as_dictionary(study)) == study

    path = tmp_path / "margin.toml"
    path.write_text(toml_text(margin.as_dictionary()))
    assert MarginRequirements(**read_margin(str(path))) == margin
    assert read_margin("aiaa-s-114") == {"preset": "aiaa-s-114"}
    words = ["truss", "--objective", "peak-factored-force", "--duration", "10"]
    assert main([*words, "--margin", "ecss"]) == ExitCode.BAD_INPUT
    assert "neither a preset nor a file; use a preset (aiaa-s-114" in capsys.readouterr().err
    assert main(words) == ExitCode.BAD_INPUT
    assert "needs the margins; give [margin]" in capsys.readouterr().err


@pytest.mark.slow
def test_a_profile_of_ones_own_is_held_against_the_margins(tmp_path: Path, capsys) -> None:
    law, _ = paper_laws(TRUSS, 140.0)
    time = np.linspace(0.0, 140.0, 701)
    rows = np.column_stack([time, law.law.motion(time).angle])
    profile = tmp_path / "profile.csv"
    np.savetxt(profile, rows, "%.17g", ",", header="time [s],angle [rad]", comments="")
    for available, code in ((80.0, ExitCode.OK), (79.0, ExitCode.NOT_VERIFIED)):
        study = tmp_path / "study.toml"
        margin = f'[margin]\npreset = "aiaa-s-114"\navailable = {available}\n'
        study.write_text(f"[truss]\npulley_friction = 0.01\n{margin}")
        assert main(["check", str(profile), str(study), "--no-optimum"]) == code
        # twice the static peak of 39.64 N is asked for
        assert f"{'passed' if code == 0 else 'FAILED'}: static margin" in capsys.readouterr().out


def solved(duration: float, **keys):
    study = TrussStudy(
        minimise="peak-factored-force",
        duration=duration,
        truss=TRUSS,
        caps=Caps(jerk="200/T^3"),
        margin=MarginRequirements(preset="aiaa-s-114", **keys),
    )
    solver = dataclasses.replace(study.solver, starts=("bezier",))
    return run(dataclasses.replace(study, solver=solver))


@pytest.mark.slow
def test_in_a_slow_motion_no_law_matters_and_the_bound_says_so() -> None:
    result = solved(140.0, available=80.0)
    needs = next(row for row in result.table if row.key == "peak-factored-force").values
    assert result.verdict.kind == "global"
    assert list(needs.values()) == pytest.approx([2 * static_peak(TRUSS).force] * 3, rel=1e-6)
    assert {"static_margin", "dynamic_margin", "load_springs"} <= set(result.arrays)
    assert result.passed
    assert result.details["margins"][0]["mostly"] == "pulley friction"


@pytest.mark.slow
def test_the_least_factored_force_is_below_that_of_the_least_force() -> None:
    cases = {"cold": {"joint_friction": 0.5}, "stated": {}}
    result = solved(5.0, cases=cases, factors={"inertia": 1.5})
    needs = next(row for row in result.table if row.key == "peak-factored-force").values
    assert needs["optimal"] < 0.7 * min(needs["Bezier"], needs["Step5"])
    again = travel_of(
        dataclasses.replace(paper_laws(TRUSS, 5.0)[0], margin=MarginRequirements(cases=cases))
    )
    assert again is not None
    assert result.passed, [check.sentence for check in result.checks]
