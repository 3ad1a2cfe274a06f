"""The sign of what a kinked term is multiplied by: numbers, constants, or a function of time alone.

A tariff, or a weight that grows with time, costs in the same sense all along a phase. Where it is
zero for a while a control above the kink would cost nothing and have no value, so only single
instants may be zero.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.problem.instants import stepping_times
from ocp.problem.phase import Phase
from ocp.problem.symbols import TIME, Between, Constant, resolve

# Of a function of time over a phase; those between two steps come on top
_SAMPLES = 1001

# Parts of a phase at which a price is looked at whose sign is that of its constants. One of them
# may be an instant at which it is zero.
_LOOKED_AT = (0.31, 0.62, 0.93)


def time_range(phase: Phase) -> tuple[float, float]:
    """The earliest start and the latest end [s]; infinite where nothing limits a free one."""
    start, end = phase.start, phase.end
    earliest = start.lower if isinstance(start, Between) else start
    latest = end.upper if isinstance(end, Between) else end
    return float(earliest), float(latest)


def sign_of_factor(factor: ca.SX, phase: Phase | None) -> int | None:
    """1 or -1 if a factor has this sign, 0 if it has none, None if signals or unknowns are in it.

    Constants have the values that they are declared with. Of functions of time that hold constants,
    too, no sign is told: the times at which they change are not known. Factors of numbers of the
    whole motion are in no phase.
    """
    symbols = resolve(factor, "a factor")
    if all(isinstance(symbol, Constant) for symbol in symbols):
        return int(np.sign(constant_value(factor)))
    if phase is None or any(symbol is not TIME for symbol in symbols):
        return None
    start, end = time_range(phase)
    if not (math.isfinite(start) and math.isfinite(end)):
        return None

    values = _values(factor, _times(factor, start, end))
    vanishing = values == 0.0
    if not np.isfinite(values).all() or (vanishing[1:] & vanishing[:-1]).any():
        return 0
    signs = np.unique(np.sign(values[~vanishing]))
    return int(signs[0]) if signs.size == 1 else 0


def at_some_times(price: ca.SX, phase: Phase) -> list[ca.SX]:
    """A price at some times of a phase; itself where time is not in it."""
    if not ca.depends_on(price, TIME.symbol):
        return [price]
    start, end = time_range(phase)
    times = [start + part * (end - start) for part in _LOOKED_AT]
    return [ca.substitute(price, TIME.symbol, ca.SX(time)) for time in times]


def constant_value(expression: ca.SX) -> float:
    """Of an expression of constants, with the values that they are declared with."""
    constants = [s for s in resolve(expression, "a weight") if isinstance(s, Constant)]
    function = ca.Function("value", [c.symbol for c in constants], [expression])
    return float(function.call([c.value for c in constants])[0])


def _times(factor: ca.SX, start: float, end: float) -> Array:
    """Times inside a phase, at least one between any two at which the factor steps or bends."""
    known = np.array([start, *stepping_times([factor], start, end), end])
    inner = np.linspace(start, end, _SAMPLES)[1:-1]
    return np.union1d(inner, 0.5 * (known[:-1] + known[1:]))


def _values(factor: ca.SX, times: Array) -> Array:
    function = ca.Function("factor", [TIME.symbol], [ca.densify(factor)])
    return np.array(function(ca.DM(times).T)).ravel()
