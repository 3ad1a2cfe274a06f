"""Chains of integrators: controls whose effect collocation integrates exactly.

A control that is the rate of a state, which is the rate of another, and so on, drives a chain of
``r`` integrators. Its polynomial of degree ``q`` makes the chain's last state a polynomial of
degree ``q + r``, so collocation of that degree integrates the chain without error whatever the
mesh. A polynomial control of the scheme's full degree has no such bound: the optimiser can gain
by what its states do not follow.
"""

from __future__ import annotations

import casadi as ca

from ocp.schemes import SchemeName
from ocp.statement import Phase
from ocp.symbols import Constant, Control, ControlShape, Unknown, resolve

_EXACT: tuple[SchemeName, ...] = ("radau", "gauss", "lobatto")


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


def _is_multiple(rate: ca.SX, driver: ca.SX) -> bool:
    """Whether a rate is linear in one symbol, with numbers as factor and offset."""
    others = [s for s in resolve(rate, "a rate") if not ca.is_equal(s.symbol, driver)]
    numbers = all(isinstance(s, (Constant, Unknown)) for s in others)
    return numbers and ca.depends_on(rate, driver) and ca.is_linear(rate, driver)


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
