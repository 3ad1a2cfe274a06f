"""Which ordering of its rows MUMPS is asked for."""

import pytest

from ocp import Mesh, Phase, Problem, Settings, State
from ocp.mesh.mesh import uniform
from ocp.nlp.ipopt import _ordering
from ocp.transcription.transcribe import transcribe
from tests.ocp.problems import scales_around_the_guess

MINIMUM_DEGREE, MINIMUM_FILL, DENSE_ROWS_APART = 0, 2, 6  # numbers of MUMPS
X = State("x")
DECAY = Phase("decay", {X: -X.symbol}, initial={X: 1.0}, end=1.0)


def ordering(objective, intervals):
    problem, scheme = Problem("decay", [DECAY], minimise=objective), Settings().scheme
    mesh, scales = Mesh((uniform(intervals, scheme.degree),)), scales_around_the_guess(problem)
    return _ordering(transcribe(problem, mesh, scheme, "automatic", scales).program)


@pytest.mark.parametrize(("intervals", "wanted"), [(20, MINIMUM_FILL), (3000, DENSE_ROWS_APART)])
def test_an_unknown_that_very_many_rows_share_is_set_apart(intervals: int, wanted: int) -> None:
    # each point of an interval bounds the state by its peak
    assert ordering(DECAY.peak(X), intervals) == wanted


def test_without_an_unknown_that_is_shared_a_large_program_is_ordered_by_degree() -> None:
    assert ordering(DECAY.at_end(X), 3000) == MINIMUM_DEGREE
