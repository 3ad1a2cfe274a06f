"""How much a finer control could still gain: an estimate from the Hamiltonian.

At every time the Hamiltonian ``H(u)`` is compared with its value at the best control within the
bounds and path constraints that limit the control directly.  The integral of the difference is
the first-order gain that better controls could bring (Pontryagin's minimum principle asks for
none), interval by interval: where it is nothing, refining the control is useless, however rough
the control looks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.costates import PhaseCostates
from ocp.problem.symbols import time
from ocp.transcription.path_constraints import Continuous
from ocp.transcription.transcribe import Transcription, inline_weights
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
_POINTS = 8


@dataclass(frozen=True, eq=False)
class HamiltonianSlopes:
    """Compiled ``H``, ``dH/du``, curvature and direct limits of the controls of one phase.

    Attributes
    ----------
    limiting : numbers of the continuous constraints that depend on controls.
    """

    function: ca.Function
    controls: tuple[Any, ...]
    limiting: tuple[int, ...]


def hamiltonian(transcription: Transcription, layout: PhaseLayout) -> HamiltonianSlopes:
    """Build the Hamiltonian of a phase, without multipliers of path constraints."""
    problem, phase = transcription.problem, layout.phase
    index = transcription.layouts.index(layout)
    costates = ca.SX.sym("costate", len(layout.states) + len(layout.integrals))
    integrands = [f.pieces[0][1] for f in layout.integrals]
    h = ca.dot(costates, ca.vertcat(*phase.dynamics.values(), *integrands))
    for f, weight in inline_weights(problem).items():
        if f.pieces[0][0] == phase.name:
            h += weight * f.pieces[0][1]
    controls = (*layout.constant, *layout.linear, *layout.polynomial)
    u = ca.vertcat(*[c.symbol for c in controls], ca.SX(0, 1))
    slope = ca.gradient(h, u)
    curvature = ca.diag(ca.jacobian(slope, u)) if controls else ca.SX(0, 1)
    found = transcription.constraints[index]
    limiting = tuple(
        i for i, c in enumerate(found)
        if c.sampled and not c.is_equation and ca.jacobian(c.expression, u).nnz() > 0
    )  # fmt: skip
    rows = ca.vertcat(*[found[i].sign * found[i].expression for i in limiting], ca.SX(0, 1))
    symbols = ca.vertcat(*[s.symbol for s in layout.signals])
    fixed = [s.symbol for s in (*problem.unknowns, *problem.constants)]
    function = ca.Function(
        "hamiltonian",
        [symbols, time.symbol, ca.vertcat(*fixed, ca.SX(0, 1)), costates],
        ca.cse([h, ca.densify(slope), ca.densify(curvature), rows,
                ca.densify(ca.vec(ca.jacobian(rows, u)))]),
    )  # fmt: skip
    return HamiltonianSlopes(function, controls, limiting)


def gains(
    transcription: Transcription, trajectory: Trajectory, costates: PhaseCostates,
    layout: PhaseLayout, slopes: HamiltonianSlopes,
) -> Array:  # fmt: skip
    """First-order gain in each interval [unit of the objective], shape (N,)."""
    own = trajectory.phase(layout.phase.name)
    count, controls = layout.intervals, slopes.controls
    if not controls:
        return np.zeros(count)
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    k, tau = np.repeat(np.arange(count), _POINTS), np.tile(0.5 * (nodes + 1.0), count)
    signals = own.local(k, tau)
    times = own.breakpoints[k] + tau * np.diff(own.breakpoints)[k]
    fixed = [trajectory.unknowns[u.name] for u in transcription.problem.unknowns]
    fixed += [trajectory.constants[c.name] for c in transcription.problem.constants]
    _, slope, curvature, rows, row_slopes = (
        v.full().reshape(-1, k.size) for v in slopes.function(
            signals.T, times[None, :], ca.DM(fixed) if fixed else ca.DM(0, 1),
            costates.local(k, tau).T)
    )  # fmt: skip
    first = len(layout.states)
    values = signals[:, first : first + len(controls)].T
    found = transcription.constraints[transcription.layouts.index(layout)]
    limiting = [found[i] for i in slopes.limiting]
    down, up = _room(transcription, trajectory, slopes.controls, limiting, values, rows,
                     row_slopes)  # fmt: skip
    room = np.where(slope > 0, down, up)
    linear = np.abs(slope) * room
    with np.errstate(divide="ignore", invalid="ignore"):
        newton = np.where(curvature > 0, 0.5 * slope**2 / curvature, np.inf)
    gain = np.minimum(linear, newton).sum(axis=0).reshape(count, _POINTS)
    gain = np.where(np.isfinite(gain), gain, 0.0)
    return np.asarray((0.5 * gain @ weights) * np.diff(own.breakpoints))


def _room(
    transcription: Transcription, trajectory: Trajectory, controls: Sequence[Any],
    limiting: Sequence[Continuous], values: Array, rows: Array, row_slopes: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """How far each control may move down and up at each time, (n_u, m) each."""
    constants = trajectory.constants
    down, up = np.empty_like(values), np.empty_like(values)
    for j, control in enumerate(controls):
        reach = max(float(np.ptp(values[j])), 1e-3 * transcription.scales.signals[control.name])
        lower, upper = (evaluate_limit(v, constants) for v in (control.lower, control.upper))
        down[j] = np.minimum(values[j] - lower, reach)
        up[j] = np.minimum(upper - values[j], reach)
    peaks = dict(zip(transcription.peak_ids, trajectory.peaks, strict=True))
    n = len(limiting)
    for i, constraint in enumerate(limiting):
        lower, upper = (evaluate_limit(v, constants) for v in (constraint.lower, constraint.upper))
        if constraint.peak is not None:
            upper = peaks[constraint.peak]
        for j in range(len(controls)):
            slope = row_slopes[j * n + i]
            with np.errstate(divide="ignore", invalid="ignore"):
                to_upper, to_lower = (upper - rows[i]) / slope, (lower - rows[i]) / slope
            step_up = np.where(slope > 0, to_upper, np.where(slope < 0, to_lower, np.inf))
            step_down = -np.where(slope > 0, to_lower, np.where(slope < 0, to_upper, -np.inf))
            up[j], down[j] = np.minimum(up[j], step_up), np.minimum(down[j], step_down)
    return np.maximum(down, 0.0), np.maximum(up, 0.0)
