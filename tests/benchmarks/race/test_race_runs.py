"""Rows are fresh processes; both programs by hand are right; failures and limits are rows."""

import os
import sys
import time
from pathlib import Path

import pytest

from benchmarks.processes import FreshProcess
from benchmarks.race import environments
from benchmarks.race.contestants import BASELINES, OURS, Contestant
from benchmarks.race.environments import NotInstalled
from benchmarks.race.medians import tables
from benchmarks.race.runs import RaceRun, race, run_once

WRITE = "import sys, pathlib; pathlib.Path(sys.argv[-1]).write_text('{\"a\": 1}')"


def python(code: str) -> FreshProcess:
    return FreshProcess((sys.executable, "-c", code))


@pytest.mark.parametrize("problem", ["A", "B"])
@pytest.mark.parametrize("contestant", BASELINES, ids=lambda c: c.name)
def test_the_programs_by_hand_are_right(contestant: Contestant, problem: str) -> None:
    row = RaceRun(problem, contestant)
    run_once(row, contestant.process(), limit=60)
    assert row.failure == ""
    assert row.judgement is not None
    assert row.judgement.reason == ""
    (run,) = row.runs
    assert 0 < run["start"] + run["solve"] <= run["process"]


def test_a_program_answers_fails_or_is_ended() -> None:
    assert python(WRITE).run("x", limit=20).answer == {"a": 1}
    failed = python("raise SystemExit('no such thing')").run(limit=20)
    assert failed.answer is None
    assert failed.failure == "no such thing"
    begin = time.monotonic()
    ended = python("import time; time.sleep(60)").run(limit=0.3)
    assert ended.failure == "not done after 0.3 s"
    assert time.monotonic() - begin < 10


def test_what_a_program_started_is_ended_with_it(tmp_path: Path) -> None:
    note = tmp_path / "pid"
    child = f"""
import os, pathlib, time
pathlib.Path({str(note)!r}).write_text(str(os.getpid()))
time.sleep(60)
"""
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    python(code).run(limit=1.5)
    pid = int(note.read_text())
    for _ in range(50):
        if not Path(f"/proc/{pid}").exists() or "Z" in Path(f"/proc/{pid}/stat").read_text():
            break
        time.sleep(0.1)
    else:
        os.kill(pid, 9)
        pytest.fail("the child outlived its program")


def test_a_row_that_fails_is_a_row_that_says_so() -> None:
    rows = [RaceRun("A", OURS), RaceRun("A", BASELINES[0])]
    processes = {OURS.name: "not installed: no such package", BASELINES[0].name: python("exit(3)")}
    said: list[str] = []
    *_, last = race(rows, processes, 3, 20, said.append)
    assert len(said) == 2  # a failure is not repeated
    record = {"rows": [row.record() for row in last], "repeats": 3, "limit": 20}
    text = "\n".join(map(str, tables(record)))
    assert "not installed: no such package" in text
    assert "ended with code 3" in text


def test_an_environment_that_cannot_be_made_says_why() -> None:
    install = [sys.executable, "-m", "pip", "install", "--no-index", "not-a-package-at-all==1.0"]
    with pytest.raises(NotInstalled, match="not installed: ERROR: No matching distribution"):
        environments.run_step(install)
    with pytest.raises(NotInstalled, match="not installed"):
        environments.run_step(["/no/such/program"])
