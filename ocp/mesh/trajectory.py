"""Trajectories: values of signals over the phases of a problem, as functions of time.

A guess, an iterate and a solution are all trajectories. Each can start the next solve, whatever its
mesh. They hold numbers only and no CasADi objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ocp.arrays import Array, Integers
from ocp.errors import StatementError
from ocp.numerics.piecewise_polynomial import PiecewisePolynomial, located
from ocp.numerics.schemes import Scheme

SignalKind = Literal["state", "control", "algebraic"]


@dataclass(frozen=True, eq=False)
class SignalGroup:
    """Signals of one kind whose polynomials have the same bases.

    Attributes
    ----------
    names : tuple of str
        One for each component of the polynomial.
    """

    kind: SignalKind
    names: tuple[str, ...]
    polynomial: PiecewisePolynomial


@dataclass(frozen=True, eq=False)
class PhaseTrajectory:
    """Piecewise polynomials of one phase.

    Attributes
    ----------
    name : str
    scheme : Scheme
    breakpoints : (N + 1,)
        Times [s].
    degrees : (N,)
        Collocation points in each interval.
    groups : tuple of SignalGroup
        States first, then controls, then algebraic signals.
    """

    name: str
    scheme: Scheme
    breakpoints: Array
    degrees: Integers
    groups: tuple[SignalGroup, ...]

    def __repr__(self) -> str:
        return (
            f"PhaseTrajectory('{self.name}': {', '.join(self.signals)}; {self.intervals} "
            f"intervals, {self.start:.6g} to {self.end:.6g} s)"
        )

    @property
    def start(self) -> float:
        """Initial time [s]."""
        return float(self.breakpoints[0])

    @property
    def end(self) -> float:
        """Final time [s]."""
        return float(self.breakpoints[-1])

    @property
    def intervals(self) -> int:
        """Number of intervals N."""
        return len(self.breakpoints) - 1

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of all signals: states, controls, algebraic signals."""
        return tuple(name for group in self.groups for name in group.names)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self._names("state")

    @property
    def controls(self) -> tuple[str, ...]:
        """Names of the controls."""
        return self._names("control")

    @property
    def algebraics(self) -> tuple[str, ...]:
        """Names of the algebraic signals."""
        return self._names("algebraic")

    def _names(self, kind: SignalKind) -> tuple[str, ...]:
        return tuple(name for group in self.groups if group.kind == kind for name in group.names)

    @property
    def state_polynomial(self) -> PiecewisePolynomial:
        """The polynomials of all states."""
        return self.groups[0].polynomial

    @property
    def fractions(self) -> Array:
        """(N + 1,) breakpoints as fractions of the phase, from 0 to 1."""
        fractions = (self.breakpoints - self.start) / (self.end - self.start)
        fractions[0], fractions[-1] = 0.0, 1.0
        return np.asarray(fractions)

    def polynomial(self, name: str) -> PiecewisePolynomial:
        """The polynomial of one signal.

        Raises
        ------
        StatementError
            When the phase has no such signal.
        """
        for group in self.groups:
            if name in group.names:
                return group.polynomial.component(group.names.index(name))
        raise StatementError(
            f"phase '{self.name}' has no signal '{name}'; its signals are {', '.join(self.signals)}"
        )

    def locate(self, times: Array) -> tuple[Integers, Array]:
        """Interval and local time in [0, 1] of each time; a breakpoint belongs to its right."""
        return located(self.breakpoints, times)

    def local(self, intervals: Integers, tau: Array) -> Array:
        """All signals at local times of given intervals, shape (m, n)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        return np.hstack([group.polynomial.value(k, tau) for group in self.groups])

    def rates(self, intervals: Integers, tau: Array) -> Array:
        """Time derivatives of the state polynomials, shape (m, n_x)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        return self.state_polynomial.rate(k, tau)

    def sample(self, times: Array) -> Array:
        """All signals at given times, shape (m, n)."""
        return self.local(*self.locate(np.atleast_1d(np.asarray(times, dtype=float))))

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        values = self.sample(self.start + np.asarray(fractions) * (self.end - self.start))
        return dict(zip(self.signals, values.T, strict=True))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion: the values of all signals over time, and of the numbers beside them.

    Attributes
    ----------
    phases : tuple of PhaseTrajectory
        In the order of the problem.
    unknowns, constants : mapping of str to float
        Values by name [unit of the statement].
    peaks : tuple of float
        Epigraph values, in the order of the problem's peaks [unit of the statement].
    """

    phases: tuple[PhaseTrajectory, ...]
    unknowns: Mapping[str, float] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    peaks: tuple[float, ...] = ()

    def __repr__(self) -> str:
        phases = (f"'{p.name}' {p.start:.6g} to {p.end:.6g} s" for p in self.phases)
        unknowns = "".join(f", {name} = {v:.6g}" for name, v in self.unknowns.items())
        return f"Trajectory({', '.join(phases)}{unknowns})"

    def phase(self, name: str) -> PhaseTrajectory:
        """The phase of that name."""
        return next(phase for phase in self.phases if phase.name == name)
