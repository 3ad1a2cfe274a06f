"""Co-design: what it refuses, what it finds, and whether its prices are true."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import pytest

from ocp import Audit, Interrupted, Solution, audit, solve
from studies.cli import main
from studies.codesign import CodesignStudy, run, search, study_from
from studies.codesign.config import as_dictionary
from studies.codesign.prices import Price, stored_prices
from studies.codesign.requirements import check_some_design, requirements
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import plain
from studies.common.result import Result
from studies.truss.search import from_starts

# the paper's slow deployment: its least force is the static ridge, as good as exactly
SLOW = {
    "minimise": "peak-force",
    "duration": 140.0,
    "caps": {"jerk": "bezier"},
    "truss": {"pulley_friction": 0.01},
    "solver": {"intervals": 24, "starts": ["bezier"]},
    "design": {"starts": 1},
}


def slow(**design: object) -> CodesignStudy:
    return study_from({**SLOW, "design": {**SLOW["design"], **design}})  # type: ignore[dict-item]


def accuracies_of(patch: pytest.MonkeyPatch, *, stops: bool = False) -> list[float]:
    """Accuracies that solves are asked for from now on; a user may stop the last one."""
    asked = []

    def all_starts(*given: Any, **how: Any) -> Audit:
        if "processes" in how:  # else of the stated design, for its own motion
            asked.append(how["settings"].accuracy.objective)
        return audit(*given, **how)

    def the_best(*given: Any, **how: Any) -> Solution:
        asked.append(how["settings"].accuracy.objective)
        if stops:
            raise Interrupted("stopped", None, None, None)
        return solve(*given, **how)

    patch.setattr(from_starts, "audit", all_starts)
    patch.setattr(search, "solve", the_best)
    return asked


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[float]]:
    """A coarse co-design, run as a user runs it, and the accuracies that it asked for."""
    path = tmp_path_factory.mktemp("codesign") / "found"
    flags = "--objective peak-force --duration 140 --jerk-cap bezier --friction 0.01"
    flags += f" --intervals 24 --starts bezier --designs 1 --results {path} --no-figures"
    with pytest.MonkeyPatch.context() as patch:
        asked = accuracies_of(patch)
        assert main(["codesign", *flags.split()]) == 0
    return path, asked


@pytest.fixture
def folder(coarse: tuple[Path, list[float]]) -> Path:
    return coarse[0]


@pytest.mark.slow
def test_the_result_is_verified_and_beats_the_stated_design(folder: Path) -> None:
    result = Result.load(folder)
    assert result.passed
    assert result.verdict.kind == "local"
    # the static ridge of the stated truss is 39.644 N (mu = 0.01); that of the vertex 38.378 N
    assert result.value("peak-force", "given design") == pytest.approx(39.645, rel=2e-4)
    assert result.value("peak-force") == pytest.approx(38.379, rel=2e-4)
    assert any(
        "Active bounds determine this design: 4 bounds" in remark for remark in result.remarks
    )


@pytest.mark.slow
def test_requirements_of_the_stated_design_are_kept(folder: Path) -> None:
    result = Result.load(folder)
    # 17.94 N and 39.644 N: the statics of the dynamic set at mu = 0.01
    assert result.value("holding-force") == pytest.approx(17.9404, rel=1e-6)
    for key in ("stroke-of-the-rope", "stowed-height"):
        row = next(row for row in result.table if row.key == key)
        assert row.cap is not None
        assert row.values["optimal"] <= row.cap * (1 + 1e-6)


@pytest.mark.slow
def test_the_vertex_is_where_its_four_bounds_cross(folder: Path) -> None:
    """Link and stiffness at their limits; crank and free length solve stroke and holding force."""
    design = Result.load(folder).details["design"]
    assert design["link"] == pytest.approx(0.195, rel=1e-6)
    assert design["spring_stiffness"] == pytest.approx(130.0, rel=1e-6)
    c, d = design["crank"], design["link"]
    open_distance = (d**2 - c**2) ** 0.5
    # k1 (l0 - e) is that of the stated truss, 100 (0.3 - sqrt(0.15^2 - 0.1^2))
    squeeze = 100 * (0.3 - (0.15**2 - 0.1**2) ** 0.5)
    assert 130 * (design["spring_free_length"] - open_distance) == pytest.approx(squeeze, rel=1e-5)


@pytest.mark.slow
def test_report_and_export_take_the_design_that_was_found(folder: Path) -> None:
    assert main(["report", str(folder)]) == 0
    table = folder.parent / "motion.csv"
    assert main(["export", str(folder), "--to", "csv", "--output", str(table)]) == 0
    # the rope of the found design: 2 n (e + b) with e = c cos + sqrt(d^2 - c^2 sin^2) when open
    design = Result.load(folder).details["design"]
    open_distance = (design["link"] ** 2 - design["crank"] ** 2) ** 0.5
    last = [row for row in table.read_text().splitlines() if row and row[0].isdigit()][-1]
    assert float(last.split(",")[1]) == pytest.approx(48 * (open_distance + 0.45), rel=1e-8)


@pytest.mark.slow
def test_prices_are_a_table(folder: Path) -> None:
    rows = (folder / "prices.csv").read_text().splitlines()
    assert rows[0].startswith("bound,side,limit,unit,price")
    assert {row.split(",")[0] for row in rows[1:5]} == {
        "stroke of the rope",
        "holding force",
        "link",
        "spring stiffness",
    }


def test_the_resolved_study_states_itself_again() -> None:
    study = slow(range=0.2, stroke=6.5)
    assert as_dictionary(study_from(as_dictionary(study))) == as_dictionary(study)


@pytest.mark.parametrize(
    ("design", "caps", "sentence"),
    [
        (
            {"holding_force": 60.0},
            {},
            r"holding force of at least 60 N: the most found is 4\d\.\d+ N",
        ),
        (
            {"stowed_height": 0.3},
            {},
            r"stowed height of at most 0\.3 m.*: the least found is 0\.349",
        ),
        ({"stroke": 3.0}, {}, r"stroke of the rope of at most 3 m.*: the least found is \d"),
        (
            {},
            {"bar_force": 130.0},
            r"bar in slow motion of at most 130 N together with holding force",
        ),
        pytest.param(
            {},
            {"force": 38.0},
            r"rope force in slow motion of at most 38 N together with.*found is 38\.3",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_contradictory_bounds_are_refused_with_what_works(
    design: dict[str, object], caps: dict[str, float], sentence: str
) -> None:
    raw = {**SLOW, "caps": {"jerk": "bezier", **caps}, "design": design}
    study = study_from(raw)
    with pytest.raises(StudyError, match=sentence) as refused:
        check_some_design(study, requirements(study))
    assert refused.value.exit_code is ExitCode.NOT_SOLVED


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        ({"design": {"free": ["lnk"]}}, "did you mean link"),
        ({"design": {"free": ["link", "link"]}}, "names link twice"),
        ({"design": {"range": 1.5}}, r"design.range is 1.5; give a fraction below 1"),
        ({"design": {"strok": 5}}, "did you mean design.stroke"),
        ({"minimise": "energy"}, "minimises one of peak-force, peak-factored-force"),
        ({"minimise": "peak-factored-force"}, "needs the margins"),
    ],
)
def test_bad_input_is_one_sentence(raw: dict[str, object], sentence: str) -> None:
    with pytest.raises(StudyError, match=sentence):
        study_from({**SLOW, **raw})


@pytest.mark.slow
def test_a_price_is_the_slope_of_the_optimum(folder: Path) -> None:
    """One per cent more stroke, solved again: the price holds to the curvature of 1 %."""
    first = Result.load(folder)
    price = next(p for p in first.details["prices"] if p["title"] == "stroke of the rope")
    step = 0.01 * price["limit"]
    again = run(slow(stroke=price["limit"] + step))
    slope = (again.value("peak-force") - first.value("peak-force")) / step
    assert slope == pytest.approx(price["price"], rel=0.02)


@pytest.mark.slow
def test_only_the_best_start_is_solved_to_its_last_digits(
    coarse: tuple[Path, list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Starts are rough; where the last solve ends early, the rough one stays, and it is said."""
    asked = accuracies_of(monkeypatch, stops=True)
    stopped, whole = run(slow()), Result.load(coarse[0])
    assert asked == coarse[1] == [1e-5, 1e-6]
    for result, stops in ((stopped, True), (whole, False)):
        assert result.interrupted == stops
        assert any("solved to full accuracy" in remark for remark in result.remarks) == stops
        assert result.value("peak-force") == pytest.approx(38.379, rel=2e-4)


@pytest.mark.slow
def test_the_design_is_the_same_for_any_number_of_processes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("studies.common.console.QUIET", 0.0)  # all lines are shown
    found = []
    for processes in (1, 2):
        monkeypatch.setattr("studies.codesign.search.allowed_processes", lambda n=processes: n)
        found.append(run(slow(starts=2), Console()))
        told = capsys.readouterr().err
        assert all(f"start {k} of 2 ({name}" in told for k, name in ((1, "given"), (2, "design")))
    one, two = ({k: a.values.tolist() for k, a in result.arrays.items()} for result in found)
    assert one == two


@pytest.mark.slow
def test_factored_force_with_the_margins_of_a_standard() -> None:
    study = slow()
    raw = {**as_dictionary(study), "minimise": "peak-factored-force"}
    result = run(study_from({**raw, "margin": {"preset": "aiaa-s-114"}}))
    assert result.passed
    need = result.value("peak-factored-force"), result.value("peak-factored-force", "given design")
    assert need[0] < 0.99 * need[1]


def test_a_study_of_python_is_checked_too() -> None:
    study = slow()
    with pytest.raises(StudyError, match="minimises one of"):
        dataclasses.replace(
            study, deployment=dataclasses.replace(study.deployment, minimise="energy")
        )


def test_a_price_without_a_number_is_said_and_stored_as_one() -> None:
    """Where several limits fix the optimum none can be moved alone, and the slope is infinite."""
    note = "several limits are active together: the active set is about to change"
    record = {"title": "crank", "unit": "m", "side": "upper", "limit": 0.13, "price": math.inf}
    price = Price(**record, of_the_design=True, note=note)
    assert price.sentence == f"crank, at most 0.13 m: its shadow price is undefined, because {note}"
    stored = plain(dataclasses.asdict(price))  # as details hold it
    assert stored_prices([stored]).splitlines()[1] == "crank,upper,0.13,m,,"  # type: ignore[list-item]
