"""Whether a start ends where an earlier one did, as its first mesh tells.

All starts have the same first mesh. Two that end in one optimum of its program have one value
there, and the meshes after it would repeat what is done.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import replace

from ocp import FixedMesh, Interrupted, OcpError, Problem, Trial, solve
from studies.truss.search.question import Question


def ends_alike(
    question: Question, name: str, start: Callable[[], Problem], done: Sequence[Trial]
) -> Trial | None:
    """The motion of an earlier start if this one ends there; None if it is to be solved further.

    Parameters
    ----------
    start : states the problem of the start with this name.
    done : what came of the starts before.
    """
    earlier = [trial for trial in done if trial.error is None]
    if not earlier:
        return None
    begin, say = clock.monotonic(), question.console.live
    settings = replace(question.settings, refinement=FixedMesh(), verify=False)
    try:
        found = solve(
            start(), settings=settings, progress=lambda line: say(f"first mesh of {name}: {line}")
        )
    except Interrupted:
        raise
    except OcpError:
        return None
    for trial in earlier:
        before = trial.solved.mesh_iterations[0].objective
        if abs(found.objective - before) <= question.same * abs(before):
            return replace(trial, name=name, seconds=clock.monotonic() - begin)
    return None
