"""Large problems: their sizes, and what some of them give."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from benchmarks.large.problems import PROBLEMS
from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.variant import Variant
from ocp import solve

STATES = {
    "heated rod": 20,
    "distillation": 32,
    "five-link arm": 10,
    "quadrotor": 8,
    "launch": 6,
}


@pytest.mark.parametrize("name", STATES)
def test_they_have_the_states_that_are_told(name: str) -> None:
    problem = PROBLEMS[name].make()
    assert {len(phase.states) for phase in problem.phases} == {STATES[name]}


@pytest.mark.slow
def test_rates_are_fitted_though_round_off_keeps_their_rows_above_the_tolerance() -> None:
    """IPOPT met all conditions, rows to 4e-10, and went on for 1,700 iterations: "Unverified"."""
    stated = Variant.nominal("robertson_fit", "large")
    found = solve(problem_of(stated, True))
    assert found.objective == pytest.approx(stated.stated["optimum"], rel=1e-7)
    assert sum(entry.iterations for entry in found.mesh_iterations[1:]) < 200


@pytest.mark.slow
def test_the_optimum_of_the_fit_is_that_of_another_method() -> None:
    stated = Variant.nominal("robertson_fit", "large")
    times = stated.samples["times"]
    measured = np.array([stated.samples[name] for name in "abc"])

    def misses(logarithms):
        slow, back, fast = np.array([0.04, 1e4, 3e7]) * np.exp(logarithms)

        def rates(_, y):
            forth, other = slow * y[0] - back * y[1] * y[2], fast * y[1] ** 2
            return [-forth, forth - other, other]

        values = solve_ivp(
            rates, (0, times[-1]), [1, 0, 0], "Radau", t_eval=times, rtol=1e-9, atol=1e-13
        ).y
        values[1] /= 3.65e-5
        return ((values - measured) / 0.01).ravel()

    found = least_squares(misses, [0.3, 0.3, 0.3])
    # the slopes are differences
    assert 2 * found.cost == pytest.approx(stated.stated["optimum"], rel=1e-7)


@pytest.mark.slow
def test_a_turn_is_right():
    # Bilimoria and Wie give four digits
    found = solve(problem_of(Variant.nominal("rigid_body_turn", "large"), True))
    assert found.objective == pytest.approx(3.243, abs=5e-4)
