"""Benchmarks solved with default settings: pinned optima, and the command around them."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.optima.__main__ import main
from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.measure import Measurement, largest_violation, measure
from benchmarks.optima.problems import CATALOGUE
from ocp import Control, FixedMesh, Phase, Problem, Settings, State, solve
from studies.common.exit_codes import ExitCode

# name: optimum. The sources stand in the problems' docstrings; each must be met to the
# benchmark's own tolerance, between 1e-5 and 1e-9 relative.
OPTIMA = {
    "brachistochrone": 0.8247591431566,  # cycloid
    "bryson_denham": 4.0,  # 4/(9 l)
    "di_min_time": 30.0,  # sqrt(2 D (1/a + 1/b))
    "peak_accel": 3.0,  # 4 D/T^2
    "hypersensitive_50": 1.330806904943,  # closed form of the infinite horizon
    "cartpole_kelly": 58.8076674582,  # boundary value problem of Pontryagin's principle
    "catmix": -0.04805568445,  # COPS 3.0
    "gas_oil": 0.00523659583,  # COPS 3.0
    "via_point": 81 / 8,  # cubic spline
    "goddard_betts_3ph": 18550.8718635,  # Betts, yapss
}


LONG = {
    "goddard_vmax": 1.01257632464,  # four arcs, solved as four phases
    "shuttle": 34.14118428,  # Betts
}


@pytest.mark.parametrize(
    "name", [*OPTIMA, *(pytest.param(n, marks=pytest.mark.slow) for n in LONG)]
)
def test_optimum_is_reached(name: str) -> None:
    benchmark = CATALOGUE[name]()
    found = measure(benchmark)
    assert found.passed, found
    assert found.value == pytest.approx((OPTIMA | LONG)[name], rel=benchmark.tolerance)
    assert found.violation is not None
    assert found.violation <= 1e-7  # the default path tolerance, at 10,000 times


def test_a_start_near_the_optimum_leads_there_on_every_processor() -> None:
    # 16 iterations; with a limit that leaves the coast no interior, 48 to 1,010 by the processor
    found = measure(CATALOGUE["goddard_betts_3ph"]())
    assert found.iterations is not None
    assert found.iterations <= 25


def _line(**bounds: float) -> Problem:
    """Least effort from 0 to 1 in 1 s; the optimum is 1, at constant speed."""
    x, u = State("x", **bounds), Control("u")
    phase = Phase("move", {x: u}, initial={x: 0}, final={x: 1}, guess={x: (0, 1)}, end=1.0)
    return Problem("line", (phase,), minimise=phase.integral(u.symbol**2))


def test_violation_is_found_between_the_points() -> None:
    solution = solve(_line(upper=1.0))
    assert largest_violation(solution) <= 1e-9  # x = t touches its bound at the end
    tighter = solve(CATALOGUE["bryson_denham"]().problem, settings=Settings(refinement=FixedMesh()))
    dense = tighter.sample(tighter.problem.phases[0].states[0], np.linspace(0, 1, 10_000))
    assert largest_violation(tighter) == pytest.approx(9 * (dense.max() - 1 / 9), rel=1e-3)
    assert largest_violation(tighter) > 1e-6  # one unrefined mesh does not keep the cap


def test_a_wrong_optimum_fails_and_is_explained(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = Benchmark("line", _line(), 2.0, 1e-6, "a mistake", ("test",))
    monkeypatch.setattr("benchmarks.optima.__main__.CATALOGUE", {"line": lambda: wrong})
    assert main([]) == ExitCode.NOT_VERIFIED
    printed = capsys.readouterr().out
    assert "FAIL" in printed
    assert "verified, but the error is -5.0e-01" in printed
    assert "0 of 1 passed" in printed


def test_a_failed_solve_is_listed_not_raised() -> None:
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("move", {x: u}, initial={x: 0}, final={x: 2}, end=1.0)
    problem = Problem("unreachable", (phase,), minimise=phase.integral(u.symbol**2))
    found = measure(Benchmark("unreachable", problem, 1.0, 1e-6, "none", ("test",)))
    assert isinstance(found, Measurement)
    assert not found.passed
    assert found.value is None
    assert found.verdict.startswith("Infeasible")


def test_command_writes_its_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "optima.json"
    assert main(["via_point", "--output", str(file)]) == ExitCode.OK
    assert "1 of 1 passed" in capsys.readouterr().out
    (record,) = json.loads(file.read_text("utf-8"))
    assert record["passed"]
    assert record["value"] == pytest.approx(10.125, rel=1e-9)


def test_a_file_that_cannot_be_written_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["via_point", "--output", str(tmp_path)]) == ExitCode.BAD_INPUT
    assert "cannot be written" in capsys.readouterr().err


def test_list_names_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == ExitCode.OK
    printed = capsys.readouterr().out
    assert all(name in printed for name in CATALOGUE)
    assert "Bryson & Ho" in printed


def test_unknown_name_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["catmx"]) == ExitCode.BAD_INPUT
    assert "the names are brachistochrone" in capsys.readouterr().err
