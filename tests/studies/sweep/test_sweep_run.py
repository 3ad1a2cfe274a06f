"""Sweeps as a user runs them: killed, resumed, hung, damaged, of another version."""

import csv
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from studies.sweep.cases.lock import alone
from studies.sweep.workers import processes

ROOT = Path(__file__).parents[3]
# a short fall of a stiff pendulum: each case takes a tenth of a second
PENDULUM = """
[base]
duration = 0.05
gravity = [0.0, -9.81]
elements = 1
samples = 11
frequencies = 0
mesh_check = false
[[base.link]]
length = 1.2
area = 0.0018
second_moment = 1.215e-8
modulus = 2e9
density = 5540.0
[[base.joint]]
kind = "free"
start_deg = 0.0
"""
CASES = 24
GRID = f"""
subject = "flex"
show = ["angle_0"]
[parameters]
"joint.0.start_deg" = {{ low = -60.0, high = 60.0, count = 6 }}
"link.0.length" = [1.0, 1.1, 1.2, 1.3]
{PENDULUM}
"""


def rows(out: Path) -> list[dict[str, str]]:
    with (out / "cases.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def files(out: Path) -> dict[str, tuple[int, int]]:
    """Each case's file, by what changes when it is written again."""
    found = (out / "cases").glob("*/*.jsonl")
    return {file.name: (file.stat().st_ino, file.stat().st_mtime_ns) for file in found}


def stated(folder: Path, text: str) -> Path:
    path = folder / "pendulum.toml"
    path.write_text(text, "utf-8")
    return path


def swept(study: Path, out: Path, *flags: str) -> int:
    return main(["sweep", str(study), "--results", str(out), "--no-figures", *flags])


@pytest.mark.slow
def test_a_sweep_killed_twice_ends_as_an_undisturbed_one(
    tmp_path: Path,
) -> None:
    study, out, whole = stated(tmp_path, GRID), tmp_path / "killed", tmp_path / "whole"
    command = [sys.executable, "-m", "antenna_ocp", "sweep", str(study), "--workers", "2"]
    finished: dict[str, tuple[int, int]] = {}
    for wanted in (5, 13):
        run = subprocess.Popen(
            [*command, "--results", str(out), "--no-figures"],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        until = time.monotonic() + 100.0
        while len(files(out)) < wanted and run.poll() is None and time.monotonic() < until:
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
        # nothing that had ended before is computed twice
        now = files(out)
        assert finished.items() <= now.items()
        assert wanted <= len(now) < CASES
        finished = now

    assert swept(study, out) == ExitCode.OK
    assert finished.items() <= files(out).items()
    assert not list((out / "cases").glob("*/*.part"))

    assert swept(study, whole) == ExitCode.OK
    first, second = rows(out), rows(whole)
    assert len(first) == CASES
    for killed, undisturbed in zip(first, second, strict=True):
        for name in undisturbed:
            if name != "seconds [s]":  # the same numbers to the last digit: the same code ran
                assert killed[name] == undisturbed[name]
    result = Result.load(out)
    assert result.verdict.kind == "measured"
    assert result.arrays["angle_0"].values.shape == (CASES,)


def test_a_damaged_case_and_a_lost_one_are_computed_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = stated(tmp_path, GRID), tmp_path / "out"
    assert swept(study, out) == ExitCode.OK
    before, table = files(out), (out / "cases.csv").read_bytes()
    halved, changed, lost, empty, other, *_ = sorted((out / "cases").glob("*/*.jsonl"))
    empty.write_text("", "utf-8")
    other.write_text("[1, 2]\n", "utf-8")
    halved.write_text(halved.read_text("utf-8")[:200], "utf-8")
    text = changed.read_text("utf-8")
    assert '"angle_0": ' in text
    changed.write_text(text.replace('"angle_0": ', '"angle_0": 1'), "utf-8")
    lost.unlink()
    capsys.readouterr()

    assert swept(study, out, "--plan") == ExitCode.OK
    assert "computed again: 4 cases whose files are damaged" in capsys.readouterr().out
    assert swept(study, out) == ExitCode.OK
    said = capsys.readouterr().err
    assert said.count("is computed again: its file is damaged") == 4
    again = {name for name, mark in files(out).items() if before.get(name) != mark}
    assert again == {halved.name, changed.name, lost.name, empty.name, other.name}

    def without_times(content: bytes) -> list[list[str]]:
        lines = list(csv.reader(content.decode().splitlines()))
        times = lines[0].index("seconds [s]")
        return [line[:times] + line[times + 1 :] for line in lines]

    assert without_times((out / "cases.csv").read_bytes()) == without_times(table)


@pytest.mark.slow
def test_a_hung_case_is_a_row_and_has_another_chance_with_more_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hung = GRID.replace("duration = 0.05", "duration = 500.0\nstep = 1e-4")
    one = hung.replace("count = 6", "count = 2").replace("[1.0, 1.1, 1.2, 1.3]", "[1.0]")
    study, out = stated(tmp_path, one), tmp_path / "out"
    # an answer is lacking, which the exit code says
    assert swept(study, out, "--case-seconds", "1.5") == ExitCode.NOT_VERIFIED
    assert [row["status"] for row in rows(out)] == ["hung", "hung"]
    assert rows(out)[0]["reason"] == "stopped after 1.5 s (--case-seconds)"
    before = files(out)
    assert swept(study, out, "--case-seconds", "1.5") == ExitCode.NOT_VERIFIED
    assert files(out) == before
    capsys.readouterr()
    assert swept(study, out, "--case-seconds", "1.6") == ExitCode.NOT_VERIFIED
    assert "its time limit was 1.5 s and is higher now" in capsys.readouterr().err


# a solver that crashes wherever the link is 1.1 m long
CRASHING = """
import os, signal
from studies.sweep.workers import worker
solved = worker.outcome
def outcome(task):
    if task["configuration"]["link"][0]["length"] == 1.1:
        os.write(2, b"the solver broke down\\n")
        os.kill(os.getpid(), signal.SIGSEGV)
    return solved(task)
worker.outcome = outcome
worker.serve()
"""


def test_a_case_whose_process_dies_is_tried_once_more_alone_and_then_a_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, out = stated(tmp_path, GRID.replace("count = 6", "count = 2")), tmp_path / "out"
    monkeypatch.setattr(processes, "SERVE", CRASHING)
    assert swept(study, out) == ExitCode.NOT_VERIFIED
    said = capsys.readouterr()
    why = "its process ended by SIGSEGV: the solver broke down"
    assert said.err.count(f"{why}; it is tried once more, alone") == 2
    assert "6 of 8 cases are solved and verified (2 killed)" in said.out
    for row in rows(out):
        died = row["link.0.length [m]"] == "1.1"
        assert row["status"] == ("killed" if died else "solved")
        assert row["reason"] == (why if died else "")


def test_cases_of_another_version_are_left_out_unless_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = stated(tmp_path, GRID.replace("count = 6", "count = 2")), tmp_path / "out"
    assert swept(study, out) == ExitCode.OK
    (own,) = (out / "cases").iterdir()
    head = json.loads((own / "version.json").read_text("utf-8"))
    (own / "version.json").write_text(json.dumps({**head, "package": "0.0.9"}), "utf-8")
    own.rename(out / "cases" / "000000000000")

    assert swept(study, out) == ExitCode.BAD_INPUT
    said = capsys.readouterr().err
    assert "8 cases of 000000000000 (format 1, version 0.0.9" in said
    assert "--recompute" in said
    assert swept(study, out, "--recompute") == ExitCode.OK
    assert len(list(own.glob("*.jsonl"))) == 8
    assert len(list((out / "cases" / "000000000000").glob("*.jsonl"))) == 8
    assert "Not used, because another version computed them" in capsys.readouterr().out


def test_a_second_run_in_the_same_folder_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = stated(tmp_path, GRID.replace("count = 6", "count = 2")), tmp_path / "out"
    assert swept(study, out) == ExitCode.OK
    with alone(out):
        assert swept(study, out) == ExitCode.NO_RESULTS_FOLDER
        said = " ".join(capsys.readouterr().err.split())
        assert f"another run uses {out} (process {os.getpid()} on " in said
    assert swept(study, out) == ExitCode.OK


def test_a_full_disk_is_said_and_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, out = stated(tmp_path, GRID.replace("count = 6", "count = 2")), tmp_path / "out"
    synced, count = os.fsync, 0

    def full(number: int) -> None:
        nonlocal count
        count += 1
        if count > 9:
            raise OSError(28, "No space left on device")
        synced(number)

    monkeypatch.setattr(os, "fsync", full)
    assert swept(study, out) == ExitCode.NO_RESULTS_FOLDER
    said = capsys.readouterr().err
    assert "cannot be written (No space left on device)" in said
    assert "give the same command again" in said
    kept = files(out)
    assert kept
    monkeypatch.setattr(os, "fsync", synced)
    assert swept(study, out) == ExitCode.OK
    assert kept.items() <= files(out).items()
    assert len(files(out)) == 8


def test_a_full_disk_after_the_last_case_is_said_and_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, out = stated(tmp_path, GRID.replace("count = 6", "count = 2")), tmp_path / "out"

    def full(*arguments: object, **named: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("studies.common.running.draw_into", full)
        code = main(["sweep", str(study), "--results", str(out)])
    assert code == ExitCode.NO_RESULTS_FOLDER
    said = capsys.readouterr()
    assert "8 of 8 cases are solved" in said.out
    assert "cannot be written (No space left on device)" in said.err
    assert "and give the same command again" in said.err
    assert swept(study, out) == ExitCode.OK
    assert "8 of 8 cases are already solved" in capsys.readouterr().err


def test_a_sweep_that_is_stopped_says_how_it_goes_on_with_its_flags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, out = stated(tmp_path, GRID), tmp_path / "out"

    def stopped(driver: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("studies.sweep.driver.Driver.run", stopped)
        assert swept(study, out, "--coarse") == ExitCode.INTERRUPTED
    again = ["sweep", str(out / "input.toml"), "--results", str(out)]
    said = " ".join(capsys.readouterr().err.split())
    assert f"to resume: antenna-ocp {' '.join(again)}" in said
    assert main([*again, "--plan"]) == ExitCode.OK
    assert "coarse meshes" in capsys.readouterr().out  # the file of the user says full ones


def test_a_process_that_is_being_started_ends_with_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    started, begun, start = threading.Event(), [], subprocess.Popen

    def slow(*arguments: object, **named: object) -> subprocess.Popen[str]:
        started.set()
        time.sleep(0.3)
        begun.append(start(*arguments, **named))
        return begun[-1]

    monkeypatch.setattr(subprocess, "Popen", slow)
    place = processes.LocalProcesses(1)
    answer = place.submit({}, None)
    assert started.wait(5.0)
    place.close()
    assert begun[0].returncode is not None
    assert answer.result()["record"]["status"] == "killed"


def test_a_plan_solves_a_few_cases_to_say_how_long_all_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = stated(tmp_path, GRID), tmp_path / "out"
    assert swept(study, out, "--plan", "--workers", "2") == ExitCode.OK
    said = capsys.readouterr().out
    assert "24 cases, 3 of which are in" in said
    assert "(mean of 3 cases in the folder)" in said
    solved = files(out)
    assert len(solved) == 3

    # the sweep keeps them, and so does another plan
    assert swept(study, out, "--plan", "--workers", "2") == ExitCode.OK
    assert files(out) == solved
