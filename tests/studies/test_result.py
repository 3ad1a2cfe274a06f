"""Results on disk: what is saved is loaded, and nothing else is."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from studies.common import writers
from studies.common.comparison_table import Cost, TableRow, costs_elsewhere
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import open_results, provenance
from studies.common.result import (
    ARRAYS_FILE,
    PARTS,
    RESULT_FILE,
    Criterion,
    Result,
    Series,
    Verdict,
)
from studies.report.words import compared

TABLE = (
    TableRow(
        "peak-force",
        "peak force",
        "N",
        {"optimal": 4.0, "Bezier": 5.0},
        cap=4.5,
        bound=3.9,
        minimised=True,
        better="less",
        broken_by=("Bezier",),
    ),
    TableRow("peak-jerk", "peak jerk", "rad/s^3", {"optimal": math.nan, "Bezier": 0.5}),
)


def example(**changes: object) -> Result:
    """A small result."""
    time = np.linspace(0.0, 5.0, 11)
    fields = {
        "kind": "truss",
        "question": "Which deployment has the least peak force?",
        "configuration": {"minimise": "peak-force", "caps": {"force": 4.5}},
        "arrays": {
            "time": Series("s", "time", time, "since the start"),
            "force": Series("N", "time", np.sin(time)),
        },
        "table": TABLE,
        "bounds": {"peak-force": 3.9},
        "verdict": Verdict("local", "local: best of 2 starts"),
        "checks": (
            Criterion("peak force", "N", 4.0, 4.5, True),
            Criterion("agreement", "", math.nan, math.nan, True, "both replays agree"),
        ),
        "costs_elsewhere": (Cost("work", "work", "J", 3.0, "Bezier", 0.0, math.inf),),
        "remarks": ("The rope's pull limits this motion.",),
        "details": {"rounds": [{"intervals": np.int64(20), "error": math.nan}]},
        "provenance": {"program": "antenna-ocp"},
    }
    return Result(**(fields | changes))  # type: ignore[arg-type]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A complete results folder."""
    opened = open_results(tmp_path / "out", "truss")
    example().save(opened.path)
    return opened.path


def test_what_is_saved_is_loaded(folder: Path) -> None:
    saved, loaded = example(), Result.load(folder)
    assert loaded.as_dictionary() == saved.as_dictionary()
    assert loaded.details == {"rounds": [{"intervals": 20, "error": None}]}
    assert math.isnan(loaded.value("peak-jerk"))
    assert loaded.value("peak-force", "Bezier") == 5.0
    assert math.isinf(loaded.costs_elsewhere[0].ratio)
    assert loaded.table[0] == saved.table[0]
    assert loaded.axis == "time"
    assert loaded.laws == ("optimal", "Bezier")
    assert loaded.passed
    for name, series in saved.arrays.items():
        assert np.array_equal(loaded.arrays[name].values, series.values)
        assert not loaded.arrays[name].values.flags.writeable


def refused(folder: Path) -> str:
    """The one sentence with which a folder is refused."""
    with pytest.raises(StudyError) as caught:
        Result.load(folder)
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def test_a_study_that_did_not_end_is_incomplete(folder: Path) -> None:
    begun = Result.begun("truss", "Which?", {"minimise": "energy"}, {"program": "antenna-ocp"})
    begun.save(folder)
    assert "arrays, table, verdict, checks missing (the study has not ended)" in refused(folder)
    partial = Result.load(folder, partial=True)
    assert partial.missing == PARTS
    assert partial.configuration == {"minimise": "energy"}
    assert partial.verdict.kind == "none"
    assert not partial.passed


def test_a_folder_without_its_record_gives_nothing_but_says_so(folder: Path) -> None:
    (folder / RESULT_FILE).unlink()
    assert f"incomplete, {RESULT_FILE} missing" in refused(folder)
    assert Result.load(folder, partial=True).missing == (RESULT_FILE, *PARTS)


def test_a_result_without_its_arrays_is_incomplete(folder: Path) -> None:
    (folder / ARRAYS_FILE).unlink()
    assert f"incomplete, {ARRAYS_FILE} missing" in refused(folder)
    partial = Result.load(folder, partial=True)
    assert partial.missing == (ARRAYS_FILE,)
    assert partial.value("peak-force") == 4.0
    assert not partial.arrays


def test_a_lost_series_is_named(folder: Path) -> None:
    np.savez(folder / ARRAYS_FILE, force=np.zeros(11))
    assert "series time" in refused(folder)
    assert Result.load(folder, partial=True).missing == ("series time", "series force")


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        StudyError, match=r"cannot be written into .*nowhere \(No such file"
    ) as caught:
        example().save(tmp_path / "nowhere")
    assert caught.value.exit_code == ExitCode.NO_RESULTS_FOLDER


def test_a_foreign_folder_is_refused_even_in_part(tmp_path: Path) -> None:
    assert "there is no results folder" in refused(tmp_path / "nowhere")
    assert "is no results folder of antenna-ocp" in refused(tmp_path)
    (tmp_path / RESULT_FILE).write_text(json.dumps({"schema": 1, "kind": "truss"}))
    assert "was not written by antenna-ocp" in refused(tmp_path)
    with pytest.raises(StudyError, match="was not written by"):
        Result.load(tmp_path, partial=True)


@pytest.mark.parametrize("partial", [False, True])
def test_another_version_is_refused(folder: Path, partial: bool) -> None:
    record = json.loads((folder / RESULT_FILE).read_text())
    (folder / RESULT_FILE).write_text(json.dumps(record | {"schema": 99}))
    with pytest.raises(StudyError, match="has the format 99, this version reads 1"):
        Result.load(folder, partial=partial)


@pytest.mark.parametrize(
    "record",
    [
        "no json",
        '{"program": "antenna-ocp", "schema": 1, "kind": "truss"}',
        '{"program": "antenna-ocp", "schema": 1, "kind": "a", "question": "", "configuration": {}, '
        '"verdict": {"kind": "sure", "sentence": ""}}',
        '{"program": "antenna-ocp", "schema": 1, "kind": "a", "question": "", "configuration": {}, '
        '"colour": "red"}',
    ],
)
def test_a_damaged_record_is_refused(folder: Path, record: str) -> None:
    (folder / RESULT_FILE).write_text(record)
    assert "damaged or was changed" in refused(folder)


class Ran:
    """Would say so if it were ever unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return pytest.fail, ("loading a result ran code",)


@pytest.mark.parametrize("partial", [False, True])
def test_objects_among_the_arrays_are_not_unpickled(folder: Path, partial: bool) -> None:
    objects = np.empty(11, dtype=object)
    objects[:] = Ran()
    np.savez(folder / ARRAYS_FILE, allow_pickle=True, time=np.zeros(11), force=objects)
    with pytest.raises(StudyError, match="damaged or was changed"):
        Result.load(folder, partial=partial)


def test_arrays_that_do_not_fit_their_axis_are_refused(folder: Path) -> None:
    np.savez(folder / ARRAYS_FILE, time=np.zeros(11), force=np.zeros(7))
    assert "force has 7 values, its axis time 11" in refused(folder)
    (folder / ARRAYS_FILE).write_bytes(b"PK\x03\x04 and no more")
    assert "damaged or was changed" in refused(folder)


def test_a_quantity_or_law_that_is_not_there_is_told_apart(folder: Path) -> None:
    result = Result.load(folder)
    with pytest.raises(StudyError, match="has no quantity 'peak-forse'; it has peak-force"):
        result.value("peak-forse")
    with pytest.raises(StudyError, match="no peak-force of a law 'bezier'; its laws are optimal"):
        result.value("peak-force", "bezier")


def row(key: str, better: str, **values: float) -> TableRow:
    """One row of a table."""
    return TableRow(key, key, "1", values, better=better)  # type: ignore[arg-type]


def test_costs_are_those_above_ten_percent_the_dearest_first() -> None:
    table = (
        row("force", "less", own=10.9, a=10.0, b=30.0),  # 9 %: no cost
        row("work", "less", own=12.0, a=10.0, b=11.0),
        row("jerk", "less", own=200.0, a=math.nan, b=10.0),
        row("tension", "more", own=-1.0, a=2.0, b=4.0),
        row("slack", "more", own=-5.0, a=-2.0, b=-1.0),  # no baseline is any good either
        row("time", "neither", own=9.0, a=1.0, b=1.0),
        row("speed", "less", own=math.nan, a=1.0, b=1.0),
    )
    costs = costs_elsewhere(table)
    assert [(cost.key, cost.baseline) for cost in costs] == [
        ("tension", "b"),
        ("jerk", "b"),
        ("work", "a"),
    ]
    assert [cost.ratio for cost in costs] == [math.inf, 20.0, 1.2]
    assert costs[1].sentence == "jerk is 20 times that of b: 200 instead of 10"
    assert "greater than any multiple" in costs[0].sentence


def test_what_is_as_good_as_none_is_no_cost() -> None:
    small = dataclasses.replace(row("loss", "less", own=2e-10, a=1e-13), negligible=1e-6)
    assert costs_elsewhere((small,)) == ()
    (cost,) = costs_elsewhere((dataclasses.replace(small, values={"own": 3e-6, "a": 1e-13}),))
    assert cost.ratio == pytest.approx(3.0)


def test_a_cost_of_what_should_be_large_is_a_part() -> None:
    (cost,) = costs_elsewhere((row("tension", "more", own=0.5, a=2.0, b=4.0),))
    assert cost.ratio == 8.0
    assert cost.sentence == "tension is 1/8 of that of b: 0.5 instead of 4"


def test_motions_that_were_found_too_are_no_laws_to_compare_with() -> None:
    table = (row("force", "less", knee=12.0, end=4.0, a=10.0),)
    (cost,) = costs_elsewhere(table, ("end",))
    assert (cost.baseline, cost.ratio) == ("a", 1.2)

    front = dataclasses.replace(
        example(), table=table, also_found=("end",), costs_elsewhere=(cost,)
    )
    assert front.compared_with == ("a",)
    alone = dataclasses.replace(front, also_found=("end", "a"), costs_elsewhere=())
    assert not compared(alone)
    assert "costs elsewhere" in writers.outcome_text(front)
    assert "costs elsewhere" not in writers.outcome_text(alone)


def test_every_result_can_be_written(tmp_path: Path) -> None:
    opened = open_results(tmp_path / "out", "truss")
    writers.write(example(), opened)
    names = {"table.txt", "profile.csv", "profile.json", "verification.json", RESULT_FILE}
    assert {path.name for path in opened.path.iterdir()} >= names
    text = (opened.path / "profile.csv").read_text()
    assert "# study.caps.force = 4.5" in text
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    assert rows[0] == "time [s],force [N]"
    assert rows[1] == "0.0,0.0"
    assert len(rows) == 12
    columns = json.loads((opened.path / "profile.json").read_text("utf-8"))["columns"]
    assert columns["force"]["unit"] == "N"
    assert len(columns["force"]["values"]) == 11
    record = json.loads((opened.path / "verification.json").read_text())
    assert record["values"] == {"peak-force": 4.0, "peak-jerk": None}
    assert record["passed"]


def test_the_report_says_all_and_the_worst_cost_first() -> None:
    lines = writers.report_text(example(provenance=provenance())).splitlines()
    assert lines[0] == "question: Which deployment has the least peak force?"
    assert lines[2].startswith("ATTENTION: work is greater than any multiple")
    text = "\n".join(lines)
    for words in ("* peak force [N]", "5 !", "verdict: local", "both replays agree", "made = "):
        assert words in text
    incomplete = writers.report_text(example(missing=("arrays",), arrays={}))
    assert "incomplete, missing: arrays" in incomplete


def test_the_exit_code_follows_from_the_result() -> None:
    assert writers.exit_code(example()) == ExitCode.OK
    assert writers.exit_code(example(interrupted=True)) == ExitCode.INTERRUPTED
    unverified = example(verdict=Verdict("unverified", "unverified: off by 1"))
    assert writers.exit_code(unverified) == ExitCode.NOT_VERIFIED
    failed = example(checks=(Criterion("peak force", "N", 5.0, 4.5, False),))
    assert writers.exit_code(failed) == ExitCode.NOT_VERIFIED
    assert "FAILED: peak force 5 N (limit 4.5)" in writers.outcome_text(failed)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("question",), None),
        (("remarks", 0), 3),
        (("table", 0, "bound"), {}),
        (("costs_elsewhere", 0, "value"), "x"),
        (("verdict",), []),
        (("arrays",), [1]),
        (("missing",), 7),
        (("checks", 0, "passed"), 1),
    ],
)
def test_a_field_of_the_wrong_type_is_refused(
    folder: Path, place: tuple[str | int, ...], value: object
) -> None:
    record = json.loads((folder / RESULT_FILE).read_text())
    inner = record
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    (folder / RESULT_FILE).write_text(json.dumps(record))
    assert "damaged or was changed" in refused(folder)
