"""Mesh iterations before and now stand in a table of their own, where the file knows them."""

from benchmarks.shows.engine.stated import SHARED, Stated
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Row


def row(name: str, before: int | None, now: int) -> Row:
    answer = {"value": 1.0, "rounds": now, "iterations": 9, "processor": 0.1}
    own = {**answer, "kind": "right", "open": "", "words": "", "audited": None}
    answers = {guess: {**own, "rounds": now} for guess in ("crude", "none")}
    return {
        "problem": name,
        "failure": "",
        "best": 1.0,
        "answers": answers,
        "rounds before": before,
    }


def test_a_third_of_the_mesh_iterations_or_fewer_are_counted() -> None:
    rows = [row("few", 6, 3), row("many", 16, 4), row("failed", 12, 0), row("unknown", None, 2)]
    table = SHARED.tables(rows)[-1]
    assert [line[0] for line in table.rows] == ["many", "failed", "few"]
    assert table.notes == ("at most a third: 1 of 3",)


def test_a_file_that_knows_none_has_no_such_table() -> None:
    titles = [table.title for table in Stated("swings", "").tables([row("one", None, 2)])]
    assert "Mesh iterations without a guess" not in titles


def test_all_shared_limits_know_theirs() -> None:
    known = [
        Variant.nominal(name, "shared").stated["rounds_before"] for name in catalogue("shared")
    ]
    assert len(known) == 24
    assert sum(before >= 10 for before in known) == 16
