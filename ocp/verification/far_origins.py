"""States that move by a small part of their value, such as a metre at a radius of 1e9 m.

Tolerances are relative to sizes. Of such a state they may not see the whole displacement: a motion
that stays where it is meets them. So what the dynamics and limits are off by is held against the
displacement, where the statement tells it: from an initial or final value to another number that is
stated. The motion may go further than that, as a joint that swings out and comes back does. Its
displacement is then as long as its range.
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

# Part of a value that the displacement from it is, at most, for its origin to count as far
_FAR = 1e-3

# Part of a value up to which another number is the same one, computed in another way
_SAME = 1e-13

# Part of the displacement that dynamics and limits may be off by
WITHIN = 1e-5

# Where in each interval the range of a state is looked at
_LOOKS = np.array([0.0, 0.5, 1.0])

# What rounding leaves of the rate of a polynomial, integrated over an interval, in parts of its
# value, and the part of the displacement up to which it counts as that
_ROUNDING = 20.0 * float(np.finfo(float).eps)
_MOST_ROUNDING = 1e-3


@dataclass(frozen=True)
class FarOrigin:
    """A state whose displacement is a small part of its value.

    Attributes
    ----------
    phase, state, unit : str
    of : str
        The state whose origin is far: itself, or the one whose rate it is.
    displacement : float
        The least one from where it begins or ends that is stated, or the range of its values
        where that is more [its unit].
    error : float
        What its dynamics and limits are off by along the motion, as a part of the displacement.
    """

    phase: str
    state: str
    unit: str
    of: str
    displacement: float
    error: float

    @property
    def sentence(self) -> str:
        """What is wrong, and the remedy."""
        return (
            f"'{self.state}' in phase '{self.phase}' is off by {self.error:.1e} of its "
            f"displacement of {with_unit(f'{self.displacement:.3g}', self.unit)}, which is too "
            f"small beside the value of '{self.of}': measure '{self.of}' from a nearer origin"
        )


def far_origins(iterate: Iterate, evaluator: Evaluator) -> Iterator[FarOrigin]:
    """The states of a motion whose displacement is a small part of their value."""
    for phase, motion in zip(iterate.problem.phases, iterate.trajectory.phases, strict=True):
        displacements = {
            state: (state.name, found)
            for state in phase.dynamics
            if (found := _displacement(motion, state, iterate.parameters)) is not None
        }
        if not displacements:
            continue

        # a state that is the rate of one has a size by it, and a displacement as well
        rates = {state: rate for state, rate in phase.dynamics.items() if rate.is_symbolic()}
        duration = max(motion.end - motion.start, np.finfo(float).tiny)
        for state in list(displacements):
            for other in phase.dynamics:
                if state in rates and rates[state].element_hash() == other.symbol.element_hash():
                    origin, least = displacements[state]
                    displacements.setdefault(other, (origin, 2.0 * least / duration))

        off = _off(iterate, evaluator, motion, list(displacements))
        for (state, (origin, least)), (missed, rounding) in zip(
            displacements.items(), off, strict=True
        ):
            part = max(missed - min(rounding, _MOST_ROUNDING * least), 0.0) / least
            yield FarOrigin(phase.name, state.name, state.unit, origin, least, part)


def _displacement(motion: PhaseTrajectory, state: State, parameters: Parameters) -> float | None:
    """That of a state from a stated end value, if it is a small part of that value."""
    ends = [
        values[motion.name, state.name]
        for values in (parameters.initial_values, parameters.final_values)
        if (motion.name, state.name) in values
    ]
    k = np.repeat(np.arange(motion.intervals), len(_LOOKS))
    seen = motion.local(k, np.tile(_LOOKS, motion.intervals))[:, motion.states.index(state.name)]
    spread = float(np.ptp(seen))
    numbers = [number for pair in (*ends, parameters.signal_limits[state.name]) for number in pair]
    found = []
    for lower, upper in ends:
        apart = [abs(number - lower) for number in numbers if np.isfinite(number)]
        stated = min((far for far in apart if far > _SAME * abs(lower)), default=np.inf)
        if lower == upper and max(stated, spread) < _FAR * abs(lower):
            found.append(max(stated, spread))
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
