"""The nonlinear program does not grow with the number of modules; its timing is a benchmark."""

import io
from pathlib import Path

import pytest

from benchmarks.parts import Setup
from benchmarks.speed.parts import build
from studies.common.console import Console


def test_the_program_is_as_large_for_a_thousand_modules(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(build, "INTERVALS", 8)
    console = Console(io.StringIO(), io.StringIO())
    setup = Setup(console, repeats=1, limit=60.0, peers=False, environments=tmp_path)
    *_, record = build.measure(setup)
    (table,) = build.tables(record)
    small, large = ([row[1:3] for row in table.rows if row[0] == n] for n in ("24", "1000"))
    assert small == large
    assert small
