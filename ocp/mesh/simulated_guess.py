"""Guesses by simulation: motions that obey the dynamics, under controls that switch at random.

A straight line from start to end obeys nothing, and where the controls are too weak for it, as in
the swing-up of a pendulum, a solver finds no way from there to a motion. A simulated motion misses
the end only. Of many draws those that come closest to the prescribed values are kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import InitialGuess
from ocp.numerics.columnwise import called, columnwise
from ocp.problem.parameters import Interval, Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Between, Control, column_of

# draws, steps of a phase, and the most switches of a control in it
_DRAWS = 512
_STEPS = 160
_MOST_SWITCHES = 8
# part of the draws whose controls sit on their bounds all the time
_ON_BOUNDS = 0.7
# typical sizes of a state beyond which a draw has run away
_FAR = 1e4


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedGuess:
    """One simulated phase.

    Attributes
    ----------
    start, end : float
        Times [s].
    fractions : (m + 1,)
        Of the phase.
    states, controls : mapping of str to (m + 1,), of str to (m,)
        States at the fractions, controls between them.
    """

    start: float
    end: float
    fractions: Array
    states: Mapping[str, Array]
    controls: Mapping[str, Array]

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        at = np.asarray(fractions, dtype=float)
        step = np.clip(np.searchsorted(self.fractions, at, side="right") - 1, 0, None)
        values = {n: np.interp(at, self.fractions, v) for n, v in self.states.items()}
        for name, levels in self.controls.items():
            values[name] = levels[np.minimum(step, levels.size - 1)]
        return values


def simulated_guesses(
    problem: Problem,
    parameters: Parameters,
    stated: InitialGuess,
    sizes: Mapping[str, float],
    bound_sizes: Mapping[tuple[str, str], float],
    count: int,
    random: np.random.Generator,
    most: float = math.inf,
) -> list[InitialGuess]:
    """Guesses in the order of how closely they come to the prescribed values.

    None where a motion cannot be simulated from its start, as with algebraic signals.

    Parameters
    ----------
    stated : InitialGuess
        For unknowns, and for initial values that are free.
    sizes : mapping of str to float
        Typical sizes of the signals.
    bound_sizes : mapping of (phase name, bound name) to float
        Typical sizes of the path constraints.
    count : int
        How many are wanted.
    most : float
        That one may miss the prescribed values and the limits by, in these sizes.
    """
    if any(problem.algebraics.values()):
        return []
    simulator = _Simulator(problem, parameters, stated, sizes, bound_sizes, random, most)
    phases: list[_Draws] = []
    for phase in problem.phases:
        phases.append(simulator.drawn(phase, phases[-1] if phases else None))
    miss = np.max([drawn.miss for drawn in phases], axis=0)
    order = [int(k) for k in np.argsort(miss)[:count] if np.isfinite(miss[k]) and miss[k] <= most]
    return [
        InitialGuess({drawn.phase.name: drawn.guess(k) for drawn in phases}, stated.unknowns)
        for k in order
    ]


@dataclass(frozen=True, eq=False, repr=False)
class _Draws:
    """Many simulated motions of one phase at once.

    Attributes
    ----------
    controlled : tuple of Control
        The controls of the phase.
    ends : (2, K)
        Initial and final time of each draw [s].
    states : (m + 1, n_x, K)
    controls : (m, n_u, K)
    last : (K,)
        The step at which each draw ends.
    miss : (K,)
        Distance from the prescribed values and limits, relative to their sizes.
    """

    phase: Phase
    controlled: tuple[Control, ...]
    ends: Array
    states: Array
    controls: Array
    last: Array
    miss: Array

    def guess(self, k: int) -> SimulatedGuess:
        """One of the draws."""
        last, (start, end) = int(self.last[k]), self.ends[:, k]
        states, controls = self.states[: last + 1, :, k].T, self.controls[:last, :, k].T
        return SimulatedGuess(
            start=float(start),
            end=float(start + (end - start) * last / _STEPS),
            fractions=np.linspace(0.0, 1.0, last + 1),
            states={s.name: row for s, row in zip(self.phase.states, states, strict=True)},
            controls={c.name: row for c, row in zip(self.controlled, controls, strict=True)},
        )


@dataclass(frozen=True, eq=False, repr=False)
class _Simulator:
    """Draws motions of the phases of a problem, see `simulated_guesses`."""

    problem: Problem
    parameters: Parameters
    stated: InitialGuess
    sizes: Mapping[str, float]
    bound_sizes: Mapping[tuple[str, str], float]
    random: np.random.Generator
    most: float

    def drawn(self, phase: Phase, before: _Draws | None) -> _Draws:
        """All draws of a phase, from where the phase before it ended."""
        ends = self._ends(phase, before)
        x = self._first_states(phase, before)
        u = self._controls(phase)
        unknowns = [self.stated.unknowns[u.name] for u in self.problem.unknowns]
        numbers = np.array([*unknowns, *self.parameters.values.values()], dtype=float)

        h, states = (ends[1] - ends[0]) / _STEPS, [x.T]
        inputs = [
            column_of(phase.states),
            column_of(self.problem.controls[phase.name]),
            TIME.symbol,
            column_of((*self.problem.unknowns, *self.problem.constants)),
        ]
        step, of_all = _step(phase, inputs).map(_DRAWS), np.tile(numbers, (_DRAWS, 1))
        # a draw that runs away is infinite, and left out
        for i in range(_STEPS):
            states += called(step, states[-1], u[i].T, ends[0] + i * h, h, of_all)
        motion = np.stack(states).transpose(0, 2, 1)
        times = np.linspace(ends[0], ends[1], _STEPS + 1)

        # a free last time may as well be earlier, where the motion comes closest
        late = (np.arange(_STEPS + 1) == _STEPS)[:, None]
        if isinstance(phase.end, Between) and phase is self.problem.phases[-1]:
            late = times >= phase.end.lower
            late[0] = False

        # a value that is none counts as one that has run away
        scale = np.array([self.sizes[s.name] for s in phase.states])[None, :, None]
        with np.errstate(over="ignore", invalid="ignore"):
            away = np.nan_to_num(np.abs(motion) / scale, nan=np.inf).max(axis=1)
            miss = self._misses(phase, np.nan_to_num(motion))
            miss[~late | (np.maximum.accumulate(away, axis=0) > _FAR)] = np.inf
            # limits take as long as all else, and what misses its end by more is left out anyway
            near = miss.min(axis=0) <= self.most
            parts = (motion[..., near], u[..., near], times[:, near])
            miss[:, near] += self._beyond_bounds(phase, inputs, *parts, numbers)

        last = np.argmin(miss, axis=0)
        last = np.where(last > 0, last, _STEPS)
        controlled = self.problem.controls[phase.name]
        return _Draws(phase, controlled, ends, motion, u, last, miss[last, np.arange(_DRAWS)])

    def _ends(self, phase: Phase, before: _Draws | None) -> Array:
        """Initial and final times, (2, K) [s].

        They are as guessed. A free first time is anywhere within finite limits in every other draw.
        A free last one is anywhere within limits that are near, else around the guess.
        """
        own, start, end = self.stated.phases[phase.name], phase.start, phase.end
        first = np.full(_DRAWS, own.start)
        if before is not None:
            first = before.ends[1]
        elif isinstance(start, Between) and math.isfinite(start.upper - start.lower):
            first[::2] = self.random.uniform(start.lower, start.upper, first[::2].size)
        if not isinstance(end, Between):
            return np.stack([first, np.full(_DRAWS, float(end))])
        duration = (own.end - own.start) * 2.0 ** self.random.uniform(-1.0, 2.0, _DRAWS)
        last = np.clip(first + duration, end.lower, end.upper)
        return np.stack([first, np.maximum(last, first + 1e-6)])

    def _first_states(self, phase: Phase, before: _Draws | None) -> Array:
        """Initial states (n_x, K): as prescribed, as the phase before ended, or as guessed."""
        guessed = self.stated.phases[phase.name].at_fractions(np.array([0.0]))
        rows = []
        for state in phase.states:
            key = (phase.name, state.name)
            row = np.full(_DRAWS, float(guessed[state.name][0]))
            if before is not None:
                # by name: symbols that are compared make a relation
                earlier = [s.name for s in before.phase.states]
                if state.name in earlier:
                    row = before.states[-1, earlier.index(state.name)]
            elif key in self.parameters.initial_values:
                row = np.clip(row, *self.parameters.initial_values[key])
            rows.append(row)
        return np.stack(rows)

    def _controls(self, phase: Phase) -> Array:
        """Controls (m, n_u, K) that switch at random times between random levels."""
        centre, random = self.stated.phases[phase.name].at_fractions(np.array([0.5])), self.random
        signals = []
        for control in self.problem.controls[phase.name]:
            lower, upper = self.parameters.signal_limits[control.name]
            middle, reach = float(centre[control.name][0]), 2.0 * self.sizes[control.name]
            low = lower if math.isfinite(lower) else min(middle, upper) - reach
            high = upper if math.isfinite(upper) else max(middle, lower) + reach

            # levels of each stretch: on the bounds, or anywhere between them
            stretches = (_MOST_SWITCHES + 1, _DRAWS)
            ends = np.where(random.random(stretches) < 0.5, low, high)
            between = random.uniform(low, high, stretches)
            level = np.where(random.random(_DRAWS) < _ON_BOUNDS, ends, between)

            switches = np.sort(random.random((_MOST_SWITCHES, _DRAWS)), axis=0)
            most = random.integers(1, _MOST_SWITCHES + 1, _DRAWS)
            switches[np.arange(_MOST_SWITCHES)[:, None] >= most] = np.inf
            at = (np.arange(_STEPS) + 0.5) / _STEPS
            number = (at[:, None, None] > switches[None]).sum(axis=1)
            signals.append(np.take_along_axis(level, number, axis=0))
        return np.stack(signals, axis=1) if signals else np.zeros((_STEPS, 0, _DRAWS))

    def _misses(self, phase: Phase, motion: Array) -> Array:
        """How far each draw is from the final values, were each step the last, (m + 1, K)."""
        miss = np.zeros((motion.shape[0], motion.shape[2]))
        for i, state in enumerate(phase.states):
            size, limits = self.sizes[state.name], self.parameters.signal_limits[state.name]
            miss += np.maximum.accumulate(_beyond(motion[:, i], limits) / size, axis=0)
            values = self.parameters.final_values.get((phase.name, state.name))
            if values is not None:
                miss += _beyond(motion[:, i], values) / size
        return miss

    def _beyond_bounds(
        self,
        phase: Phase,
        inputs: list[ca.SX],
        motion: Array,
        u: Array,
        times: Array,
        numbers: Array,
    ) -> Array:
        """By how much each draw has left the path constraints until a step, (m + 1, K)."""
        beyond = np.zeros(times.shape)
        if not (phase.bounds and times.size):
            return beyond
        expressions = ca.densify(ca.vertcat(*[bound.expression for bound in phase.bounds]))
        signals = (motion, np.concatenate([u, u[-1:]]), times[:, None])
        columns = [values.transpose(0, 2, 1).reshape(times.size, -1) for values in signals]
        (values,) = columnwise(ca.Function("bounds", inputs, [expressions]), *columns, numbers)
        for bound, own in zip(phase.bounds, values.T, strict=True):
            key = (phase.name, bound.name)
            left = _beyond(own, self.parameters.bound_limits[key]) / self.bound_sizes[key]
            # where it has no value, nothing is known to be left
            left = np.nan_to_num(left).reshape(times.shape)
            beyond += np.maximum.accumulate(left, axis=0)
        return beyond


def _step(phase: Phase, inputs: list[ca.SX]) -> ca.Function:
    """One step of the classical Runge-Kutta method of order 4.

    ``(states, u, t, h, unknowns and constants) -> states later``, with `h` the length of the step
    [s].
    """
    x, u, t, numbers = inputs
    rates = ca.densify(ca.vertcat(*phase.dynamics.values()))
    rate, h = ca.Function("rate", inputs, ca.cse([rates])), ca.SX.sym("h")
    k1 = rate(x, u, t, numbers)
    k2 = rate(x + 0.5 * h * k1, u, t + 0.5 * h, numbers)
    k3 = rate(x + 0.5 * h * k2, u, t + 0.5 * h, numbers)
    k4 = rate(x + h * k3, u, t + h, numbers)
    later = ca.densify(x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
    return ca.Function("step", [x, u, t, h, numbers], [later])


def _beyond(values: Array, limits: Interval) -> Array:
    """By how much values lie outside limits."""
    return np.maximum(np.maximum(values - limits[1], limits[0] - values), 0.0)
