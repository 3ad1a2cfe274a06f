"""What would have to be relaxed where the solver finds no motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ocp import FixedMesh, OcpError, Problem, Settings, relaxed
from studies.common.exit_codes import ExitCode, StudyError

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


def none_found(
    names: Sequence[str], tried: int, needed: str, error: Exception, interrupted: bool
) -> StudyError:
    """That no start found a motion.

    Parameters
    ----------
    names, tried : of the starts, and how many of them were tried.
    needed : the least relaxation, in words.
    error : of the first start.
    """
    starts = f"{len(names)} start{'s' * (len(names) > 1)}"
    if tried < len(names):  # the budget ended before the others
        starts = (
            f"{tried} of {starts}, because the time limit was reached; raise --seconds to try more"
        )
    return StudyError(
        f"no motion was found from {starts}; the smallest relaxation found: {needed}; from "
        f"{names[0]}: {error}",
        ExitCode.INTERRUPTED if interrupted else ExitCode.NOT_SOLVED,
    )
