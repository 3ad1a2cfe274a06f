"""The comparison of simulation times: its choice of settings, its table, and without Exudyn."""

import sys

import numpy as np
import pytest

from benchmarks.exudyn import pairing, peer
from benchmarks.exudyn.__main__ import main
from benchmarks.exudyn.peer import Run, Setting
from studies.common.exit_codes import ExitCode, StudyError


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second of the coarsest pendulums, and Exudyn a stand-in made of arrays."""
    import dataclasses

    short = tuple(dataclasses.replace(case, duration=0.1) for case in pairing.cases(elements=1))
    monkeypatch.setattr(pairing, "cases", lambda: short)
    monkeypatch.setattr("benchmarks.exudyn.peer.load", lambda: type("E", (), {"__version__": "1"}))

    def stand_in(case: pairing.PairedCase, steps: int, setting: Setting) -> Run:
        size = len(case.chain.links)
        seconds = 1e3 * steps * (2.0 if setting.scheme == "trapezoidal" else 1.0)
        return Run(np.full((size, 2, 11), 0.05 / steps**2), steps, seconds, seconds, 0.1)

    monkeypatch.setattr(pairing, "their_run", stand_in)


def test_each_code_takes_its_cheapest_setting_below_the_limit(small: None) -> None:
    case = pairing.cases()[0]
    found = pairing.compare(case, lambda _: None, rounds=1)
    # error of the stand-in: sqrt(2) 0.05 / steps^2, 2.8e-5 m at 50; 50 * 1.02 * sqrt(2.8) follow
    implicit, explicit = found.theirs
    assert implicit.runs[0].steps == 86
    assert explicit.runs[0].steps == 180
    assert implicit.setting.startswith("generalised alpha")
    assert explicit.setting.startswith("Verlet")
    assert implicit.median("seconds") == 86e3
    assert 0.0 < found.ours.error <= pairing.LIMIT
    assert found.ratio == found.ours.median("seconds") / 86e3  # shorter of 86e3 s and 180e3 s


def test_the_command_prints_both_pendulums(small: None, capsys) -> None:
    assert main([]) == ExitCode.OK
    printed = capsys.readouterr().out
    assert [line.split()[0] for line in printed.splitlines() if "Exudyn" in line][:3] == [
        *("single", "single", "double")
    ]


def test_no_setting_below_the_limit_is_said(small: None, monkeypatch) -> None:
    monkeypatch.setattr(pairing, "LIMIT", 1e-13)
    monkeypatch.setattr(pairing, "OUR_TOLERANCES", (1e-5, 8e-6))
    with pytest.raises(StudyError, match="antenna-ocp: no setting that was tried"):
        pairing.compare(pairing.cases()[0], lambda _: None)


def test_a_run_that_blows_up_is_infinitely_far() -> None:
    path = np.zeros((1, 2, 3))
    assert pairing.distance(path, path + np.array([3.0, 4.0])[:, None]) == 5.0
    assert pairing.distance(path, path * np.nan) == np.inf


def test_without_exudyn_its_requirements_are_named(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "exudyn", None)
    assert main([]) == ExitCode.BAD_INPUT
    assert "pip install -r benchmarks/exudyn/requirements.txt" in capsys.readouterr().err


def test_exudyn_moves_as_we_do() -> None:
    pytest.importorskip("exudyn", reason="Exudyn is not installed")
    for case in pairing.cases(elements=1):
        ours = pairing.our_run(case, 7, 1e-8).ends[..., :11]
        settings = [Setting("trapezoidal"), Setting("generalised alpha")]
        for setting in [*settings, pairing.EXPLICIT] if case.explicit else settings:
            path = peer.run(case.chain, 0.1, pairing.SAMPLE, 2e-5, setting).ends
            assert pairing.distance(path, ours) < 2e-5
