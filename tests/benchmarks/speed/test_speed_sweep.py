"""Sweeps: a fresh process each, medians, and what is derived from them."""

import io

import numpy as np
import pytest

from benchmarks.parts import Setup
from benchmarks.speed.parts import growth
from benchmarks.speed.sweep import sweep
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
    assert growth.per_interval(row) == pytest.approx(expected)
    (table,) = growth.tables(record)
    assert str(run["iterations"]) in str(table)
    assert len(growth.draw(record).axes) == 3


def test_a_run_without_iterations_is_a_gap_not_a_zero() -> None:
    run = {"set_up": 0.1, "solve": 1.0, "memory": 100.0, "intervals": 100}
    rows = [
        {"value": value, "runs": [run | {"iterations": count}]}
        for value, count in ((100, 10), (300, 0))
    ]
    panel, *_ = growth.draw({"rows": rows}).axes
    (line,) = panel.get_lines()
    values = np.asarray(line.get_ydata(), float)
    assert values[0] > 0
    assert np.isnan(values[1])
