"""The nonlinear program does not grow with the number of modules; its timing is a benchmark."""

import pytest

from studies import build_time
from studies.cli import main


def test_the_program_is_as_large_for_a_thousand_modules(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(build_time, "REPEATS", 1)
    monkeypatch.setattr(build_time, "INTERVALS", 8)
    assert main(["build-time"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    small, large = ([row[1:3] for row in rows if row[:1] == [n]] for n in ("24", "1000"))
    assert small == large
    assert small
