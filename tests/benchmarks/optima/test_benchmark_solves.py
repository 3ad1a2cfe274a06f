"""Benchmarks solved with default settings: pinned optima, and the command around them."""

import numpy as np
import pytest

from benchmarks.cases import measure
from benchmarks.optima.__main__ import main, passes
from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.catalogue import CATALOGUE
from benchmarks.optima.checks import largest_violation
from ocp import Control, FixedMesh, Phase, Problem, Settings, State, solve
from studies.common.exit_codes import ExitCode

# name: optimum, of what is minimised. The sources stand beside the problems; each must be met to
# the benchmark's own tolerance, between 1e-5 and 1e-9 relative.
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
    "goddard_betts_3ph": -18550.8718635,  # Betts, yapss
}


LONG = {
    "goddard_vmax": -1.01257632464,  # four arcs, solved as four phases
    "shuttle": -34.14118428,  # Betts
}


@pytest.mark.parametrize(
    "name", [*OPTIMA, *(pytest.param(n, marks=pytest.mark.slow) for n in LONG)]
)
def test_optimum_is_reached(name: str) -> None:
    benchmark = CATALOGUE[name]()
    found = measure(name)
    assert passes(found), found
    assert found.value == pytest.approx((OPTIMA | LONG)[name], rel=benchmark.tolerance)


def test_a_start_near_the_optimum_leads_there_on_every_processor() -> None:
    # 16 iterations; with a limit that leaves the coast no interior, 48 to 1,010 by the processor
    assert measure("goddard_betts_3ph").iterations <= 25


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


def stated(monkeypatch: pytest.MonkeyPatch, benchmark: Benchmark) -> None:
    """One benchmark in the place of all others, solved in this process."""
    catalogue = {benchmark.name: lambda: benchmark}
    monkeypatch.setattr("benchmarks.optima.catalogue.CATALOGUE", catalogue)
    monkeypatch.setattr("benchmarks.optima.__main__.CATALOGUE", catalogue)
    monkeypatch.setattr("benchmarks.optima.__main__.solved_apart", measure)


def test_a_wrong_optimum_fails_and_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stated(monkeypatch, Benchmark(_line(), 2.0, 1e-6, "a mistake"))
    assert main([]) == ExitCode.NOT_VERIFIED
    printed = capsys.readouterr().out
    assert "-5.0e-01" in printed
    assert "trusted optimum" in printed.split("error:")[0]
    assert "0 of 1 passed" in printed


def test_a_failed_solve_is_listed_not_raised(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("move", {x: u}, initial={x: 0}, final={x: 2}, end=1.0)
    problem = Problem("unreachable", (phase,), minimise=phase.integral(u.symbol**2))
    stated(monkeypatch, Benchmark(problem, 1.0, 1e-6, "none"))
    assert main([]) == ExitCode.NOT_VERIFIED
    assert "Infeasible: " in capsys.readouterr().out


def test_a_problem_is_solved_in_a_process_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["via_point"]) == ExitCode.OK
    assert "1 of 1 passed" in capsys.readouterr().out


def test_list_names_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == ExitCode.OK
    printed = capsys.readouterr().out
    assert all(name in printed for name in CATALOGUE)
    assert "Bryson & Ho" in printed


def test_unknown_name_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["catmx"]) == ExitCode.BAD_INPUT
    assert "did you mean catmix?" in capsys.readouterr().err
