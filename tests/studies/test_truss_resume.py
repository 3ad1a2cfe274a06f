"""A study that was killed goes on from its finished starts."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

ROOT = Path(__file__).parents[2]
STUDY = ("truss", "--objective", "energy", "--jerk-cap", "bezier", "--no-figures")


def stopped_after_the_first_start(number: int, out: Path, *more: str) -> tuple[int, str]:
    """Exit code and messages of a study that gets a signal when its first start is done."""
    process = subprocess.Popen(
        [sys.executable, "-m", "studies.cli", *STUDY, *more, "--results", str(out)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    assert process.stderr is not None
    lines = []
    with process.stderr:
        for line in process.stderr:
            lines.append(line)
            if "start 1 of 3 (bezier): energy" in line:
                os.kill(process.pid, number)
    return process.wait(timeout=120), "".join(lines)


@pytest.mark.slow
def test_after_kill_finished_starts_are_used(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    starts = ("--starts", "bezier,step5,straight", "--friction", "0.01")
    code, messages = stopped_after_the_first_start(signal.SIGKILL, out, *starts)
    assert code == -signal.SIGKILL
    assert f"it goes on by: antenna-ocp truss --resume {out}" in messages
    assert [file.name for file in (out / "starts").glob("*.json")] == ["forces-bezier.json"]

    assert main(["truss", "--resume", str(out), "--no-figures"]) == ExitCode.OK
    lines = capsys.readouterr().err.splitlines()
    # the first start is taken over, the second agrees with it, so that the third is not needed
    assert [("in an earlier run" in line) for line in lines if ": energy" in line] == [True, False]
    record = json.loads((out / "verification.json").read_text())
    assert [start["start"] for start in record["starts"]] == ["bezier", "step5"]
    result = Result.load(out)
    assert result.bounds["energy"] <= result.value("energy") <= 1.01 * result.bounds["energy"]


@pytest.mark.slow
def test_sigterm_keeps_the_best_and_says_how_to_go_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    more = ("--starts", "bezier,step5,straight", "--friction", "0.01")
    code, messages = stopped_after_the_first_start(signal.SIGTERM, out, *more)
    assert code == ExitCode.INTERRUPTED
    assert "Traceback" not in messages
    assert messages.splitlines()[-1].endswith(f"go on by: antenna-ocp truss --resume {out}")
    assert Result.load(out).interrupted


def test_what_cannot_go_on_is_named(tmp_path: Path, capsys) -> None:
    assert main(["truss", "--resume", str(tmp_path)]) == ExitCode.BAD_INPUT
    assert "no results folder with an input.toml" in capsys.readouterr().err
