"""What `antenna-ocp check` makes of clean, noisy and wrong motions of truss and arm."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from models.laws import JerkLimited, constant_acceleration
from models.truss import TrussParameters
from studies.check.reading.profile import read_profile
from studies.check.smoothing.noise import estimate_noise
from studies.check.smoothing.recovery import recover
from studies.check.truss import check_truss
from studies.cli import main
from studies.common.columns import Dialect
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from studies.common.writers import outcome_text
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment, profile
from studies.truss.motions.laws import paper_laws
from tests.studies.written_columns import read_csv

T = 140.0
TRUSS = TrussParameters(pulley_friction=0.01)
BEZIER, STEP5 = (deployment.law for deployment in paper_laws(TRUSS, T))
D = DEPLOYED - TRUSS.stowed_angle


def write(path: Path, time: np.ndarray, values: np.ndarray, header: str = "time,angle") -> Path:
    np.savetxt(path, np.column_stack([time, values]), "%.17g", ",", header=header, comments="")
    return path


def check(path: Path, **caps: float) -> Result:
    measured = read_profile(path)
    study = TrussStudy(
        minimise="peak-acceleration", duration=measured.duration, truss=TRUSS, caps=Caps(**caps)
    )
    return check_truss(measured, study, optimum=False)


def noisy(law: object, sigma: float, rows: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    time = np.linspace(0.0, T, rows)
    scatter = sigma * np.random.default_rng(seed).standard_normal(rows)
    return time, law.motion(time).angle + scatter  # type: ignore[attr-defined]


@pytest.mark.parametrize("law", [BEZIER, STEP5], ids=["Bezier", "Step5"])
@pytest.mark.parametrize(
    ("sigma", "rows", "wide"), [(1e-5, 701, 0.05), (1e-4, 281, 0.05), (1e-3, 281, 0.20)]
)
def test_peaks_lie_within_bounds_that_are_narrow(
    law: object, sigma: float, rows: int, wide: float, tmp_path: Path
) -> None:
    result = check(write(tmp_path / "a.csv", *noisy(law, sigma, rows, seed=1)))
    assert result.passed, [c.sentence for c in result.checks]
    # of 281 values a standard deviation is known to 4 %; the estimate by a median to 10 %
    assert result.details["noise"]["deviation"] == pytest.approx(sigma, rel=0.3)
    truth = Deployment("law", law, TRUSS).values  # type: ignore[arg-type]
    for key, peak in result.details["peaks"].items():
        assert peak["low"] <= truth[key] <= peak["high"], key
        if key not in ("peak-jerk", "peak-rope-jerk", "least-tension"):
            assert peak["high"] - peak["low"] <= 2 * wide * truth[key], key


@pytest.mark.parametrize(
    ("sigma", "words"), [(0.0, "broken by at least"), (1e-4, "exceeded by an estimated")]
)
def test_a_cap_is_broken_only_beyond_the_noise(sigma: float, words: str, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", *noisy(BEZIER, sigma, 281, seed=2))
    peak = Deployment("law", BEZIER, TRUSS).values["peak-acceleration"]
    assert check(path, acceleration=1.002 * peak).passed
    result = check(path, acceleration=0.9 * peak)
    (failed,) = [c for c in result.checks if not c.passed]
    assert words in failed.sentence
    assert result.verdict.sentence.startswith("no, it fails 1 of")


@pytest.mark.parametrize("columns", [("time", "angle"), ("time", "rope_length")])
@pytest.mark.parametrize("jumps", [False, True])
def test_our_own_profile_passes_with_one_column(
    columns: tuple[str, ...], jumps: bool, tmp_path: Path
) -> None:
    """Neither jumps of the jerk nor of the acceleration ring, although no column states them."""
    jerk = 124.22 / T**3
    law = (
        constant_acceleration((0, T / 2, T), (4 * D / T**2, -4 * D / T**2), TRUSS.stowed_angle)
        if jumps
        else JerkLimited(T, TRUSS.stowed_angle, DEPLOYED, jerk)
    )
    exported = profile(Deployment("optimal", law, TRUSS), samples=401)
    path = write(tmp_path / "a.csv", *(exported[c] for c in columns), ",".join(columns))
    caps = {} if jumps else {"jerk": jerk}
    result = check(path, acceleration=law.motion(T / 4).acceleration[0] * (1 + 1e-5), **caps)
    assert result.passed, [c.sentence for c in result.checks]
    exact = Deployment("optimal", law, TRUSS).values
    for key in ("peak-acceleration", "peak-rope-acceleration", "peak-reaction", "peak-force"):
        assert result.value(key) == pytest.approx(exact[key], rel=1e-5), key


@pytest.mark.slow
def test_small_motion_backwards_is_noise_and_large_is_reported(tmp_path: Path) -> None:
    time, angle = noisy(BEZIER, 1e-3, 1401, seed=3)
    assert (np.diff(angle) < 0).any()
    assert angle.max() > DEPLOYED
    assert check(write(tmp_path / "a.csv", time, angle)).passed

    swing = 0.1 * np.exp(-(((time - 70) / 3) ** 2))
    back = check(write(tmp_path / "b.csv", time, angle + swing))
    assert [c.name for c in back.checks if not c.passed] == ["backward speed"]
    over = check(write(tmp_path / "c.csv", time, angle + 0.02 * (time / T) ** 6))
    failed = [c.name for c in over.checks if not c.passed]
    assert "overshoot beyond 90 deg" in failed
    clean = BEZIER.motion(time).angle
    exact = check(write(tmp_path / "d.csv", time, clean + swing))
    assert [c.name for c in exact.checks if not c.passed] == ["backward motion"]


def test_the_duration_is_the_profiles_own(tmp_path: Path, capsys) -> None:
    law = paper_laws(TRUSS, 25.0)[0].law
    time = np.linspace(3.0, 28.0, 501)  # a log need not start at zero
    path = write(tmp_path / "a.csv", time, law.motion(np.clip(time - 3.0, 0.0, 25.0)).angle)
    words = ["check", str(path), "--friction", "0.01", "--jerk-cap", "bezier", "--no-optimum"]
    assert main(words) == ExitCode.OK
    printed = capsys.readouterr().out
    assert "T = 25 s" in printed
    assert "its time starts at 3 s, which is taken as 0" in printed
    assert main([*words, "--duration", "10..20"]) == ExitCode.NOT_VERIFIED
    assert "FAILED: duration 25 s (asked for 10 to 20 s)" in capsys.readouterr().out


@pytest.mark.parametrize("aims", ['"time"', '["time", "energy"]', "{ time = 1.0, energy = 1e-3 }"])
def test_a_study_of_least_time_lends_its_caps(aims: str, tmp_path: Path, capsys) -> None:
    study = tmp_path / "study.toml"
    study.write_text(f"minimise = {aims}\nduration = [2.0, 200.0]\n[caps]\nspeed = 0.02\n", "utf-8")
    time = np.linspace(0.0, T, 141)
    profile = write(tmp_path / "a.csv", time, BEZIER.motion(time).angle)
    words = ["--no-optimum", "--results", str(tmp_path / "r"), "--no-figures"]
    code = main(["check", str(profile), str(study), *words])
    # the Bezier law reaches 0.0188 rad/s
    assert code == ExitCode.OK
    told = "minimises the time, but the profile takes 140 s" in capsys.readouterr().out
    assert told == ("energy" not in aims)


@pytest.mark.parametrize(
    "part",
    [0.99, pytest.param(1.01, marks=pytest.mark.slow)],
    ids=["drawn above", "drawn below"],
)
def test_a_cap_within_the_noise_is_named_as_not_decided(part: float, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", *noisy(BEZIER, 1e-3, 281, seed=1))
    cap = part * check(path).value("peak-acceleration")
    result = check(path, acceleration=cap)
    assert result.passed
    assert "fails none of" in result.verdict.sentence
    assert "1 is not decided: peak angular acceleration" in result.verdict.sentence
    (open_still,) = [c.sentence for c in result.checks if not c.decided]
    assert open_still.startswith("not decided: peak angular acceleration")
    said = outcome_text(result)
    assert "1 not decided" in said
    assert "verified" not in said
    far = check(path, acceleration=2 * cap)
    assert "passes all" in far.verdict.sentence
    assert "verified: all" in outcome_text(far)


def test_seconds_that_are_headed_ms_are_told_from_the_length(tmp_path: Path, capsys) -> None:
    law, time = paper_laws(TRUSS, 10.0)[0].law, np.linspace(0.0, 10.0, 101)
    path = write(tmp_path / "a.csv", time, law.motion(time).angle, "Time [ms],angle [rad]")
    assert main(["check", str(path), "--no-optimum"]) == ExitCode.BAD_INPUT
    said = " ".join(capsys.readouterr().err.split())
    assert "lasts 0.01 s; most likely the unit of its time column is wrong" in said
    assert "'Time [ms]'" in said


def test_rounding_of_the_digits_counts_as_noise() -> None:
    time = np.linspace(0.0, T, 1401)
    rounded = BEZIER.motion(time).angle.round(5)
    found = estimate_noise(time, rounded, np.ones_like(time))
    assert found.matters
    assert found.step == pytest.approx(1e-5, rel=1e-6)
    assert found.deviation >= 0.999 * 1e-5 / math.sqrt(12)
    exact = estimate_noise(time, BEZIER.motion(time).angle, np.ones_like(time))
    assert not exact.matters


def test_uneven_times_with_gaps_are_recovered() -> None:
    rng = np.random.default_rng(4)
    time = np.sort(
        np.concatenate([[0.0, T], rng.uniform(0.0, 60.0, 400), rng.uniform(66.0, T, 500)])
    )
    angle = STEP5.motion(time).angle + 1e-4 * rng.standard_normal(time.size)
    found = recover(time, angle, np.ones_like(time))
    grid = np.linspace(0.0, T, 501)
    off = found.law.motion(grid).acceleration - STEP5.motion(grid).acceleration
    width = np.interp(grid, *found.band(2))
    rounding = 1e-12  # [rad/s^2]: at both ends, where it is known to rest, the band has no width
    assert (np.abs(off) <= width + rounding).all()


@pytest.mark.slow
def test_a_check_is_stored_and_drawn(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", *noisy(BEZIER, 1e-4, 281, seed=5))
    folder = tmp_path / "results"
    code = main(["check", str(path), "--jerk-cap", "bezier", "--results", str(folder)])
    assert code == ExitCode.OK
    for name in ("rows", "motion", "rope", "force", "overview"):
        assert (folder / f"{name}.png").stat().st_size > 10_000
    record = json.loads((folder / "verification.json").read_text())
    assert record["peaks"]["peak-acceleration"]["high"] > record["values"]["peak-acceleration"]
    assert "optimal" in Result.load(folder).laws


def arm_file(path: Path, columns: dict[str, np.ndarray]) -> str:
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        "%.12g",
        ",",
        header=",".join(columns),
        comments="",
    )
    return str(path)


@pytest.mark.slow
def test_the_arm_is_replayed_by_angles_and_by_torques(tmp_path: Path, capsys) -> None:
    from studies.arm.config import ArmStudy
    from studies.arm.laws.rigid import feed_forward, joint_motion
    from studies.arm.laws.unit_laws import unit_law

    stage = ArmStudy().slew
    law = unit_law("Bezier", stage.duration).law
    time = np.linspace(0.0, stage.duration, 173)
    angle = np.degrees(joint_motion(stage, law, time)[0][0])
    torque = feed_forward(stage, law)(time)[0]

    by_torque = arm_file(tmp_path / "t.csv", {"t [s]": time, "root torque [mNm]": 1e3 * torque})
    folder = tmp_path / "results"
    words = ["--no-optimum", "--no-figures", "--results", str(folder)]
    assert main(["check", by_torque, *words]) == ExitCode.OK
    result = Result.load(folder)
    assert result.kind == "check-arm"
    # the law itself, read every 0.05 s and interpolated
    assert result.value("peak_root_torque") == pytest.approx(
        result.value("peak_root_torque", "Bezier"), rel=1e-3
    )
    assert result.value("residual_energy") == pytest.approx(
        result.value("residual_energy", "Bezier"), rel=0.05
    )

    by_angle = arm_file(tmp_path / "a.csv", {"Time (ms)": 1e3 * time, "root_angle_deg": angle})
    assert main(["check", by_angle, "--no-optimum", "--torque-cap", "3"]) == ExitCode.NOT_VERIFIED
    assert "FAILED: peak root torque" in capsys.readouterr().out
    assert main(["check", by_angle, "--no-optimum", "--drive", "torque"]) == ExitCode.BAD_INPUT
    assert "needs root_torque" in capsys.readouterr().err


@pytest.mark.parametrize("what", ["noise", "overshoot"])
def test_what_is_measured_can_be_read_again_between_its_rows(what: str, tmp_path: Path) -> None:
    time, angle = noisy(BEZIER, 1e-3, 281, seed=3)
    if what == "overshoot":
        angle += 0.02 * np.exp(-((time - 135.0) ** 2))
    path = write(tmp_path / "a.csv", time, angle)
    # rows are at most open and never backwards: between them the law must not be either
    words = ["check", str(path), "--friction", "0.01", "--no-optimum", "--no-figures", "--results"]
    expected = ExitCode.OK if what == "noise" else ExitCode.NOT_VERIFIED
    assert main([*words, str(tmp_path / "r")]) == expected
    # the figures are drawn from the same law at times between the rows
    words = ["export", str(tmp_path / "r"), "--to", "csv", "--step", "0.05", "--output"]
    assert main([*words, str(tmp_path / "o.csv")]) == ExitCode.OK
    if what == "overshoot":
        # held at its stop it rests, where a law through rows that still have a speed would ring
        rows = read_csv((tmp_path / "o.csv").read_text("utf-8"), Dialect())
        stopped = rows["angle"] >= math.pi / 2 - 1e-12
        assert stopped.sum() > 20
        assert np.abs(rows["angular_acceleration"][stopped]).max() < 1e-9


@pytest.mark.slow
def test_a_motion_that_runs_back_is_drawn_with_friction(tmp_path: Path) -> None:
    # without friction it keeps its sense; the figure of the force shows it under friction, too
    time, angle = noisy(BEZIER, 1e-4, 281, seed=3)
    angle += 0.02 * np.exp(-((time - 130.0) ** 2))
    path = write(tmp_path / "a.csv", time, angle)
    words = ["check", str(path), "--no-optimum", "--results", str(tmp_path / "r")]
    assert main(words) == ExitCode.NOT_VERIFIED
    assert (tmp_path / "r" / "force.png").exists()


def test_steep_edges_of_an_export_are_no_noise_and_scatter_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from studies.arm.config import study_from
    from studies.check import arm

    def turned(torque, times: np.ndarray) -> np.ndarray:
        """The angle of a rigid arm [rad], of 100 kg m^2."""
        speed = cumulative_trapezoid(torque(times) / 100.0, times, initial=0.0)
        return np.asarray(cumulative_trapezoid(speed, times, initial=0.0))

    def replayed(measured, motion, study):
        run = SimpleNamespace(
            times=fine, joint_angles=lambda: [turned(motion.joints[0].torque, fine)]
        )
        return SimpleNamespace(run=SimpleNamespace(before=run))

    fine, time = np.linspace(0.0, 8.6, 8601), np.linspace(0.0, 8.6, 173)
    rows = -3.3 * np.sign(time - 4.3) * (time > 0.0) * (time < 8.6)
    angle = np.interp(time, fine, turned(CubicSpline(time, rows, bc_type="clamped"), fine))
    scatter = np.random.default_rng(0).normal(0.0, 0.1, time.size)
    monkeypatch.setattr(arm, "_replayed", replayed)
    study, smoothed = study_from({"stage": "big", "duration": 8.6}), []
    # the angles are those of the torque before it was sampled
    unsampled = angle + 3e-5 * np.sin(np.pi * time / 8.6) ** 2
    for noise, turns in ((0.0, angle), (0.0, unsampled), (scatter, angle)):
        columns = {"time [s]": time, "root_torque [N m]": rows + noise, "root_angle [rad]": turns}
        measured = read_profile(Path(arm_file(tmp_path / "torque.csv", columns)))
        driving = arm._driving(measured, study.slew, None)
        assert driving.smoothed[0]
        by_curve = replayed(
            measured, arm._motion(measured, study.slew, driving, exported=True), study
        )
        smoothed.append(arm._as_exported(measured, study, driving, by_curve)[0].smoothed[0])
    assert smoothed == [False, False, True]
