"""Sweeps: a fresh process each, medians, and what is derived from them."""

import io

import pytest
from studies.speed import growth_part, plots
from studies.speed.setup import Setup
from studies.speed.sweep import sweep

from studies.common.console import Console


def test_a_mesh_of_ten_intervals_is_measured(tmp_path) -> None:
    console = Console(io.StringIO(), io.StringIO())
    setup = Setup(console, repeats=1, limit=60.0, peers=False, environments=tmp_path)
    *_, record = sweep("growth", (10,), setup)
    (row,) = record["rows"]
    assert row["failure"] == ""
    (run,) = row["runs"]
    assert run["status"] == "Solve_Succeeded"
    assert run["memory"] > run["imports"] > 10  # [MiB]
    expected = run["solve"] / 10 / run["iterations"]
    assert growth_part.per_interval(row) == pytest.approx(expected)
    (table,) = growth_part.tables(record)
    assert str(run["iterations"]) in str(table)
    assert len(growth_part.draw(record).axes) == 3


def test_bars_and_curves_draw_rows_with_and_without_an_answer() -> None:
    medians = {"start": 0.1, "solve": 0.2, "verification": None, "process": 0.3}
    check = {"peak_error": 1e-4, "excess": -1.0, "miss": 0.0}
    good = {"problem": "A", "title": "good", "right": True, "medians": medians, "check": check}
    nothing = dict.fromkeys(medians)
    bad = good | {"title": "bad", "right": False, "medians": nothing, "check": None}
    rows = [row | {"why not": "not installed"} for row in (good, bad)]
    titles = {"A": "A: T = 1 s, least peak"}
    (panel,) = plots.bars(rows, titles).axes
    assert [label.get_text() for label in panel.get_yticklabels()] == ["good", "bad"]
    (panel,) = plots.curves(rows, titles).axes
    assert plots.worst_error(check) == 1e-4
