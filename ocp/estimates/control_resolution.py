"""How well the shapes of controls are resolved on a mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import comb

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.estimates.switch_detection import control_samples, jumps_at
from ocp.mesh.mesh import PhaseMesh
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.piecewise_polynomial import PiecewisePolynomial
from ocp.optimality.active_set import CLOSE, share_at_limit


def control_errors(motion: PhaseTrajectory, mesh: PhaseMesh) -> Array:
    """Estimated error of each control's shape in each interval, relative to its range, (N, n_u).

    Of a constant or linear control it is what the next order would add, from the smaller of the
    differences to both neighbours: a level next to a jump is no error, a value between two levels
    is. Of a polynomial of a higher order it is its last Legendre coefficient.
    """
    errors = [error for _, error in _errors_by_control(motion, mesh)]
    return np.column_stack([np.zeros((mesh.intervals, 0)), *errors])


def parts_to_resolve(motion: PhaseTrajectory, mesh: PhaseMesh, allowed: float) -> Array:
    """In how many parts each interval is cut until its control shapes err by what is allowed, (N,).

    The error of a shape of order p falls with the power p + 1 of the width.
    """
    most = np.zeros(mesh.intervals)
    for orders, error in _errors_by_control(motion, mesh):
        most = np.maximum(most, (error / allowed) ** (1.0 / (orders + 1.0)))
    return most


def _errors_by_control(
    motion: PhaseTrajectory, mesh: PhaseMesh
) -> Iterator[tuple[Integers, Array]]:
    """Orders and estimated errors of each control, (N,) each; one that never varies has none."""
    # a breakpoint at which nothing jumps separates no levels
    mesh = replace(mesh, movable=tuple(i for i in mesh.movable if jumps_at(motion, i)))
    for name in motion.controls:
        size = float(np.ptp(control_samples(motion, name)[1]))
        control = motion.polynomial(name)
        if size == 0.0:
            yield control.orders, np.zeros(mesh.intervals)
            continue
        ends, width = control.ends()[:, :, 0], np.diff(control.breakpoints)
        level = 0.5 * (ends[:, 0] + ends[:, 1])
        slope = (ends[:, 1] - ends[:, 0]) / width

        # the error of a step is a quarter of the difference of levels, that of a line an eighth of
        # the difference of slopes times the width
        by_levels = _smaller_difference(level, mesh) / 4.0
        by_slopes = width * _smaller_difference(slope, mesh) / 8.0
        error = np.where(control.orders == 0, by_levels, by_slopes)
        error = np.where(control.orders > 1, _legendre_tail(control), error)
        yield control.orders, error / size


def saturated(motion: PhaseTrajectory, limits: Mapping[str, tuple[float, float]]) -> Flags:
    """Whether each control stays on one of its bounds or close to it in an interval, (N, n_u)."""
    on_bound = np.zeros((motion.intervals, len(motion.controls)), dtype=bool)
    for j, name in enumerate(motion.controls):
        margin = CLOSE * float(np.ptp(control_samples(motion, name)[1]))
        for limit in limits[name]:
            on_bound[:, j] |= share_at_limit(motion.polynomial(name), limit, margin) == 1.0
    return on_bound


def _smaller_difference(values: Array, mesh: PhaseMesh) -> Array:
    """Smaller of the differences to both neighbours, (N,); 0 beside a movable breakpoint."""
    at_breakpoints = np.concatenate([[np.inf], np.abs(np.diff(values)), [np.inf]])
    at_breakpoints[list(mesh.movable)] = 0.0
    smaller = np.minimum(at_breakpoints[:-1], at_breakpoints[1:])
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _legendre_tail(control: PiecewisePolynomial) -> Array:
    """Size of the highest Legendre coefficient in each interval, (N,)."""
    orders = control.orders
    highest = np.take_along_axis(control.powers()[:, 0, :], orders[:, None], axis=1)[:, 0]
    # the leading coefficient of the Legendre polynomial on [0, 1]
    leading: Integers = np.array([comb(2 * order, order) for order in orders.tolist()])
    return np.abs(highest) / leading
