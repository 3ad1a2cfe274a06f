"""A study that was killed goes on from its finished starts."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

ROOT = Path(__file__).parents[2]
STUDY = (
    *("truss", "--objective", "energy", "--jerk-cap", "bezier", "--friction", "0.01"),
    *("--starts", "bezier,step5,straight", "--no-figures"),
)
# The process sends itself the signal as it prints the words. One from outside comes some time
# later, and a start takes a third of a second: the study may then have ended.
COMMAND = """
import os, signal, sys
import studies.cli
import studies.common.console as console

console.QUIET = 0.0  # every line of progress is shown
number, words = int(sys.argv.pop(1)), sys.argv.pop(1)
if sys.argv.pop(1) == "background":  # as a shell starts it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
else:
    signal.signal(signal.SIGINT, signal.default_int_handler)
write, sent = sys.stderr.write, []

def heard(text):
    count = write(text)
    if words in text and not sent:
        sent.append(number)
        sys.stderr.flush()
        os.kill(os.getpid(), number)
    return count

sys.stderr.write = heard
sys.exit(studies.cli.main())
"""


def stopped_at(words: str, number: int, out: Path, where: str = "foreground") -> tuple[int, str]:
    """Exit code and messages of a study that gets a signal when it first prints `words`."""
    signalled = [sys.executable, "-c", COMMAND, str(int(number)), words, where]
    done = subprocess.run(
        [*signalled, *STUDY, "--results", str(out)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        timeout=120,
        check=False,
    )
    assert words in done.stderr
    return done.returncode, done.stderr


@pytest.mark.slow
def test_after_kill_finished_starts_are_used(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    code, messages = stopped_at("start 1 of 3 (bezier): energy", signal.SIGKILL, out)
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
    code, messages = stopped_at(words, signal.SIGTERM, out, where)
    assert code == ExitCode.INTERRUPTED
    assert "Traceback" not in messages
    assert messages.splitlines()[-1].endswith(f"go on by: antenna-ocp truss --resume {out}")
    assert Result.load(out).interrupted


def test_what_cannot_go_on_is_named(tmp_path: Path, capsys) -> None:
    assert main(["truss", "--resume", str(tmp_path)]) == ExitCode.BAD_INPUT
    assert "no results folder with an input.toml" in capsys.readouterr().err
