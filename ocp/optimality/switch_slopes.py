"""How a program changes with the place of a breakpoint on which a control switches.

On such a breakpoint the control is at one limit before and at the other one behind. If the mesh
does not let it move, the program says nothing of its neighbourhood: many sets of multipliers fit.
Those of the problem itself are among them, and they tell no gain by a move of the
switch (Bryson and Ho, Applied Optimal Control, ch. 3.7: the Hamiltonian has no jump).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.mesh import Mesh
from ocp.optimality.active_set import AT, share_at_limit
from ocp.optimality.iterate import Iterate
from ocp.transcription.transcribe import transcribe

# Of the shorter interval beside a breakpoint: the step of a central difference. Rows are smooth in
# the widths of intervals, most of them linear.
_STEP = 1e-4

_NOTHING = 1e-300  # so that nothing is divided by zero

# Of the phase: a breakpoint this close to a known instant belongs to it and stays there.
_SAME = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class SwitchSlopes:
    """Derivatives of the Lagrangian by breakpoints: ``direct + by_multiplier @ multipliers``.

    Scaled, so that the largest factor of a multiplier is one.

    Attributes
    ----------
    direct : (k,)
    by_multiplier : (k, rows + unknowns)
    """

    direct: Array
    by_multiplier: Array

    def of(self, multipliers: Array) -> Array:
        """The derivatives for scaled multipliers (rows + unknowns,), shape (k,)."""
        return self.direct + self.by_multiplier @ multipliers

    def promised(self, multipliers: Array) -> Array:
        """Their moduli, in parts of the largest share of each, (k,)."""
        shares = np.abs(self.by_multiplier * multipliers).max(axis=1, initial=0.0)
        return np.abs(self.of(multipliers)) / np.maximum(shares, np.abs(self.direct) + _NOTHING)


def switch_slopes(iterate: Iterate) -> SwitchSlopes:
    """Of all fixed breakpoints at which a control switches."""
    unknowns = np.zeros(iterate.x.size)
    slopes = []
    for index, phase in enumerate(iterate.mesh.phases):
        for number in _switches(iterate, index):
            width = np.diff(phase.breakpoints)
            step = _STEP * min(width[number - 1], width[number])
            before, after = (_values(iterate, index, number, part) for part in (-step, step))
            slope = (after - before) / (2.0 * step)
            slopes.append(np.concatenate([slope / np.abs(slope).max(), unknowns]))
    size = iterate.transcription.program.rows + iterate.x.size
    table = np.array(slopes).reshape(-1, 1 + size)
    return SwitchSlopes(table[:, 0], table[:, 1:])


def _values(iterate: Iterate, index: int, number: int, step: float) -> Array:
    """Objective and rows of the same unknowns where a breakpoint stands elsewhere."""
    of_phase = iterate.mesh.phases[index]
    points = of_phase.breakpoints.copy()
    points[number] += step
    phases = list(iterate.mesh.phases)
    phases[index] = replace(of_phase, breakpoints=points)

    known = iterate.transcription
    mesh = Mesh(tuple(phases), iterate.mesh.extra, iterate.mesh.back_off)
    moved = transcribe(known.problem, mesh, known.scheme, known.controls, known.scales, known)
    objective, rows = moved.program.oracle(iterate.x, iterate.parameters.vector)
    return np.concatenate([[float(objective)], np.array(rows).ravel()])


def _switches(iterate: Iterate, index: int) -> Integers:
    """Numbers of the breakpoints of a phase that stay and carry a switch."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    switch = np.zeros(mesh.intervals - 1, dtype=bool)
    for low, high in _at_limits(iterate, index):
        switch |= (low[:-1] & high[1:]) | (high[:-1] & low[1:])
    switch &= ~(mesh.moving[:-1] | mesh.moving[1:])

    numbers = np.flatnonzero(switch) + 1
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    apart = np.abs(mesh.breakpoints[numbers][:, None] - known[None, :]) > _SAME
    return np.asarray(numbers[apart.all(axis=1)])


def _at_limits(iterate: Iterate, index: int) -> Iterator[tuple[Flags, Flags]]:
    """For each control with two limits, in which intervals it is all through at either one."""
    motion = iterate.trajectory.phases[index]
    for control in motion.controls:
        lower, upper = iterate.parameters.signal_limits[control]
        if not np.isfinite(upper - lower):
            continue
        margin, values = AT * (upper - lower), motion.polynomial(control)
        yield (
            share_at_limit(values, lower, margin) == 1.0,
            share_at_limit(values, upper, margin) == 1.0,
        )
