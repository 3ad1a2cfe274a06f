"""Path constraints: what holds at all times of a phase, be it stated as bound, peak or limit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ocp.problem.functionals import Peak
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.problem.symbols import Algebraic, State, Time, resolve
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.scaling import Scales


@dataclass(frozen=True, eq=False, repr=False)
class PathConstraint:
    """``lower <= sign * expression - peak <= upper`` at all times of a phase.

    Attributes
    ----------
    phase, name, unit : str
        Of the phase, and of the bound, peak or signal.
    scale : float
        Size by which its rows are divided [unit].
    sampled : bool
        Whether it has rows. Bounds of signals are bounds of unknowns instead.
    of_controls : bool
        Whether it is linear in the controls and depends on no other signal. Then its rows hold its
        Bernstein coefficients, and with them the constraint at all times, instead of its values at
        the collocation points.
    peak : Peak or None
        The peak that bounds the expression from above.
    sign : float
        -1 for the lower side of a peak of an absolute value.
    is_equation : bool
        Whether its limits agree.
    """

    phase: str
    name: str
    unit: str
    expression: ca.SX
    lower: Any
    upper: Any
    scale: float
    sampled: bool
    peak: Peak | None = None
    sign: float = 1.0
    is_equation: bool = False
    of_controls: bool = False

    def limits(self, parameters: Parameters, peaks: Mapping[Peak, float]) -> tuple[float, float]:
        """Lower and upper limit of ``sign * expression``, at given values of the peaks."""
        if self.peak is not None:
            return -math.inf, peaks[self.peak]
        if self.sampled:
            return parameters.bound_limits[self.phase, self.name]
        return parameters.signal_limits[self.name]


def path_constraints(
    problem: Problem, columns: PhaseColumns, scales: Scales
) -> tuple[PathConstraint, ...]:
    """All path constraints of a phase, those with rows at the collocation points first."""
    phase = columns.phase
    constraints = [
        PathConstraint(
            phase=phase.name,
            name=b.name,
            unit=b.unit,
            expression=b.expression,
            lower=b.lower,
            upper=b.upper,
            scale=scales.bounds[phase.name, b.name],
            sampled=True,
            is_equation=b.is_equation,
            of_controls=not b.is_equation and _is_of_controls(b.expression, problem, phase.name),
        )
        for b in phase.bounds
    ]

    constraints += [
        PathConstraint(
            phase=phase.name,
            name=peak.name,
            unit=peak.unit,
            expression=expression,
            lower=-math.inf,
            upper=0.0,
            scale=scales.functionals[peak],
            sampled=True,
            peak=peak,
            sign=sign,
            of_controls=_is_of_controls(expression, problem, phase.name),
        )
        for peak in problem.peaks
        for name, expression in peak.pieces
        for sign in peak.signs
        if name == phase.name
    ]

    # controls need none: their Bernstein coefficients keep the bounds at all times
    constraints += [
        PathConstraint(
            phase=phase.name,
            name=signal.name,
            unit=signal.unit,
            expression=signal.symbol,
            lower=signal.lower,
            upper=signal.upper,
            scale=scales.signals[signal.name],
            sampled=False,
        )
        for signal in (*columns.states, *columns.algebraics)
        if signal.is_limited
    ]
    return tuple(constraints)


def _is_of_controls(expression: ca.SX, problem: Problem, phase: str) -> bool:
    """Whether an expression is linear in controls and depends on no other function of time."""
    symbols = resolve(expression, "a path constraint")
    if any(isinstance(s, (State, Algebraic, Time)) for s in symbols):
        return False
    controls = ca.vertcat(*[c.symbol for c in problem.controls[phase]], ca.SX(0, 1))
    slope = ca.jacobian(expression, controls)
    return slope.nnz() > 0 and not ca.depends_on(slope, controls)
