"""A singular arc: what finer controls promise is worked off, as far as is asked for."""

import numpy as np
import pytest

from ocp import Accuracy, Control, Phase, Problem, Settings, State, certify, solve

# min int x^2 + v^2 from (0, 1) under |u| <= 1 (Jacobson, Gershwin, Lele, IEEE TAC 1970): u = -1
# until v = -x, at sqrt 2, then the singular u = x, on which x decays as exp(-t). The end is
# on it.
SWITCH, END = np.sqrt(2), 5.0
LEFT = SWITCH - 1
LAST = LEFT * np.exp(SWITCH - END)


def optimum():
    """Both arcs' costs: of x = t - t^2/2, v = 1 - t, and of x = -v."""
    bang = np.polynomial.Polynomial([0, 1, -0.5]) ** 2 + np.polynomial.Polynomial([1, -1]) ** 2
    return bang.integ()(SWITCH) + LEFT**2 - LAST**2


@pytest.mark.parametrize("intervals", [13, 20, 31])
@pytest.mark.parametrize("asked", [1e-6, 1e-8])
def test_a_singular_arc_is_found_as_exactly_as_asked_for(intervals, asked):
    x, v, u = State("x"), State("v"), Control("u", lower=-1, upper=1)
    run = Phase("run", {x: v, v: u}, {x: 0, v: 1}, {x: LAST, v: -LAST}, end=END)
    problem = Problem("regulator", run, minimise=run.integral(x**2 + v**2))
    settings = Settings(intervals=intervals, accuracy=Accuracy(objective=asked))
    solution = solve(problem, settings=settings)
    off = abs(solution.objective / optimum() - 1)
    # what is still promised is said, and counts double: it is of first order
    promised = solution.mesh_iterations[-1].gain
    assert off <= 2 * max(asked, promised)
    assert promised <= asked or "finer controls promise a gain" in solution.verdict
    # 1e-8 is not reached from every mesh, but then the rest is small, and said
    assert promised <= 2e-6
    assert certify(solution).passed
