"""Fuzzed lines: the same for a seed, over all commands, judged as stated."""

from pathlib import Path

import pytest

from benchmarks.shows.fuzz import commands
from benchmarks.shows.fuzz.grammar import KINDS
from benchmarks.shows.fuzz.said import faults_of
from studies.registry import COMMANDS


def test_lines_are_drawn_over_all_commands_and_again_for_a_seed() -> None:
    drawn = [commands.question(3, index) for index in range(2 * len(KINDS))]
    assert {question["name"] for question in drawn} == set(COMMANDS)
    assert drawn == [commands.question(3, index) for index in range(2 * len(KINDS))]
    assert drawn[0] != commands.question(4, 0)


@pytest.mark.parametrize(
    ("code", "said", "fault"),
    [
        (0, "", ""),
        (2, "antenna-ocp: duration is -1; give a finite positive number", ""),
        (5, "[  1.0 s] checked", ""),
        (2, "", "exit code 2 without a message"),
        (70, "antenna-ocp: unforeseen KeyError: 'a'", "exit code 70"),
        (2, "antenna-ocp: " + "x" * 200, "213 characters"),
        (2, "Traceback (most recent call last)\nantenna-ocp: no", "a traceback"),
    ],
)
def test_what_is_wrong_with_an_ending_is_told(code: int, said: str, fault: str) -> None:
    assert fault in " ".join(faults_of(code, said)) if fault else not faults_of(code, said)


def test_a_spoilt_line_is_carried_out_and_watched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = tmp_path / "made"
    made.mkdir()
    (made / "profile.csv").write_text("time [s]\n")
    monkeypatch.chdir(tmp_path)
    case = tmp_path / "cases" / "000000"
    case.mkdir(parents=True)
    asked = {"name": "truss", "words": ["STUDY"], "files": {"STUDY": "a = " + "[" * 900}}
    row = commands.answer(asked, case)
    assert (row["code"], row["faults"]) == (2, [])
    assert "nested deeper" in row["said"]
