"""Chains of integrators: controls whose effect collocation integrates exactly.

A control that is the rate of a state, which is the rate of another, and so on, drives a chain of
``r`` integrators. Its polynomial of degree ``q`` makes the chain's last state a polynomial of
degree ``q + r``, so collocation of that degree integrates the chain without error whatever the
mesh. A polynomial control of the scheme's full degree has no such bound: the optimiser can gain
by what its states do not follow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from ocp.numerics.polynomials import polynomial_degree
from ocp.numerics.schemes import FIXED_DEGREE, SchemeName
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import (
    Algebraic,
    Constant,
    Control,
    ControlShape,
    State,
    Unknown,
    resolve,
    time,
)
from ocp.settings import Settings

_DEGREES = {"constant": 0, "linear": 1}
_EXACT: tuple[SchemeName, ...] = ("radau", "gauss", "lobatto")


@lru_cache(maxsize=256)
def chain_length(phase: Phase, control: Control) -> int:
    """Number of integrators in the longest pure chain that a control drives in a phase.

    The rate of the chain's first state is linear in the control, with no other signal in it, and
    that of each following state likewise in the one before; 0 if no state follows the control in
    this way, or if the control acts on another state as well.
    """
    rates = {state: ca.SX(rate.__SX__() if hasattr(rate, "__SX__") else rate)
             for state, rate in phase.dynamics.items()}  # fmt: skip
    acted_on = [s for s, rate in rates.items() if ca.depends_on(rate, control.symbol)]
    if len(acted_on) != 1:
        return 0
    length, driver = 0, control.symbol
    left = dict(rates)
    while True:
        following = [s for s, rate in left.items() if _is_multiple(rate, driver)]
        if not following:
            return length
        length, driver = length + 1, following[0].symbol
        del left[following[0]]


@dataclass(frozen=True, eq=False)
class Link:
    """A state of a chain: its rate is ``gain * driver + offset``.

    Attributes
    ----------
    gain, offset : expressions of constants of the problem.
    degree : of the state as a polynomial of time in an interval.
    """

    driver: State | Control
    gain: ca.SX
    offset: ca.SX
    degree: int


@lru_cache(maxsize=256)
def links(phase: Phase, shapes: tuple[tuple[Control, int], ...]) -> Mapping[State, Link]:
    """States of a phase that are polynomials of time wherever the given controls are.

    Parameters
    ----------
    shapes : the controls that are polynomials in an interval, each with its degree there.

    Returns
    -------
    Each such state with its link; a driver comes before what it drives.
    """
    found: dict[State, Link] = {}
    known: dict[State | Control, int] = dict(shapes)
    left = {state: ca.SX(rate.__SX__() if hasattr(rate, "__SX__") else rate)
            for state, rate in phase.dynamics.items()}  # fmt: skip
    while True:
        following = [
            (state, driver) for state, rate in left.items() for driver in known
            if _is_multiple(rate, driver.symbol, (Constant,))
        ]  # fmt: skip
        if not following:
            return found
        for state, driver in following:
            rate = left.pop(state)
            found[state] = Link(
                driver, ca.jacobian(rate, driver.symbol), ca.substitute(rate, driver.symbol, 0),
                known[driver] + 1,
            )  # fmt: skip
            known[state] = known[driver] + 1


def _is_multiple(
    rate: ca.SX, driver: ca.SX, numbers: tuple[type, ...] = (Constant, Unknown)
) -> bool:
    """Whether a rate is linear in one symbol, with numbers as factor and offset."""
    others = [s for s in resolve(rate, "a rate") if not ca.is_equal(s.symbol, driver)]
    alone = all(isinstance(s, numbers) for s in others)
    return alone and ca.depends_on(rate, driver) and ca.is_linear(rate, driver)


def shape_of(
    control: Control, phase: Phase, default: ControlShape, scheme: SchemeName, least_degree: int
) -> ControlShape:
    """How a control varies within an interval: as it states, else as the settings say.

    "automatic" is linear for a control that drives a chain of two or more integrators which the
    scheme then integrates exactly, and polynomial otherwise.
    """
    shape = control.shape or default
    if shape != "automatic":
        return shape
    chain = chain_length(phase, control)
    exact = scheme in _EXACT and least_degree >= chain + 1
    return "linear" if chain >= 2 and exact else "polynomial"


def first_degree(problem: Problem, phase: Phase, settings: Settings) -> int:
    """Degree of a phase's first mesh: the stated one, or the higher one that is exact.

    Where the degree that integrates the phase exactly is more than `Settings.highest_degree`, or
    there is none, or the scheme has but one, it is the stated one.
    """
    if settings.scheme in FIXED_DEGREE:
        return settings.degree
    exact = exact_degree(problem, phase, settings)
    wanted = exact if exact is not None and exact <= settings.highest_degree else 0
    return max(settings.degree, wanted)


def exact_degree(problem: Problem, phase: Phase, settings: Settings) -> int | None:
    """The least degree that integrates all states exactly on any mesh; None if there is none.

    It exists where the rates only add and multiply what is a polynomial of time in an interval:
    constant and linear controls, time, and states that do not feed back on themselves.
    """
    rates, controls = list(phase.dynamics.values()), problem.signals_of(phase, Control)
    shapes = {c: shape_of(c, phase, settings.control_shape, settings.scheme,
                          settings.highest_degree) for c in controls}  # fmt: skip
    bent = [c for c in controls if shapes[c] not in _DEGREES]
    bent += problem.signals_of(phase, Algebraic)
    if any(ca.depends_on(rate, s.symbol) for rate in rates for s in bent):
        return None
    known = {c: _DEGREES[shapes[c]] for c in controls if shapes[c] in _DEGREES}
    symbols = [s.symbol for s in (*phase.states, *known, time)]
    degrees = [0] * len(rates)
    for _ in range(len(rates) + 1):
        found = [polynomial_degree(r, symbols, [*degrees, *known.values(), 1]) for r in rates]
        raised = [d + 1 for d in found if d is not None]
        if len(raised) < len(rates):
            return None
        if raised == degrees:
            return max(degrees)
        degrees = raised
    return None  # a state feeds back on itself
