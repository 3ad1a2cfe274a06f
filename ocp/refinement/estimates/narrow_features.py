"""Narrow features along a motion: what happens between all points at which it was looked at.

A gust, a bump of the road or a resonance may be far narrower than an interval. Collocation and the
estimates of its errors then see the values on both sides only, and the motion holds to the last
digit for a problem without it. So a motion that is about to be an answer is looked at densely once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.mesh import Mesh, with_points
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.piecewise_polynomial import Lagrange
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.numerics.schemes import Gauss
from ocp.optimality.steps import owner_text, path_expressions
from ocp.problem.symbols import TIME
from ocp.refinement.estimates.error_estimate import MotionErrors

# Samples of all phases together, and of one panel of an interval. Long expressions are sampled
# less: so many operations in all take some hundredths of a second.
_SAMPLES = 4000
_OF_PANEL = 4
_OPERATIONS = 1e7

# Degree up to which a polynomial hides nothing between the points, and the operations of an
# expression up to which it is worth to look whether it is one
_SMOOTH = 8
_SHORT = 1000

# Times what was known of an interval: below it the dense samples are the same thing once more
_MORE = 3.0

# Part of what is off in an interval that lies outside of the feature, at most, on each side
_OUTSIDE = 0.01


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
    """

    phase: int
    where: str
    name: str
    first: float
    last: float
    time: float
    size: float


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
    operations = [
        ca.n_nodes(ca.vertcat(*[e for _, e in path_expressions(problem, phase.name)]))
        for phase in problem.phases
    ]
    samples = min(_SAMPLES, _OPERATIONS / max(1, *operations))
    count = sum(motion.intervals for motion in errors.trajectory.phases)
    panels = int(samples // (_OF_PANEL * count))
    if panels < 2:
        return
    for index, motion in enumerate(errors.trajectory.phases):
        looked_at = [
            (name, by_panel, np.where(total > _MORE * known + allowed, total, 0.0))
            for name, by_panel, total, known in _Samples(errors, motion, index, panels).off()
        ]
        if not looked_at:
            continue
        missed = np.array([total for _, _, total in looked_at])
        for k in np.flatnonzero(missed.any(axis=0)).tolist():
            worst = int(np.argmax(missed[:, k]))
            name, by_panel, total = looked_at[worst]
            first, last = _span(by_panel[k])
            start, width = motion.fractions[k], np.diff(motion.fractions)[k]
            middle = start + 0.5 * (first + last) / panels * width
            yield NarrowFeature(
                phase=index,
                where=motion.name,
                name=name,
                first=max(float(start + (first - 1) / panels * width), 0.0),
                last=min(float(start + (last + 1) / panels * width), 1.0),
                time=float(motion.start + middle * (motion.end - motion.start)),
                size=float(total[k]),
            )


def feature_remark(features: Sequence[NarrowFeature]) -> str:
    """What to say of features that the mesh does not see, or nothing where there are none."""
    if not features:
        return ""
    worst = max(features, key=lambda feature: feature.size)
    return (
        f"{worst.name} in phase '{worst.where}' changes near {worst.time:.6g} s between the points "
        f"of the mesh, by {worst.size:.2g} of its size in all: state breakpoints there"
    )


def mesh_that_sees(mesh: Mesh, features: Iterable[NarrowFeature]) -> Mesh:
    """The mesh with breakpoints on both sides of features, without added points."""
    fractions: list[list[float]] = [[] for _ in mesh.phases]
    for feature in features:
        fractions[feature.phase] += [feature.first, feature.last]
    pairs = zip(mesh.phases, fractions, strict=True)
    return Mesh(tuple(with_points(phase, np.array(at)) if at else phase for phase, at in pairs))


def _span(off: Array) -> tuple[int, int]:
    """The panels that hold nearly all of what is off: the first one, and the one after the last."""
    shares = np.cumsum(off) / off.sum()
    first = int(np.searchsorted(shares, _OUTSIDE))
    return first, int(np.searchsorted(shares, 1.0 - _OUTSIDE)) + 1


@dataclass(frozen=True, eq=False, repr=False)
class _Samples:
    """Dense samples of one phase, at Gauss points of panels that divide each interval."""

    errors: MotionErrors
    motion: PhaseTrajectory
    index: int
    panels: int

    def off(self) -> Iterator[tuple[str, Array, Array, Array]]:
        """What is off in the panels (N, P) and in all (N,), and what was known of that (N,).

        With the name of what it belongs to. All are relative.
        """
        known = self.errors.dynamics[self.index]
        for name, by_panel, total in (*self._dynamics(), *self._integrals()):
            yield name, by_panel, total, known
        yield from self._constraints()

    def _points(self) -> tuple[Array, Array]:
        """Local times of the samples of an interval and their weights, which add up to one."""
        gauss = Gauss().at(_OF_PANEL)
        tau = (np.arange(self.panels)[:, None] + gauss.points) / self.panels
        return tau.ravel(), np.tile(gauss.weights, self.panels) / self.panels

    def _in_panels(self, values: Array) -> Array:
        """Values (N, P q) by panel, (N, P, q); what is no number the points have told already."""
        shape = (self.motion.intervals, self.panels, _OF_PANEL)
        return np.where(np.isfinite(values), values, 0.0).reshape(shape)

    def _values(self, expressions: Sequence[ca.SX], tau: Array) -> Array:
        """Expressions at the same local times of every interval, (n, N, m)."""
        k = np.repeat(np.arange(self.motion.intervals), tau.size)
        local = np.tile(tau, self.motion.intervals)
        trajectory, name = self.errors.trajectory, self.motion.name
        values = self.errors.evaluator.values(trajectory, name, expressions, k, local)
        return values.T.reshape(len(expressions), self.motion.intervals, tau.size)

    def _smooth(self, expression: ca.SX) -> bool:
        """Whether an expression is a polynomial of time along the motion, and hides nothing."""
        if ca.n_nodes(expression) > _SHORT:
            return False
        problem, motion = self.errors.transcription.problem, self.motion
        symbols = {signal.name: signal.symbol for signal in problem.signals[motion.name]}
        of_time = [*(symbols[name] for name in motion.signals), TIME.symbol]
        degree = polynomial_degree(expression, of_time, [1] * len(of_time))
        return degree is not None and degree <= _SMOOTH

    def _dynamics(self) -> Iterator[tuple[str, Array, Array]]:
        """What the residuals of the states amount to."""
        transcription, motion = self.errors.transcription, self.motion
        dynamics = transcription.problem.phases[self.index].dynamics
        rough = {s: rate for s, rate in dynamics.items() if not self._smooth(rate)}
        if not rough:
            return
        tau, weights = self._points()
        k = np.repeat(np.arange(motion.intervals), tau.size)
        rates = motion.rates(k, np.tile(tau, motion.intervals))
        steps = np.diff(motion.breakpoints)[:, None]
        for state, stated in zip(rough, self._values(list(rough.values()), tau), strict=True):
            own = rates[:, motion.states.index(state.name)].reshape(stated.shape)
            size = transcription.scales.signals[state.name]
            residual = self._in_panels(np.abs(own - stated) * steps * weights / size).sum(axis=2)
            yield owner_text(state), residual, residual.sum(axis=1)

    def _integrals(self) -> Iterator[tuple[str, Array, Array]]:
        """How integrands stray from polynomials through the points, and the integrals are off."""
        transcription, motion = self.errors.transcription, self.motion
        integrals = [
            f
            for f in transcription.problem.integrals[motion.name]
            if not self._smooth(f.expression)
        ]
        if not integrals:
            return
        expressions = [f.expression for f in integrals]
        tau, weights = self._points()
        steps = np.diff(motion.breakpoints)
        values = self._values(expressions, tau)
        strayed, missed = np.zeros_like(values), np.zeros(values.shape[:2])
        for degree in sorted(set(motion.degrees.tolist())):
            here, rule = motion.degrees == degree, motion.scheme.at(degree)
            at_points = self._values(expressions, rule.points)[:, here]
            basis = Lagrange(tuple(rule.points.tolist())).values(tau)
            strayed[:, here] = np.abs(values[:, here] - at_points @ basis.T)
            missed[:, here] = np.abs(values[:, here] @ weights - at_points @ rule.weights)

        totals = np.abs((values @ weights * steps).sum(axis=1))
        for f, off, total, missing in zip(integrals, strayed, totals, missed, strict=True):
            size = max(transcription.scales.functionals[f], float(total))
            by_panel = self._in_panels(off * steps[:, None] * weights / size).sum(axis=2)
            yield owner_text(f), by_panel, np.nan_to_num(missing * steps / size)

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
        tau, _ = self._points()
        every = self._values([constraint.expression for constraint, _, _ in rows], tau)
        for (constraint, (lower, upper), known), values in zip(rows, every, strict=True):
            signed = constraint.sign * values
            beyond = self._in_panels(np.maximum(signed - upper, lower - signed))
            if constraint.is_equation:
                size, before = constraint.scale, self.errors.dynamics[index]
            else:
                size, before = known.size, np.maximum(known.values, 0.0)
            by_panel = np.maximum(beyond.max(axis=2), 0.0) / size
            yield f"'{constraint.name}'", by_panel, by_panel.max(axis=1), before
