"""The Hamiltonian of a phase, and its derivatives by the controls and by time.

``H = L + lambda . f`` in the sign of `ocp.optimality.multipliers`, where ``L`` holds the integrals
that the objective adds up. Path constraints ``c`` are not part of it. Their multipliers enter the
slope ``H_u + sum mu c_u``, which vanishes at an optimum (Bryson and Ho, "Applied Optimal Control",
ch. 2 and 3), so that ``c_u`` is given beside ``H_u``. It is built once for a phase. The estimate of
what finer controls gain (`ocp.optimality.control_gains`) and the test of the minimum principle
(`ocp.diagnostics.minimum_principle`) evaluate it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.numerics.columnwise import columnwise
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, phase_costates
from ocp.problem.symbols import TIME, Control
from ocp.transcription.transcribe import Transcription


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
    time_slopes : casadi.Function
        ``(the same inputs) -> H_t, slopes of the path constraints by time (n_c,)``.
    """

    phase: str
    controls: tuple[Control, ...]
    paths: tuple[int, ...]
    limits_controls: Flags
    autonomous: bool
    function: ca.Function
    time_slopes: ca.Function

    def expressions(self) -> tuple[list[ca.SX], ca.SX, ca.SX]:
        """New symbols for the inputs of `function`, with ``H`` and `paths` (n_c,) in them."""
        function = self.function
        inputs = [ca.SX.sym(f"i{i}", function.size1_in(i)) for i in range(function.n_in())]
        value, *_, path, _ = function(*inputs)
        return inputs, value, path

    def along(
        self,
        evaluator: Evaluator,
        trajectory: Trajectory,
        costates: PhaseCostates,
        intervals: Integers,
        tau: Array,
    ) -> HamiltonianValues:
        """Values at local times of intervals, both (m,)."""
        return self.at(evaluator, trajectory, costates.local(intervals, tau), intervals, tau)

    def at(
        self,
        evaluator: Evaluator,
        trajectory: Trajectory,
        costates: Array,
        intervals: Integers,
        tau: Array,
    ) -> HamiltonianValues:
        """Values with given costates (m, n) at local times of intervals, both (m,)."""
        phase = trajectory.phase(self.phase)
        times = evaluator.times(phase, intervals, tau)
        value, terms, slope, slope_size, curvature, path, path_slope = columnwise(
            self.function,
            phase.local(intervals, tau),
            times[:, None],
            evaluator.numbers(trajectory),
            costates,
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

    def slopes_by_time(
        self,
        evaluator: Evaluator,
        trajectory: Trajectory,
        costates: PhaseCostates,
        intervals: Integers,
        tau: Array,
    ) -> tuple[Array, Array]:
        """``H_t`` (m,) and slopes of `paths` (m, n_c) at local times of intervals, both (m,)."""
        phase = trajectory.phase(self.phase)
        of_terms, of_paths = columnwise(
            self.time_slopes,
            phase.local(intervals, tau),
            evaluator.times(phase, intervals, tau)[:, None],
            evaluator.numbers(trajectory),
            costates.local(intervals, tau),
        )
        return of_terms[:, 0], of_paths


def hamiltonian_of(evaluator: Evaluator, transcription: Transcription, index: int) -> Hamiltonian:
    """The Hamiltonian of a phase, built at the first call for a problem and kept.

    The order of the signals depends on the shapes of the controls, which may differ between meshes.
    """
    phase = transcription.columns.phases[index]
    key = ("hamiltonian", index, tuple(signal.name for signal in phase.signals))
    return evaluator.once(key, partial(_build, transcription, index))


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
    by_time = [ca.jacobian(value, TIME.symbol) for value in (ca.sum1(terms), path)]
    return Hamiltonian(
        phase=name,
        controls=controls,
        paths=paths,
        limits_controls=limits_controls,
        autonomous=not ca.depends_on(everything, TIME.symbol),
        function=ca.Function(
            "hamiltonian", inputs, ca.cse([ca.densify(output) for output in outputs])
        ),
        time_slopes=ca.Function(
            "time_slopes", inputs, ca.cse([ca.densify(slope) for slope in by_time])
        ),
    )


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
    """Jumps of the Hamiltonian at inner breakpoints, relative to its terms there, (N - 1,).

    Where the terms are nothing, the jumps are.
    """
    values = _at_ends(iterate, evaluator, index)
    ends = values.value.reshape(-1, 2)
    sizes = np.abs(values.terms).sum(axis=1).reshape(-1, 2)
    larger = np.maximum(sizes[1:, 0], sizes[:-1, 1])
    jumps = np.abs(ends[1:, 0] - ends[:-1, 1])
    return np.asarray(jumps / np.maximum(larger, iterate.negligible_rate(index)))


def _at_ends(iterate: Iterate, evaluator: Evaluator, index: int) -> HamiltonianValues:
    """Values at the beginning and the end of each interval, (2 N,) instants."""
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    intervals, tau = np.repeat(np.arange(phase.intervals), 2), np.tile([0.0, 1.0], phase.intervals)
    costates = phase_costates(iterate, index)
    return hamiltonian.along(evaluator, iterate.trajectory, costates, intervals, tau)
