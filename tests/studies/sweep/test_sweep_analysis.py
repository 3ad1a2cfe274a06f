"""Warm starts from a neighbour's motion, Sobol indices, tables and figures of sweeps."""

import csv
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.cli import main
from studies.common.comparison_table import TableRow
from studies.common.configuration import toml_text
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result, Series, Verdict
from studies.report import words
from studies.sweep.figures import draw, shown
from studies.sweep.indices import saltelli_points, sobol_indices
from studies.truss import TrussStudy, run
from studies.truss.config import DEPLOYED
from studies.truss.motions.laws import law_of_result
from studies.truss.motions.starts import from_neighbour

COARSE = {"intervals": 12, "starts": ["bezier"]}


@pytest.fixture(scope="module")
def neighbour() -> Result:
    return run(TrussStudy(minimise="peak-acceleration", caps={"jerk": "bezier"}, solver=COARSE))


def test_a_neighbour_is_stretched_to_stroke_and_duration(neighbour: Result) -> None:
    study = TrussStudy(
        minimise="peak-acceleration",
        duration=70.0,
        caps={"jerk": "bezier"},
        truss={"stowed_angle_deg": 20.0},
    )
    start = from_neighbour(law_of_result(neighbour), study)
    assert start.duration == 70.0
    times = np.linspace(0.0, 70.0, 20001)
    angle, speed = start.angle(times), start.speed(times)
    assert angle[0] == pytest.approx(study.truss.stowed_angle, abs=1e-9)
    assert angle[-1] == pytest.approx(DEPLOYED, abs=1e-9)
    # rates fit the angle: central differences of 3.5 ms err by the jerk times h^2 / 6
    assert np.gradient(angle, times)[1:-1] == pytest.approx(speed[1:-1], abs=1e-8)
    rate = np.gradient(speed, times)[1:-1]
    assert rate == pytest.approx(start.acceleration(times)[1:-1], abs=1e-6)


@pytest.mark.slow
def test_a_study_from_a_neighbour_has_the_same_optimum(neighbour: Result) -> None:
    study = TrussStudy(
        minimise="peak-acceleration", duration=150.0, caps={"jerk": "bezier"}, solver=COARSE
    )
    warm, cold = run(study, neighbour=neighbour), run(study)
    assert [start["start"] for start in warm.details["starts"]] == ["neighbour"]
    assert warm.verdict.kind == cold.verdict.kind == "global"
    # both within the gap at which the bound counts as met
    value = "peak-acceleration"
    assert warm.value(value) == pytest.approx(cold.value(value), rel=1e-8)


def test_indices_are_the_shares_of_a_sum() -> None:
    keys = ["a", "b", "c"]
    points = saltelli_points(keys, 512, 3)
    assert points.shape == (512 * 5, 3)
    # variances of 3 a and of b are as 9 to 1; c does nothing
    found, sentence = sobol_indices(
        keys, {"sum": 3 * points[:, 0] + points[:, 1], "flat": np.ones(len(points))}, 3
    )
    assert sentence == ""
    assert list(found) == ["sum"]
    # of 512 samples: within their interval, which is a few hundredths
    assert found["sum"]["first"]["a"] == pytest.approx(0.9, abs=0.05)
    assert found["sum"]["total"]["b"] == pytest.approx(0.1, abs=0.03)
    assert found["sum"]["total"]["c"] == pytest.approx(0.0, abs=1e-12)


def test_indices_are_refused_where_a_case_has_no_solution() -> None:
    points = saltelli_points(["a", "b"], 8, 0)
    values = points.sum(axis=1)
    values[3] = np.nan
    found, sentence = sobol_indices(["a", "b"], {"sum": values}, 0)
    assert found == {}
    assert sentence.startswith("1 cases have no solution")
    with pytest.raises(StudyError, match="need a power of two, such as 16"):
        saltelli_points(["a", "b"], 12, 0)


FALL: dict[str, Any] = {
    "duration": 0.05,
    "gravity": [0.0, -9.81],
    "elements": 1,
    "samples": 11,
    "frequencies": 0,
    "mesh_check": False,
    "link": [
        {"length": 1.2, "area": 1.8e-3, "second_moment": 1e-8, "modulus": 2e9, "density": 5e3}
    ],
    "joint": [{"kind": "free", "start_deg": 0.0}],
}
LENGTHS, ANGLES = {"low": 1.0, "high": 1.4}, {"low": -30.0, "high": 30.0}
SWEEPS: dict[str, tuple[dict[str, Any], int, set[str]]] = {
    "grid": (
        {"parameters": {"link.0.length": [1.0, 1.1, 1.2], "joint.0.start_deg": [0.0, 5.0, -1.0]}},
        9,
        {"curves", "heat_map"},
    ),
    "words": (
        {"parameters": {"form": ["minimal", "index-1"], "link.0.length": [1.0, -1.0]}},
        4,
        {"curves"},
    ),
    "one-at-a-time": (
        {"parameters": {"link.0.length": [1.0, 1.4], "joint.0.start_deg": [-5.0, 5.0]}},
        5,
        {"tornado"},
    ),
    "sobol-indices": (
        {"parameters": {"link.0.length": LENGTHS, "joint.0.start_deg": ANGLES}, "samples": 4},
        16,
        {"points", "sobol_indices"},
    ),
}


@pytest.fixture(scope="module", params=SWEEPS)
def swept(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, int, set[str]]:
    """The folder of a sweep, how many cases it has, and its figures."""
    content, count, figures = SWEEPS[request.param]
    sampling = "grid" if request.param == "words" else request.param
    folder = tmp_path_factory.mktemp("sweep")
    text = toml_text(
        {"subject": "flex", "sampling": sampling, "show": ["tip_x"], **content, "base": FALL}
    )
    (folder / "sweep.toml").write_text(text, "utf-8")
    flags = ["--results", str(folder / "out"), "--no-figures"]
    if find_spec("pyarrow"):
        flags.append("--parquet")
    assert main(["sweep", str(folder / "sweep.toml"), *flags]) == ExitCode.OK
    return folder / "out", count, figures


def test_every_sampling_has_table_result_and_figures(swept: tuple[Path, int, set[str]]) -> None:
    out, count, figures = swept
    with (out / "cases.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == count
    result = Result.load(out)
    assert result.passed
    assert shown(result) == ["tip_x"]
    assert {name for name, _ in draw(result)} == figures

    # a long question is broken into lines that fit
    long = replace(result, question=f"{result.question}, {', '.join(50 * ['a-further-key'])}")
    for _, figure in draw(long):
        figure.draw_without_rendering()
        head = figure._suptitle.get_window_extent()
        assert head.x0 >= 0
        assert head.x1 <= figure.bbox.width

    # the table is of the files: case by case the number of the result
    for row, value in zip(rows, result.arrays["tip_x"].values, strict=True):
        if row["status"] == "solved":
            assert float(row["tip_x [m]"]) == value
        else:
            assert row["status"] == "refused"
            assert "length is -1.0" in row["reason"]
            assert np.isnan(value)


def test_the_parquet_table_is_the_csv_table(swept: tuple[Path, int, set[str]]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out, count, _ = swept
    table = parquet.read_table(out / "cases.parquet")
    with (out / "cases.csv").open(encoding="utf-8", newline="") as file:
        head, *lines = list(csv.reader(file))
    assert table.column_names == head
    assert table.num_rows == count == len(lines)
    place = head.index("tip_x [m]")
    texts = ["" if value is None else repr(value) for value in table["tip_x [m]"].to_pylist()]
    assert texts == [line[place] for line in lines]


def test_the_report_of_a_sweep_is_a_page(
    swept: tuple[Path, int, set[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    out, count, figures = swept
    assert main(["report", str(out)]) == ExitCode.OK
    assert f"of {count} cases are solved and verified" in capsys.readouterr().out
    text = (out / "report.html").read_text("utf-8")
    result = Result.load(out)
    assert text.count('src="data:image/png;base64,') == len(figures)
    assert "The arrays are missing" not in text
    # least, median and greatest are no laws beside each other
    assert "of the other laws" not in text
    said = " ".join(words.answer(result))
    assert "The x of the tip at the end lies between " in said or count == 4  # two of which refused
    assert "The minimum is at " in said or count == 4


def test_the_least_of_many_cases_is_told_with_all_that_are_as_low() -> None:
    values = np.array([3.0, 1.0, 1.0 + 1e-9, np.nan])
    case = Series("1", "case", np.arange(1.0, 5.0), "number of the case")
    row = TableRow("force", "force", "N", {"least": 1.0, "median": 1.0, "greatest": 3.0})
    result = Result(
        kind="sweep",
        question="?",
        configuration={"parameters": {"duration": [], "kind": []}},
        arrays={"case": case, "force": Series("N", "case", values, "force")},
        table=(row,),
        verdict=Verdict("local", "3 of 4 cases are solved"),
        details={
            "points": [[5.0, "a"], [6.0, "a"], [6.0, "b"], [None, None]],
            "units": {"duration": "s"},
        },
    )
    assert words.answer(result) == [
        "The force lies between 1 and 3 N. The minimum is at duration = 6 s, kind = a, with "
        "the same value in 1 more."
    ]
    assert not words.compared(result)
    assert words.rests_on(result)[0].startswith("Each case is the best of its starts.")


def test_a_tornado_without_its_middle_says_so() -> None:
    values = np.array([np.nan, 1.0, 2.0])
    case = Series("1", "case", np.arange(1.0, 4.0), "number of the case")
    result = Result(
        kind="sweep",
        question="?",
        configuration={"parameters": {"duration": [5.0, 6.0]}, "sampling": "one-at-a-time"},
        arrays={"case": case, "force": Series("N", "case", values, "force")},
        verdict=Verdict("local", "2 of 3 cases are solved"),
        details={
            "statuses": ["hung", "solved", "solved"],
            "titles": {"force": ["force", "N"]},
            "minimised": ["force"],
            "points": [[None], [5.0], [6.0]],
            "units": {"duration": "s"},
        },
    )
    ((name, figure),) = draw(result)
    assert name == "tornado"
    (panel,) = figure.axes
    assert "the base study has no solution" in panel.texts[0].get_text()
    assert not panel.patches
