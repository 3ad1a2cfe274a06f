"""Steps that are kept: read as they were written, by the study and the code that they are of."""

import dataclasses
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from models.laws import JerkLimited
from ocp import Control, OcpError, Phase, Problem, Settings, State, Trial, solve
from studies.cli import main
from studies.common import finished
from studies.common.code_version import CodeVersion
from studies.common.console import silent
from studies.common.exit_codes import ExitCode
from studies.common.finished import NOTHING_KEPT, FinishedSteps, finished_steps, forget_steps
from studies.common.processes.side_by_side import side_by_side
from studies.common.result import Result
from studies.mission.stages import Use

QUICK = (
    *("truss", "--objective", "energy", "--duration", "5", "--jerk-cap", "bezier"),
    *("--intervals", "12", "--starts", "bezier", "--no-figures"),
)


class Counted:
    """Gives something, and counts how often."""

    def __init__(self, *given):
        self.given, self.calls = list(given), 0

    def __call__(self):
        self.calls += 1
        return self.given.pop(0)


def cart() -> Problem:
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("cart", {x: v, v: u}, {x: 0.0, v: 0.0}, {x: 1.0, v: 0.0}, end=1.0)
    return Problem("cart", [phase], minimise=phase.integral(u**2, "effort", "m^2/s^3"))


GIVEN = {
    "numbers": (1, -0.1, float("inf"), True, None),
    "texts": {"a": ["b", "c"], "d": b"\x00\xff"},
    "arrays": np.array([[1.0, np.nan], [-0.0, 1e-310]]),
    "objects": (Use("torque", "N m", 1.5, 2.0), JerkLimited(2.0, 0.1, 1.5, 40.0)),
}


@pytest.mark.parametrize("name", GIVEN)
def test_a_step_is_read_as_it_was_taken(name, tmp_path: Path) -> None:
    take, kept, lines = Counted(GIVEN[name]), FinishedSteps(tmp_path), []
    for _ in range(2):
        found = kept.step(name, take, say=lines.append)
        np.testing.assert_equal(found, GIVEN[name])
        assert type(found) is type(GIVEN[name])
    assert take.calls == kept.count == 1
    assert lines == [f"{name}: found in an earlier run"]


def test_a_solution_is_that_of_the_problem_as_it_is_stated_again(tmp_path: Path) -> None:
    kept, first, again = FinishedSteps(tmp_path), cart(), cart()
    found = kept.step("cart", lambda: solve(first, settings=Settings()), first)
    read = kept.step("cart", lambda: pytest.fail("it is taken again"), again)
    assert read.problem is again
    assert read.objective == found.objective == pytest.approx(12.0, rel=1e-9)


def test_what_the_user_stopped_is_taken_again(tmp_path: Path) -> None:
    whole = solve(cart())
    take = Counted(dataclasses.replace(whole, ending="interrupted"), whole)
    kept = FinishedSteps(tmp_path)
    assert kept.step("cart", take, whole.problem).interrupted
    assert kept.count == 0
    assert not kept.step("cart", take, whole.problem).interrupted
    assert kept.count == 1


@pytest.mark.parametrize("damage", [None, b"", b"PK"])
def test_a_start_is_kept_once_and_one_that_is_damaged_is_kept_again(
    damage: bytes | None, tmp_path: Path
) -> None:
    kept, trial = FinishedSteps(tmp_path), Trial("bezier", None, OcpError("none"), math.nan, 1.0)
    assert kept.keep("motion", trial)
    if damage is not None:
        (tmp_path / "motion-bezier.step").write_bytes(damage)
    again = kept.known("motion", {"bezier": cart, "step5": cart})
    assert list(again) == ["bezier"]
    found = again["bezier"]()
    assert (found is None) is (damage is not None)
    assert found is None or str(found.error) == "none"
    assert kept.keep("motion", trial) is (damage is not None)


def test_where_nothing_is_kept_each_step_is_taken() -> None:
    take = Counted(1, 2)
    assert [NOTHING_KEPT.within("a").step("b", take) for _ in range(2)] == [1, 2]
    assert NOTHING_KEPT.count == 0


@pytest.mark.parametrize("damage", [b"", b"PK", b"no archive"])
def test_a_damaged_step_is_taken_again(damage: bytes, tmp_path: Path) -> None:
    take, kept = Counted(1.5, 1.5), FinishedSteps(tmp_path)
    kept.step("a", take)
    (tmp_path / "a.step").write_bytes(damage)
    assert kept.step("a", take) == 1.5
    assert take.calls == 2


class Odd(str):
    """A text that would come back as another thing."""

    __slots__ = ()


@pytest.mark.parametrize("thing", [Odd("a"), lambda: 1, CodeVersion, Path("a")])
def test_what_no_file_can_hold_is_refused(thing, tmp_path: Path) -> None:
    with pytest.raises((TypeError, ValueError)):
        FinishedSteps(tmp_path).step("a", lambda: thing)
    assert not list(tmp_path.glob("*"))


def doubled(number: float, console) -> float:
    console.progress(f"doubled {number:g}")
    return 2.0 * number


@pytest.mark.parametrize("processes", [1, 2])
def test_parts_of_an_earlier_run_are_read(processes: int, tmp_path: Path) -> None:
    kept = FinishedSteps(tmp_path)
    parts = [kept.part(f"part {n:g}", doubled, n) for n in (1.0, 2.0)]
    list(side_by_side(parts[:1], silent(), processes))

    class Told(type(silent())):
        def progress(self, text):
            lines.append(text)

    lines: list[str] = []
    assert list(side_by_side(parts, Told(), processes)) == [2.0, 4.0]
    assert sorted(lines) == ["doubled 2", "part 1: found in an earlier run"]


def test_another_question_or_version_finds_nothing(tmp_path: Path, monkeypatch) -> None:
    finished_steps(tmp_path, ["truss", {"duration": 2.0}]).step("a", lambda: 1)
    assert finished_steps(tmp_path, ["truss", {"duration": 2.0}]).count == 1
    assert finished_steps(tmp_path, ["truss", {"duration": 3.0}]).count == 0
    assert finished_steps(tmp_path, ["codesign", {"duration": 2.0}]).count == 0
    other = CodeVersion(1, "0.2.0", "3.7.2", "other sources")
    monkeypatch.setattr(finished, "code_version", lambda: other)
    assert finished_steps(tmp_path, ["truss", {"duration": 2.0}]).count == 0


@pytest.mark.slow
def test_a_study_that_was_changed_takes_over_nothing(tmp_path: Path, capsys) -> None:
    out, alone, study = tmp_path / "out", tmp_path / "alone", tmp_path / "study.toml"
    assert main([*QUICK, "--results", str(out)]) == ExitCode.OK
    assert main(["truss", "--resume", str(out), "--no-figures"]) == ExitCode.OK
    lines = capsys.readouterr().err.splitlines()
    assert any(line.endswith("s, in an earlier run") for line in lines)
    assert any(line.endswith("a second solve: found in an earlier run") for line in lines)

    study.write_text((out / "input.toml").read_text().replace("duration = 5.0", "duration = 5.5"))
    shutil.copy(study, out / "input.toml")
    assert main(["truss", "--resume", str(out), "--no-figures"]) == ExitCode.OK
    lines = capsys.readouterr().err
    assert "no step of this study, as input.toml states it, was finished" in lines
    assert "in an earlier run" not in lines
    assert main(["truss", str(study), "--no-figures", "--results", str(alone)]) == ExitCode.OK
    found, expected = (Result.load(folder).value("energy") for folder in (out, alone))
    assert found == expected


def test_steps_that_nobody_needs_are_removed_with_those_of_other_questions(tmp_path: Path) -> None:
    for duration in (2.0, 3.0):
        finished_steps(tmp_path, ["truss", {"duration": duration}]).step("a", lambda: 1)
    forget_steps(tmp_path)
    assert list(tmp_path.iterdir()) == []
    forget_steps(tmp_path)  # where there are none, nothing happens
