"""A pass from one statement to another that is easier to solve, with the way back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, runtime_checkable

import casadi as ca

from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Symbol, column_of, scalar


@dataclass(frozen=True, eq=False, repr=False)
class Restated:
    """Another problem that is solved in place of one, and how to get from one to the other.

    Both have phases of the same names and times. A symbol that both have stands for itself.

    Attributes
    ----------
    problem : Problem
        The new statement.
    back : mapping of Symbol to expression
        Each signal, unknown and peak of the old statement that the new one lacks, by symbols of the
        new one [its unit]. Other functionals that were replaced may be given, too.
    forth : mapping of Symbol to expression
        Signals and unknowns of the new statement by symbols of the old one [its unit]. A guess that
        lacks them gets them so; those left out get the guess of the new statement.
    """

    problem: Problem
    back: Mapping[Symbol, Any] = field(default_factory=dict)
    forth: Mapping[Symbol, Any] = field(default_factory=dict)


@runtime_checkable
class Reformulation(Protocol):
    """A pass from one statement to another, named in `Settings`.

    All passes are applied one after the other before a solve. What is told of the answer is told of
    the statement: its motion, objective, replay, plots and sensitivities.
    """

    def apply(self, problem: Problem) -> Restated | None:
        """The problem to solve instead; None where there is nothing to do."""
        ...


def substituted(expression: Any, instead: Mapping[Symbol, Any]) -> ca.SX:
    """An expression with others in place of some of its symbols."""
    others = [scalar(other, f"'{symbol.name}'") for symbol, other in instead.items()]
    new = ca.vertcat(*others, ca.SX(0, 1))
    return ca.substitute(scalar(expression, "an expression"), column_of(instead), new)


def with_functionals(
    problem: Problem, phases: Sequence[Phase], replaced: Mapping[Functional, Functional]
) -> Problem:
    """A problem with other phases, and with functionals of these in place of the old ones."""

    def of(expression: ca.SX) -> ca.SX:
        return substituted(expression, replaced)

    bounds, links = (
        [replace(bound, expression=of(bound.expression)) for bound in stated]
        for stated in (problem.bounds, problem.links)
    )
    return with_statement(problem, of(problem.objective), phases=phases, bounds=bounds, links=links)


def with_statement(problem: Problem, objective: ca.SX, **changed: Any) -> Problem:
    """A problem with another objective to minimise, and other fields."""
    stated = "minimise" if problem.sense > 0 else "maximise"
    return replace(problem, **{stated: problem.sense * objective}, **changed)


def taken_names(problem: Problem) -> list[str]:
    """Names of a problem that nothing new in it may have."""
    names = [symbol.name for symbol in problem.symbols]
    return names + [bound.name for bound in problem.boundary_constraints]


def with_limits(bounds: Sequence[Bound], further: Iterable[Bound]) -> list[Bound]:
    """The bounds of a phase with further ones, each once."""
    names = {bound.name for bound in bounds}
    return [*bounds, *(limit for limit in further if limit.name not in names)]
