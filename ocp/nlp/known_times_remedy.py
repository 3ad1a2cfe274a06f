"""What to do about known times at which expressions step or bend, where a solve has failed.

A phase with a free time begins or ends on one side or the other of each known time. The engine
tries these sides. A user who splits the phase there states which one is meant.
"""

from __future__ import annotations

from ocp.problem.problem import Problem

_MOST_SHOWN = 4


def remedy_for_known_times(problem: Problem) -> str:
    """Where a phase with a free time may be split; ends with "or", or is empty."""
    for phase in problem.phases:
        times = problem.steps[phase.name]
        if phase.has_fixed_times or not times:
            continue
        shown = ", ".join(f"{time:.6g}" for time in times[:_MOST_SHOWN])
        more = f" and {len(times) - _MOST_SHOWN} more times" if len(times) > _MOST_SHOWN else ""
        return (
            f"expressions of phase '{phase.name}' step or bend at {shown} s{more}, and a free time "
            "of the phase may lie on either side of them: split the phase there, and link the "
            "parts by joined(first, second); or "
        )
    return ""
