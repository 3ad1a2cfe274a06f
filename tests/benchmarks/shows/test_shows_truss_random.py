"""Random truss studies: what is drawn is what was asked for, and how a command ended is read."""

import math
from pathlib import Path

import pytest

from benchmarks.shows import truss_random
from benchmarks.shows.truss_random import ASKED, answer, question, read_output, tables
from models.truss import TrussParameters
from studies.cli import parse
from studies.common.console import Console
from studies.common.study_command import read_study
from studies.truss.command import STUDY

QUESTIONS = [question(3, index) for index in range(140)]


def test_questions_are_what_was_asked_for() -> None:
    paper = TrussParameters()
    for drawn in QUESTIONS:
        assert 2 <= drawn["duration"] <= 600
        assert 0 <= drawn["friction"] <= 0.05
        assert 6 <= drawn["modules"] <= 48
        assert drawn["jerk_multiple"] is None or 40 <= drawn["jerk_multiple"] <= 1000
        for name, length in drawn["lengths"].items():
            assert math.isclose(length, getattr(paper, name), rel_tol=0.3001)  # four digits
    assert {drawn["objective"] for drawn in QUESTIONS} == set(ASKED)
    without = sum(drawn["jerk_multiple"] is None for drawn in QUESTIONS)
    assert 0 < without <= len(QUESTIONS) / 3
    assert QUESTIONS[7] == question(3, 7) != question(4, 7)


@pytest.mark.filterwarnings("ignore:.*spring:UserWarning")
def test_every_command_is_understood_and_states_what_was_drawn() -> None:
    for drawn in QUESTIONS[:35]:
        study = read_study(STUDY, parse(drawn["command"])[0], Console())
        assert study.objectives == (drawn["objective"],)
        assert study.duration[1] == drawn["duration"]
        assert study.truss.modules == drawn["modules"]
        assert study.truss.link == drawn["lengths"]["link"]
        multiple = drawn["jerk_multiple"]
        if multiple is not None:
            # the least time writes the number out with six digits
            assert study.caps.jerk == pytest.approx(multiple / drawn["duration"] ** 3, rel=1e-5)


@pytest.mark.slow
def test_a_study_that_ends_well_is_read(tmp_path: Path) -> None:
    command = ["truss", "--objective", "peak-acceleration", "--jerk-cap", "bezier"]
    command += ["--starts", "bezier", "--intervals", "8", "--no-figures"]
    row = answer({"command": command}, tmp_path)
    assert row["code"] == 0
    # the closed form of the jerk-limited motion, as the README's table prints it
    assert row["value"] == pytest.approx(3.41756e-4, rel=1e-5)
    assert row["verdict"].startswith("global: the bound")
    assert row["files"] >= 5
    assert not row["traceback"]
    assert row["check"] == 0
    assert row["beaten_by"] == ""
    assert not (tmp_path / "study").exists()
    assert "verdict: global" in (tmp_path / "printed.txt").read_text("utf-8")


def test_an_infeasible_study_is_a_complaint(tmp_path: Path) -> None:
    command = ["truss", "--objective", "peak-force", "--duration", "5", "--jerk-cap", "40/T^3"]
    row = answer({"command": command}, tmp_path)
    assert row["code"] == 3
    assert row["value"] is None
    assert "no motion deploys in 5 s" in row["complaint"]
    assert row["proof"] == "closed form of the least jerk"
    assert not row["traceback"]


@pytest.mark.parametrize(
    "text",
    [
        "Traceback (most recent call last):\n",
        'x\n  File "ocp/solve.py", line 3, in solve\n',
        "antenna-ocp: unforeseen KeyError: 'x'; this is a defect\n",
        "RuntimeWarning: divide by zero\n",
        "lib/dataclasses.py:1501: UserWarning: the spring pulls at first\n",
    ],
)
def test_what_no_user_should_see_is_seen(text: str) -> None:
    assert read_output(text)["traceback"]
    assert not read_output("[   0.1 s] warning: the spring pulls while stowed\n")["traceback"]


def test_rows_of_all_kinds_are_printed() -> None:
    base = {**QUESTIONS[2], "seconds": 1.0, "failure": ""}
    ended = {
        "code": 0,
        "value": 44.5,
        "verdict": "local: best",
        "complaint": "",
        "traceback": False,
    }
    rows = [
        {**base, "index": 0, **ended},
        {**base, "index": 1, **ended, "code": 70, "traceback": True, "value": None},
        {**base, "index": 2, **ended, "code": -11},
        {**base, "index": 3, "failure": "not done after 1 s"},
    ]
    studies, held = tables(rows)
    assert dict(held.rows)["exit 70 or a traceback"] == "1 of 3"
    assert dict(held.rows)["no answer within the limit"] == "1 of 4"
    assert "not done after 1 s" in str(studies)
    assert "YES" in str(studies)
    assert truss_random.LIMIT > 0
