"""How much a finer control could still gain: an estimate from the Hamiltonian.

At every time the Hamiltonian is compared with its value at the best control within the bounds and
path constraints that limit the control directly. Pontryagin's minimum principle asks for no
difference. Its integral over an interval is, to first order, the gain that better controls could
bring there. Where it is nothing, refining the control is useless, however rough the control looks.
"""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from ocp.mesh.evaluation import Evaluator
from ocp.optimality.costates import phase_costates
from ocp.optimality.hamiltonian import Hamiltonian, HamiltonianValues, hamiltonian_of
from ocp.optimality.iterate import Iterate

# Gauss points in an interval: twice the usual degree of the controls, whose error oscillates
_POINTS = 8

# Part of a control's size that it may move at least, where all of its values are the same
_LEAST_REACH = 1e-3


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

    density = np.minimum(to_the_end, newton).sum(axis=1).reshape(phase.intervals, _POINTS)
    density = np.where(np.isfinite(density), density, 0.0)
    return np.asarray((0.5 * density @ weights) * np.diff(phase.breakpoints))


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
        lower, upper = parameters.pair(control)
        down[:, j] = np.minimum(controls[:, j] - lower, reach)
        up[:, j] = np.minimum(upper - controls[:, j], reach)

    # until the linearised path constraint meets its limit
    peaks = dict(zip(iterate.problem.peaks, iterate.trajectory.peaks, strict=True))
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[index][number]
        if constraint.is_equation or not hamiltonian.limits_controls[i]:
            continue
        lower, upper = constraint.limits(parameters, peaks)
        slope, path = values.path_slope[:, i], values.path[:, [i]]
        with np.errstate(divide="ignore", invalid="ignore"):
            to_upper, to_lower = (upper - path) / slope, (lower - path) / slope
        rising, falling = slope > 0, slope < 0
        step_up = np.where(rising, to_upper, np.where(falling, to_lower, np.inf))
        step_down = -np.where(rising, to_lower, np.where(falling, to_upper, -np.inf))
        down, up = np.minimum(down, step_down), np.minimum(up, step_up)
    return np.maximum(down, 0.0), np.maximum(up, 0.0)
