"""Which ordering of its rows MUMPS is asked for."""

import pytest

from benchmarks.speed.process.program import build, force_problem
from ocp import Phase, Problem, State
from ocp.nlp.ipopt import _ordering

MINIMUM_DEGREE, MINIMUM_FILL, DENSE_ROWS_APART = 0, 2, 6  # numbers of MUMPS


@pytest.mark.parametrize(("intervals", "ordering"), [(20, MINIMUM_FILL), (3000, DENSE_ROWS_APART)])
def test_an_unknown_that_very_many_rows_share_is_set_apart(intervals: int, ordering: int) -> None:
    # each of four points an interval bounds the force by its peak
    assert _ordering(build(force_problem(), intervals).program) == ordering


def test_without_an_unknown_that_is_shared_a_large_program_is_ordered_by_degree() -> None:
    x = State("x")
    phase = Phase("decay", {x: -x.symbol}, initial={x: 1.0}, end=1.0)
    problem = Problem("decay", [phase], minimise=phase.at_end(x))
    assert _ordering(build(problem, 3000).program) == MINIMUM_DEGREE
