"""The shows of caps and of margins: what they ask, and how they judge an answer."""

from pathlib import Path

import pytest

from benchmarks.shows.drive import factored_force, formats, mechanism_caps
from benchmarks.shows.drive.mechanism_caps import verdict_on
from studies.export.formats import TABLES
from studies.truss.quantities import QUANTITIES


def test_sixty_four_questions_are_all_different() -> None:
    questions = [mechanism_caps.question(0, index) for index in range(64)]
    assert len({tuple(question.values()) for question in questions}) == 64
    assert {question["quantity"] for question in questions} <= set(QUANTITIES)


@pytest.mark.parametrize(
    ("multiple", "code", "peak", "complaint", "outcome"),
    [
        (0.9, 3, None, "the least possible is 1.0", "proven"),
        (0.9, 4, None, "no motion was found", "NOT PROVEN"),
        (1.05, 0, 1.0, "", "active"),
        (2.0, 0, 0.9, "", "kept"),
        (2.0, 0, 1.00001, "", "BROKEN"),
        (1.05, 4, None, "the least peak motor power found is 2", "prevented, named"),
        (1.05, 4, None, "something else", "FAILED"),
    ],
)
def test_an_outcome_is_what_it_says(multiple, code, peak, complaint, outcome) -> None:
    row = {"quantity": "peak-power", "multiple": multiple, "code": code, "cap": 1.0}
    assert verdict_on({**row, "peak": peak, "complaint": complaint}) == outcome


def test_a_cap_below_the_least_possible_is_proven_by_the_command(tmp_path: Path) -> None:
    row = mechanism_caps.answer(mechanism_caps.question(0, 8), tmp_path)
    question = mechanism_caps.question(0, 8)
    assert question == {"duration": 4.0, "quantity": "peak-power", "multiple": 0.9}
    assert verdict_on({**question, **row}) == "proven"
    assert mechanism_caps.tables([{**question, **row, "failure": "", "seconds": 1.0}])


def test_every_table_and_curve_is_a_case_once(tmp_path: Path) -> None:
    questions = [formats.question(0, index) for index in range(26)]
    assert len({tuple(one.items()) for one in questions}) == 26
    assert {one["name"] for one in questions} >= set(TABLES)
    rows = []
    for index in (8, 20):  # a table that is short, and polynomials
        row = formats.answer(formats.question(0, index), tmp_path)
        rows.append({**formats.question(0, index), **row, "failure": ""})
    table, curves = formats.tables(rows)
    assert table.rows[0][6] == "yes"
    assert float(curves.rows[0][2]) <= 1e-9


@pytest.mark.slow
def test_at_140_s_no_law_matters_for_the_margins(tmp_path: Path) -> None:
    question = factored_force.question(0, 7)
    assert question == {"asked": "aiaa-s-114", "duration": 140.0, "friction": 0.01}
    row = {**question, **factored_force.answer(question, tmp_path), "failure": ""}
    _, outcome = factored_force.tables([row])
    assert outcome.rows[0][3] == "static"
    assert outcome.rows[0][6] == "yes"
    assert outcome.rows[0][7].startswith("global")
    # what the truss takes at rest is the same for all, to rounding
    assert float(outcome.rows[0][4]) < 1e-3
