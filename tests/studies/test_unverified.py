"""An answer that fails its verification is kept and called so."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest

from ocp import Unverified
from ocp.analysis import worker_processes
from studies.cli import main
from studies.common.exit_codes import ExitCode


def test_an_unverified_answer_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    honest = worker_processes.solve

    def doubtful(*arguments: Any, **options: Any) -> Any:
        found = honest(*arguments, **options)
        failed = dataclasses.replace(found.verification, passed=False, reasons=("off by 1",))
        raise Unverified("off", dataclasses.replace(found, verification=failed))

    monkeypatch.setattr(worker_processes, "solve", doubtful)
    out = tmp_path / "out"
    arguments = ["truss", "--objective", "peak-acceleration", "--jerk-cap", "bezier"]
    arguments += ["--starts", "straight", "--no-figures", "--results", str(out)]
    assert main(arguments) == ExitCode.NOT_VERIFIED
    record = json.loads((out / "verification.json").read_text())
    assert record["verdict"] == "unverified: off by 1"
    assert not record["passed"]
    assert (out / "profile.csv").is_file()
