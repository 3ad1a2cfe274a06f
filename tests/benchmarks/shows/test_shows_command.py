"""Shows: each case a process and a row, killed runs go on, failures are rows with a reason."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from benchmarks.records import ROOT, provenance
from benchmarks.shows import show as shows
from benchmarks.shows.__main__ import main
from benchmarks.shows.show import SHOWS, show
from studies.common.console import Table

THIS = "benchmarks.shows.truss_random"


class Counting:
    """A show whose cases are counted; its second fails, its third is interrupted the first time."""

    LINE, LIMIT = "a show for tests", 20.0

    def question(self, seed: int, index: int) -> dict[str, Any]:
        return {"asked": 100 * seed + index}

    def tables(self, rows: Sequence[Any]) -> list[Table]:
        cells = [(str(row["asked"]), str(row.get("answered")), row["failure"]) for row in rows]
        return [Table("counting", ("asked", "answered", "failure"), cells)]


CHILD = """
import json, pathlib, sys
seed, index, folder, path = sys.argv[1:]
tries = pathlib.Path(folder) / "tries"
tries.write_text(tries.read_text() + "x" if tries.exists() else "x")
if index == "1":
    sys.exit("no such truss")
pathlib.Path(path).write_text(json.dumps({"answered": int(seed) + int(index)}))
"""


@pytest.fixture
def counting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The show above in the place of all others; its cases are the script above."""
    import benchmarks.shows.__main__ as command

    def process(words: Sequence[str], environment: dict[str, str]) -> Any:
        return command_process((sys.executable, "-c", CHILD, *words[4:]), environment)

    command_process = command.FreshProcess
    monkeypatch.setattr(command, "FreshProcess", process)
    monkeypatch.setattr(command, "show", lambda name: Counting())
    return tmp_path / "rows"


def stored(folder: Path) -> list[dict[str, Any]]:
    files = sorted((folder / "cases").glob("*/*.jsonl"))
    return [json.loads(file.read_text().splitlines()[0]) for file in files]


def run(folder: Path, *flags: str) -> int:
    return main(["counting", "--results", str(folder), *flags])


def test_the_first_cases_can_be_left_out(
    counting: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(counting, "--count", "1", "--skip", "0") == 0
    assert run(counting, "--count", "4", "--skip", "3", "--seed", "0") == 0
    rows = stored(counting)
    assert [row["index"] for row in rows] == [0, 3]
    assert "1 of 1 rows are in" in capsys.readouterr().out
    assert run(counting, "--count", "2", "--skip", "2") == 2
    assert "--skip 2 leaves none of 2 cases" in capsys.readouterr().err


def test_every_case_is_a_row_and_a_failure_says_why(
    counting: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(counting, "--count", "3", "--seed", "5") == 0
    rows = stored(counting)
    assert [row["index"] for row in rows] == [0, 1, 2]
    assert [row["asked"] for row in rows] == [500, 501, 502]
    assert [row.get("answered") for row in rows] == [5, None, 7]
    assert [row["failure"] for row in rows] == ["", "no such truss", ""]
    out = capsys.readouterr().out
    assert "no such truss" in out
    assert f"3 of 3 rows are in {counting}" in out


def test_a_run_that_was_stopped_goes_on_where_it_was(
    counting: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(counting, "--count", "3") == 0
    lost, damaged = sorted((counting / "cases").glob("*/*.jsonl"))[1:]
    lost.unlink()
    damaged.write_text('{"index"')
    assert run(counting, "--count", "4") == 0
    tries = [
        len((counting / "kept" / f"counting-0-{i:06}" / "tries").read_text()) for i in range(4)
    ]
    assert tries == [1, 2, 2, 1]
    assert f"4 of 4 rows are in {counting}" in capsys.readouterr().out


def test_rows_until_an_interruption_are_printed(
    counting: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import benchmarks.shows.__main__ as command

    run_case = command.SeededCases.run

    def interrupted(cases: Any, index: int) -> Any:
        if index == 2:
            raise KeyboardInterrupt
        return run_case(cases, index)

    monkeypatch.setattr(command.SeededCases, "run", interrupted)
    assert run(counting, "--count", "3") == 130
    assert f"2 of 3 rows are in {counting}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("flags", "code", "words"),
    [
        (("truss-randm",), 2, "did you mean truss-random?"),
        ((), 2, "the shows are " + ", ".join(SHOWS)),
        (("truss-random", "--count", "0"), 2, "positive whole number"),
        (("truss-random", "--seed", "-1"), 2, "whole number of at least 0"),
        (("truss-random", "--limit", "nan"), 2, "positive number of seconds"),
    ],
)
def test_bad_input_is_one_sentence(
    flags: tuple[str, ...], code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(list(flags)) == code
    # a long sentence stands in several lines
    assert words in " ".join(capsys.readouterr().err.split())


def test_rows_of_another_state_of_the_code_are_left_out(
    counting: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(counting, "--count", "1") == 0
    assert run(counting, "--count", "1", "--seed", "1") == 0
    assert [row["asked"] for row in stored(counting)] == [0, 100]

    other = {**provenance(), "commit": "another"}
    monkeypatch.setattr("benchmarks.shows.__main__.provenance", lambda: other)
    assert run(counting, "--count", "1") == 0
    said = capsys.readouterr().out
    assert "2 rows of" in said
    assert "are there too, and left out" in said


def test_a_folder_that_cannot_be_made_is_one_sentence(
    counting: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counting.write_text("mine")
    assert run(counting) == 6
    assert "cannot be written" in capsys.readouterr().err


def test_every_show_has_what_a_show_needs(capsys: pytest.CaptureFixture[str]) -> None:
    for name in SHOWS:
        module = show(name)
        assert all(callable(getattr(module, verb)) for verb in ("question", "answer", "tables"))
        assert module.LIMIT > 0
    assert main(["--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(shows.SHOWS)


def test_a_case_ends_with_the_run_that_started_it(tmp_path: Path) -> None:
    pid = tmp_path / "pid"
    case = f"""
import os, pathlib, time
from benchmarks.shows.case import end_with_parent
end_with_parent()
pathlib.Path({str(pid)!r}).write_text(str(os.getpid()))
time.sleep(60)
"""
    run = f"""
import subprocess, sys
subprocess.run([sys.executable, '-c', {case!r}], start_new_session=True)
"""
    with subprocess.Popen([sys.executable, "-c", run], cwd=ROOT) as process:
        _wait(lambda: pid.exists() and pid.read_text() != "")
        process.kill()
    _wait(lambda: not _alive(int(pid.read_text())))


def _wait(condition: Callable[[], bool]) -> None:
    for _ in range(200):
        if condition():
            return
        time.sleep(0.1)
    pytest.fail("waited for 20 s")


def _alive(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    return status.exists() and ") Z " not in status.read_text()
