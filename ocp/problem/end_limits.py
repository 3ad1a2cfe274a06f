"""Path limits that the end values of a phase break by themselves, or lie at.

Where all that a limit depends on is prescribed at an end, its value there is a number, and no
motion changes it. A solver would look for one all the same, from start to start.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import casadi as ca
import numpy as np

from ocp.problem.bounds import Bound
from ocp.problem.display import with_unit
from ocp.problem.parameters import Interval, Parameters, limit_slopes
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, is_real, scalar

# A stated number, or an expression of constants, and its name among the sensitivities
Named = tuple[str, Any]

# Part of a limit's size that its value may be beyond it: from here on no mesh was solved to its end
_BEYOND = 3e-8

# Below this a number is what a computation leaves of zero, and tells no size
_ZERO = 1e-12


def limits_broken_at_ends(problem: Problem, parameters: Parameters) -> Iterator[str]:
    """What is wrong with each limit that prescribed values break, in words."""
    for phase in problem.phases:
        for what, time, values in (
            ("initial", phase.start, parameters.initial_values),
            ("final", phase.end, parameters.final_values),
        ):
            numbers = _prescribed(phase, time, values, parameters)
            for bound in phase.bounds:
                limits = parameters.bound_limits[phase.name, bound.name]
                found = _broken(bound, limits, numbers, _sizes(phase, parameters))
                if found is not None:
                    value, limit, beyond = (with_unit(f"{n:.6g}", bound.unit) for n in found)
                    yield (
                        f"the {what} values of phase '{phase.name}' make '{bound.name}' {value}, "
                        f"which is beyond its limit of {limit} by {beyond}"
                    )


def sides_closed_by_ends(problem: Problem, parameters: Parameters) -> dict[str, tuple[bool, bool]]:
    """Named numbers that cannot fall or cannot rise, as a prescribed value lies at its limit.

    Names are those of sensitivities. Limits of states count, and not those of expressions.

    Returns
    -------
    mapping of str to (bool, bool)
        Whether no motion is left below, and above, the number as it is.
    """
    closed: dict[str, tuple[bool, bool]] = {}
    for phase in problem.phases:
        sizes = _sizes(phase, parameters)
        for what, stated in (("initial", phase.initial), ("final", phase.final)):
            values = getattr(parameters, f"{what}_values")
            for state in stated:
                low, high = values[phase.name, state.name]
                least, largest = parameters.signal_limits[state.name]
                if low != high or isinstance(stated[state], tuple):
                    continue
                own = f"{phase.name}: {state.name} {what}", stated[state]
                lower, upper = (f"{state.name} {side}" for side in ("lower", "upper"))
                at = _BEYOND * sizes[state.name]
                if low - least <= at:
                    _close(closed, own, (lower, state.lower), parameters)
                if largest - high <= at:
                    _close(closed, (upper, state.upper), own, parameters)
    return closed


def _close(
    closed: dict[str, tuple[bool, bool]], larger: Named, smaller: Named, parameters: Parameters
) -> None:
    """Close the side of each number on which less than no room is between two stated numbers."""
    room = scalar(larger[1], "a limit") - scalar(smaller[1], "a limit")
    slopes = {larger[0]: 1.0, smaller[0]: -1.0, **limit_slopes(room, parameters)}
    for name, slope in slopes.items():
        below, above = closed.get(name, (False, False))
        closed[name] = below or slope > 0.0, above or slope < 0.0


def _prescribed(
    phase: Phase,
    time: object,
    values: Mapping[tuple[str, str], Interval],
    parameters: Parameters,
) -> dict[str, float]:
    """The numbers of states, constants and time that are fixed at an end, by name."""
    numbers = dict(parameters.values)
    if is_real(time):
        numbers[TIME.name] = float(time)  # type: ignore[arg-type]
    own = {name: limits for (where, name), limits in values.items() if where == phase.name}
    return numbers | {name: low for name, (low, high) in own.items() if low == high}


def _sizes(phase: Phase, parameters: Parameters) -> dict[str, float]:
    """How large each state is by what is stated of it."""
    sizes = {}
    for state in phase.states:
        stated = list(parameters.signal_limits[state.name])
        for values in (parameters.initial_values, parameters.final_values):
            stated += values.get((phase.name, state.name), ())
        known = [abs(number) for number in stated if math.isfinite(number)]
        largest = max(known, default=0.0)
        sizes[state.name] = largest if largest > _ZERO else 1.0
    return sizes


def _broken(
    bound: Bound, limits: Interval, numbers: Mapping[str, float], sizes: Mapping[str, float]
) -> tuple[float, float, float] | None:
    """Value, limit and excess where a limit is broken by numbers alone; None elsewhere."""
    if not bound.symbols or any(s.name not in numbers for s in bound.symbols):
        return None
    symbols = ca.vertcat(*[s.symbol for s in bound.symbols])
    slopes = ca.jacobian(bound.expression, symbols)
    function = ca.Function("at_end", [symbols], [bound.expression, ca.densify(slopes)])
    out = function([numbers[s.name] for s in bound.symbols])
    value, by = float(out[0]), np.abs(np.asarray(out[1]).ravel())
    lower, upper = limits
    beyond, limit = max((value - upper, upper), (lower - value, lower))
    if not (math.isfinite(beyond) and np.all(np.isfinite(by))):
        return None

    # how far the expression moves when its states move by their sizes
    moves = [by[i] * sizes.get(s.name, 0.0) for i, s in enumerate(bound.symbols)]
    size = bound.scale if bound.scale is not None else max(sum(moves), abs(value), abs(limit))
    return (value, limit, beyond) if beyond > _BEYOND * size else None
