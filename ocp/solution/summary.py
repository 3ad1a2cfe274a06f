"""A solution in a few lines, to print."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ocp.problem.display import objective_unit, with_unit
from ocp.problem.symbols import Between

if TYPE_CHECKING:
    from ocp.solution.solution import Solution

# part of the duration within which a time is at its limit: what the solver's barrier leaves
_AT_LIMIT = 1e-6

_MOST_NUMBERS = 5  # of unknowns or peaks that are listed


def summary(solution: Solution) -> str:
    """At most ten lines: objective, verdict, time, mesh iterations, errors, unknowns and peaks."""
    width = max(len(what) for what, _ in _lines(solution))
    lines = [f"  {what:<{width}}  {text}" for what, text in _lines(solution)]
    return "\n".join([f"Solution of '{solution.problem.name}'", *lines])


def _lines(solution: Solution) -> Iterator[tuple[str, str]]:
    problem, phases = solution.problem, solution.trajectory.phases
    sense = "minimum" if problem.sense > 0 else "maximum"
    yield sense, with_unit(f"{solution.objective:.10g}", objective_unit(problem))
    yield "verdict", solution.verdict

    span = f"{phases[0].start:.6g} to {max(phase.end for phase in phases):.6g} s"
    count = sum(phase.intervals for phase in phases)
    in_phases = f" in {len(phases)} phases" if len(phases) > 1 else ""
    yield "time", f"{span}, {count} intervals{in_phases}{_times_at_limits(solution)}"
    yield (
        "solved in",
        f"{_counted(len(solution.mesh_iterations), 'mesh iteration')}, "
        f"{_counted(solution.iterations, 'iteration')}, {solution.seconds:.3g} s",
    )
    yield "worst error", _errors(solution)

    unknowns = {u.name: u.unit for u in problem.unknowns}
    if unknowns:
        values = solution.trajectory.unknowns
        yield (
            "unknowns",
            _listed([with_unit(f"{n} = {values[n]:.6g}", unknowns[n]) for n in unknowns]),
        )
    if problem.peaks:
        pairs = zip(problem.peaks, solution.trajectory.peaks, strict=True)
        yield "peaks", _listed([with_unit(f"{p.name} = {v:.6g}", p.unit) for p, v in pairs])


def _times_at_limits(solution: Solution) -> str:
    """The ends of phases that lie at a limit which was stated for them."""
    texts = []
    for phase, motion in zip(solution.problem.phases, solution.trajectory.phases, strict=True):
        if isinstance(phase.end, Between):
            near = _AT_LIMIT * (motion.end - motion.start)
            sides = {"lower": phase.end.lower, "upper": phase.end.upper}
            at = [side for side, limit in sides.items() if abs(motion.end - limit) <= near]
            texts += [f"the end of '{phase.name}' is at its {side} limit" for side in at]
    return "; " + _listed(texts) if texts else ""


def _errors(solution: Solution) -> str:
    """The worst errors, as parts of the sizes of what they are errors of."""
    verification = solution.verification
    if not solution.replay.phases:
        return "not verified"
    return (
        f"replayed end {verification.miss:.1e}, constraints {max(verification.excess, 0.0):.1e}, "
        f"dynamics {verification.dynamics:.1e} (relative)"
    )


def _listed(texts: list[str]) -> str:
    shown = ", ".join(texts[:_MOST_NUMBERS])
    more = len(texts) - _MOST_NUMBERS
    return f"{shown} and {more} more" if more > 0 else shown


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
