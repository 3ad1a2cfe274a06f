"""Commands that were killed or stopped go on, with the numbers of a run that nobody stopped."""

import signal
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from tests.studies.stopped_runs import stopped_at

ROBUST = """duration = 140
[caps]
jerk = "bezier"
[robust]
draws = 200
[robust.scenarios.rough]
joint_friction = 0.15
[robust.scatter.pulley_friction]
low = 0.0
high = 0.01
"""
# by their names: further words, where they get which signal, and the steps that are finished then
STOPPED = {
    "robust truss": ("STUDY --coarse", "robust law: ", signal.SIGKILL, 2),
    "codesign": (
        "--objective peak-force --duration 140 --jerk-cap bezier --starts bezier --intervals 24 "
        "--designs 1",
        "the best start to full accuracy",
        signal.SIGINT,
        2,
    ),
    "mission": (
        "--total 38 --no-refine --residual-energy 0.01 --intervals 30",
        "ring in ",
        signal.SIGKILL,
        3,
    ),
    "flex": ("--preset big-arm", "speed x 4", signal.SIGKILL, 2),
    "turn": ("", "a second solve, ", signal.SIGKILL, 1),
    "paper": ("--elements 2", "small arm", signal.SIGINT, 5),
    "arm baselines": ("--stage small", "residual energy on the full model", signal.SIGKILL, 8),
    "arm least-duration": ("--stage small --drive angle", "optimum in ", signal.SIGKILL, 2),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STOPPED)
def test_a_command_goes_on_with_the_same_result(
    name: str, tmp_path: Path, capsys, monkeypatch
) -> None:
    # the steps of an arm, which are looked at below, are removed from a result that is verified
    monkeypatch.setattr("studies.common.finished.forget_steps", lambda folder: None)
    flags, words, number, least = STOPPED[name]
    (tmp_path / "study.toml").write_text(ROBUST)
    flags = flags.replace("STUDY", str(tmp_path / "study.toml"))
    study, out = (*name.split(), *flags.split(), "--no-figures"), tmp_path / "out"
    code, messages = stopped_at(study, words, number, out)
    assert code == (ExitCode.INTERRUPTED if number == signal.SIGINT else -number)
    assert f"to resume after an interruption: antenna-ocp {name} --resume {out}" in messages
    steps = written(out)
    assert len(steps) >= least

    code = main([*name.split(), "--resume", str(out), "--no-figures"])
    count = f"{len(steps)} step{'s were' if len(steps) > 1 else ' was'} finished in an earlier run"
    assert count in capsys.readouterr().err
    assert {file: written(out)[file] for file in steps} == steps  # none was taken again

    assert main([*study, "--results", str(tmp_path / "alone")]) == code
    found, expected = (numbers(Result.load(tmp_path / name)) for name in ("out", "alone"))
    assert list(found) == list(expected)
    for what, values in expected.items():
        np.testing.assert_array_equal(found[what], values, err_msg=what)


def written(folder: Path) -> dict[str, int]:
    """The finished steps, and when each was written [ns]."""
    return {str(file): file.stat().st_mtime_ns for file in folder.glob("steps/**/*.step")}


def numbers(result: Result) -> dict[str, np.ndarray]:
    """All numbers of a table and all arrays, by what they are."""
    rows = {
        f"{row.key}, {law}": np.array(x) for row in result.table for law, x in row.values.items()
    }
    return rows | {name: series.values for name, series in result.arrays.items()}
