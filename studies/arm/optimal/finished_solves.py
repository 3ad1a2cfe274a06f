"""Solves that are done, kept in the results folder, so that a study that was killed goes on.

A study solves in the same order whenever it is run. So a solve is known by its number, and by a
mark of its mesh and its constants: these follow from replays, which another version may do in
another way.
"""

from __future__ import annotations

import hashlib
import time as clock
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ocp import Mesh, Problem, Settings, Solution, Trial, solve
from studies.common.finished import FinishedStarts

Solve = Callable[..., Solution]
"""What is called as `ocp.solve` is."""
_KIND = "solve"
_LEAST_SECONDS = 1e-3  # a budget of none would be no budget


class FinishedSolves:
    """`ocp.solve`, but what an earlier run has solved is read.

    Only solutions are kept: what failed is tried again, as its error says more than its words.

    Parameters
    ----------
    kept : FinishedStarts
        Of the results folder.
    say : callable
        Receives a line where a solve is read.
    """

    def __init__(self, kept: FinishedStarts, say: Callable[[str], None]) -> None:
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
        name = f"{self._count:02d}-{_mark(mesh, how.get('constants') or {})}"
        earlier = self._kept.read(_KIND, name, problem)
        if earlier is not None and earlier.solution is not None:
            self._say(f"solve {self._count}: found in an earlier run")
            return earlier.solution

        solution = solve(problem, mesh=mesh, partial=False, **how)
        self._kept.keep(_KIND, Trial(name, solution, None, float(solution.objective), 0.0))
        return solution


def within(until: float, solver: Solve) -> Solve:
    """A solver that ends at a time of the clock `time.monotonic` [s] at the latest."""

    def solved(problem: Problem, *, settings: Settings, **how: Any) -> Solution:
        left = max(until - clock.monotonic(), _LEAST_SECONDS)
        return solver(problem, settings=replace(settings, seconds=left), **how)

    return solved


def _mark(mesh: Mesh, constants: dict[Any, float]) -> str:
    """Few letters that differ where meshes or constants do."""
    numbers = [phase.breakpoints for phase in mesh.phases]
    numbers.append(np.array([*constants.values()], dtype=float))
    return hashlib.sha256(np.concatenate(numbers).tobytes()).hexdigest()[:12]
