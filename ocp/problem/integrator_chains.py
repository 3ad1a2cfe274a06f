"""Integrator chains: controls whose effect collocation integrates exactly.

A control that is the rate of a state, which is the rate of another, and so on, drives a chain of
``r`` integrators. Its polynomial of degree ``q`` makes the chain's last state a polynomial of
degree ``q + r``, so collocation of that degree integrates the chain without error on any mesh. A
polynomial control of the scheme's full degree has no such bound: the optimiser can gain by what its
states do not follow.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import casadi as ca

from ocp.numerics.polynomial_expressions import is_linear, is_quadratic
from ocp.numerics.schemes import Scheme
from ocp.problem.functionals import pieces_over
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import (
    TIME,
    Algebraic,
    Constant,
    Control,
    Piecewise,
    State,
    Symbol,
    Unknown,
    resolve,
)


@lru_cache
def chain_length(phase: Phase, control: Control) -> int:
    """Number of integrators in the longest pure chain that a control drives in a phase.

    The rate of the chain's first state is linear in the control, with no other signal in it, and
    that of each following state likewise in the one before. It is 0 if no state follows the
    control in this way, or if the control acts on another state as well.
    """
    acted_on = [s for s, rate in phase.dynamics.items() if ca.depends_on(rate, control.symbol)]
    if len(acted_on) != 1:
        return 0

    length, driver = 0, control.symbol
    others = dict(phase.dynamics)
    while True:
        following = [
            state
            for state, rate in others.items()
            if _is_multiple(rate, phase.rate_symbols[state], driver)
        ]
        if not following:
            return length
        length, driver = length + 1, following[0].symbol
        del others[following[0]]


def _is_multiple(rate: ca.SX, symbols: Iterable[Symbol], driver: ca.SX) -> bool:
    """Whether a rate of some symbols is linear in one of them, with numbers beside it."""
    others = [s for s in symbols if not ca.is_equal(s.symbol, driver)]
    alone = all(isinstance(s, (Constant, Unknown)) for s in others)
    return alone and ca.depends_on(rate, driver) and is_linear(rate, driver)


def variation_of(
    problem: Problem,
    phase: Phase,
    control: Control,
    default: Piecewise,
    scheme: Scheme,
    least_degree: int,
) -> Piecewise:
    """How a control varies within an interval: as it states, else as the settings say.

    "automatic" is linear for a control that drives a chain of two or more integrators which the
    scheme then integrates exactly, and polynomial otherwise. A control in an equation of the phase,
    such as an acceleration of implicit dynamics, is polynomial: it then has a value of its own at
    each point at which the equation is imposed. So is one whose limits are curved, in time or
    with other controls, because straight lines would need very many intervals to follow them. An
    automatic polynomial in which the phase is linear has one coefficient fewer than there are
    collocation points, see `enters_linearly`. "full" is "automatic" without this.
    """
    shape = control.piecewise or default
    if shape not in ("automatic", "full"):
        return shape
    if in_equation(control, phase) or _has_curved_limit(problem, phase, control):
        return "polynomial"
    chain = chain_length(phase, control)
    exact = scheme.exact_for_chains and least_degree >= chain + 1
    return "linear" if chain >= 2 and exact else "polynomial"


def in_equation(control: Control, phase: Phase) -> bool:
    """Whether an equation of a phase holds a control."""
    return any(
        bound.is_equation and ca.depends_on(bound.expression, control.symbol)
        for bound in phase.bounds
    )


@lru_cache
def _has_curved_limit(problem: Problem, phase: Phase, control: Control) -> bool:
    """Whether a limit or peak of controls and not of states is curved, in time or with others."""
    limited = [bound.expression for bound in phase.bounds]
    limited += [expression for _, expression in pieces_over(problem.peaks, phase.name)]
    return any(_is_curved(expression, control) for expression in limited)


def _is_curved(expression: ca.SX, control: Control) -> bool:
    """Whether a limit of a control and of no state changes in time, or with others is quadratic.

    Controls that turn along such a limit, as that of a thrust, follow an arc and no straight lines.
    """
    symbols = resolve(expression, "a limit")
    of_states = any(isinstance(symbol, (State, Algebraic)) for symbol in symbols)
    if of_states or not ca.depends_on(expression, control.symbol):
        return False
    if any(symbol is TIME for symbol in symbols):
        return True
    several = sum(isinstance(symbol, Control) for symbol in symbols) > 1
    quadratic = several and is_quadratic(expression, control.symbol)
    return quadratic and not is_linear(expression, control.symbol)


@lru_cache
def enters_linearly(problem: Problem, phase: Phase, control: Control) -> bool:
    """Whether rates, integrands, peaks and bounds of a phase are linear in one of its controls.

    Their slopes by the control may depend on all else, other controls included. At an optimum such
    a control is at a bound, or on a *singular arc*: there the slope of the Hamiltonian by it
    vanishes for some time (Bryson and Ho, "Applied Optimal Control", ch. 8).
    """
    expressions = [*phase.dynamics.values(), *(bound.expression for bound in phase.bounds)]
    expressions += [integral.expression for integral in problem.integrals[phase.name]]
    expressions += [expression for _, expression in pieces_over(problem.peaks, phase.name)]
    return is_linear(ca.vertcat(*expressions, ca.SX(0, 1)), control.symbol)
