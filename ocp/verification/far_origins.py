"""States that move by a small part of their value, such as a metre at a radius of 1e9 m.

Tolerances are relative to sizes. Of such a state they may not see the whole displacement: a motion
that stays where it is meets them. So what the dynamics and limits are off by is held against the
displacement, where the statement tells it: from an initial or final value to another number that is
stated, in a phase or, where it goes through several phases, in one of these. A bound on how far two
end values are apart counts, too, and so does what links are off by. The motion may go further than
that, as a joint that swings out and comes back does. Its displacement is then as long as its range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.schemes import Gauss
from ocp.optimality.iterate import Iterate
from ocp.problem.display import with_unit
from ocp.problem.functionals import BoundaryValue
from ocp.problem.parameters import Parameters
from ocp.problem.symbols import State, resolve

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
            f"small compared with the value of '{self.of}': measure '{self.of}' from a nearer "
            "origin"
        )


def far_origins(iterate: Iterate, evaluator: Evaluator) -> Iterator[FarOrigin]:
    """The states of a motion whose displacement is a small part of their value."""
    differences = {
        state: list(_differences(iterate, evaluator, state))
        for state in {s: None for phase in iterate.problem.phases for s in phase.dynamics}
    }
    for phase, motion in zip(iterate.problem.phases, iterate.trajectory.phases, strict=True):
        displacements = {
            state: (state.name, *found)
            for state in phase.dynamics
            if (found := _displacement(iterate, motion, state, differences[state])) is not None
        }
        if not displacements:
            continue

        # a state that is the rate of one has a size by it, and a displacement as well
        rates = {state: rate for state, rate in phase.dynamics.items() if rate.is_symbolic()}
        for state in list(displacements):
            for other in phase.dynamics:
                if state in rates and rates[state].element_hash() == other.symbol.element_hash():
                    origin, least, duration = displacements[state]
                    displacements.setdefault(other, (origin, 2.0 * least / duration, duration))

        off = _off(iterate, evaluator, motion, list(displacements))
        for (state, (origin, least, _)), (lost, rounding) in zip(
            displacements.items(), off, strict=True
        ):
            missed = lost + max((each.beyond for each in differences[state]), default=0.0)
            part = max(missed - min(rounding, _MOST_ROUNDING * least), 0.0) / least
            yield FarOrigin(phase.name, state.name, state.unit, origin, least, part)


@dataclass(frozen=True)
class _Difference:
    """A bound or link of the problem that is a difference of end values of one state.

    Attributes
    ----------
    distances : tuple of float
        Its limits that are no zero, as distances of the state [its unit].
    beyond : float
        By which the motion exceeds it [unit of the state].
    """

    distances: tuple[float, ...]
    beyond: float


def _differences(iterate: Iterate, evaluator: Evaluator, state: State) -> Iterator[_Difference]:
    """The bounds and links of the problem that say how far end values of a state are apart."""
    for bound in iterate.problem.boundary_constraints:
        values = resolve(bound.expression, "a bound")
        if not values or not all(
            isinstance(value, BoundaryValue) and ca.is_equal(value.expression, state.symbol)
            for value in values
        ):
            continue

        # a difference, or a multiple of one, has constant slopes that add up to nothing
        slopes = ca.jacobian(bound.expression, ca.vertcat(*[value.symbol for value in values]))
        if not slopes.is_constant():
            continue
        slopes = np.array(ca.DM(slopes)).ravel()
        largest = float(np.abs(slopes).max())
        if not largest or abs(float(slopes.sum())) > _SAME * largest:
            continue

        value = evaluator.number(iterate.trajectory, bound.expression, {})
        lower, upper = iterate.parameters.bound_limits["", bound.name]
        distances = [abs(limit) for limit in (lower, upper) if limit and np.isfinite(limit)]
        yield _Difference(
            tuple(distance / largest for distance in distances),
            max(value - upper, lower - value, 0.0) / largest,
        )


def _displacement(
    iterate: Iterate, motion: PhaseTrajectory, state: State, differences: list[_Difference]
) -> tuple[float, float] | None:
    """Displacement of a state from a stated end value, and in what time [s].

    None where it is no small part of that value. It is that of the phase or, where the phase tells
    of none, that of all phases with the state.
    """
    apart = [distance for each in differences for distance in each.distances]
    every = [each for each in iterate.trajectory.phases if state.name in each.states]
    for motions in ([motion], every):
        found = _least_displacement(motions, state, iterate.parameters, apart)
        if found is not None:
            seconds = sum(each.end - each.start for each in motions)
            return found, max(seconds, float(np.finfo(float).tiny))
    return None


def _least_displacement(
    motions: list[PhaseTrajectory], state: State, parameters: Parameters, apart: list[float]
) -> float | None:
    """Displacement of a state over some phases; None if it is no small part of an end value.

    Parameters
    ----------
    apart : list of float
        Distances of its end values that bounds of the problem state.
    """
    ends = [
        values[motion.name, state.name]
        for motion in motions
        for values in (parameters.initial_values, parameters.final_values)
        if (motion.name, state.name) in values
    ]
    seen = [
        motion.local(
            np.repeat(np.arange(motion.intervals), len(_LOOKS)), np.tile(_LOOKS, motion.intervals)
        )[:, motion.states.index(state.name)]
        for motion in motions
    ]
    spread = float(np.ptp(np.concatenate(seen)))
    numbers = [number for pair in (*ends, parameters.signal_limits[state.name]) for number in pair]
    found = []
    for lower, upper in ends:
        far = [abs(number - lower) for number in numbers if np.isfinite(number)] + apart
        stated = min((each for each in far if each > _SAME * abs(lower)), default=np.inf)
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
