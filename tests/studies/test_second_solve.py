"""A second solve of what is printed: confirmed, replaced by a better one, or refused."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ocp import (
    Control,
    Evidence,
    Finding,
    FixedMesh,
    Interrupted,
    Phase,
    Problem,
    Settings,
    Solution,
    State,
    Unverified,
    solve,
)
from studies.cli import main
from studies.common import second_solve as second
from studies.common.console import silent
from studies.common.exit_codes import ExitCode

CONSTANT = Settings(intervals=4, refinement=FixedMesh())


def least_effort() -> Problem:
    """A metre from rest to rest by pushes that are constant in each interval."""
    x, v = State("x", "m"), State("v", "m/s")
    push = Control("push", "m/s^2", piecewise="constant")
    move = Phase("move", {x: v, v: push}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    return Problem("least effort", [move], minimise=move.integral(push**2))


@pytest.fixture(scope="module")
def coarse() -> Solution:
    """An answer that a finer mesh makes better by some per cent."""
    return solve(least_effort(), settings=CONSTANT)


def test_a_right_answer_is_confirmed_and_stays() -> None:
    right = solve(least_effort())
    told = second.second_solve(right, Settings(), silent())
    assert told.solution is right
    assert told.check.passed
    assert told.check.value < 1e-5
    assert "confirmed within" in told.check.sentence


def test_a_spent_budget_leaves_the_answer_and_says_so(coarse: Solution) -> None:
    told = second.second_solve(coarse, Settings(), silent(), left=-0.1)
    assert told.solution is coarse
    assert told.check.sentence == "passed: a second solve: open: the time limit was reached"


def test_a_better_answer_takes_its_place(coarse: Solution) -> None:
    told = second.second_solve(coarse, Settings(), silent())
    assert told.solution.objective == pytest.approx(12.0, rel=1e-4)
    assert told.check.passed
    assert "it found a solution that is better by" in told.check.sentence


def test_an_answer_that_no_better_one_follows_does_not_hold(coarse: Solution) -> None:
    # on its own mesh nothing is better
    told = second.second_solve(coarse, CONSTANT, silent())
    assert told.solution is coarse
    assert not told.check.passed
    assert "FAILED: a second solve: " in told.check.sentence


def test_a_better_motion_that_is_not_verified_is_no_answer(
    coarse: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    def doubtful(*arguments: Any, **options: Any) -> Solution:
        raise Unverified("off by 1", coarse)

    monkeypatch.setattr(second, "solve", doubtful)
    told = second.second_solve(coarse, Settings(), silent())
    assert told.solution is coarse
    assert not told.check.passed


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), Interrupted("stopped")])
def test_a_stop_keeps_the_answer(
    coarse: Solution, stop: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*arguments: Any, **options: Any) -> Any:
        raise stop

    monkeypatch.setattr(second, "certify", stopped)
    told = second.second_solve(coarse, Settings(), silent())
    assert told.interrupted
    assert told.solution is coarse
    assert told.check.passed


def test_what_is_open_does_not_fail(coarse: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    def unfinished(answer: Evidence, **options: Any) -> Iterator[Finding]:
        yield Finding("a second solve", math.nan, 1e-5, "no time was left", open=True)

    monkeypatch.setattr(second, "confirm", unfinished)
    told = second.second_solve(coarse, Settings(), silent())
    assert told.check.passed
    assert "open: no time was left" in told.check.sentence


def test_a_command_whose_answer_does_not_hold_keeps_it_and_ends_with_5(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def better(answer: Evidence, **options: Any) -> Iterator[Finding]:
        yield Finding("a second solve", 0.5, 1e-5, "a motion is better by half")

    monkeypatch.setattr(second, "confirm", better)
    out = tmp_path / "out"
    arguments = ["truss", "--objective", "peak-acceleration", "--jerk-cap", "bezier"]
    arguments += ["--starts", "straight", "--no-figures", "--results", str(out)]
    assert main(arguments) == ExitCode.NOT_VERIFIED
    record = json.loads((out / "verification.json").read_text())
    assert not record["passed"]
    assert (out / "profile.csv").is_file()
    assert "a motion is better by half" in json.dumps(record)
