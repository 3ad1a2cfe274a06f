"""Typical sizes, in the units of the statement, and what they are worth.

A motion may stay far below sizes that limits or statements gave. Limits of plus and minus 1e6,
written for none, say nothing of how large a signal or an unknown is.

What a replay misses is relative to sizes of its own. The size of a state follows its values. One
that moves by a small part of them, such as a metre at a radius of 1e9 m, may stay where it is and
miss its end by next to nothing of that size. So the miss of such a state is held against the way
that it is to go.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ocp.mesh.initial_guess import FRACTIONS, InitialGuess
from ocp.mesh.trajectory import Trajectory
from ocp.problem.functionals import Functional
from ocp.problem.parameters import Parameters
from ocp.scaling.symbol_sizes import BOUNDS, GUESSED_NUMBER, STATED, largest_finite

# Part of its values, below which the way of a state counts instead of them, and up to which two
# numbers are one, computed in two ways
_FAR = 1e-3
_SAME = 1e-13

# Where in each interval the range of a state is looked at
_LOOKS = np.array([0.0, 0.5, 1.0])


def error_sizes(
    parameters: Parameters, trajectory: Trajectory, sizes: Mapping[str, float]
) -> dict[str, float]:
    """Sizes of the states by name, to which the misses of their ends are relative.

    The way of a state is from one stated end value to another one, or the range of its values
    where that is more, as for a joint that swings out and comes back.

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
    found = {name: sizes[name] for phase in trajectory.phases for name in phase.states}
    for name, numbers in stated.items():
        largest = max(abs(number) for number in numbers)
        apart = [abs(a - b) for a in numbers for b in numbers]
        least = min((way for way in apart if way > _SAME * largest), default=largest)
        way = max(least, _range(trajectory, name))
        if way < _FAR * largest:
            found[name] = min(found[name], way)
    return found


def _range(trajectory: Trajectory, name: str) -> float:
    """Largest minus least value of a state, at the ends and in the middle of each interval."""
    seen = [
        motion.polynomial(name).value(
            np.repeat(np.arange(motion.intervals), _LOOKS.size), np.tile(_LOOKS, motion.intervals)
        )
        for motion in trajectory.phases
        if name in motion.states
    ]
    return float(np.ptp(np.concatenate(seen)))


# Factor by which a size may be more than a signal has in a motion. Limits of plus and minus 1e4
# around motions of one were tried on 75 problems, and hid no optimum; those of 1e6 did.
ROOMY = 1e4

# Of the typical duration: what lasts no longer has shrunk to the least duration. That is a
# thousandth of this (`ocp.transcription.blocks`), and the barrier of the solver keeps a little off.
VANISHED = 1e-6

# Of the typical duration: ten times the least, which what shrinks ends near
SHRUNK = 1e-8


def near_limits(limits: Sequence[float], typical: float) -> list[float]:
    """Absolute values of the finite limits of something that a motion with such a value may feel.

    A limit of plus and minus 1e6, written for none, says nothing of how large something is.
    """
    finite = [abs(limit) for limit in limits if math.isfinite(limit)]
    return [limit for limit in finite if limit <= ROOMY * typical]


def far_below_limits(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals and unknowns far below a size that their limits gave; they may also be zero."""
    phases = [phase.at_fractions(FRACTIONS) for phase in motion.phases.values()]

    def largest(name: str) -> float:
        if name in motion.unknowns:
            return largest_finite(motion.unknowns[name])
        return max(largest_finite(values.get(name, 0.0)) for values in phases)

    return {name for name, size in _of_limits(scales) if ROOMY * largest(name) < size}


def is_brief(scales: Scales, motion: InitialGuess) -> bool:
    """Whether a motion lasts far less than limits of its times gave for long, and yet some time.

    One that has shrunk to the least duration says nothing of how long anything takes.
    """
    longest = max(phase.end - phase.start for phase in motion.phases.values())
    return SHRUNK * scales.time < longest < scales.time / ROOMY


def roomy(scales: Scales, of_motion: Scales, factor: float = ROOMY) -> list[str]:
    """Signals and unknowns whose limits gave sizes many times those of a motion, as 1e6 may be."""
    sizes = of_motion.symbols
    return [name for name, size in _of_limits(scales) if size > factor * sizes[name]]


def _of_limits(scales: Scales) -> Iterator[tuple[str, float]]:
    """Names and sizes that limits may have made too large."""
    for name, size, why in scales.symbols_with_reasons:
        if why in (BOUNDS, GUESSED_NUMBER):
            yield name, size


@dataclass(frozen=True, repr=False)
class Scales:
    """Typical sizes, in the units of the statement.

    Attributes
    ----------
    signals, unknowns, functionals : size by name (functionals by object).
    bounds : size by (phase name or "", bound name).
    time : typical duration [s].
    objective : size of the objective.
    reasons : where each size comes from, by kind and the key above.
    """

    signals: Mapping[str, float]
    unknowns: Mapping[str, float]
    bounds: Mapping[tuple[str, str], float]
    functionals: Mapping[Functional, float]
    time: float
    objective: float
    reasons: Mapping[tuple[str, Any], str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"Scales({len(self.signals)} signals, {len(self.bounds)} bounds; objective "
            f"{self.objective:.4g}, time {self.time:.4g} s)"
        )

    @property
    def symbols(self) -> dict[str, float]:
        """Size of each signal and unknown by name."""
        return {**self.signals, **self.unknowns}

    @property
    def symbols_with_reasons(self) -> Iterator[tuple[str, float, str]]:
        """Names of signals and unknowns, their sizes, and where these come from."""
        for kind, sizes in (("signal", self.signals), ("unknown", self.unknowns)):
            for name, size in sizes.items():
                yield name, size, self.reasons.get((kind, name), "")

    @property
    def objective_is_stated(self) -> bool:
        """Whether the objective's size was stated."""
        return self.reasons.get(("objective", "")) == STATED
