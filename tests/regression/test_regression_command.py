"""The regression command: one cheap case through a process of its own, and made-up comparisons."""

import dataclasses
import json
import sys
from pathlib import Path

import pytest

from benchmarks import regression
from benchmarks.comparison import compare, comparison_table
from benchmarks.processes import FreshProcess
from benchmarks.records import Record, RecordFile, provenance, read_records

SOLVED = Record("one", 2.0, 1e-5, 3, 100, 1.0, checks=4, failed_checks=("slope",), verdict="local")
OTHER = Record("two", 5.0, 1e-5, 2, 50, 1.0, checks=2)


def changed(**fields: object) -> dict[str, Record]:
    """Both records, the first one with other fields."""
    return {"one": dataclasses.replace(SOLVED, **fields), "two": OTHER}  # type: ignore[arg-type]


def test_a_case_is_solved_kept_and_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "today.json"
    assert regression.main(["bryson_denham", "--output", str(output)]) == 0
    record = read_records(output).records["bryson_denham"]
    assert record.value == pytest.approx(4.0, rel=record.tolerance)  # 4/(9 l) with l = 1/9
    assert record.iterations >= record.rounds >= 1
    assert record.checks > 0
    assert record.failed_checks == ()
    assert "bryson_denham" in capsys.readouterr().out

    # what is kept is not solved again, and equals itself
    monkeypatch.setattr(regression, "solved_apart", pytest.fail)
    arguments = ["bryson_denham", "--output", str(output), "--against", str(output)]
    assert regression.main(arguments) == 0
    assert "nothing became worse" in capsys.readouterr().out


def test_a_crash_is_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(regression, "names", lambda: ("no_such_case",))
    output = tmp_path / "today.json"
    assert regression.main(["--output", str(output)]) == 1
    assert "KeyError" in read_records(output).records["no_such_case"].failure


@pytest.mark.parametrize("asked", [None, "SkylakeX"])
def test_all_machines_count_iterations_with_the_same_kernels(
    asked: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[dict[str, str]] = []

    def process(command: tuple[str, ...], environment: dict[str, str]) -> FreshProcess:
        given.append(environment)
        return FreshProcess((sys.executable, "-c", ""))

    monkeypatch.setattr(regression, "FreshProcess", process)
    monkeypatch.delenv("OPENBLAS_CORETYPE", raising=False)
    if asked is not None:
        monkeypatch.setenv("OPENBLAS_CORETYPE", asked)
    assert regression.main(["bryson_denham"]) == 1
    assert given[0]["OPENBLAS_CORETYPE"] == (asked or "Haswell")


def test_records_of_another_commit_are_not_continued(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "today.json"
    RecordFile({**provenance(), "commit": "another"}, {}).write(output)
    assert regression.main(["bryson_denham", "--output", str(output)]) == 2
    assert "--fresh" in capsys.readouterr().err
    monkeypatch.setattr(regression, "solved_apart", lambda name: SOLVED)
    monkeypatch.setattr(regression, "names", lambda: ("one",))
    assert regression.main(["--output", str(output), "--fresh"]) == 0


@pytest.mark.parametrize("content", ["", "[]", '{"records": 1}', '{"records": [{}]}'])
def test_a_foreign_file_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str
) -> None:
    file = tmp_path / "foreign.json"
    file.write_text(content, "utf-8")
    assert regression.main(["bryson_denham", "--against", str(file)]) == 2
    assert "holds no records" in capsys.readouterr().err
    assert regression.main(["no_such_case"]) == 2


def test_what_stays_within_its_tolerance_passes() -> None:
    after = changed(value=2.0 * (1 + 9e-6), iterations=107, failed_checks=())
    comparison = compare(changed(), after)
    assert comparison.complaints == ()
    assert comparison.iterations == (150, 157)
    assert "150 -> 157 (+4.7 %)" in str(comparison_table(comparison))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"value": 2.0 * (1 + 2e-5)}, "differs by +2.0e-05"),
        ({"value": 2.0 * (1 - 2e-5)}, "differs by -2.0e-05"),
        ({"value": float("nan")}, "differs by +nan"),
        ({"iterations": 110}, "+6.7 % above 150"),
        ({"failed_checks": ("slope", "replay")}, "lost replay"),
        ({"failed_checks": ("replay",)}, "lost replay"),
        ({"checks": 3}, "2 checks pass, 3 before"),
        ({"value": None, "failure": "a crash"}, "no answer any more: a crash"),
    ],
)
def test_what_became_worse_is_said(fields: dict[str, object], words: str) -> None:
    complaints = compare(changed(), changed(**fields)).complaints
    assert len(complaints) == 1
    assert words in complaints[0]


def test_cases_of_one_side_are_named() -> None:
    comparison = compare({"one": SOLVED}, {"two": OTHER})
    assert comparison.missing == ("one", "two")
    assert "on one side only: one, two" in str(comparison_table(comparison))


def test_records_keep_every_digit(tmp_path: Path) -> None:
    record = dataclasses.replace(SOLVED, value=1 / 3)
    file = tmp_path / "records.json"
    RecordFile({"commit": "c"}, {"one": record}).write(file)
    assert read_records(file) == RecordFile({"commit": "c"}, {"one": record})
    assert json.loads(file.read_text("utf-8"))["records"][0]["value"] == 1 / 3


@pytest.mark.slow
def test_an_arm_is_a_case(tmp_path: Path) -> None:
    # a stage is solved and refined by a study, whose solution is what is compared
    output = tmp_path / "today.json"
    assert regression.main(["arm_small", "--output", str(output)]) == 0
    record = read_records(output).records["arm_small"]
    # source: 0.69835 N m, as the committed records have it
    assert record.value == pytest.approx(0.69835, rel=1e-4)
