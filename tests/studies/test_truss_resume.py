"""A study that was killed goes on from its finished starts."""

import json
import signal
from pathlib import Path

import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from tests.studies.stopped_runs import stopped_at

STUDY = (
    *("truss", "--objective", "energy", "--jerk-cap", "bezier", "--friction", "0.01"),
    *("--starts", "bezier,step5,straight", "--no-figures"),
)


@pytest.mark.slow
def test_after_kill_finished_starts_are_used(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    code, messages = stopped_at(STUDY, "start 1 of 3 (bezier): energy", signal.SIGKILL, out)
    assert code == -signal.SIGKILL
    assert f"to resume after an interruption: antenna-ocp truss --resume {out}" in messages
    assert [file.name for file in out.glob("steps/*/*")] == ["forces-bezier.step"]

    assert main(["truss", "--resume", str(out), "--no-figures"]) == ExitCode.OK
    lines = capsys.readouterr().err.splitlines()
    lines = [line for line in lines if "still working" not in line]  # which repeats one
    # the first start is taken over, the second agrees with it, so that the third is not needed
    assert [("in an earlier run" in line) for line in lines if ": energy" in line] == [True, False]
    record = json.loads((out / "verification.json").read_text())
    assert [start["start"] for start in record["starts"]] == ["bezier", "step5"]
    result = Result.load(out)
    assert result.bounds["energy"] <= result.value("energy") <= 1.01 * result.bounds["energy"]


@pytest.mark.slow
@pytest.mark.parametrize("where", ["foreground", "background"])
@pytest.mark.parametrize(
    "words",
    ["start 1 of 3 (bezier): energy", "start 2 of 3 (step5): truss: mesh iteration 1"],
    ids=["between two starts", "while one is solved"],
)
def test_sigterm_keeps_the_best_and_says_how_to_go_on(
    words: str, where: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    code, messages = stopped_at(STUDY, words, signal.SIGTERM, out, where)
    assert code == ExitCode.INTERRUPTED
    assert "Traceback" not in messages
    assert messages.splitlines()[-1].endswith(f"to resume: antenna-ocp truss --resume {out}")
    assert Result.load(out).interrupted


def test_what_cannot_go_on_is_named(tmp_path: Path, capsys) -> None:
    assert main(["truss", "--resume", str(tmp_path)]) == ExitCode.BAD_INPUT
    assert "no results folder with an input.toml" in capsys.readouterr().err
