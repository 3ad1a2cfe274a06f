"""The comparison of simulation times: its choice of settings, its table, and without Exudyn."""

import json
import sys

import numpy as np
import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError
from studies.exudyn import peer, speed
from studies.exudyn.peer import Run, Setting


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second of the coarsest pendulums, and Exudyn a stand-in made of arrays."""
    import dataclasses

    short = tuple(dataclasses.replace(case, duration=0.1) for case in speed.cases(elements=1))
    monkeypatch.setattr(speed, "cases", lambda: short)
    monkeypatch.setattr("studies.exudyn.peer.load", lambda: type("E", (), {"__version__": "1"}))

    def stand_in(case: speed.Case, steps: int, setting: Setting) -> Run:
        size = len(case.chain.links)
        seconds = 1e3 * steps * (2.0 if setting.scheme == "trapezoidal" else 1.0)
        return Run(np.full((size, 2, 11), 0.05 / steps**2), steps, seconds, seconds, 0.1)

    monkeypatch.setattr(speed, "their_run", stand_in)


def test_each_code_takes_its_cheapest_setting_below_the_limit(small: None) -> None:
    case = speed.cases()[0]
    found = speed.compare(case, lambda _: None, rounds=1)
    # error of the stand-in: sqrt(2) 0.05 / steps^2, 2.8e-5 m at 50; 50 * 1.02 * sqrt(2.8) follow
    implicit, explicit = found.theirs
    assert implicit.steps == 86
    assert explicit.steps == 180
    assert implicit.setting.startswith("generalised alpha")
    assert explicit.setting.startswith("Verlet")
    assert implicit.seconds == 86e3
    assert 0.0 < found.ours.error <= speed.LIMIT
    assert found.ratio == found.ours.seconds / 86e3  # the shorter of 86e3 s and 180e3 s


def test_the_command_writes_what_it_prints(small: None, tmp_path, capsys) -> None:
    out = tmp_path / "speed"
    assert main(["arm-speed", "--results", str(out)]) == ExitCode.OK
    assert capsys.readouterr().out.rstrip() == (out / "table.txt").read_text("utf-8").rstrip()
    record = json.loads((out / "speed.json").read_text("utf-8"))
    assert [row["case"] for row in record["rows"]] == ["single", "double"]
    assert record["passed"]


def test_no_setting_below_the_limit_is_said(small: None, monkeypatch) -> None:
    monkeypatch.setattr(speed, "LIMIT", 1e-13)
    monkeypatch.setattr(speed, "OUR_TOLERANCES", (1e-5, 8e-6))
    with pytest.raises(StudyError, match="antenna-ocp: no setting that was tried"):
        speed.compare(speed.cases()[0], lambda _: None)


def test_a_run_that_blows_up_is_infinitely_far() -> None:
    path = np.zeros((1, 2, 3))
    assert speed.distance(path, path + np.array([3.0, 4.0])[:, None]) == 5.0
    assert speed.distance(path, path * np.nan) == np.inf


def test_without_exudyn_the_extra_is_named(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "exudyn", None)
    assert main(["arm-speed"]) == ExitCode.BAD_INPUT
    assert "pip install 'antenna-ocp[exudyn]'" in capsys.readouterr().err


def test_exudyn_moves_as_we_do() -> None:
    pytest.importorskip("exudyn", reason="the optional extra is not installed")
    for case in speed.cases(elements=1):
        ours = speed.our_run(case, 7, 1e-8).ends[..., :11]
        settings = [Setting("trapezoidal"), Setting("generalised alpha")]
        for setting in [*settings, speed.EXPLICIT] if case.explicit else settings:
            path = peer.run(case.chain, 0.1, speed.SAMPLE, 2e-5, setting).ends
            assert speed.distance(path, ours) < 2e-5
