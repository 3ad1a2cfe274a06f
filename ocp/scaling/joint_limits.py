"""Sizes of signals by limits that they share, as ``fx^2 + fy^2 <= 400^2``.

Each signal is as large as it may be while the others are zero.
"""

from __future__ import annotations

from collections.abc import Set

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.scaling.variations import largest_finite

# Values that a signal is given, from small to large. What lies between the two beside a limit is
# looked at as finely, until they are within 1e-5.
_COUNT, _SMALLEST, _LARGEST, _TIMES = 49, 1e-12, 1e12, 4


def sizes_by_joint_limits(
    problem: Problem, unsized: Set[str], parameters: Parameters
) -> dict[str, float]:
    """Sizes by bounds of phases on signals alone, the largest of several.

    Parameters
    ----------
    unsized : set of str
        Names of the signals. A bound that depends on any other symbol tells nothing.
    """
    sizes = dict[str, float]()
    constants = ca.vertcat(*[c.symbol for c in problem.constants], ca.SX(0, 1))
    bounds = [(phase.name, bound) for phase in problem.phases for bound in phase.bounds]
    for phase, bound in bounds:
        signals = [s for s in bound.symbols if not isinstance(s, Constant)]
        if not {s.name for s in signals} <= unsized:
            continue
        together = ca.vertcat(*[s.symbol for s in signals])
        function = ca.Function("joint", [together, constants], [bound.expression])
        limits = [v for v in parameters.bound_limits[phase, bound.name] if np.isfinite(v)]
        for signal, way in zip(signals, np.eye(len(signals)), strict=True):
            ends = [
                _end(function, sign * way, parameters.vector, limit)
                for sign in (1.0, -1.0)
                for limit in limits
            ]
            sizes[signal.name] = max(sizes.get(signal.name, 0.0), largest_finite(ends))
    return {name: size for name, size in sizes.items() if size > 0}


def _end(function: ca.Function, way: Array, constants: Array, limit: float) -> float:
    """How far it is from zero along a way to where an expression has its limit; 0 if nowhere."""
    low, high = _SMALLEST, _LARGEST
    for _ in range(_TIMES):
        lengths = np.geomspace(low, high, _COUNT)
        above = function(np.outer(way, lengths), constants).full()[0] > limit
        changes = np.flatnonzero(above[1:] != above[:-1])
        if not changes.size:
            return 0.0
        low, high = lengths[changes[0]], lengths[changes[0] + 1]
    return float(high)
