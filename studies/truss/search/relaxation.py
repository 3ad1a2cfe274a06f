"""What would have to be relaxed where the solver finds no motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ocp import FixedMesh, OcpError, Problem, Settings, relaxed

RELAXING = 60.0  # [s] that may be spent on it
RELAXED = Settings(intervals=40, refinement=FixedMesh())  # as `ocp.relaxed` has it by default


def relaxation_in_words(problem: Problem, progress: Callable[[str], None]) -> str:
    """The limits that a relaxed problem changes; empty if it was not solved.

    Where the truss begins and ends, and that it rests there, are no limits that a user could move.
    """
    settings = replace(RELAXED, seconds=RELAXING)
    ends = [
        f"{phase.name}: {state.name} {word}"
        for phase in problem.phases
        for word, given in (("initial", phase.initial), ("final", phase.final))
        for state in given
    ]
    try:
        found = relaxed(problem, keep=ends, settings=settings, progress=progress)
    except (OcpError, KeyboardInterrupt):
        return ""
    return "; ".join(map(str, found.items)) or "none: on one mesh, a motion meets all limits"
