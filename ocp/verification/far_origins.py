"""States that move by a small part of their size, such as a metre at a radius of 1e9 m.

Tolerances are relative to sizes. Of such a state they may not see the whole way: a motion that
stays where it is meets them. So what the dynamics and limits are off by is held against the way,
where the statement tells it: from an initial or final value to another number that is stated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.schemes import Gauss
from ocp.optimality.iterate import Iterate
from ocp.problem.display import with_unit
from ocp.problem.parameters import Parameters
from ocp.problem.symbols import State

# Part of a value that the way from it is, at most, for its origin to count as far
_FAR = 1e-3

# Part of the way that dynamics and limits may be off by
WAY = 1e-5

# What rounding leaves of the rate of a polynomial, integrated over an interval, in parts of its
# value, and the part of the way up to which it counts as that
_ROUNDING = 20.0 * float(np.finfo(float).eps)
_MOST_ROUNDING = 1e-3


@dataclass(frozen=True)
class FarOrigin:
    """A state whose way is a small part of its size.

    Attributes
    ----------
    phase, state, unit : str
    of : str
        The state whose origin is far: itself, or the one whose rate it is.
    way : float
        The least way from where it begins or ends that is stated [its unit].
    off : float
        What its dynamics and limits are off by along the motion, as a part of the way.
    """

    phase: str
    state: str
    unit: str
    of: str
    way: float
    off: float

    @property
    def sentence(self) -> str:
        """What is wrong, and the remedy."""
        return (
            f"'{self.state}' in phase '{self.phase}' is off by {self.off:.1e} of its way of "
            f"{with_unit(f'{self.way:.3g}', self.unit)}, as '{self.of}' changes by next to nothing "
            f"of its value: count '{self.of}' from an origin that is near"
        )


def far_origins(iterate: Iterate, evaluator: Evaluator) -> Iterator[FarOrigin]:
    """The states of a motion whose way is a small part of their size."""
    for phase, motion in zip(iterate.problem.phases, iterate.trajectory.phases, strict=True):
        ways = {
            state: (state.name, found)
            for state in phase.dynamics
            if (found := _way(phase.name, state, iterate.parameters)) is not None
        }
        if not ways:
            continue

        # a state that is the rate of one has a size by it, and a way as well
        rates = {state: rate for state, rate in phase.dynamics.items() if rate.is_symbolic()}
        duration = max(motion.end - motion.start, np.finfo(float).tiny)
        for state in list(ways):
            for other in phase.dynamics:
                if state in rates and rates[state].element_hash() == other.symbol.element_hash():
                    origin, way = ways[state]
                    ways.setdefault(other, (origin, 2.0 * way / duration))

        off = _off(iterate, evaluator, motion, list(ways))
        for (state, (origin, way)), amount in zip(ways.items(), off, strict=True):
            part = max(amount[0] - min(amount[1], _MOST_ROUNDING * way), 0.0) / way
            yield FarOrigin(phase.name, state.name, state.unit, origin, way, part)


def _way(phase: str, state: State, parameters: Parameters) -> float | None:
    """The least way from a stated end value to another number, if it is a small part of it."""
    ends = [
        values[phase, state.name]
        for values in (parameters.initial_values, parameters.final_values)
        if (phase, state.name) in values
    ]
    numbers = [number for pair in (*ends, parameters.signal_limits[state.name]) for number in pair]
    found = []
    for lower, upper in ends:
        apart = [abs(number - lower) for number in numbers if np.isfinite(number)]
        ways = [way for way in apart if way > 0.0]
        if lower == upper and ways and min(ways) < _FAR * abs(lower):
            found.append(min(ways))
    return min(found, default=None)


def _off(
    iterate: Iterate, evaluator: Evaluator, motion: PhaseTrajectory, states: list[State]
) -> list[tuple[float, float]]:
    """What dynamics miss of states along the motion and limits are exceeded by, and rounding."""
    dynamics = iterate.problem.phase(motion.name).dynamics
    rule = Gauss().at(int(motion.degrees.max()) + 2)
    k = np.repeat(np.arange(motion.intervals), rule.degree)
    tau = np.tile(rule.points, motion.intervals)
    seconds = np.diff(motion.breakpoints)[k] * np.tile(rule.weights, motion.intervals)
    rates = [dynamics[state] for state in states]
    stated = evaluator.values(iterate.trajectory, motion.name, rates, k, tau)
    own, values = motion.rates(k, tau), motion.local(k, tau)

    off = []
    for j, state in enumerate(states):
        column = motion.states.index(state.name)
        missed = float(np.abs(own[:, column] - stated[:, j]) @ seconds)
        lower, upper = iterate.parameters.signal_limits[state.name]
        beyond = np.maximum(values[:, column] - upper, lower - values[:, column])
        rounding = _ROUNDING * motion.intervals * float(np.abs(values[:, column]).max())
        off.append((missed + max(float(beyond.max()), 0.0), rounding))
    return off
