"""Sizes after a solved mesh: those of what was found, where they are far from what was taken."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ocp.mesh.initial_guess import FRACTIONS, InitialGuess, initial_guess
from ocp.optimality.iterate import Iterate
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.scaling.automatic import scales_of
from ocp.scaling.scales import Scales, far_below_limits, is_brief, roomy
from ocp.scaling.symbol_sizes import NOTHING, largest_end_value, largest_finite

# Of the sizes that the guess gave: values beyond are outsized.
OUTSIZED = 1e4

# Factor by which limits may be more than all else that is known of a signal, if the motion vanishes
# next to them. Where nothing asks for it but the objective, limits of plus and minus 1000 held a
# motion of a metre at zero.
WIDE = 1e2

_OFF = 3.0  # factor from which on a solved objective replaces the size taken from the guess
_FALL = 1e-3  # of its size, to which the objective's falls by a solved value of zero
_SOLVED = "value on an earlier mesh"


def scales_after(last: Iterate, stated: Callable[[], Scales]) -> Scales:
    """Sizes for the mesh after a solved one; the same object where they are near what was found.

    All are taken from the motion where its values are far from the sizes that the guess or limits
    gave, as those of a motion that was far larger, or of limits that nothing comes near, those of
    times as well. These limits say nothing then. Elsewhere only the objective's follows its value.

    A motion that vanishes has no sizes, and they stay as they are, unless they come from wide
    limits: next to those all slopes may have been too small to move it.

    Parameters
    ----------
    stated : callable
        Gives those of the statement alone. It is asked where a motion vanishes.
    """
    scales, problem, parameters = last.scales, last.problem, last.parameters
    motion = initial_guess(problem, parameters, last.trajectory)
    if float(np.abs(last.x).max(initial=0.0)) > OUTSIZED:
        return _all_of(scales_of(problem, motion, parameters), last)

    small, brief = far_below_limits(scales, motion), is_brief(scales, motion)
    if not (small or brief or _is_oversized(scales, last.objective)):
        return resized(scales, last.objective, 0.0)

    of_motion = scales_of(problem, motion, parameters, small)
    vanishing = _vanishes(scales, motion)
    if vanishing and is_zero(problem, parameters, stated(), motion):
        return of_motion if roomy(scales, of_motion, WIDE) else scales
    if vanishing or brief or roomy(scales, of_motion):
        return _all_of(of_motion, last)
    return resized(scales, last.objective, of_motion.objective)


def is_zero(problem: Problem, parameters: Parameters, stated: Scales, motion: InitialGuess) -> bool:
    """Whether a motion is zero next to the sizes of the statement, and asked to go nowhere.

    One that is given an end value other than zero is small at most, however large the sizes are.
    """
    ends = (largest_end_value(s, p, parameters) for p in problem.phases for s in p.states)
    return _vanishes(stated, motion) and not any(end > 0 for end in ends)


def resized(scales: Scales, objective: float, least: float) -> Scales:
    """Scales with the objective's size taken from a solved value, where it was far off.

    Tolerances of the solver are relative to the scaled objective: where the guess, or a loose limit
    in place of one, costs many times the optimum, they would leave controls undetermined that cost
    little. A stated size stays. One that was taken from a value before is lowered only.

    Parameters
    ----------
    least : the size around the solved motion. A best value may be 0: by such values the size falls
        to a thousandth once, and no further than to this one.
    """
    again = scales.reasons.get(("objective", "")) == _SOLVED
    size = scales.objective
    found = max(abs(objective), min(least, size if again else _FALL * size))
    near = size / _OFF <= found <= _OFF * size
    if scales.objective_is_stated or near or (again and found > size) or not math.isfinite(found):
        return scales
    return replace(scales, objective=found, reasons={**scales.reasons, ("objective", ""): _SOLVED})


def _all_of(of_motion: Scales, last: Iterate) -> Scales:
    """Sizes of a motion, and its value as that of the objective."""
    return resized(of_motion, last.objective, of_motion.objective)


def _is_oversized(scales: Scales, objective: float) -> bool:
    """Whether the objective's size is many times a solved value, and was not stated."""
    return not scales.objective_is_stated and _OFF * abs(objective) < scales.objective


def _vanishes(scales: Scales, motion: InitialGuess) -> bool:
    """Whether all signals of a motion are zero, next to their sizes: it has no sizes of its own."""
    return all(
        largest_finite(values) <= NOTHING * scales.signals[name]
        for phase in motion.phases.values()
        for name, values in phase.at_fractions(FRACTIONS).items()
    )
