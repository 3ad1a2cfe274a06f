"""Known times at which expressions step or bend while the times of their phase are free.

A breakpoint of a mesh stands at a fraction of its phase. Where the phase begins or ends when it
likes, none stands at a known time, and no mesh follows what changes there.
"""

from __future__ import annotations

from collections.abc import Iterator

from ocp.problem.instants import stepping_times
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem, expressions_over
from ocp.problem.symbols import Between

_MOST_SHOWN = 4


def unplaced_times(problem: Problem) -> Iterator[tuple[Phase, tuple[float, ...]]]:
    """Phases with a free time, and the known times at which their expressions step or bend [s].

    They are those that may lie inside the phase.
    """
    for phase in problem.phases:
        start, end = phase.start, phase.end
        if not (isinstance(start, Between) or isinstance(end, Between)):
            continue
        first = start.lower if isinstance(start, Between) else float(start)
        last = end.upper if isinstance(end, Between) else float(end)
        times = stepping_times(expressions_over(phase, problem.functionals), first, last)
        if times:
            yield phase, times


def remedy_for_unplaced_times(problem: Problem) -> str:
    """Where a phase with a free time has to be split; ends with "or", or is empty."""
    for phase, times in unplaced_times(problem):
        shown = ", ".join(f"{time:.6g}" for time in times[:_MOST_SHOWN])
        more = f" and {len(times) - _MOST_SHOWN} more times" if len(times) > _MOST_SHOWN else ""
        return (
            f"expressions of phase '{phase.name}' step or bend at {shown} s{more}, and no mesh "
            "follows that where a time of the phase is free: split the phase there, and link the "
            "parts by joined(first, second); or "
        )
    return ""
