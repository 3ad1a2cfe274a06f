"""Trajectories: values of signals over the phases of a problem, as functions of time.

A guess, an iterate and a solution are all trajectories; each can start the next solve, whatever
its mesh.  They hold numbers only and no CasADi objects.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.numerics.schemes import SchemeName, derivative_matrix, lagrange, scheme

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Piece:
    """The intervals of one degree.

    Attributes
    ----------
    intervals : (m,) their numbers.
    states : (m, degree + 1, n_x) values at the support points.
    controls : (m, degree, n_p) values of polynomial controls at the collocation points.
    algebraics : (m, degree, n_z) values at the collocation points.
    """

    degree: int
    intervals: Integers
    states: Array
    controls: Array
    algebraics: Array


@dataclass(frozen=True, eq=False)
class PhaseTrajectory:
    """Piecewise polynomials of one phase.

    Attributes
    ----------
    breakpoints : (N + 1,) times [s].
    states, constant, linear, polynomial, algebraics : names of the signals of each kind.
    steps : (N, n_c) values of piecewise constant controls.
    ramps : (N, 2, n_l) end values of piecewise linear controls.
    pieces : polynomial values, by degree.
    """

    name: str
    scheme: SchemeName
    breakpoints: Array
    states: tuple[str, ...]
    constant: tuple[str, ...]
    linear: tuple[str, ...]
    polynomial: tuple[str, ...]
    algebraics: tuple[str, ...]
    steps: Array
    ramps: Array
    pieces: tuple[Piece, ...]

    @property
    def start(self) -> float:
        """Initial time [s]."""
        return float(self.breakpoints[0])

    @property
    def end(self) -> float:
        """Final time [s]."""
        return float(self.breakpoints[-1])

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of all signals: states, controls, algebraics."""
        return (*self.states, *self.controls, *self.algebraics)

    @property
    def controls(self) -> tuple[str, ...]:
        """Names of the controls: constant, linear, polynomial."""
        return (*self.constant, *self.linear, *self.polynomial)

    @cached_property
    def degrees(self) -> Integers:
        """(N,) degree of each interval."""
        degrees = np.empty(len(self.breakpoints) - 1, dtype=np.int64)
        for piece in self.pieces:
            degrees[piece.intervals] = piece.degree
        return degrees

    def locate(self, times: Array) -> tuple[Integers, Array]:
        """Interval and local time in [0, 1] of each time; a breakpoint belongs to its right."""
        t = np.asarray(times, dtype=float)
        k = np.searchsorted(self.breakpoints, t, side="right") - 1
        k = np.clip(k, 0, len(self.breakpoints) - 2)
        return k, (t - self.breakpoints[k]) / np.diff(self.breakpoints)[k]

    def local(self, intervals: Integers, tau: Array) -> Array:
        """All signals at local times of given intervals, shape (m, n)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        x = np.empty((k.size, len(self.states)))
        p = np.empty((k.size, len(self.polynomial)))
        z = np.empty((k.size, len(self.algebraics)))
        for piece, here, row in self._by_piece(k):
            method = scheme(self.scheme, piece.degree)
            x[here] = _combine(lagrange(method.support, tau[here]), piece.states[row])
            if p.shape[1] + z.shape[1]:
                inner = lagrange(method.points, tau[here])
                p[here] = _combine(inner, piece.controls[row])
                z[here] = _combine(inner, piece.algebraics[row])
        ramps = self.ramps[k, 0] * (1.0 - tau)[:, None] + self.ramps[k, 1] * tau[:, None]
        return np.hstack([x, self.steps[k], ramps, p, z])

    def rates(self, intervals: Integers, tau: Array) -> Array:
        """Time derivatives of the state polynomials, shape (m, n_x)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        rates = np.empty((k.size, len(self.states)))
        for piece, here, row in self._by_piece(k):
            slope = derivative_matrix(scheme(self.scheme, piece.degree).support, tau[here])
            rates[here] = _combine(slope, piece.states[row])
        return rates / np.diff(self.breakpoints)[k][:, None]

    def _by_piece(self, k: Integers) -> Iterator[tuple[Piece, Any, Integers]]:
        """The pieces that intervals `k` belong to: which of them, and their rows there."""
        if len(self.pieces) == 1:
            yield self.pieces[0], slice(None), np.searchsorted(self.pieces[0].intervals, k)
            return
        degrees = self.degrees[k]
        for piece in self.pieces:
            here = np.flatnonzero(degrees == piece.degree)
            if here.size:
                yield piece, here, np.searchsorted(piece.intervals, k[here])

    def sample(self, times: Array) -> Array:
        """All signals at given times, shape (m, n)."""
        return self.local(*self.locate(np.atleast_1d(np.asarray(times, dtype=float))))

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        values = self.sample(self.start + np.asarray(fractions) * (self.end - self.start))
        return dict(zip(self.signals, values.T, strict=True))


def _combine(weights: Array, values: Array) -> Array:
    return np.asarray(np.einsum("ms,msn->mn", weights, values))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Phases in order, static unknowns and constants by name, peaks in the problem's order."""

    phases: tuple[PhaseTrajectory, ...]
    unknowns: Mapping[str, float] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    peaks: tuple[float, ...] = ()

    def phase(self, name: str) -> PhaseTrajectory:
        """The phase of that name."""
        return next(phase for phase in self.phases if phase.name == name)
