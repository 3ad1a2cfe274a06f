"""Sizes to which what a replay misses is relative.

The size of a state follows its values. One that moves by a small part of them, such as a metre at a
radius of 1e9 m, may stay where it is and miss its end by next to nothing of that size. So the miss
of such a state is held against the way that it is to go.
"""

from __future__ import annotations

from collections.abc import Mapping

from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem

# Part of its values, below which the way of a state counts instead of them, and up to which two
# numbers are one, computed in two ways
_FAR = 1e-3
_SAME = 1e-13


def error_sizes(
    problem: Problem, parameters: Parameters, sizes: Mapping[str, float]
) -> dict[str, float]:
    """Sizes of the states by name, to which the misses of their ends are relative.

    Parameters
    ----------
    sizes : mapping of str to float
        Typical sizes of the signals by name [their units].
    """
    stated: dict[str, list[float]] = {}
    for values in (parameters.initial_values, parameters.final_values):
        for (_, name), (lower, upper) in values.items():
            if lower == upper:
                stated.setdefault(name, []).append(lower)
    found = {state.name: sizes[state.name] for phase in problem.phases for state in phase.states}
    for name, numbers in stated.items():
        largest = max(abs(number) for number in numbers)
        apart = [abs(a - b) for a in numbers for b in numbers]
        least = min((way for way in apart if way > _SAME * largest), default=largest)
        if least < _FAR * largest:
            found[name] = min(found[name], least)
    return found
