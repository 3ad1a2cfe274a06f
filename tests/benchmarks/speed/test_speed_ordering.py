"""Which ordering of its rows MUMPS is asked for."""

import pytest

from benchmarks.speed.program import build, force_problem
from ocp import Phase, Problem, State
from ocp.nlp.ipopt import _ordering


@pytest.mark.parametrize(("intervals", "ordering"), [(20, 2), (3000, 6)])
def test_an_unknown_that_very_many_rows_share_is_set_apart(intervals: int, ordering: int) -> None:
    # each of four points an interval bounds the force by its peak
    assert _ordering(build(force_problem(), intervals).program) == ordering


def test_without_an_unknown_that_is_shared_the_mesh_may_be_as_fine_as_it_likes() -> None:
    x = State("x")
    phase = Phase("decay", {x: -x.symbol}, initial={x: 1.0}, end=1.0)
    problem = Problem("decay", [phase], minimise=phase.at_end(x))
    assert _ordering(build(problem, 3000).program) == 2
