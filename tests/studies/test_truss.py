"""The truss study end to end in a coarse mode, and its parts."""

import dataclasses
import io
import json
import math
from pathlib import Path

import numpy as np
import pytest

from models.laws import (
    Hermite,
    JerkLimited,
    Piecewise,
    RateCaps,
    Step5,
    constant_acceleration,
    least_peak_acceleration,
    least_time,
    linear_jerk,
)
from studies.cli import main
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.keys import key_lines
from studies.common.result import Result
from studies.paper.cases import DEPLOYED, WITH_FRICTION
from studies.truss import figures
from studies.truss import study as truss_study
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.figures import all_figures, angle_figure
from studies.truss.limits.bounds import least_work
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment, columns_at, profile
from studies.truss.motions.laws import knots, paper_laws, pinned_bezier, stored_law
from studies.truss.search.motion_search import best_motion
from studies.truss.search.question import Question
from studies.truss.study import run

T = 140.0  # s
D = DEPLOYED - WITH_FRICTION.stowed_angle
PINNED = pinned_bezier(WITH_FRICTION, T)
STEP5 = Step5(T, WITH_FRICTION.stowed_angle, DEPLOYED)
MAIN = ("truss", "--objective", "peak-acceleration", "--jerk-cap", "bezier", "--friction", "0.01")


def test_the_main_study_meets_its_bound_and_reproduces(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    assert main([*MAIN, "--results", str(first), "--no-figures"]) == ExitCode.OK
    record = json.loads((first / "verification.json").read_text())
    bound = least_peak_acceleration(D, T, jerk=record["study"]["caps"]["jerk"])
    assert record["passed"]
    assert record["verdict"].startswith("global")
    # the accuracy asked of the jerk-limited problem
    assert record["values"]["peak-acceleration"] == pytest.approx(bound, rel=1e-5)
    again = ["truss", str(first / "input.toml"), "--results", str(second)]
    assert main([*again, "--no-figures"]) == ExitCode.OK
    columns = [json.loads((p / "profile.json").read_text())["columns"] for p in (first, second)]
    for name, column in columns[0].items():
        values = np.array(column["values"])
        miss = np.abs(values - columns[1][name]["values"]).max()
        assert miss <= 1e-9 * np.abs(values).max(), name
    verify = ["check", str(first / "profile.csv"), "--jerk-cap", "bezier"]
    assert main([*verify, "--friction", "0.01"]) == ExitCode.OK


def test_a_check_is_repeated_with_its_caps(tmp_path, capsys):
    law = PINNED
    times = np.linspace(0, T, 1401)
    rows = [f"{t},{a}" for t, a in zip(times, law.motion(times).angle, strict=True)]
    profile = tmp_path / "profile.csv"
    profile.write_text("\n".join(["time,angle", *rows]) + "\n")
    check = ["check", str(profile), "--no-figures", "--no-optimum", "--results"]

    first, second = tmp_path / "first", tmp_path / "second"
    code = main([*check, str(first), "--jerk-cap", "100/T^3"])
    assert code == ExitCode.NOT_VERIFIED  # its jerk is 124.22/T^3
    rerun = f"antenna-ocp check {profile} --no-optimum {first / 'input.toml'}"
    assert f"to run it again: {rerun}" in capsys.readouterr().out
    again = ["check", str(profile), str(first / "input.toml"), "--no-figures", "--no-optimum"]
    assert main([*again, "--results", str(second)]) == code
    assert (first / "table.txt").read_text() == (second / "table.txt").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("intervals", [20, 21, 100, 101])
@pytest.mark.parametrize("jerk", [69.0, 124.22, 1000.0])
def test_the_jerk_limited_optimum_from_any_mesh(jerk: float, intervals: int) -> None:
    raw = {
        "minimise": "peak-acceleration",
        "caps": {"jerk": f"{jerk}/T^3"},
        "truss": {"pulley_friction": 0.01},
        "solver": {"intervals": intervals, "starts": ["bezier"]},
    }
    study = study_from(raw)
    outcome = best_motion(Question(study, Console(io.StringIO(), io.StringIO())))
    bound = least_peak_acceleration(D, T, jerk=study.caps.jerk)
    assert outcome.deployment.values["peak-acceleration"] == pytest.approx(bound, rel=1e-5)
    ((_, epigraph, dense),) = outcome.solution.verification.peaks
    assert epigraph == pytest.approx(dense, rel=1e-6)
    assert outcome.deployment.law.end_angle == pytest.approx(math.pi / 2, abs=1e-8)
    assert outcome.deployment.energies.imbalance < 1e-8  # of the motor's work


@pytest.mark.parametrize("law", [PINNED, STEP5])
def test_energies_balance_and_the_bound_on_work_holds(law: object) -> None:
    deployment = Deployment("law", law, WITH_FRICTION)  # type: ignore[arg-type]
    assert deployment.energies.imbalance < 1e-12  # the quadrature's rounding
    study = study_from({"minimise": "energy", "truss": {"pulley_friction": 0.01}})
    work = least_work(study, T)
    assert work <= deployment.values["energy"] <= 1.01 * work


@pytest.mark.slow
def test_extremes_are_found_between_samples() -> None:
    values = Deployment("Bezier", PINNED, WITH_FRICTION).values
    grid = np.linspace(0, T, 1_000_003)
    dense = np.abs(PINNED.motion(grid).jerk).max()
    assert values["peak-jerk"] >= dense * (1 - 1e-12)
    assert values["peak-force"] == pytest.approx(39.71144, rel=1e-6)  # digits given


def test_a_kink_that_is_found_twice_has_one_row() -> None:
    """Rounded angles of two rows that are some 1e-15 s apart say nothing of the rates."""
    whole = Step5(10.0, WITH_FRICTION.stowed_angle, DEPLOYED)
    net_time = Deployment("whole", whole, WITH_FRICTION).edges[-2]
    edges = np.array([0.0, 5.0, net_time + 4e-15, 10.0])
    motion = whole.motion(edges)
    law = Hermite(edges, motion.angle, motion.speed, motion.acceleration, motion.acceleration)

    deployment = Deployment("split", law, WITH_FRICTION)
    assert edges[2] in deployment.edges
    assert np.diff(deployment.edges).min() > 1.0
    assert np.diff(profile(deployment)["time"]).min() > 1e-6


def test_forces_are_the_same_between_the_rows_of_a_profile() -> None:
    """Rows that are 4e-6 s apart do not say by their angles what the acceleration is."""
    whole = Step5(2.0, WITH_FRICTION.stowed_angle, DEPLOYED)
    edges = np.unique([*np.linspace(0.0, 2.0, 201), *np.linspace(1.2, 1.2 + 4e-5, 11)])
    motion, steps = whole.motion(edges), np.diff(edges)
    first, last = motion.acceleration[:-1], motion.acceleration[1:]
    gains = np.diff(motion.speed)
    turns = np.diff(motion.angle) - steps * motion.speed[:-1]
    close = steps < 1e-5
    gains[close] = (steps * (first + last) / 2)[close]
    turns[close] = (steps**2 * (first / 3 + last / 6))[close]
    turns[np.searchsorted(edges, 1.2 + 2e-5)] += 2e-15  # [rad]; 7e-4 rad/s^2 within 4e-6 s
    columns = (motion.angle, motion.speed, motion.acceleration, motion.acceleration)
    law = Hermite(edges, *columns, gains, turns)

    asked = Deployment("law", law, WITH_FRICTION)
    between = np.linspace(1.2, 1.2 + 4e-5, 1001)
    force = asked.at(between)[1].rope_force

    def miss(rows: dict[str, np.ndarray]) -> float:
        read = Deployment("read", stored_law(rows), WITH_FRICTION).at(between)[1]
        return np.abs(read.rope_force - force).max() / asked.values["peak-force"]

    assert miss(columns_at(asked, edges)) > 5e-6
    assert miss(profile(asked)) < 2e-7


@pytest.mark.parametrize("jerk", [69.0, 124.22, 1000.0])
def test_least_time_inverts_the_jerk_limited_law(jerk: float) -> None:
    law = JerkLimited(T, math.pi / 2 - D, math.pi / 2, jerk / T**3)
    caps = RateCaps(jerk=jerk / T**3, acceleration=law.peak_acceleration)
    assert least_time(D, caps) == pytest.approx(T, rel=1e-9)
    assert least_time(D, RateCaps(speed=0.1)) == pytest.approx(D / 0.1)
    assert least_time(D, RateCaps(acceleration=0.3)) == pytest.approx(2 * math.sqrt(D / 0.3))


def test_a_ramped_jerk_integrates_exactly() -> None:
    law = linear_jerk((0.0, 1.0, 3.0), ((6.0, 0.0), (1.0, 2.0)), start_angle=0.5)
    before = law.motion(np.nextafter(1.0, 0))
    after = law.motion(1.0)
    for name in ("angle", "speed", "acceleration"):
        assert getattr(before, name)[0] == pytest.approx(getattr(after, name)[0], rel=1e-14)
    assert after.acceleration[0] == pytest.approx(3.0)
    assert after.jerk[0] == 1.0
    assert law.motion(3.0).jerk[0] == pytest.approx(2.0)
    assert law.end_angle == pytest.approx(0.5 + 0.75 + 2 * 2 + 3 * 2 + 8 / 6 + 0.5 * 16 / 24)


def test_a_study_survives_its_own_toml() -> None:
    raw = {
        "minimise": [{"peak-force": 1.0, "energy": 0.5}, "peak-acceleration"],
        "duration": [5.0, 9.0],
        "caps": {"jerk": 2.0, "force": 80.0},
        "truss": {"net_angle_deg": 82.0, "modules": 12},
    }
    study = study_from(raw)
    assert study_from(as_dictionary(study)) == study


def test_every_figure_is_drawn_with_labelled_axes() -> None:
    laws = [Deployment("Bezier", PINNED, WITH_FRICTION), Deployment("Step5", STEP5, WITH_FRICTION)]
    names = []
    for name, figure in all_figures(laws):
        names.append(name[:5])
        figure.canvas.draw()
        # neither pictures of the antenna, which have no axes, nor the scale of their colours
        flat = [axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"]
        assert all(axes.get_xlabel() for axes in flat), name
    assert names == ["overv", *(f"fig{k}" for k in (11, 12, 13, 14, 17, 18, 19, 20)), "bar_f"]


def test_a_stored_study_is_reported_exported_and_drawn_without_solving(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, drawn, file = tmp_path / "out", tmp_path / "figures", tmp_path / "mine.csv"
    assert main([*MAIN, "--starts", "bezier", "--no-figures", "--results", str(out)]) == 0
    printed = capsys.readouterr().out
    result = Result.load(out)
    assert result.verdict.kind == "global"
    assert result.laws == ("optimal", "Bezier", "Step5")
    assert study_from(result.configuration).duration == (T, T)
    costs = {cost.key: cost for cost in result.costs_elsewhere}
    assert costs["peak-jerk"].baseline == "Step5"
    assert costs["peak-jerk"].ratio == pytest.approx(1.800, rel=1e-3)  # of the two laws' own jerks
    assert costs["peak-jerk"].sentence in printed

    def refuse(*_: object, **__: object) -> None:
        pytest.fail("a stored result was solved again")

    monkeypatch.setattr(truss_study, "best_motion", refuse)
    monkeypatch.setattr(
        figures, "all_figures", lambda laws, caps: [("angle", angle_figure(laws, caps))]
    )
    assert main(["report", str(out), "--figures", "png", "--to", str(drawn)]) == ExitCode.OK
    report = capsys.readouterr().out
    for words in (result.question, result.verdict.sentence, "passed: energy imbalance", "casadi"):
        assert words in report
    assert (drawn / "figures" / "angle.png").is_file()
    assert main(["export", str(out), "--to", "csv", "--output", str(file)]) == ExitCode.OK
    assert file.read_bytes() == (out / "profile.csv").read_bytes()
    assert main(["export", str(out), "--to", "csv", "--output", str(file)]) == 6
    capsys.readouterr()
    assert main(["export", str(out), "--to", "json"]) == ExitCode.OK
    assert "motor_force" in json.loads(capsys.readouterr().out)["columns"]


def test_the_stored_law_is_the_one_that_was_found() -> None:
    limited = JerkLimited(T, math.pi / 2 - D, math.pi / 2, 200 / T**3).profile
    # knots give the law itself; a profile has angle, speed and acceleration at each of its rows
    for law, kind, tolerance in (
        (limited, Piecewise, 1e-14),
        (PINNED, Hermite, 1e-9),
        (JUMPING, Hermite, 1e-9),
    ):
        columns = profile(Deployment("law", law, WITH_FRICTION)) | knots(law)
        stored = stored_law(columns)
        assert isinstance(stored, kind)
        t = np.linspace(0.0, law.duration, 777)
        miss = stored.motion(t).angle - law.motion(t).angle
        assert np.abs(miss).max() <= tolerance


JUMPING = constant_acceleration((0.0, 70.0, 140.0), (4 * D / T**2, -4 * D / T**2), math.pi / 2 - D)


@pytest.mark.slow
def test_a_least_time_that_is_the_shortest_stated_one_is_said_to_be_it() -> None:
    study = study_from(
        {
            "minimise": "time",
            "duration": [8.0, 60.0],
            "caps": {"jerk": 1.0, "least_tension": "none"},
            "solver": {"intervals": 10, "starts": ["bezier"]},
        }
    )
    assert any(
        remark.startswith("The minimum time is the lower limit of the duration, 8 s")
        for remark in run(study).remarks
    )
    held_back = dataclasses.replace(study, duration=(2.0, 60.0))
    assert not any("lower limit of the duration" in remark for remark in run(held_back).remarks)


def test_a_study_in_python_takes_what_toml_takes() -> None:
    study = TrussStudy(minimise="energy", duration=5.0, caps=Caps(jerk="200/T^3"))
    assert study == study_from({"minimise": "energy", "duration": 5, "caps": {"jerk": 1.6}})
    with pytest.raises(StudyError, match=r"caps\.force is -1; give a finite positive number"):
        Caps(force=-1)
    with pytest.raises(StudyError, match="did you mean energy"):
        TrussStudy(minimise="enery")


def test_every_key_is_documented_with_unit_and_default() -> None:
    lines = {line.key: line for line in key_lines(TrussStudy)}
    assert lines["caps.force"].unit == "N"
    assert lines["duration"].default == "140.0"
    assert lines["solver.intervals"].default == "40"
    assert all(line.meaning for line in lines.values())


def test_a_study_that_failed_leaves_an_incomplete_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise StudyError("no motion was found", ExitCode.NOT_SOLVED)

    monkeypatch.setattr(truss_study, "best_motion", fail)
    out = tmp_path / "out"
    assert main([*MAIN, "--results", str(out)]) == ExitCode.NOT_SOLVED
    assert json.loads((out / "failure.json").read_text())["code"] == "NOT_SOLVED"
    with pytest.raises(StudyError, match=r"arrays, table, checks missing \(no motion was"):
        Result.load(out)
    assert main(["report", str(out)]) == ExitCode.BAD_INPUT
    assert main(["report", str(out), "--partial"]) == ExitCode.OK
    partial = Result.load(out, partial=True)
    assert partial.configuration["minimise"] == "peak-acceleration"
    assert partial.verdict.sentence == "no motion was found"


@pytest.mark.parametrize("degrees", [20.0, 26.0, 66.0])
def test_the_paper_s_laws_have_values_in_every_range(degrees: float) -> None:
    """They never run backwards, which pulley friction does not allow."""
    stowed = math.radians(degrees)
    truss = dataclasses.replace(WITH_FRICTION, stowed_angle=stowed)
    bezier, step5 = paper_laws(truss, T)
    for law, shape in ((bezier, 5.62), (step5, 7.5)):
        expected = shape * (DEPLOYED - stowed) / T**2
        # 5.62 is that of the paper's points, to its three digits
        assert law.values["peak-acceleration"] == pytest.approx(expected, rel=1e-3)
        assert law.values["least-tension"] > 0.0


@pytest.mark.slow
def test_objectives_in_order_are_both_in_the_verdict() -> None:
    result = run(
        study_from(
            {
                "minimise": ["peak-acceleration", "peak-rope-speed"],
                "duration": T,
                "concession": 0.01,
                "caps": {"jerk": "bezier"},
                "solver": {"starts": ["bezier"], "intervals": 12},
            }
        )
    )
    least, conceded = result.bounds["peak-acceleration"], result.value("peak-acceleration")
    assert least < conceded <= 1.01 * least * (1 + 1e-5)
    said = result.verdict.sentence
    assert f"then peak rope speed {result.value('peak-rope-speed'):.6g} m/s" in said
    used = 100 * (conceded / least - 1) / 0.01
    assert (
        f"to {conceded:.6g} rad/s^2, which is {used:.0f} % of the allowed concession (1 %)" in said
    )
    # a limit that was conceded is no value of the solver
    (peak,) = [remark for remark in result.remarks if "in the solver" in remark]
    assert peak.startswith("peak rope speed: ")
