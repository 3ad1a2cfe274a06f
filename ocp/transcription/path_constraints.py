"""Path constraints: what holds at all times of a phase, be it stated as bound, peak or limit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from ocp.problem.functionals import Peak, pieces_over
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.problem.symbols import Algebraic, Control, State, Time, column_of, resolve
from ocp.scaling.scales import Scales, near_limits
from ocp.transcription.columns import PhaseColumns

# Of the largest value of a constraint: a scale that is smaller would ask for more digits than sums
# of such values have.
_FINEST = 1e-4


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
    has_stated_scale : bool
        Whether the user stated the scale.
    of_controls : bool
        Whether it is linear in the controls and depends on no other signal. Then its rows hold its
        Bernstein coefficients, and with them the constraint at all times, instead of its values at
        the collocation points.
    of_states : bool
        Whether it depends on a state or an algebraic signal. Where it does not, its multipliers
        leave the costates as they are.
    has_control : bool
        Whether it depends on a control, be it with states or without.
    peak : Peak or None
        The peak that bounds the expression from above.
    sign : float
        -1 for the lower side of a peak of an absolute value.
    is_equation : bool
        Whether its limits agree.
    of_cost : bool
        Whether it only holds a cost above what it stands for, see `Bound`.
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
    has_stated_scale: bool = False
    of_cost: bool = False
    of_controls: bool = field(init=False)
    of_states: bool = field(init=False)
    has_control: bool = field(init=False)

    def __post_init__(self) -> None:
        symbols = resolve(self.expression, "a path constraint")
        controls = column_of(symbol for symbol in symbols if isinstance(symbol, Control))
        of_states = any(isinstance(symbol, (State, Algebraic)) for symbol in symbols)
        of_time = of_states or any(isinstance(symbol, Time) for symbol in symbols)
        slope = ca.jacobian(self.expression, controls)
        linear = slope.nnz() > 0 and not ca.depends_on(slope, controls)
        object.__setattr__(self, "of_controls", linear and not (of_time or self.is_equation))
        object.__setattr__(self, "of_states", of_states)
        object.__setattr__(self, "has_control", not controls.is_empty())

    def limits(self, parameters: Parameters, peaks: Mapping[Peak, float]) -> tuple[float, float]:
        """Lower and upper limit of ``sign * expression``, at given values of the peaks."""
        if self.peak is not None:
            return -math.inf, peaks[self.peak]
        if self.sampled:
            return parameters.bound_limits[self.phase, self.name]
        return parameters.signal_limits[self.name]

    def size(self, limits: tuple[float, float], largest: float) -> float:
        """What an excess is a part of: the largest of the limits and the typical value.

        A limit that is far beyond all values and the scale does not count.

        Parameters
        ----------
        limits : (lower, upper)
        largest : float
            Largest absolute value on the motion. It is the typical one where no scale is stated,
            and one that is stated counts down to the part of it that rounding leaves exact.
        """
        typical = max(self.scale, _FINEST * largest) if self.has_stated_scale else largest
        return max([*near_limits(limits, max(self.scale, largest)), typical]) or 1.0


def path_constraints(
    problem: Problem, columns: PhaseColumns, scales: Scales
) -> tuple[PathConstraint, ...]:
    """All path constraints of a phase, those with rows at the collocation points first."""
    phase = columns.phase
    of_bounds = [
        PathConstraint(
            phase=phase.name,
            name=b.name,
            unit=b.unit,
            expression=b.expression,
            lower=b.lower,
            upper=b.upper,
            scale=scales.bounds[phase.name, b.name],
            sampled=True,
            has_stated_scale=b.scale is not None,
            is_equation=b.is_equation,
            of_cost=b.of_cost,
        )
        for b in phase.bounds
    ]
    # no expression is above its peak
    of_peaks = [
        PathConstraint(
            phase=phase.name,
            name=peak.name,
            unit=peak.unit,
            expression=expression,
            lower=-math.inf,
            upper=0.0,
            scale=scales.functionals[peak],
            sampled=True,
            has_stated_scale=peak.scale is not None,
            peak=peak,
            sign=sign,
        )
        for peak, expression in pieces_over(problem.peaks, phase.name)
        for sign in peak.signs
    ]
    # controls need none: their Bernstein coefficients keep the bounds at all times
    of_signals = [
        PathConstraint(
            phase=phase.name,
            name=s.name,
            unit=s.unit,
            expression=s.symbol,
            lower=s.lower,
            upper=s.upper,
            scale=scales.signals[s.name],
            sampled=False,
        )
        for s in (*columns.states, *columns.algebraics)
        if s.is_limited
    ]
    return (*of_bounds, *of_peaks, *of_signals)
