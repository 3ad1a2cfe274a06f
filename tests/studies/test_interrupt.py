"""Ctrl-C during a solve: exit code 130, one sentence, and what was found is kept."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# every line of progress is shown at once, so that the test knows where the solve stands
COMMAND = """
import signal, sys
import studies.cli
import studies.common.console as console
console.QUIET = 0.0
# a shell lets what runs in its background ignore Ctrl-C, and these tests may run there
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(studies.cli.main())
"""
STUDY = ("truss", "--duration", "5", "--jerk-cap", "200/T^3", "--friction", "0.01")


def interrupted_at(
    words: str, results: Path, *more: str, objective: str = "peak-force"
) -> tuple[int, str]:
    """Exit code and messages of a run that receives SIGINT when it first prints `words`."""
    arguments = [*STUDY, "--objective", objective, "--results", str(results), *more]
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    assert process.stderr is not None
    lines, sent = [], False
    with process.stderr:
        for line in process.stderr:
            lines.append(line)
            if words in line and not sent:
                process.send_signal(signal.SIGINT)
                sent = True
    assert sent, lines[-1]
    return process.wait(timeout=120), "".join(lines)


def test_during_the_first_round_the_input_is_kept(tmp_path: Path) -> None:
    code, messages = interrupted_at("mesh iteration 1", tmp_path / "out")
    assert code == 130
    assert messages.splitlines()[-1] == (
        "antenna-ocp: interrupted before a motion was found; the inputs are kept; to resume: "
        f"antenna-ocp truss --resume {tmp_path / 'out'}"
    )
    assert "Traceback" not in messages
    assert (tmp_path / "out" / "input.toml").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("words", ["mesh iteration 3", "start 2 of 2"])
def test_later_the_best_motion_is_kept(words: str, tmp_path: Path) -> None:
    more = ("--starts", "bezier,dwell", "--no-figures")
    code, messages = interrupted_at(words, tmp_path / "out", *more)
    assert code == 130
    assert "Traceback" not in messages
    assert "antenna-ocp: interrupted; the results so far are kept" in messages
    record = json.loads((tmp_path / "out" / "verification.json").read_text())
    assert "interrupted" in record["verdict"]
    # whatever round it was, a motion near the optimum of 44.53360 N
    assert record["values"]["peak-force"] == pytest.approx(44.5336, rel=2e-2)
    assert (tmp_path / "out" / "profile.csv").is_file()


@pytest.mark.slow
def test_while_figures_are_drawn_all_numbers_are_kept(tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, messages = interrupted_at(
        "drawing", out, "--starts", "straight", objective="peak-acceleration"
    )
    assert code == 130
    assert "Traceback" not in messages
    assert json.loads((out / "verification.json").read_text())["passed"]
    assert (out / "profile.csv").is_file()
