"""Solves that are done, kept in the results folder, so that a study that was killed goes on.

A study solves in the same order whenever it is run. So a solve is known by its number, and by a
mark of its mesh and its constants: these follow from replays, which another version may do in
another way.
"""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ocp import Mesh, Problem, Settings, Solution, solve
from studies.common.code_version import hashed
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import FinishedSteps

Solve = Callable[..., Solution]
"""What is called as `ocp.solve` is."""


class FinishedSolves:
    """`ocp.solve`, but what an earlier run has solved is read.

    Only solutions are kept: what failed is tried again, as its error says more than its words.

    Parameters
    ----------
    kept : FinishedSteps
        Of the results folder.
    say : callable
        Receives a line where a solve is read.
    """

    def __init__(self, kept: FinishedSteps, say: Callable[[str], None]) -> None:
        self._kept, self._say = kept, say
        self._count = 0

    def __call__(self, problem: Problem, *, mesh: Mesh, **how: Any) -> Solution:
        """The solution of a problem on a mesh, `how` as of `ocp.solve`.

        Raises
        ------
        OcpError
            As `ocp.solve` does.
        """
        self._count += 1
        take = functools.partial(solve, problem, mesh=mesh, partial=False, **how)
        begins_with = _mark(mesh, how.get("constants") or {})
        name = f"solve {self._count}"
        return self._kept.step(name, take, problem, self._say, begins_with=begins_with)


def within(until: float, solver: Solve) -> Solve:
    """A solver that ends at a time of the clock `time.monotonic` [s] at the latest.

    It raises a StudyError where that has passed.
    """

    def solved(problem: Problem, *, settings: Settings, **how: Any) -> Solution:
        left = until - clock.monotonic()
        if left <= 0.0:
            raise StudyError(
                "the seconds of the search are used up; give more --seconds", ExitCode.NOT_SOLVED
            )
        return solver(problem, settings=replace(settings, seconds=left), **how)

    return solved


def _mark(mesh: Mesh, constants: dict[Any, float]) -> str:
    """Few letters that differ where meshes or constants do."""
    numbers = [phase.breakpoints for phase in mesh.phases]
    numbers.append(np.array([*constants.values()], dtype=float))
    return hashed(np.concatenate(numbers).tolist())[:12]
