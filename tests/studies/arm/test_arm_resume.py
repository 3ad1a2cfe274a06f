"""A motion of the arm whose study was stopped goes on from its finished solves."""

from pathlib import Path

import numpy as np
import pytest

from ocp import Control, FixedMesh, Mesh, Phase, Problem, Radau, Settings, State, solve
from ocp.mesh.mesh import uniform
from studies.arm.optimal import study_solver
from studies.arm.optimal.study_solver import StudySolver
from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import FinishedSteps
from studies.common.result import Result

STUDY = ("arm", "solve", "--stage", "small", "--objective", "energy", "--no-figures")
SETTINGS = Settings(scheme=Radau(3), refinement=FixedMesh(), verify=False)


def cart() -> Problem:
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("cart", {x: v, v: u}, {x: 0.0, v: 0.0}, {x: 1.0, v: 0.0}, end=1.0)
    return Problem("cart", [phase], minimise=phase.integral(u**2, "effort", "m^2/s^3"))


class Counted:
    """`ocp.solve` that counts, and that a user stops at a call."""

    def __init__(self, stopped_at: int = 0) -> None:
        self.calls, self.stopped_at = 0, stopped_at

    def __call__(self, *given, **how):
        self.calls += 1
        if self.calls == self.stopped_at:
            raise KeyboardInterrupt
        return solve(*given, **how)


def test_a_solve_is_read_only_at_its_place_and_on_its_mesh(tmp_path: Path, monkeypatch) -> None:
    counted, kept = Counted(), FinishedSteps(tmp_path)
    monkeypatch.setattr(study_solver, "solve", counted)
    coarse, fine = (Mesh((uniform(n, 3),)) for n in (4, 8))

    first = StudySolver(kept=kept)
    found = [first(cart(), mesh=mesh, settings=SETTINGS) for mesh in (coarse, fine)]
    assert counted.calls == 2

    lines: list[str] = []
    again = StudySolver(lines.append, kept=kept)
    read = again(cart(), mesh=coarse, settings=SETTINGS)
    assert counted.calls == 2
    assert lines == ["solve 1: found in an earlier run"]
    assert read.objective == found[0].objective
    for ours, theirs in zip(read.trajectory.phases, found[0].trajectory.phases, strict=True):
        assert np.array_equal(ours.breakpoints, theirs.breakpoints)

    # the second solve was on the fine mesh
    again(cart(), mesh=coarse, settings=SETTINGS)
    assert counted.calls == 3


@pytest.mark.slow
def test_a_motion_that_was_stopped_goes_on(tmp_path: Path, monkeypatch, capsys) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr(study_solver, "solve", Counted(stopped_at=3))
    assert main([*STUDY, "--results", str(out)]) == ExitCode.INTERRUPTED
    messages = capsys.readouterr().err
    assert messages.splitlines()[-1].endswith(f"to resume: antenna-ocp arm solve --resume {out}")
    assert len(list(out.glob("steps/*/solve*"))) == 2

    monkeypatch.setattr(study_solver, "solve", solve)
    assert main(["arm", "solve", "--resume", str(out), "--no-figures"]) == ExitCode.OK
    lines = capsys.readouterr().err
    assert "solve 2: found in an earlier run" in lines
    assert "solve 3: found in an earlier run" not in lines
    assert Result.load(out).value("residual_energy") <= 1e-6
    assert not (out / "steps").exists()  # nothing is left to go on with


@pytest.mark.slow
def test_a_front_that_was_stopped_goes_on(tmp_path: Path, monkeypatch, capsys) -> None:
    out, front = tmp_path / "out", ("pareto", "arm", "--range", "8.6..8.7", "--no-figures")
    monkeypatch.setattr(study_solver, "solve", Counted(stopped_at=3))
    assert main([*front, "--results", str(out)]) == ExitCode.INTERRUPTED
    messages = capsys.readouterr().err
    assert messages.splitlines()[-1].endswith(f"to resume: antenna-ocp pareto arm --resume {out}")
    assert len(list(out.glob("steps/*/solve*"))) == 2

    # the third solve is the first that is not there
    counted = Counted(stopped_at=1)
    monkeypatch.setattr(study_solver, "solve", counted)
    assert main(["pareto", "arm", "--resume", str(out), "--no-figures"]) == ExitCode.INTERRUPTED
    assert "solve 2: found in an earlier run" in capsys.readouterr().err
    assert counted.calls == 1


def test_resume_takes_no_other_words(tmp_path: Path, capsys) -> None:
    words = ["arm", "solve", "--resume", str(tmp_path)]
    assert main([*words, "--drive", "angle"]) == ExitCode.BAD_INPUT
    assert "allows no other arguments, but --drive is given" in capsys.readouterr().err
    assert main(words) == ExitCode.BAD_INPUT
    assert "no results folder with an input.toml" in capsys.readouterr().err


@pytest.mark.parametrize("command", [("arm", "solve"), ("truss",)])
def test_resume_leaves_the_results_of_another_command_alone(
    command, tmp_path: Path, capsys
) -> None:
    for name, text in (("input.toml", ""), ("provenance.json", "{}")):
        (tmp_path / name).write_text(text)
    (tmp_path / "result.json").write_text('{"kind": "check"}')
    assert main([*command, "--resume", str(tmp_path)]) == ExitCode.BAD_INPUT
    assert "has the results of another command (kind 'check'" in capsys.readouterr().err


def test_a_search_whose_seconds_are_used_up_names_the_flag() -> None:
    with pytest.raises(StudyError, match="time limit; give more --seconds"):
        StudySolver(until=0.0)(cart(), mesh=Mesh((uniform(4, 3),)), settings=SETTINGS)
