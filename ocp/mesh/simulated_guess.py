"""Guesses by simulation: motions that obey the dynamics, under controls that switch at random.

A straight line from start to end obeys nothing, and where the controls are too weak for it, as in
the swing-up of a pendulum, a solver finds no way from there to a motion. A simulated motion misses
the end only. Of many draws those that come closest to the prescribed values are kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import InitialGuess, PhaseGuess
from ocp.numerics.columnwise import called, columnwise
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Between, Symbol

# draws, steps of a phase, and the most switches of a control in it
_DRAWS = 512
_STEPS = 160
_MOST_SWITCHES = 8
# part of the draws whose controls sit on their bounds all the time
_ON_BOUNDS = 0.7
# typical sizes of a state beyond which a draw has run away
_FAR = 1e4

# Newton steps to algebraic signals at the start of a draw, and from one stage to the next. The
# motion is a guess: what is left of an equation is for the solver.
_FROM_GUESS, _FROM_STAGE = 12, 2
# as many as are solved for in closed form
_MOST_ALGEBRAICS = 6


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
        States and algebraic signals at the fractions, controls between them.
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


@dataclass(frozen=True, eq=False, repr=False)
class _Draws:
    """Many simulated motions of one phase at once.

    Attributes
    ----------
    ends : (2, K)
        Initial and final time of each draw [s].
    states : (m + 1, n_x + n_z, K)
        And algebraic signals.
    controls : (m, n_u, K)
    last : (K,)
        The step at which each draw ends.
    miss : (K,)
        Distance from the prescribed values and limits, relative to their sizes.
    """

    ends: Array
    states: Array
    controls: Array
    last: Array
    miss: Array


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

    None where a motion cannot be simulated from its start, or equations are not as many as the
    algebraic signals that they determine.

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
    if not all(_can_be_simulated(problem, phase) for phase in problem.phases):
        return []
    unknowns = [stated.unknowns[u.name] for u in problem.unknowns]
    numbers = np.array([*unknowns, *parameters.values.values()], dtype=float)

    phases: list[_Draws] = []
    for phase in problem.phases:
        drawn = _drawn(
            problem, phase, parameters, stated, sizes, bound_sizes, numbers, phases, random
        )
        phases.append(drawn)
    miss = np.max([drawn.miss for drawn in phases], axis=0)
    order = [int(k) for k in np.argsort(miss)[:count] if np.isfinite(miss[k]) and miss[k] <= most]
    return [
        InitialGuess(
            {
                phase.name: _guess(problem, phase, drawn, k)
                for phase, drawn in zip(problem.phases, phases, strict=True)
            },
            stated.unknowns,
        )
        for k in order
    ]


def _guess(problem: Problem, phase: Phase, drawn: _Draws, k: int) -> PhaseGuess:
    """One of the draws."""
    last = int(drawn.last[k])
    start, end = drawn.ends[:, k]
    names = [control.name for control in problem.controls[phase.name]]
    return SimulatedGuess(
        start=float(start),
        end=float(start + (end - start) * last / _STEPS),
        fractions=np.linspace(0.0, 1.0, last + 1),
        states={
            s.name: drawn.states[: last + 1, i, k]
            for i, s in enumerate((*phase.states, *problem.algebraics[phase.name]))
        },
        controls={name: drawn.controls[:last, i, k] for i, name in enumerate(names)},
    )


def _drawn(
    problem: Problem,
    phase: Phase,
    parameters: Parameters,
    stated: InitialGuess,
    sizes: Mapping[str, float],
    bound_sizes: Mapping[tuple[str, str], float],
    numbers: Array,
    before: Sequence[_Draws],
    random: np.random.Generator,
) -> _Draws:
    """All draws of a phase, from where the phase before it ended."""
    own = stated.phases[phase.name]
    first = before[-1].ends[1] if before else _first_times(phase, own, random)
    ends = np.stack([first, _last_times(phase, first, own, random)])
    x = _first_states(problem, phase, parameters, own, before)
    u = _controls(problem, phase, parameters, own, sizes, random)

    h = (ends[1] - ends[0]) / _STEPS
    of_all = np.tile(numbers, (_DRAWS, 1))
    equations = _Equations.of(problem, phase, parameters)
    algebraics = problem.algebraics[phase.name]
    states = [x.T]
    if algebraics:
        guessed = own.at_fractions(np.array([0.0]))
        z = np.tile([float(guessed[a.name][0]) for a in algebraics], (_DRAWS, 1))
        (z,) = called(equations.solved(_FROM_GUESS).map(_DRAWS), x.T, z, u[0].T, ends[0], of_all)
        states = [np.hstack([x.T, z])]
    step = _step(problem, phase, equations).map(_DRAWS)
    # a draw that runs away is infinite, and left out
    for i in range(_STEPS):
        states += called(step, states[-1], u[i].T, ends[0] + i * h, h, of_all)
    motion = np.stack(states).transpose(0, 2, 1)

    # a value that is none counts as one that has run away
    scale = np.array([sizes[s.name] for s in (*phase.states, *algebraics)])[None, :, None]
    with np.errstate(over="ignore", invalid="ignore"):
        away = np.nan_to_num(np.abs(motion) / scale, nan=np.inf).max(axis=1)
        miss = _misses(phase, parameters, np.nan_to_num(motion), scale)
        at = np.linspace(ends[0], ends[1], _STEPS + 1)
        miss += _beyond_bounds(phase, parameters, bound_sizes, equations, motion, u, at, numbers)
    miss[np.maximum.accumulate(away, axis=0) > _FAR] = np.inf

    # a free last time may as well be earlier, where the motion comes closest
    last = np.full(_DRAWS, _STEPS)
    if isinstance(phase.end, Between) and phase is problem.phases[-1]:
        times = ends[0] + np.arange(_STEPS + 1)[:, None] * h
        late = (times >= phase.end.lower) & (np.arange(_STEPS + 1)[:, None] > 0)
        last = np.argmin(np.where(late, miss, np.inf), axis=0)
        last = np.where(last > 0, last, _STEPS)
    return _Draws(ends, motion, u, last, miss[last, np.arange(_DRAWS)])


def _first_times(phase: Phase, own: PhaseGuess, random: np.random.Generator) -> Array:
    """Initial times: as guessed, and if free anywhere within finite limits in every other draw."""
    times, start = np.full(_DRAWS, own.start), phase.start
    if isinstance(start, Between) and math.isfinite(start.upper - start.lower):
        times[::2] = random.uniform(start.lower, start.upper, times[::2].size)
    return times


def _last_times(phase: Phase, first: Array, own: PhaseGuess, random: np.random.Generator) -> Array:
    """Final times: anywhere within limits that are near, else around the guess."""
    end = phase.end
    if not isinstance(end, Between):
        return np.full(_DRAWS, float(end))
    duration = (own.end - own.start) * 2.0 ** random.uniform(-1.0, 2.0, _DRAWS)
    return np.maximum(np.clip(first + duration, end.lower, end.upper), first + 1e-6)


def _first_states(
    problem: Problem,
    phase: Phase,
    parameters: Parameters,
    own: PhaseGuess,
    before: Sequence[_Draws],
) -> Array:
    """Initial states (n_x, K): as prescribed, as the phase before ended, or as guessed."""
    guessed = own.at_fractions(np.array([0.0]))
    rows = []
    for state in phase.states:
        key = (phase.name, state.name)
        row = np.full(_DRAWS, float(guessed[state.name][0]))
        if before:
            # by name: symbols that are compared make a relation
            earlier = [s.name for s in problem.phases[len(before) - 1].states]
            if state.name in earlier:
                row = before[-1].states[-1, earlier.index(state.name)]
        elif key in parameters.initial_values:
            row = np.clip(row, *parameters.initial_values[key])
        rows.append(row)
    return np.stack(rows)


def _controls(
    problem: Problem,
    phase: Phase,
    parameters: Parameters,
    own: PhaseGuess,
    sizes: Mapping[str, float],
    random: np.random.Generator,
) -> Array:
    """Controls (m, n_u, K) that switch at random times between random levels."""
    centre = own.at_fractions(np.array([0.5]))
    signals = []
    for control in problem.controls[phase.name]:
        lower, upper = parameters.signal_limits[control.name]
        middle, reach = float(centre[control.name][0]), 2.0 * sizes[control.name]
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


def _can_be_simulated(problem: Problem, phase: Phase) -> bool:
    """Whether a phase has no algebraic signals, or few, and as many equations."""
    algebraics = len(problem.algebraics[phase.name])
    equations = sum(bound.is_equation for bound in phase.bounds)
    return not algebraics or equations == algebraics <= _MOST_ALGEBRAICS


@dataclass(frozen=True, eq=False, repr=False)
class _Equations:
    """What determines the algebraic signals of a phase.

    Attributes
    ----------
    inputs : list of SX
        States, algebraic signals, controls, time, unknowns and constants.
    residuals : SX (n_z,)
        That are zero.
    """

    inputs: list[ca.SX]
    residuals: ca.SX

    @classmethod
    def of(cls, problem: Problem, phase: Phase, parameters: Parameters) -> _Equations:
        """Those of a phase, whose limits agree."""

        def column(symbols: Sequence[Symbol]) -> ca.SX:
            return ca.vertcat(*[s.symbol for s in symbols], ca.SX(0, 1))

        inputs = [
            column(phase.states),
            column(problem.algebraics[phase.name]),
            column(problem.controls[phase.name]),
            TIME.symbol,
            column((*problem.unknowns, *problem.constants)),
        ]
        residuals = [
            bound.expression - parameters.bound_limits[phase.name, bound.name][0]
            for bound in phase.bounds
            if bound.is_equation
        ]
        return cls(inputs, ca.densify(ca.vertcat(*residuals, ca.SX(0, 1))))

    def solved(self, steps: int) -> ca.Function:
        """Algebraic signals after so many Newton steps: ``inputs -> z``."""
        x, z, u, t, numbers = self.inputs
        slopes = ca.jacobian(self.residuals, z)
        newton = ca.Function("newton", self.inputs, [z - ca.solve(slopes, self.residuals)])
        after = z
        for _ in range(steps):
            after = newton(x, after, u, t, numbers)
        return ca.Function("solved", self.inputs, [after])


def _step(problem: Problem, phase: Phase, equations: _Equations) -> ca.Function:
    """One step of the classical Runge-Kutta method, with algebraic signals from stage to stage.

    ``(states and algebraic signals, u, t, h, unknowns and constants) -> the same, later``, with `h`
    the length of the step [s].
    """
    x, z, u, t, numbers = equations.inputs
    rates = ca.densify(ca.vertcat(*phase.dynamics.values()))
    rate = ca.Function("rate", equations.inputs, ca.cse([rates]))
    solved = equations.solved(_FROM_STAGE) if z.numel() else None
    h = ca.SX.sym("h")

    def stage(at: ca.SX, near: ca.SX, time: ca.SX) -> tuple[ca.SX, ca.SX]:
        own = near if solved is None else solved(at, near, u, time, numbers)
        return rate(at, own, u, time, numbers), own

    k1, z1 = stage(x, z, t)
    k2, z2 = stage(x + 0.5 * h * k1, z1, t + 0.5 * h)
    k3, z3 = stage(x + 0.5 * h * k2, z2, t + 0.5 * h)
    k4, z4 = stage(x + h * k3, z3, t + h)
    following = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    last = z4 if solved is None else solved(following, z4, u, t + h, numbers)
    both = ca.densify(ca.vertcat(following, last))
    return ca.Function("step", [ca.vertcat(x, z), u, t, h, numbers], [both])


def _misses(phase: Phase, parameters: Parameters, motion: Array, scale: Array) -> Array:
    """How far each draw is from the final values, were each step the last, (m + 1, K)."""
    miss = np.zeros((motion.shape[0], motion.shape[2]))
    for i, state in enumerate(phase.states):
        size = scale[0, i, 0]
        beyond = _beyond(motion[:, i], parameters.signal_limits[state.name]) / size
        miss += np.maximum.accumulate(beyond, axis=0)
        values = parameters.final_values.get((phase.name, state.name))
        if values is not None:
            miss += _beyond(motion[:, i], values) / size
    return miss


def _beyond_bounds(
    phase: Phase,
    parameters: Parameters,
    sizes: Mapping[tuple[str, str], float],
    equations: _Equations,
    motion: Array,
    u: Array,
    times: Array,
    numbers: Array,
) -> Array:
    """By how much each draw has left the path constraints until a step, (m + 1, K)."""
    beyond = np.zeros(times.shape)
    if not phase.bounds:
        return beyond
    expressions = ca.densify(ca.vertcat(*[bound.expression for bound in phase.bounds]))
    levels = np.concatenate([u, u[-1:]])
    n_x = len(phase.states)
    signals = (motion[:, :n_x], motion[:, n_x:], levels, times[:, None])
    columns = [values.transpose(0, 2, 1).reshape(times.size, -1) for values in signals]
    (values,) = columnwise(
        ca.Function("bounds", equations.inputs, [expressions]), *columns, numbers
    )
    for bound, own in zip(phase.bounds, values.T, strict=True):
        limits, key = parameters.bound_limits[phase.name, bound.name], (phase.name, bound.name)
        # where it has no value, nothing is known to be left
        left = np.nan_to_num(_beyond(own, limits) / sizes[key]).reshape(times.shape)
        beyond += np.maximum.accumulate(left, axis=0)
    return beyond


def _beyond(values: Array, limits: tuple[float, float]) -> Array:
    """By how much values lie outside limits."""
    return np.maximum(np.maximum(values - limits[1], limits[0] - values), 0.0)
