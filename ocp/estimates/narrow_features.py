"""Narrow features along a motion: what happens between all points at which it was looked at.

A gust, a bump of the road or a resonance may be far narrower than an interval. Collocation and the
estimates of its errors then see the values on both sides only, and the motion holds to the last
digit for a problem without it. So a motion that is about to be an answer is looked at densely once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.estimates.dense_panels import (
    OF_PANEL,
    DensePanels,
    finite,
    panels_of_phase,
)
from ocp.estimates.motion_errors import MotionErrors
from ocp.mesh.mesh import Mesh, with_points
from ocp.numerics.piecewise_polynomial import Lagrange
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.optimality.steps import owner_text, path_expressions
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME

# Degree up to which a polynomial hides nothing between the points, and the operations of an
# expression up to which it is worth to look whether it is one
_SMOOTH = 8
_SHORT = 1000

# Times what was known of an interval: below it the dense samples are the same thing once more
_MORE = 3.0


@dataclass(frozen=True)
class NarrowFeature:
    """A feature that the points of an interval do not see.

    Attributes
    ----------
    phase : int
        Number of the phase.
    where, name : str
        Name of the phase, and what is off there, in words.
    first, last : float
        Where it is with its tails, as fractions of the phase.
    time : float
        Of its middle [s].
    size : float
        What it changes of the state, the integral or the constraint, relative to its size.
    of : str
        What the size is a part of.
    parts : int
        Intervals that a mesh should have there at least.
    """

    phase: int
    where: str
    name: str
    first: float
    last: float
    time: float
    size: float
    of: str = "its size"
    parts: int = 1


def narrow_features(errors: MotionErrors, allowed: float) -> Iterator[NarrowFeature]:
    """The largest feature of each interval that holds one.

    Parameters
    ----------
    errors : MotionErrors
        Of the motion, as its points tell.
    allowed : float
        What may be left, relative.
    """
    problem = errors.transcription.problem
    if not may_hide(problem):
        return

    hiding = {phase.name: _hiding(problem, phase.name) for phase in problem.phases}
    count = panels_of_phase(errors.trajectory.phases, max(hiding.values()))
    if not count:
        return

    for index, motion in enumerate(errors.trajectory.phases):
        if not hiding[motion.name]:
            continue
        places = _Samples(errors, index, DensePanels.of(motion, count))
        looked_at = [
            (name, by_panel, np.where(total > _MORE * known + allowed, total, 0.0))
            for name, by_panel, total, known in places.off()
        ]
        if not looked_at:
            continue

        # an interval is told by what it misses most of
        missed = np.array([total for _, _, total in looked_at])
        for k in np.flatnonzero(missed.any(axis=0)).tolist():
            worst = int(np.argmax(missed[:, k]))
            name, by_panel, total = looked_at[worst]
            first, last = places.panels.span(k, by_panel)
            yield NarrowFeature(
                phase=index,
                where=motion.name,
                name=name,
                first=first,
                last=last,
                time=motion.start + 0.5 * (first + last) * (motion.end - motion.start),
                size=float(total[k]),
            )


def feature_remark(features: Sequence[NarrowFeature], problem: Problem) -> str:
    """What to say of features that the mesh does not see, or nothing where there are none."""
    if not features:
        return ""
    worst = max(features, key=lambda feature: feature.size)
    # with a free time of the phase, what is narrow may move with it
    fixed = problem.phases[worst.phase].has_fixed_times
    remedy = "state breakpoints there"
    if not fixed:
        remedy += " if its time is known, or begin on more intervals"
    return (
        f"{worst.name} in phase '{worst.where}' changes near {worst.time:.6g} s between the points "
        f"of the mesh, by {worst.size:.2g} of {worst.of} in all: {remedy}"
    )


def mesh_that_sees(mesh: Mesh, features: Iterable[NarrowFeature]) -> Mesh:
    """The mesh with breakpoints on both sides of features and in them, without added points."""
    fractions: list[list[float]] = [[] for _ in mesh.phases]
    for feature in features:
        inner = np.linspace(feature.first, feature.last, feature.parts + 1)
        fractions[feature.phase] += inner.tolist()
    pairs = zip(mesh.phases, fractions, strict=True)
    return Mesh(tuple(with_points(phase, np.array(at)) if at else phase for phase, at in pairs))


def may_hide(problem: Problem) -> bool:
    """Whether any expression of a problem can hide something between points."""
    return any(_hiding(problem, phase.name) for phase in problem.phases)


@lru_cache(maxsize=256)
def _hiding(problem: Problem, name: str) -> int:
    """Operations of all expressions of a phase; 0 where none of them can hide anything."""
    expressions = [expression for _, expression in path_expressions(problem, name)]
    if all(is_smooth(problem, name, expression) for expression in expressions):
        return 0
    return int(ca.n_nodes(ca.vertcat(*expressions)))


def is_smooth(problem: Problem, name: str, expression: ca.SX) -> bool:
    """Whether an expression is a polynomial of time along a motion, and hides nothing."""
    if ca.n_nodes(expression) > _SHORT:
        return False
    of_time = [*(signal.symbol for signal in problem.signals[name]), TIME.symbol]
    degree = polynomial_degree(expression, of_time, [1] * len(of_time))
    return degree is not None and degree <= _SMOOTH


@dataclass(frozen=True, eq=False, repr=False)
class _Samples:
    """Dense samples of one phase.

    Attributes
    ----------
    errors : MotionErrors
    index : int
        Number of the phase.
    panels : DensePanels
    """

    errors: MotionErrors
    index: int
    panels: DensePanels

    def off(self) -> Iterator[tuple[str, Array, Array, Array]]:
        """What is off in the panels (P,) and in all (N,), and what was known of that (N,).

        With the name of what it belongs to. All are relative.
        """
        known = self.errors.dynamics[self.index]
        for name, by_panel, total in (*self._dynamics(), *self._integrals()):
            yield name, by_panel, total, known
        yield from self._constraints()

    def _values(self, expressions: Sequence[ca.SX], intervals: Integers, tau: Array) -> Array:
        """Expressions at local times (r, q) of intervals (r,), (n, r, q)."""
        k = np.repeat(intervals, tau.shape[1])
        trajectory, name = self.errors.trajectory, self.panels.motion.name
        values = self.errors.evaluator.values(trajectory, name, expressions, k, tau.ravel())
        return values.T.reshape(len(expressions), *tau.shape)

    def _smooth(self, expression: ca.SX) -> bool:
        """See `is_smooth`."""
        return is_smooth(self.errors.transcription.problem, self.panels.motion.name, expression)

    def _dynamics(self) -> Iterator[tuple[str, Array, Array]]:
        """What the residuals of the states amount to."""
        transcription, motion = self.errors.transcription, self.panels.motion
        dynamics = transcription.problem.phases[self.index].dynamics
        rough = {s: rate for s, rate in dynamics.items() if not self._smooth(rate)}
        if not rough:
            return
        tau, seconds = self.panels.tau, self.panels.seconds
        rates = motion.rates(np.repeat(self.panels.intervals, OF_PANEL), tau.ravel())
        values = self._values(list(rough.values()), self.panels.intervals, tau)
        for state, stated in zip(rough, values, strict=True):
            own = rates[:, motion.states.index(state.name)].reshape(stated.shape)
            residual = finite(np.abs(own - stated) * seconds).sum(axis=1)
            residual = residual / transcription.scales.signals[state.name]
            yield owner_text(state), residual, self.panels.in_all(residual)

    def _integrals(self) -> Iterator[tuple[str, Array, Array]]:
        """How integrands stray from polynomials through the points, and the integrals are off."""
        transcription, motion = self.errors.transcription, self.panels.motion
        integrals = [
            f
            for f in transcription.problem.integrals[motion.name]
            if not self._smooth(f.expression)
        ]
        if not integrals:
            return
        expressions = [f.expression for f in integrals]
        tau, seconds = self.panels.tau, self.panels.seconds
        values = self._values(expressions, self.panels.intervals, tau)
        strayed, by_scheme = np.zeros_like(values), np.zeros((len(integrals), motion.intervals))
        for degree in sorted(set(motion.degrees.tolist())):
            here, rule = np.flatnonzero(motion.degrees == degree), motion.scheme.at(degree)
            points = np.tile(rule.points, (here.size, 1))
            at_points = self._values(expressions, here, points)
            by_scheme[:, here] = at_points @ rule.weights * np.diff(motion.breakpoints)[here]

            panels = np.flatnonzero(motion.degrees[self.panels.intervals] == degree)
            basis = Lagrange(tuple(rule.points.tolist())).values(tau[panels].ravel())
            own = at_points[:, np.searchsorted(here, self.panels.intervals[panels])]
            followed = np.einsum("pqm,npm->npq", basis.reshape(*tau[panels].shape, -1), own)
            strayed[:, panels] = np.abs(values[:, panels] - followed)

        for f, densely, scheme, off in zip(integrals, values, by_scheme, strayed, strict=True):
            found = self.panels.in_all(finite(densely * seconds).sum(axis=1))
            size = max(transcription.scales.functionals[f], abs(float(found.sum())))
            by_panel = finite(off * seconds).sum(axis=1) / size
            yield owner_text(f), by_panel, finite(np.abs(found - scheme) / size)

    def _constraints(self) -> Iterator[tuple[str, Array, Array, Array]]:
        """What limits, peaks and equations are exceeded by."""
        index = self.index
        rows = [
            (constraint, limits, known)
            for constraint, limits, known in zip(
                self.errors.transcription.constraints[index],
                self.errors.limits[index],
                self.errors.excess[index],
                strict=True,
            )
            if not self._smooth(constraint.expression)
        ]
        if not rows:
            return
        expressions = [constraint.expression for constraint, _, _ in rows]
        every = self._values(expressions, self.panels.intervals, self.panels.tau)
        for (constraint, (lower, upper), known), values in zip(rows, every, strict=True):
            signed = constraint.sign * values
            beyond = finite(np.maximum(signed - upper, lower - signed))
            if constraint.is_equation:
                size, before = constraint.scale, self.errors.dynamics[index]
            else:
                size, before = known.size, np.maximum(known.values, 0.0)
            by_panel = np.maximum(beyond.max(axis=1), 0.0) / size
            total = np.maximum.reduceat(by_panel, self.panels.starts)
            yield f"'{constraint.name}'", by_panel, np.asarray(total), before
