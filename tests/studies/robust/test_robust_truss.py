"""One law for many trusses: its forces, its rates, what it refuses, and what it finds."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from models.truss import DYNAMIC_SET
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.robust import run, study_from
from studies.robust.config import RobustTrussStudy, as_dictionary
from studies.robust.replay import drawn, rate, replay
from studies.robust.search import _from_all_starts, bounds, search
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import pinned_bezier
from studies.truss.search.motion_search import Search

SLOW = {
    "duration": 140.0,
    "caps": {"jerk": "bezier"},
    "truss": {"pulley_friction": 0.01},
    "solver": {"intervals": 24, "starts": ["bezier"]},
    "robust": {
        "scenarios": {"rough": {"pulley_friction": 0.015}},
        "scatter": {"pulley_friction": {"low": 0.005, "high": 0.015}},
        "draws": 400,
    },
}


def slow(**robust: object) -> RobustTrussStudy:
    return study_from({**SLOW, "robust": {**SLOW["robust"], **robust}})  # type: ignore[dict-item]


def moved(study: RobustTrussStudy, scenario: str = "nominal") -> Deployment:
    truss = study.truss_of(scenario)
    return Deployment("Bezier", pinned_bezier(truss, 140.0), truss)


def test_forces_of_a_scenario_are_those_of_its_own_truss() -> None:
    scenario = {"net_stiffness": 240.0, "joint_friction": 0.3, "linear_density": 0.2}
    study = slow(scenarios={"other": scenario})
    values = np.array([study.values_of(scenario)])
    found, own = replay(moved(study), values), moved(study, "other").values
    # both are refined between samples: this to 1/16 of them, the other to rounding
    assert found.peak[0] == pytest.approx(own["peak-force"], rel=1e-6)
    assert found.least[0] == pytest.approx(own["least-tension"], rel=1e-6)


def test_a_stuck_joint_adds_its_moment_over_the_leverage() -> None:
    """A twin in NumPy without friction of the pulleys, where f = -4 n e'."""
    stuck = {"stuck_moment": 100.0, "stuck_angle_deg": 40.0, "stuck_width_deg": 6.0}
    study = slow(scenarios={"stuck": stuck})
    study = dataclasses.replace(
        study, deployment=dataclasses.replace(study.deployment, truss=DYNAMIC_SET)
    )
    from studies.robust.replay import forces

    deployment = moved(study)
    time = np.linspace(0.0, 140.0, 500)[None]
    free, _ = forces(deployment, time, np.array([study.values_of({})]))
    held, _ = forces(deployment, time, np.array([study.values_of(stuck)]))

    angle, c, d = deployment.law.motion(time[0]).angle, 0.1, 0.15
    root = np.sqrt(d**2 - (c * np.sin(angle)) ** 2)
    slope = -c * np.sin(angle) - c**2 * np.sin(angle) * np.cos(angle) / root
    aside = (np.degrees(angle) - 40.0) / 6.0
    share = np.where(np.abs(aside) < 0.5, np.cos(math.pi * aside) ** 2, 0.0)
    expected = 100.0 * share / (-4 * 24 * slope)
    assert expected.max() > 5.0  # it is felt
    assert held[0] - free[0] == pytest.approx(expected, abs=1e-9)  # rounding of forces of 50 N


def test_the_rate_of_an_analytic_case() -> None:
    """The peak grows with mu, which is uniform: a cap at its 80 % point is broken by a fifth."""
    study = slow(draws=4000)
    deployment = moved(study)
    at = replay(deployment, np.array([study.values_of({"pulley_friction": 0.013})])).peak[0]
    found = rate(int((replay(deployment, drawn(study)).peak > at).sum()), 4000, 0.999)
    assert found.low < 0.2 < found.high

    none = rate(0, 10_000, 0.95)
    assert none.high == pytest.approx(1 - 0.025 ** (1 / 10_000), rel=1e-9)  # closed form
    some = rate(12, 100, 0.9)
    assert some.low == pytest.approx(beta.ppf(0.05, 12, 89), rel=1e-9)


def test_the_draws_are_those_of_the_seed() -> None:
    assert np.array_equal(drawn(slow()), drawn(slow()))
    assert not np.array_equal(drawn(slow()), drawn(slow(seed=2)))
    normal = {"joint_friction": {"mean": 0.1, "deviation": 0.2}}
    assert drawn(slow(scatter=normal)).min() >= 0.0


@pytest.mark.parametrize(
    ("robust", "words"),
    [
        ({"scenarios": {}}, "no scenarios"),
        ({"scenarios": {"a": {"pulley_frictoin": 1}}}, "did you mean"),
        ({"scenarios": {"nominal": {}}}, "always there"),
        ({"scenarios": {"a": {"stuck_moment": 1.0}}}, "acts nowhere"),
        ({"scatter": {"net_stiffness": {"low": 1}}}, "give low and high"),
        ({"confidence": 1.0}, "below 1"),
    ],
)
def test_bad_input_is_one_sentence(robust: dict[str, object], words: str) -> None:
    with pytest.raises(StudyError, match=words):
        slow(**robust)


def test_a_scenario_without_any_law_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The rough truss needs 51 N to stand still on its ridge, the nominal one 40 N."""
    file = tmp_path / "study.toml"
    file.write_text(
        'duration = 140\n[caps]\njerk = "bezier"\nforce = 45\n[truss]\npulley_friction = 0.01\n'
        "[robust.scenarios.rough]\npulley_friction = 0.015\n"
    )
    flags = ["--coarse", "--results", str(tmp_path / "r")]
    assert main(["robust", "truss", str(file), *flags]) == ExitCode.INFEASIBLE
    assert "scenario rough" in capsys.readouterr().err


@pytest.mark.slow
def test_a_scenario_that_prevents_a_law_is_named() -> None:
    """A joint that takes 900 N m cannot be pulled open with 60 N on a rope; the rest needs 40 N."""
    stuck = {"stuck joint": {"stuck_moment": 900.0, "stuck_angle_deg": 40.0}}
    fast = {**SLOW, "duration": 6.0, "caps": {"jerk": "500/T^3", "force": 60.0}}
    with pytest.raises(StudyError, match="none was found for stuck joint alone") as refused:
        search(study_from({**fast, "robust": {"scenarios": stuck}}), silent())
    assert refused.value.exit_code is ExitCode.NOT_SOLVED


def test_the_nominal_scenario_alone_gives_the_optimum_of_the_truss() -> None:
    study = slow()
    found = _from_all_starts(study, ("nominal",), silent())
    own = Search(study.deployment, silent()).run().deployment.values["peak-force"]
    peak = Deployment("", found.law, study.deployment.truss).values["peak-force"]
    # the two prices of smoothness take up to 2e-5 of the peak each
    assert peak == pytest.approx(own, rel=1e-4)


def test_a_coarse_law_meets_the_bound_of_the_worst_scenario(tmp_path: Path) -> None:
    study = slow()
    result = run(study)
    assert result.passed
    worst = next(row for row in result.table if row.key == "worst-force")
    # the static ridge of the rough truss, from its phase plane: a slow law cannot pass below it
    assert worst.bound == pytest.approx(max(bounds(study).values()))
    assert worst.bound <= worst.values["robust"] <= worst.bound * (1 + 1e-4)
    assert result.verdict.kind == "global"
    result.save(tmp_path)
    assert Result.load(tmp_path).details["rates"] == result.details["rates"]
    assert as_dictionary(study_from(as_dictionary(study))) == as_dictionary(study)
