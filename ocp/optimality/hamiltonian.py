"""The Hamiltonian of a phase, its derivatives by the controls, and what it lets finer ones gain.

``H = L + lambda . f`` in the sign of `ocp.optimality.multipliers`, where ``L`` holds the integrals
that the objective adds up. Path constraints ``c`` are not part of it. Their multipliers enter the
slope ``H_u + sum mu c_u``, which vanishes at an optimum (Bryson and Ho, "Applied Optimal Control",
ch. 2 and 3), so that ``c_u`` is given beside ``H_u``. It is built once for a phase, and read by
`gains` and by the test of the minimum principle (`ocp.verification.minimum_principle`).

The gain compares, at every time, the Hamiltonian with its value at the best control within the
bounds and path constraints that limit the control directly. Pontryagin's minimum principle asks for
no difference. Its integral over an interval is, to first order, what better controls could bring
there. Where it is nothing, refining the control is useless, however rough the control looks.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.numerics.columnwise import columnwise
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, phase_costates
from ocp.problem.symbols import TIME, Control
from ocp.transcription.path_constraints import PathConstraint
from ocp.transcription.transcribe import Transcription

# Gauss points in an interval: twice the usual degree of the controls, whose error oscillates
_POINTS = 8

# Part of a control's size that it may move at least, where all of its values are the same
_LEAST_REACH = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class HamiltonianValues:
    """The Hamiltonian of a phase at `m` instants.

    Attributes
    ----------
    value : (m,)
        ``H`` [unit of the objective / s].
    terms : (m, n)
        ``L`` and each ``lambda_i f_i``, whose sum is ``H``.
    slope : (m, n_u)
        ``H_u``.
    slope_size : (m, n_u)
        Sum of the absolute slopes of the terms.
    curvature : (m, n_u, n_u)
        ``H_uu``.
    path : (m, n_c)
        Path constraints, with the sign in which they are imposed.
    path_slope : (m, n_c, n_u)
        Their slopes by the controls.
    """

    value: Array
    terms: Array
    slope: Array
    slope_size: Array
    curvature: Array
    path: Array
    path_slope: Array


@dataclass(frozen=True, eq=False, repr=False)
class Hamiltonian:
    """The compiled Hamiltonian of one phase.

    Attributes
    ----------
    phase : str
    controls : tuple of Control
        In the order of a trajectory.
    paths : tuple of int
        Numbers of the phase's path constraints that have rows at the collocation points.
    limits_controls : (n_c,)
        Whether each of these depends on a control.
    autonomous : bool
        Whether time enters neither dynamics, nor integrands, nor path constraints.
    function : casadi.Function
        ``(signals, time, unknowns and constants, costates) -> HamiltonianValues``.
    """

    phase: str
    controls: tuple[Control, ...]
    paths: tuple[int, ...]
    limits_controls: Flags
    autonomous: bool
    function: ca.Function

    def along(
        self,
        evaluator: Evaluator,
        trajectory: Trajectory,
        costates: PhaseCostates,
        intervals: Integers,
        tau: Array,
    ) -> HamiltonianValues:
        """Values at local times of intervals, both (m,)."""
        phase = trajectory.phase(self.phase)
        times = evaluator.times(phase, intervals, tau)
        value, terms, slope, slope_size, curvature, path, path_slope = columnwise(
            self.function,
            phase.local(intervals, tau),
            times[:, None],
            evaluator.numbers(trajectory),
            costates.local(intervals, tau),
        )
        instants, n_u, n_c = tau.size, len(self.controls), len(self.paths)
        return HamiltonianValues(
            value=value[:, 0],
            terms=terms,
            slope=slope,
            slope_size=slope_size,
            curvature=curvature.reshape(instants, n_u, n_u),
            path=path,
            path_slope=path_slope.reshape(instants, n_u, n_c).transpose(0, 2, 1),
        )


def hamiltonian_of(evaluator: Evaluator, transcription: Transcription, index: int) -> Hamiltonian:
    """The Hamiltonian of a phase, built at the first call for a problem and kept.

    The order of the signals depends on the shapes of the controls, which may differ between meshes.
    """
    phase = transcription.columns.phases[index]
    key = ("hamiltonian", index, tuple(signal.name for signal in phase.signals))
    if key not in evaluator.compiled:
        evaluator.compiled[key] = _build(transcription, index)
    hamiltonian: Hamiltonian = evaluator.compiled[key]
    return hamiltonian


def _build(transcription: Transcription, index: int) -> Hamiltonian:
    problem, phase = transcription.problem, transcription.columns.phases[index]
    name = phase.phase.name
    controls = phase.controls
    u = ca.vertcat(*[control.symbol for control in controls], ca.SX(0, 1))

    # terms: inlined integrals, dynamics, integrals that are running totals
    costs = [
        weight * integral.expression
        for integral, weight in problem.summed.items()
        if integral.phase == name
    ]
    rates = [*phase.phase.dynamics.values(), *[f.expression for f in phase.integrals]]
    costates = ca.SX.sym("costate", len(rates))
    terms = ca.vertcat(*costs, costates * ca.vertcat(*rates))
    slopes_of_terms = ca.densify(ca.jacobian(terms, u))
    slope = ca.sum1(slopes_of_terms).T
    curvature = ca.jacobian(slope, u)

    constraints = transcription.constraints[index]
    paths = tuple(i for i, constraint in enumerate(constraints) if constraint.sampled)
    path = ca.vertcat(
        *[constraints[i].sign * constraints[i].expression for i in paths], ca.SX(0, 1)
    )
    path_slope = ca.jacobian(path, u)
    limits_controls = np.array([path_slope[i, :].nnz() > 0 for i in range(len(paths))], dtype=bool)

    numbers = [s.symbol for s in (*problem.unknowns, *problem.constants)]
    signals = ca.vertcat(*[signal.symbol for signal in phase.signals])
    inputs = [signals, TIME.symbol, ca.vertcat(*numbers, ca.SX(0, 1)), costates]
    outputs = [
        ca.sum1(terms),
        terms,
        slope,
        ca.sum1(ca.fabs(slopes_of_terms)).T,
        ca.vec(curvature),
        path,
        ca.vec(path_slope),
    ]
    everything = ca.vertcat(*rates, *costs, path, ca.SX(0, 1))
    return Hamiltonian(
        phase=name,
        controls=controls,
        paths=paths,
        limits_controls=limits_controls,
        autonomous=not ca.depends_on(everything, TIME.symbol),
        function=ca.Function(
            "hamiltonian", inputs, ca.cse([ca.densify(output) for output in outputs])
        ),
    )


def gains(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """What finer controls gain in each interval of a phase [unit of the objective], shape (N,)."""
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    if not hamiltonian.controls:
        return np.zeros(phase.intervals)

    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    intervals = np.repeat(np.arange(phase.intervals), _POINTS)
    tau = np.tile(0.5 * (nodes + 1.0), phase.intervals)
    costates = phase_costates(iterate, index)
    values = hamiltonian.along(evaluator, iterate.trajectory, costates, intervals, tau)

    # the best control is a Newton step away where H is convex in it, else at the end of its room
    names = phase.signals
    columns = [names.index(control.name) for control in hamiltonian.controls]
    controls = phase.local(intervals, tau)[:, columns]
    down, up = _room(iterate, hamiltonian, values, controls, index)
    to_the_end = np.abs(values.slope) * np.where(values.slope > 0, down, up)
    curvature = np.einsum("muu->mu", values.curvature)
    with np.errstate(divide="ignore", invalid="ignore"):
        newton = np.where(curvature > 0, 0.5 * values.slope**2 / curvature, np.inf)

    density = np.minimum(to_the_end, newton).sum(axis=1)
    density = np.minimum(density, _traded(iterate, hamiltonian, values, (down, up), index))
    density = np.where(np.isfinite(density), density, 0.0).reshape(phase.intervals, _POINTS)
    return np.asarray((0.5 * density @ weights) * np.diff(phase.breakpoints))


def shifts(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """What moving each inner breakpoint by its shorter interval gains [unit of the objective].

    To first order the objective changes with the time of a breakpoint by the jump of the
    Hamiltonian there: at an optimum there is none (Bryson and Ho, ch. 3.7). Shape (N - 1,).
    """
    width = np.diff(iterate.trajectory.phases[index].breakpoints)
    shorter: Array = np.minimum(width[1:], width[:-1])
    return np.abs(hamiltonian_jumps(iterate, evaluator, index)) * shorter


def hamiltonian_jumps(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """Right minus left value of the Hamiltonian at each inner breakpoint, (N - 1,)."""
    values = _at_ends(iterate, evaluator, index).value.reshape(-1, 2)
    return np.asarray(values[1:, 0] - values[:-1, 1])


def relative_jumps(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """Jumps of the Hamiltonian at inner breakpoints, relative to its terms there, (N - 1,)."""
    values = _at_ends(iterate, evaluator, index)
    ends = values.value.reshape(-1, 2)
    sizes = np.abs(values.terms).sum(axis=1).reshape(-1, 2)
    larger = np.maximum(sizes[1:, 0], sizes[:-1, 1])
    return np.abs(ends[1:, 0] - ends[:-1, 1]) / np.where(larger > 0, larger, 1.0)


def _at_ends(iterate: Iterate, evaluator: Evaluator, index: int) -> HamiltonianValues:
    """Values at the beginning and the end of each interval, (2 N,) instants."""
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    intervals, tau = np.repeat(np.arange(phase.intervals), 2), np.tile([0.0, 1.0], phase.intervals)
    costates = phase_costates(iterate, index)
    return hamiltonian.along(evaluator, iterate.trajectory, costates, intervals, tau)


def _traded(
    iterate: Iterate,
    hamiltonian: Hamiltonian,
    values: HamiltonianValues,
    room: tuple[Array, Array],
    index: int,
) -> Array:
    """What controls that share a limit, such as ``u1 + u2 <= F``, can gain at most, (m,).

    By duality: for any multiplier of the shared limit the gain is no more than the multiplier times
    the slack, and what each control gains alone by its slope with the limit's part added. The best
    multiplier makes one of these slopes vanish. Infinite where no limit is shared.
    """
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    least = np.full(values.value.size, np.inf)
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[index][number]
        shared = values.path_slope[:, i]
        if not _shares(constraint, shared):
            continue
        lower, upper = constraint.limits(iterate.parameters, peaks)
        to_upper, to_lower = upper - values.path[:, i], values.path[:, i] - lower
        for j in np.flatnonzero(shared[0]):
            multiplier = -values.slope[:, j] / shared[:, j]
            slack = np.maximum(np.where(multiplier > 0, to_upper, to_lower), 0.0)
            alone = values.slope + multiplier[:, None] * shared
            gained = np.abs(alone) * np.where(alone > 0, *room)
            least = np.minimum(least, np.abs(multiplier) * slack + gained.sum(axis=1))
    return least


def _shares(constraint: PathConstraint, slopes: Array) -> bool:
    """Whether a constraint is shared by several controls and by nothing else."""
    return constraint.of_controls and bool(np.count_nonzero(slopes[:1]) > 1)


def _room(
    iterate: Iterate,
    hamiltonian: Hamiltonian,
    values: HamiltonianValues,
    controls: Array,
    index: int,
) -> tuple[Array, Array]:
    """How far each control may move down and up at each time, (m, n_u) each."""
    parameters = iterate.parameters
    down, up = np.empty_like(controls), np.empty_like(controls)

    # within its bounds, and no farther than its whole range on the trajectory
    for j, control in enumerate(hamiltonian.controls):
        least = _LEAST_REACH * iterate.scales.signals[control.name]
        reach = max(float(np.ptp(controls[:, j])), least)
        lower, upper = parameters.signal_limits[control.name]
        down[:, j] = np.minimum(controls[:, j] - lower, reach)
        up[:, j] = np.minimum(upper - controls[:, j], reach)

    # until the linearised path constraint meets its limit
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[index][number]
        if constraint.is_equation or not hamiltonian.limits_controls[i]:
            continue
        if _shares(constraint, values.path_slope[:, i]):
            continue  # one control may move more where another one makes room, see `_traded`
        lower, upper = constraint.limits(parameters, peaks)
        slope, path = values.path_slope[:, i], values.path[:, [i]]
        with np.errstate(divide="ignore", invalid="ignore"):
            to_upper, to_lower = (upper - path) / slope, (lower - path) / slope
        rising, falling = slope > 0, slope < 0
        step_up = np.where(rising, to_upper, np.where(falling, to_lower, np.inf))
        step_down = -np.where(rising, to_lower, np.where(falling, to_upper, -np.inf))
        down, up = np.minimum(down, step_down), np.minimum(up, step_up)
    return np.maximum(down, 0.0), np.maximum(up, 0.0)
