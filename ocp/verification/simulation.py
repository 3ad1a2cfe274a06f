"""Independent simulation: the controls of a solution drive the stated dynamics again.

It starts at the initial state. Its steps start again at the breakpoints, where the controls may
jump. It uses an explicit integrator of `ocp.numerics.integrators`, or the implicit one there if a
motion is stiff, and its own compiled copy of the dynamics, unscaled and straight from the
statement. At each call of it Newton's method solves the algebraic equations.

The variational equation ``Phi' = df/dx Phi`` along the solution tells how an error made at one time
grows until another. States are in units of their sizes. A forward replay of a motion that amplifies
errors by more than `MOST` would measure round-off and tolerances times that factor instead of the
solution. It is therefore restarted from the solution's state, per phase or within one, so that each
segment amplifies less (multiple shooting), and says so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from ocp.accuracy import SLACK, Accuracy
from ocp.arrays import TINY, Array
from ocp.mesh.algebraic_equations import algebraic_values, solved_algebraics
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, SignalGroup, Trajectory
from ocp.numerics.columnwise import called, columnwise
from ocp.numerics.integrators import accumulated, backward_differences, driven_step
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.problem.instants import within
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, column_of

# Steps of an interval in the first run, and samples of an interval that are kept: their polynomial
# of degree 8 follows the motion as closely as the integrator of order 8 does.
_SAMPLES = 8

# Steps of an interval beyond which halving them ends, whatever their estimated error.
_MOST_STEPS = 4096

# Explicit steps of an interval after which the stiff integrator is asked. A motion that collocation
# of degree 8 at most follows in one interval needs no more of order 8, unless they are unstable.
_STEPS_IF_STIFF = 64

# Estimated error of a step relative to the states' sizes. Thousands of steps, amplified a hundred
# times, then stay below the default tolerance of 1e-6 for the missed end state. Where more is
# allowed to be missed, a step may err by as much more.
STEP_TOLERANCE = 1e-11

# Relative distance within which the ends of two phases are the same instant, and that within which
# a state is continuous there. The links are met to the solver's tolerance, not to rounding.
_SAME_INSTANT = 1e-9
_SAME_STATE = 1e-7

# Factor by which a segment may amplify errors. Beyond it the errors of the replay's own steps would
# fill what it may miss its end by if nothing else is asked for.
MOST = SLACK * Accuracy.replay / STEP_TOLERANCE

# Parts of an interval in each of which df/dx is taken as constant. The growth is asked for its
# order of magnitude, not for its digits.
_PARTS = 4

# Terms of the exponential's power series, exact to rounding for norms up to 1/2: 0.5^14 / 14! < eps
_TERMS = 13


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedPhase:
    """Simulated states of one phase.

    Attributes
    ----------
    name : str
    state_names : tuple of str
    times : (N, m + 1)
        Times in each interval, both ends included [s].
    states : (N, m + 1, n_x)
        Simulated states at these times.
    miss : (n_x,)
        Simulated end minus the solution's end, the largest of all segments.
    amplification : float
        Factor by which an error of the states can grow over the phase.
    restarts : int
        How often the simulation was set back to the solution's state for that reason, at the start
        of the phase included.
    """

    name: str
    state_names: tuple[str, ...]
    times: Array
    states: Array
    miss: Array
    amplification: float
    restarts: int

    def __repr__(self) -> str:
        return f"SimulatedPhase('{self.name}': {', '.join(self.state_names)})"


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedMotion:
    """Simulations of all phases.

    Attributes
    ----------
    phases : tuple of SimulatedPhase
    sizes : mapping of str to float
        Typical sizes of the states, by name.
    """

    phases: tuple[SimulatedPhase, ...]
    sizes: Mapping[str, float] = field(default_factory=dict)

    @property
    def miss(self) -> float:
        """Largest miss of an end state relative to its size.

        nan if nothing was simulated, or if a state is no number there.
        """
        misses = [
            abs(float(miss)) / self.sizes[name]
            for phase in self.phases
            for name, miss in zip(phase.state_names, phase.miss, strict=True)
        ]
        # a nan that does not come first is not the largest one of max()
        return float(np.max(misses)) if misses else math.nan

    @property
    def amplification(self) -> float:
        """Largest factor by which the motion of a phase amplifies errors; nan as for `miss`."""
        return max((phase.amplification for phase in self.phases), default=math.nan)

    @property
    def restarts(self) -> int:
        """How often the simulation was set back to the solution because of the amplification."""
        return sum(phase.restarts for phase in self.phases)

    def __repr__(self) -> str:
        if not self.phases:
            return "SimulatedMotion(not simulated)"
        names = ", ".join(f"'{phase.name}'" for phase in self.phases)
        return (
            f"SimulatedMotion({names}; end-state error {self.miss:.2g} of the scale of the states)"
        )


def simulate(
    problem: Problem,
    trajectory: Trajectory,
    sizes: Mapping[str, float],
    tolerance: float = STEP_TOLERANCE,
    most: float = MOST,
) -> SimulatedMotion:
    """Simulate all phases, each from where the one before it arrived.

    A phase passes its miss on to the next one where the solution is continuous there.

    Parameters
    ----------
    trajectory : Trajectory
        The solution, whose controls, times and initial state are taken.
    sizes : mapping of str to float
        Typical sizes of the states by name, to which errors are relative.
    tolerance : float
        Of the estimated error of a step.
    most : float
        By which factor errors may grow until the simulation is set back to the solution.
    """
    phases: list[SimulatedPhase] = []
    grown = 1.0  # by how much an error of the last restart has been amplified since
    for statement in problem.phases:
        phase = trajectory.phase(statement.name)
        rate = _dynamics(problem, statement, phase, trajectory)
        phase_sizes = np.array([sizes[name] for name in phase.states])
        transition = transitions(rate, phase, phase_sizes)
        amplification = growth(transition)

        # go on from the phase before, unless errors have grown too much since the last restart
        grown *= amplification
        restarted = bool(phases) and grown > most
        if restarted:
            grown = amplification
        offset = np.zeros(phase_sizes.size)
        if phases and not restarted:
            offset = _passed_on(trajectory.phase(phases[-1].name), phases[-1], phase)

        parts = segments(transition, most)
        states = np.concatenate(
            [
                _simulated_segment(
                    rate,
                    phase,
                    part,
                    offset if part.start == 0 else np.zeros_like(offset),
                    phase_sizes,
                    tolerance,
                    stepping=bool(problem.steps[statement.name]),
                )
                for part in parts
            ]
        )
        times, solved = _sampled(phase)
        misses = (states - solved)[[part.stop - 1 for part in parts], -1]
        largest = np.abs(misses).argmax(axis=0)
        phases.append(
            SimulatedPhase(
                name=phase.name,
                state_names=phase.states,
                times=times,
                states=states,
                miss=misses[largest, np.arange(largest.size)],
                amplification=amplification,
                restarts=len(parts) - 1 + restarted,
            )
        )
    return SimulatedMotion(tuple(phases), dict(sizes))


def _passed_on(before: PhaseTrajectory, simulated: SimulatedPhase, after: PhaseTrajectory) -> Array:
    """By how much the states of a phase start beside the solution, (n_x,)."""
    offset = np.zeros(len(after.states))
    if not np.isclose(before.end, after.start, rtol=_SAME_INSTANT, atol=1e-3 * _SAME_INSTANT):
        return offset

    last = before.state_polynomial.ends()[-1, 1]
    first = after.state_polynomial.ends()[0, 0]
    for j, name in enumerate(after.states):
        if name in before.states:
            i = before.states.index(name)
            # a state that jumps at the link starts where the solution says
            if np.isclose(last[i], first[j], rtol=_SAME_STATE, atol=1e-2 * _SAME_STATE):
                offset[j] = simulated.miss[i]
    return offset


def _simulated_segment(
    rate: ca.Function,
    phase: PhaseTrajectory,
    segment: slice,
    offset: Array,
    sizes: Array,
    tolerance: float,
    *,
    stepping: bool,
) -> Array:
    """States (m, _SAMPLES + 1, n_x) of some intervals, from the solution's state plus an offset.

    It takes steps as needed.

    Parameters
    ----------
    stepping : bool
        Whether the dynamics step at a breakpoint.
    """
    intervals = np.arange(segment.start, segment.stop)
    start = phase.state_polynomial.value(intervals[:1], np.array([0.0]))[0] + offset
    inputs = _input_powers(phase)[intervals]
    first, last = phase.breakpoints[intervals], phase.breakpoints[intervals + 1]
    if stepping:
        # the sides of a breakpoint have to be told apart
        first, last = within(first, first, last), within(last, first, last)

    step = driven_step(rate, len(start), *inputs.shape[1:])
    steps, error = _SAMPLES, np.inf
    while error > tolerance and steps <= _MOST_STEPS:
        states, error = _march(step, inputs, (first, last), start, sizes, steps)
        states = states[:, :: steps // _SAMPLES]
        if error > tolerance and steps == _STEPS_IF_STIFF:
            implicit = backward_differences(
                rate, start, inputs, (first, last), sizes, _SAMPLES, tolerance
            )
            if implicit is not None:
                return implicit
        steps *= 2
    return states


def _sampled(phase: PhaseTrajectory) -> tuple[Array, Array]:
    """Times (N, _SAMPLES + 1) in each interval of a phase, both ends included, and states there."""
    tau = np.linspace(0.0, 1.0, _SAMPLES + 1)
    times = phase.breakpoints[:-1, None] + np.diff(phase.breakpoints)[:, None] * tau
    intervals = np.repeat(np.arange(phase.intervals), tau.size)
    states = phase.state_polynomial.value(intervals, np.tile(tau, phase.intervals))
    return times, states.reshape(*times.shape, -1)


def _dynamics(
    problem: Problem, statement: Phase, phase: PhaseTrajectory, trajectory: Trajectory
) -> ca.Function:
    """``(x, u, t) -> f`` with unknowns and constants put in; u are all signals but the states.

    Algebraic variables solve their equations at each call, and start at those of the solution.
    """
    symbols = {signal.name: signal.symbol for signal in problem.signals[statement.name]}
    x = [symbols[name] for name in phase.states]
    u = [symbols[name] for name in phase.signals[len(phase.states) :]]

    rates = ca.vertcat(*statement.dynamics.values())
    algebraics = problem.algebraics[statement.name]
    if algebraics and algebraic_values(trajectory, phase, Evaluator(problem)) is not None:
        solved = solved_algebraics(problem, statement.name)
        rates = ca.substitute(rates, column_of(algebraics), solved)
    numbers = [s.symbol for s in (*problem.unknowns, *problem.constants)]
    values = [trajectory.unknowns[s.name] for s in problem.unknowns]
    values += [trajectory.constants[s.name] for s in problem.constants]
    if numbers:
        rates = ca.substitute(rates, ca.vertcat(*numbers), ca.DM(values))
    inputs = [ca.vertcat(*x), ca.vertcat(*u, ca.SX(0, 1)), TIME.symbol]
    return ca.Function("dynamics", inputs, ca.cse([rates]))


def _march(
    step: ca.Function,
    inputs: Array,
    times: tuple[Array, Array],
    start: Array,
    sizes: Array,
    steps: int,
) -> tuple[Array, float]:
    """States (m, steps + 1, n_x) of a march with equal explicit steps, and its error.

    Parameters
    ----------
    step : casadi.Function
        See `driven_step`.
    inputs : (m, n_u, count)
        Coefficients of powers of local time of all signals but the states.
    times : two of (m,)
        Where each interval begins and ends [s].
    """
    count, (first, last) = len(inputs), times

    # one row a step: coefficients of the inputs, start and length of its interval, local times
    data = np.column_stack(
        [
            np.repeat(inputs.reshape(count, -1), steps, axis=0),
            np.repeat(first, steps),
            np.repeat(last - first, steps),
            np.tile(np.arange(steps) / steps, count),
            np.full(count * steps, 1.0 / steps),
        ]
    )
    with np.errstate(all="ignore"):
        ends, errors = called(accumulated(step, count * steps), start, data)

    # an interval's last state is the first one of the next
    joints = np.vstack([start, ends])
    rows = np.arange(count)[:, None] * steps + np.arange(steps + 1)
    relative = np.abs(errors) / sizes
    error = float(relative.max()) if np.all(np.isfinite(relative)) else np.inf
    return joints[rows], error


def _input_powers(phase: PhaseTrajectory) -> Array:
    """Coefficients of powers of local time of all signals but the states, (N, n_u, count)."""
    tables = [group.polynomial.powers() for group in phase.groups if group.kind != "state"]
    count = max((table.shape[2] for table in tables), default=1)
    padded = [np.zeros((phase.intervals, 0, count))]
    for table in tables:
        padded.append(np.zeros((*table.shape[:2], count)))
        padded[-1][:, :, : table.shape[2]] = table
    return np.concatenate(padded, axis=1)


def replayed(trajectory: Trajectory, simulated: SimulatedMotion) -> Trajectory:
    """The trajectory with the simulated states in place of the solved ones.

    In every interval the states are the polynomial through the samples of the simulation.
    """
    basis = Lagrange(tuple(np.linspace(0.0, 1.0, _SAMPLES + 1).tolist()))
    phases = []
    for phase, simulated_phase in zip(trajectory.phases, simulated.phases, strict=True):
        piece = Piece(np.arange(phase.intervals), basis, simulated_phase.states)
        polynomial = PiecewisePolynomial(phase.breakpoints, (piece,))
        states = SignalGroup("state", phase.states, polynomial)

        # the degree tells those who look between the points how densely to look
        degrees = np.full(phase.intervals, _SAMPLES)
        phases.append(replace(phase, degrees=degrees, groups=(states, *phase.groups[1:])))
    return replace(trajectory, phases=tuple(phases))


def transitions(rate: ca.Function, phase: PhaseTrajectory, sizes: Array) -> Array:
    """Growth of a small error of the states over each interval, shape (N, n_x, n_x).

    Parameters
    ----------
    rate : casadi.Function
        ``(x, u, t) -> f``, where `u` are all signals but the states.
    sizes : (n_x,)
        Typical sizes of the states.
    """
    count, n_x = phase.intervals, len(sizes)
    intervals = np.repeat(np.arange(count), _PARTS)
    tau = np.tile((np.arange(_PARTS) + 0.5) / _PARTS, count)
    steps = np.diff(phase.breakpoints)[intervals]
    signals, times = phase.local(intervals, tau), phase.breakpoints[intervals] + tau * steps

    jacobian = _state_jacobian(rate)
    (slopes,) = columnwise(jacobian, signals[:, :n_x], signals[:, n_x:], times[:, None])
    # CasADi lays a Jacobian out column by column
    slopes = slopes.reshape(-1, n_x, n_x).transpose(0, 2, 1) * sizes / sizes[:, None]

    # at an instant without a derivative, such as a corner of the model, nothing is known of growth
    exponents = slopes * (steps / _PARTS)[:, None, None]
    exponents = np.nan_to_num(exponents, posinf=0.0, neginf=0.0)
    parts = exponential(exponents).reshape(count, _PARTS, n_x, n_x)
    product = parts[:, 0]
    for part in range(1, _PARTS):
        product = parts[:, part] @ product
    return np.asarray(product)


def _state_jacobian(rate: ca.Function) -> ca.Function:
    """``(x, u, t) -> df/dx``, column by column."""
    x, u, t = (ca.SX.sym(name, rate.sparsity_in(i)) for i, name in enumerate("xut"))
    jacobian = ca.densify(ca.vec(ca.jacobian(rate(x, u, t), x)))
    return ca.Function("slope", [x, u, t], ca.cse([jacobian]))


def exponential(matrices: Array) -> Array:
    """Exponential of each matrix of a stack (m, n, n).

    The matrix is halved often, put into a power series and squared back. Squaring loses a digit
    where the norm is about 10. `scipy.linalg.expm` does the same more finely, but loading it takes
    longer than loading all of `ocp`, and every verified solve would have to.
    """
    norm = float(np.abs(matrices).sum(axis=-1).max(initial=0.0))
    halvings = max(0, math.ceil(math.log2(max(norm, TINY))) + 1)
    small, unit = np.ldexp(matrices, -halvings), np.eye(matrices.shape[-1])

    powers = np.broadcast_to(unit, matrices.shape)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(_TERMS, 0, -1):
            powers = unit + small @ powers / k
        for _ in range(halvings):
            powers = powers @ powers
    return np.asarray(powers)


def growth(transition: Array) -> float:
    """Largest factor by which errors grow from the start to any time, or from any to the end.

    Parameters
    ----------
    transition : (N, n_x, n_x)
        Of the intervals, see `transitions`.
    """
    forward = backward = np.eye(transition.shape[1])
    most = 1.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first, last in zip(transition, transition[::-1], strict=True):
            forward, backward = first @ forward, backward @ last
            most = max(most, _norm(forward), _norm(backward))
    return most


def _norm(matrix: Array) -> float:
    return float(np.linalg.norm(matrix)) if np.isfinite(matrix).all() else np.inf


def segments(transition: Array, most: float = MOST) -> list[slice]:
    """Runs of intervals over which errors grow by no more than `most`: halved until they do."""

    def halved(first: int, last: int) -> list[slice]:
        if last - first <= 1 or growth(transition[first:last]) <= most:
            return [slice(first, last)]
        middle = (first + last) // 2
        return [*halved(first, middle), *halved(middle, last)]

    return halved(0, len(transition))
