"""A problem like another one, but smooth where that has kinks.

A solver of smooth problems can flip between the branches of a kink without end. From an answer of
the smooth problem it begins on the right ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import casadi as ca

from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.kinks import roundable_kinks
from ocp.problem.phase import Phase, kept_alive
from ocp.problem.problem import Problem
from ocp.problem.symbols import resolve

# rounds an expression of a phase, given by its name
Rounding = Callable[[ca.SX, str], ca.SX]


def with_rounded_kinks(problem: Problem, widths: Mapping[str, Sequence[ca.SX]]) -> Problem:
    """The problem with its kinks rounded; signals, unknowns and constants are the same.

    Parameters
    ----------
    widths : mapping of phase name to (k,)
        Of each of its `roundable_kinks`, in the unit of its surface. Numbers or expressions of
        constants.
    """

    def rounded(expression: ca.SX, phase: str) -> ca.SX:
        kinks = roundable_kinks(problem, phase)
        return kinks.rounded([expression], ca.vertcat(*widths[phase], ca.SX(0, 1)))[0]

    phases = [_rounded_phase(phase, rounded) for phase in problem.phases]
    by_name = {phase.name: phase for phase in phases}
    functionals = [_rounded_functional(f, by_name, rounded) for f in problem.functionals]
    old = ca.vertcat(*[f.symbol for f in problem.functionals], ca.SX(0, 1))
    new = ca.vertcat(*[f.symbol for f in functionals], ca.SX(0, 1))

    def of_new(bounds: Sequence[Bound]) -> list[Bound]:
        return [replace(b, expression=ca.substitute(b.expression, old, new)) for b in bounds]

    return Problem(
        problem.name,
        phases,
        minimise=ca.substitute(problem.objective, old, new),
        bounds=of_new(problem.bounds),
        links=of_new(problem.links),
        scale=problem.scale,
    )


def _rounded_phase(phase: Phase, rounded: Rounding) -> Phase:
    return replace(
        phase,
        dynamics={state: rounded(rate, phase.name) for state, rate in phase.dynamics.items()},
        bounds=[replace(b, expression=rounded(b.expression, phase.name)) for b in phase.bounds],
    )


def _rounded_functional(
    functional: Functional, phases: Mapping[str, Phase], rounded: Rounding
) -> Functional:
    pieces = tuple((name, rounded(piece, name)) for name, piece in functional.pieces)
    symbols = dict.fromkeys(s for _, piece in pieces for s in resolve(piece, functional.name))
    made = replace(functional, pieces=pieces, symbols=tuple(symbols))
    made.remember_phases(phases[name].dynamics for name, _ in pieces)
    return kept_alive(made, [phases[name] for name, _ in pieces])
