"""Problems: phases, the bounds and links between them, and what to minimise or maximise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from ocp.errors import StatementError
from ocp.problem.bounds import Bound, checked_bounds
from ocp.problem.functionals import Functional, Integral, Peak
from ocp.problem.phase import Phase
from ocp.problem.symbols import (
    Algebraic,
    Constant,
    Control,
    Signal,
    Symbol,
    Unknown,
    check_scale,
    is_number,
    resolve,
    scalar,
)
from ocp.problem.validation import check_problem


@dataclass(frozen=True, eq=False)
class Problem:
    """Phases, the bounds and links between them, and what to minimise or maximise.

    Parameters
    ----------
    name : str
    phases : Phase or sequence of Phase
    minimise, maximise : expression of functionals, unknowns and constants
        Exactly one of them.
    bounds, links : sequence of Bound
        Of functionals, unknowns and constants.
    scale : float or None
        Typical size of the objective. It is derived from its terms if None.

    Raises
    ------
    StatementError
        When there is no or more than one objective, a name appears twice, or an expression uses
        what the problem does not have.
    """

    name: str
    phases: Sequence[Phase]
    minimise: Any = None
    maximise: Any = None
    bounds: Sequence[Bound] = ()
    links: Sequence[Bound] = ()
    scale: float | None = None

    def __post_init__(self) -> None:
        check_scale("the objective", self.scale)
        phases = (self.phases,) if isinstance(self.phases, Phase) else tuple(self.phases)
        where = f"problem '{self.name}'"
        object.__setattr__(self, "phases", phases)
        object.__setattr__(self, "bounds", checked_bounds(self.bounds, where))
        object.__setattr__(self, "links", checked_bounds(self.links, f"the links of {where}"))
        if (self.minimise is None) == (self.maximise is None):
            raise StatementError(f"{where} needs exactly one of minimise and maximise")
        check_problem(self)

    def __repr__(self) -> str:
        from ocp.problem.display import problem_summary

        return problem_summary(self)

    def __str__(self) -> str:
        from ocp.problem.display import problem_text

        return problem_text(self)

    def _repr_html_(self) -> str:
        from ocp.problem.display import problem_html

        return problem_html(self)

    @property
    def objective(self) -> ca.SX:
        """The expression to minimise (the negative of what is maximised)."""
        if self.minimise is not None:
            return scalar(self.minimise, "the objective")
        return -scalar(self.maximise, "the objective")

    @property
    def sense(self) -> float:
        """1 when minimising, -1 when maximising."""
        return 1.0 if self.minimise is not None else -1.0

    @property
    def boundary_constraints(self) -> tuple[Bound, ...]:
        """The bounds and the links: the constraints on numbers of the whole motion."""
        return (*self.bounds, *self.links)

    @cached_property
    def boundary_symbols(self) -> tuple[Symbol, ...]:
        """Symbols of the objective, the bounds and the links."""
        symbols = dict.fromkeys(resolve(self.objective, "the objective"))
        for bound in self.boundary_constraints:
            for expression in (bound.expression, bound.lower, bound.upper):
                symbols.update(dict.fromkeys(resolve(expression, f"the bound '{bound.name}'")))
        return tuple(symbols)

    @cached_property
    def functionals(self) -> tuple[Functional, ...]:
        """The functionals in use."""
        return tuple(s for s in self.boundary_symbols if isinstance(s, Functional))

    @cached_property
    def peaks(self) -> tuple[Peak, ...]:
        """The peaks in use."""
        return tuple(f for f in self.functionals if isinstance(f, Peak))

    def integrals(self, phase: str) -> tuple[Integral, ...]:
        """The integrals in use over the phase of that name."""
        integrals = (f for f in self.functionals if isinstance(f, Integral))
        return tuple(f for f in integrals if f.phase == phase)

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """All declared symbols in use."""
        symbols: dict[Symbol, None] = {}
        for phase in self.phases:
            symbols.update(dict.fromkeys(phase.symbols))
            for values in (phase.initial, phase.final):
                for value in values.values():
                    for limit in value if isinstance(value, tuple) else (value,):
                        symbols.update(dict.fromkeys(resolve(limit, "a boundary value")))
        for functional in self.functionals:
            symbols.update(dict.fromkeys(functional.symbols))
        symbols.update(dict.fromkeys(self.boundary_symbols))

        # the limits of what was found so far may bring in further constants
        for symbol in list(symbols):
            if isinstance(symbol, (Signal, Unknown)):
                for limit in (symbol.lower, symbol.upper):
                    where = f"a bound of '{symbol.name}'"
                    symbols.update(dict.fromkeys(resolve(limit, where)))
        return tuple(symbols)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The static decision parameters."""
        return tuple(s for s in self.symbols if isinstance(s, Unknown))

    @cached_property
    def constants(self) -> tuple[Constant, ...]:
        """The named constants."""
        return tuple(s for s in self.symbols if isinstance(s, Constant))

    def phase(self, name: str) -> Phase:
        """The phase of that name."""
        return next(phase for phase in self.phases if phase.name == name)

    def controls(self, phase: Phase) -> tuple[Control, ...]:
        """Controls of a phase, those of its functionals in use included."""
        return tuple(s for s in self._symbols_by_phase[phase.name] if isinstance(s, Control))

    def algebraics(self, phase: Phase) -> tuple[Algebraic, ...]:
        """Algebraic signals of a phase, those of its functionals in use included."""
        return tuple(s for s in self._symbols_by_phase[phase.name] if isinstance(s, Algebraic))

    def signals(self, phase: Phase) -> tuple[Signal, ...]:
        """States, controls and algebraic signals of a phase."""
        return (*phase.states, *self.controls(phase), *self.algebraics(phase))

    @cached_property
    def _symbols_by_phase(self) -> dict[str, tuple[Symbol, ...]]:
        symbols = {phase.name: dict.fromkeys(phase.symbols) for phase in self.phases}
        for functional in self.functionals:
            for name, expression in functional.pieces:
                symbols[name].update(dict.fromkeys(resolve(expression, functional.name)))
        return {name: tuple(found) for name, found in symbols.items()}

    @cached_property
    def limit_expressions(self) -> tuple[tuple[ca.SX, ...], ca.Function]:
        """Limits that are expressions of constants, and the function that evaluates them all."""
        expressions: dict[int, ca.SX] = {}
        for limit in self._limits():
            if not is_number(limit):
                expression = scalar(limit, "a limit")
                expressions[expression.element_hash()] = expression
        constants = ca.vertcat(*[c.symbol for c in self.constants], ca.SX(0, 1))
        stacked = ca.vertcat(*expressions.values(), ca.SX(0, 1))
        return tuple(expressions.values()), ca.Function("limits", [constants], [stacked])

    def _limits(self) -> Iterator[Any]:
        """All limits and boundary values of the statement."""
        for symbol in self.symbols:
            if isinstance(symbol, (Signal, Unknown)):
                yield from (symbol.lower, symbol.upper)
        for bound in (*self.boundary_constraints, *(b for p in self.phases for b in p.bounds)):
            yield from (bound.lower, bound.upper)
        for phase in self.phases:
            for value in (*phase.initial.values(), *phase.final.values()):
                yield from value if isinstance(value, tuple) else (value,)


def with_objective(problem: Problem, minimise: Any, extra_bounds: Sequence[Bound] = ()) -> Problem:
    """The same phases and links with another objective and further bounds.

    Parameters
    ----------
    problem : Problem
    minimise : expression of functionals, unknowns and constants
        The objective in place of the problem's own.
    extra_bounds : sequence of Bound
        Beside those of the problem.
    """
    return Problem(
        problem.name,
        problem.phases,
        minimise=minimise,
        bounds=(*problem.bounds, *extra_bounds),
        links=problem.links,
    )
