"""All fifteen problems as stated: structure, optima, guesses."""

import math

import pytest

from benchmarks.optima.__main__ import select
from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.catalogue import CATALOGUE
from ocp import Between
from studies.common.exit_codes import StudyError

# name: phases, states a phase, controls a phase, unknowns, free times, optimum as published
STRUCTURE = {
    "brachistochrone": (1, 3, 1, 0, 1, 0.824759143157),
    "bryson_denham": (1, 2, 1, 0, 0, 4.0),
    "di_min_time": (1, 2, 1, 0, 1, 30.0),
    "peak_accel": (1, 2, 1, 0, 0, 3.0),
    "peak_accel_jerk": (1, 3, 1, 0, 0, 3 - math.sqrt(3)),
    "hypersensitive_50": (1, 1, 1, 0, 0, 1.330807),
    "alp_rider": (1, 4, 2, 0, 0, 2030.85609),
    "cartpole_kelly": (1, 4, 1, 0, 0, 58.80767),
    "goddard_vmax": (1, 3, 1, 0, 1, -1.01257),
    "catmix": (1, 2, 1, 0, 0, -4.80556e-2),
    "robot_arm": (1, 6, 3, 0, 1, 9.14093620),
    "gas_oil": (1, 2, 0, 3, 0, 5.2366e-3),
    "shuttle": (1, 6, 2, 0, 1, -math.degrees(0.59587608)),
    "via_point": (2, 2, 1, 0, 0, 10.125),
    "goddard_betts_3ph": (3, 3, (0, 1, 0), 0, 5, -18550.872),
}


@pytest.fixture(params=list(CATALOGUE))
def benchmark_stated(request: pytest.FixtureRequest) -> Benchmark:
    return CATALOGUE[request.param]()


def test_there_are_fifteen() -> None:
    assert list(CATALOGUE) == list(STRUCTURE)


def test_structure(benchmark_stated: Benchmark) -> None:
    problem = benchmark_stated.problem
    phases, states, controls, unknowns, free_times, _ = STRUCTURE[benchmark_stated.name]
    assert problem.name == benchmark_stated.name
    assert len(problem.phases) == phases
    assert {len(phase.states) for phase in problem.phases} == {states}
    found = tuple(len(problem.controls[phase.name]) for phase in problem.phases)
    assert found == (controls if isinstance(controls, tuple) else (controls,) * phases)
    assert len(problem.unknowns) == unknowns
    times = [time for phase in problem.phases for time in (phase.start, phase.end)]
    assert sum(isinstance(time, Between) for time in times) == free_times


def test_optimum_is_the_published_one(benchmark_stated: Benchmark) -> None:
    published = STRUCTURE[benchmark_stated.name][-1]
    # published values carry five or more digits
    assert benchmark_stated.optimum == pytest.approx(published, rel=1e-5)
    assert 0 < benchmark_stated.tolerance <= 1e-5
    assert benchmark_stated.source


def test_every_signal_has_a_guess_and_no_control_a_shape(benchmark_stated: Benchmark) -> None:
    problem = benchmark_stated.problem
    for phase in problem.phases:
        controls = problem.controls[phase.name]
        assert set(phase.guess) == {*phase.states, *controls}
        assert all(control.piecewise is None for control in controls)


def test_error_is_relative_and_signed() -> None:
    catmix = CATALOGUE["catmix"]()
    assert catmix.error(0.5 * catmix.optimum) == pytest.approx(0.5)
    assert catmix.error(2 * catmix.optimum) == pytest.approx(-1)


def test_selection() -> None:
    assert [b.name for b in select([])] == list(CATALOGUE)
    assert [b.name for b in select(["catmix", "shuttle"])] == ["catmix", "shuttle"]
    with pytest.raises(StudyError, match="no benchmark 'catmx'"):
        select(["catmx"])
