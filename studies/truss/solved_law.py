"""Laws out of solutions: what the optimiser found, as a motion law like any other."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.laws import AngularMotion, Law, linear_jerk
from models.laws.motion import law_times
from ocp import PhaseTrajectory, Solution
from studies.truss.config import TrussStudy
from studies.truss.problem import Statement, acceleration_in

Array = NDArray[np.float64]

JOINT = 1e-9  # of the duration: the largest gap between two phases
SHORTEST = 1e-12  # of the duration: shorter intervals are left out


def law_of(study: TrussStudy, statement: Statement, solution: Solution) -> Law:
    """The law of a solution.

    With jerk as the control it is the exact integral of that jerk, piecewise linear in time, from
    rest, whatever the collocation polynomials say; else it is the engine's independent replay.
    """
    if statement.signals.jerk is None:
        return ReplayedLaw(study, statement, solution)
    edges: list[float] = [0.0]
    ramps: list[tuple[float, float]] = []
    for phase in solution.trajectory.phases:
        spans = itertools.pairwise(phase.breakpoints)
        for (begin, end), ramp in zip(spans, _ramps(phase, statement), strict=True):
            if end - begin > SHORTEST * phase.breakpoints[-1]:
                edges.append(float(end))
                ramps.append((float(ramp[0]), float(ramp[1])))
    return linear_jerk(tuple(edges), tuple(ramps), start_angle=study.truss.stowed_angle)


def _ramps(phase: PhaseTrajectory, statement: Statement) -> Array:
    """Jerk at the start and the end of each interval, shape (N, 2)."""
    assert statement.signals.jerk is not None
    return phase.polynomial(statement.signals.jerk.name).ends()[:, :, 0]


@dataclass(frozen=True, eq=False)
class ReplayedLaw:
    """The replayed states of a solution whose control is a force or an acceleration.

    Its jerk is not defined and given as NaN.
    """

    study: TrussStudy
    statement: Statement
    solution: Solution

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.solution.replayed.phases[-1].end)

    @property
    def start_angle(self) -> float:
        """At time 0 [rad]."""
        return float(self.motion(0.0).angle[0])

    @property
    def end_angle(self) -> float:
        """At T [rad]."""
        return float(self.motion(self.duration).angle[0])

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which the control jumps [s]."""
        return tuple(float(t) for t in self.solution.breakpoints[1:-1])

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        signals = self.statement.signals
        return AngularMotion(
            time=t,
            angle=self._sample(signals.angle, t),
            speed=np.maximum(self._sample(signals.speed, t), 0.0),
            acceleration=self._acceleration(t),
            jerk=np.full_like(t, np.nan),
        )

    def _sample(self, expression: Any, time: Array, phase: str | None = None) -> Array:
        return self.solution.sample(expression, time, phase, replayed=True)

    def _acceleration(self, time: Array) -> Array:
        values = np.full_like(time, np.nan)
        phases = self.solution.replayed.phases
        slack = JOINT * self.duration  # phases meet to the solver's tolerance only
        for own, phase, net in zip(phases, self.statement.phases, self.statement.nets, strict=True):
            here = (time >= own.start - slack) & (time <= own.end + slack)
            if here.any():
                expression = acceleration_in(self.study, self.statement.signals, net)
                values[here] = self._sample(expression, time[here], phase.name)
        return values
