"""Spoilt answers: what is done to them, and that a certificate refuses them."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.shows.engine import spoilt
from ocp.mesh.mesh import PhaseMesh


def test_a_breakpoint_is_moved_and_those_that_it_passes_are_left_out() -> None:
    mesh = PhaseMesh(np.array([0.0, 0.2, 0.5, 0.505, 1.0]), np.array([3, 4, 5, 6]), (2,))
    moved = spoilt.moved_breakpoint(mesh, mesh.breakpoints, 2, 0.51)
    assert moved.breakpoints == pytest.approx([0.0, 0.2, 0.51, 1.0])
    assert moved.degrees.tolist() == [3, 4, 6]
    assert moved.movable == ()


def test_limits_are_wider_by_a_part_of_the_larger_one_but_for_equations() -> None:
    lower, upper = np.array([-1.0, 2.0, -np.inf, 0.0]), np.array([3.0, 2.0, 5.0, np.inf])
    low, high = spoilt.wider((lower, upper))
    assert low == pytest.approx([-1.0 - 3e-4, 2.0, -np.inf, 0.0])
    assert high == pytest.approx([3.0 + 3e-4, 2.0, 5.0 + 5e-4, np.inf])


@pytest.mark.slow
@pytest.mark.parametrize("index", [5, 6, 7, 18, 24], ids=spoilt.WAYS)
def test_each_way_of_spoiling_is_refused_by_the_check_that_should(
    index: int, tmp_path: Path
) -> None:
    question = spoilt.question(1, index)
    row = spoilt.answer(question, tmp_path)
    assert question["way"] == spoilt.WAYS[index % 5]
    assert row["by"], row
    (counts,) = spoilt.tables([{**question, **row, "index": index, "failure": ""}])[1:]
    assert f"{question['way']}" in str(counts)
