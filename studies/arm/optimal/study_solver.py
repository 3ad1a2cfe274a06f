"""The solver of a study: what it has solved is kept in the results folder, so that it goes on.

A study solves in the same order whenever it is run. So a solve is known by its number, and by a
mark of its mesh and its constants: these follow from replays, which another version may do in
another way.
"""

from __future__ import annotations

import functools
import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ocp import Mesh, Problem, Settings, Solution, solve
from studies.common.code_version import hashed
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps

Say = Callable[[str], None]


def unheard(line: str) -> None:
    """Where lines go that nobody wants."""


@dataclass(eq=False)
class StudySolver:
    """`ocp.solve` with what all solves of a study share; what an earlier run has solved is read.

    Only solutions are kept: what failed is tried again, as its error says more than its words.

    Attributes
    ----------
    say, live : receive a line a step, and a line now and then.
    kept : finished steps of the results folder.
    until : time of the clock `time.monotonic` [s] at which solves end at the latest.
    count : how many solves there were.
    seconds : of the processor that they took [s].
    """

    say: Say = unheard
    live: Say = unheard
    kept: FinishedSteps = NOTHING_KEPT
    until: float = math.inf
    count: int = 0
    seconds: float = 0.0

    def __call__(self, problem: Problem, *, mesh: Mesh, settings: Settings, **how: Any) -> Solution:
        """The solution of a problem on a mesh, `how` as of `ocp.solve`.

        Raises
        ------
        OcpError
            As `ocp.solve` does.
        StudyError
            If no time is left.
        """
        if math.isfinite(self.until):
            settings = replace(settings, seconds=self._left())
        self.count += 1
        take = functools.partial(
            solve,
            problem,
            mesh=mesh,
            settings=settings,
            partial=False,
            progress=self.live,
            **how,
        )
        begin = clock.process_time()
        begins_with = _mark(mesh, how.get("constants") or {})
        try:
            name = f"solve {self.count}"
            return self.kept.step(name, take, problem, self.say, begins_with=begins_with)
        finally:
            self.seconds += clock.process_time() - begin

    def _left(self) -> float:
        """Time until the end [s]."""
        left = self.until - clock.monotonic()
        if left <= 0.0:
            raise StudyError(
                "the search reached its time limit; give more --seconds", ExitCode.NOT_SOLVED
            )
        return left


def _mark(mesh: Mesh, constants: dict[Any, float]) -> str:
    """Few letters that differ where meshes or constants do."""
    numbers = [phase.breakpoints for phase in mesh.phases]
    numbers.append(np.array([*constants.values()], dtype=float))
    return hashed(np.concatenate(numbers).tolist())[:12]
