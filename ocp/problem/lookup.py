"""Expressions of a problem by their names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ocp.errors import StatementError
from ocp.problem.problem import Problem
from ocp.problem.symbols import Time


def named(problem: Problem, name: Any, phase: str | None = None) -> Any:
    """What a name stands for; anything but a string is handed back as it is.

    Parameters
    ----------
    name : of a signal, unknown, constant, functional, or bound, or "objective" (as it was stated).
    phase : whose bounds are meant; those of all phases if None.

    Raises
    ------
    StatementError
        When nothing or more than one thing has the name.
    """
    if not isinstance(name, str):
        return name
    found = [value for key, value in _all(problem, phase) if key == name]
    if not found and name == "objective":
        return problem.minimise if problem.minimise is not None else problem.maximise
    if len(found) != 1:
        known = ", ".join(sorted({f"'{key}'" for key, _ in _all(problem, phase)}))
        raise StatementError(
            f"{len(found)} things of '{problem.name}' are named '{name}'; named are {known}"
        )
    return found[0]


def _all(problem: Problem, phase: str | None) -> Iterator[tuple[str, Any]]:
    for symbol in problem.symbols:
        if not isinstance(symbol, Time):
            yield symbol.name, symbol
    for bound in problem.boundary_constraints:
        yield bound.name, bound.expression
    for own in problem.phases:
        if phase in (None, own.name):
            for bound in own.bounds:
                yield bound.name, bound.expression
