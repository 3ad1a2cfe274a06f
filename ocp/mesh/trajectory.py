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
    start, end : float
        Initial and final time [s].
    intervals : int
        Their number N.
    signals, states, controls, algebraics : tuple of str
        Names of all signals in the order of the groups, and of those of each kind.
    state_polynomial : PiecewisePolynomial
        The polynomials of all states.
    fractions : (N + 1,)
        Breakpoints as fractions of the phase, from 0 to 1.
    """

    name: str
    scheme: Scheme
    breakpoints: Array
    degrees: Integers
    groups: tuple[SignalGroup, ...]
    start: float = field(init=False)
    end: float = field(init=False)
    intervals: int = field(init=False)
    signals: tuple[str, ...] = field(init=False)
    states: tuple[str, ...] = field(init=False)
    controls: tuple[str, ...] = field(init=False)
    algebraics: tuple[str, ...] = field(init=False)
    state_polynomial: PiecewisePolynomial = field(init=False)
    fractions: Array = field(init=False)

    def __post_init__(self) -> None:
        start, end = float(self.breakpoints[0]), float(self.breakpoints[-1])
        fractions = np.linspace(0.0, 1.0, len(self.breakpoints))
        if end > start:  # a motion that takes no time is refused later, with a sentence
            fractions = (self.breakpoints - start) / (end - start)
            fractions[0], fractions[-1] = 0.0, 1.0
        derived = {
            "start": start,
            "end": end,
            "intervals": len(self.breakpoints) - 1,
            "signals": tuple(name for group in self.groups for name in group.names),
            "states": self._names("state"),
            "controls": self._names("control"),
            "algebraics": self._names("algebraic"),
            "state_polynomial": self.groups[0].polynomial,
            "fractions": fractions,
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return (
            f"PhaseTrajectory('{self.name}': {', '.join(self.signals)}; {self.intervals} "
            f"intervals, {self.start:.6g} to {self.end:.6g} s)"
        )

    def _names(self, kind: SignalKind) -> tuple[str, ...]:
        return tuple(name for group in self.groups if group.kind == kind for name in group.names)

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
        """The phase of that name; StatementError if there is none."""
        for phase in self.phases:
            if phase.name == name:
                return phase
        names = ", ".join(f"'{phase.name}'" for phase in self.phases)
        raise StatementError(f"there is no phase {name!r}; give one of {names}")
