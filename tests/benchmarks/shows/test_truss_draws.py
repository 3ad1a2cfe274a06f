"""Twelve random studies of the truss keep what must hold for all."""

from pathlib import Path

import pytest

from benchmarks.shows.truss_random import answer, question
from studies.common.exit_codes import ExitCode


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*spring:UserWarning")
@pytest.mark.parametrize("index", range(12))
def test_a_random_study_keeps_what_must_hold(index: int, tmp_path: Path) -> None:
    row = answer(question(0, index), tmp_path)
    assert not row["traceback"], (tmp_path / "printed.txt").read_text("utf-8")
    assert row["code"] in (
        ExitCode.OK,
        ExitCode.INFEASIBLE,
        ExitCode.NOT_SOLVED,
        ExitCode.NOT_VERIFIED,
    )
    if row["code"] == ExitCode.OK:
        assert row["check"] == ExitCode.OK, (tmp_path / "printed_check.txt").read_text("utf-8")
        assert row["beaten_by"] == ""
    if row["code"] == ExitCode.INFEASIBLE:
        assert row["proof"], row["complaint"]
    if row["code"] == ExitCode.NOT_SOLVED:
        words = (
            "the smallest relaxation found",
            "found under the other caps is",
            "no motion was found that keeps all of these caps",
        )
        assert any(said in row["complaint"] for said in words), row["complaint"]
