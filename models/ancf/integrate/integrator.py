"""Variable-step Radau IIA integration of a form of the equations of motion.

Each step solves for the stage accelerations by simplified Newton iterations; the linear
systems decouple over the eigenvalues lambda of the Butcher matrix into
`(M + (h^2 lambda^2 + eta h lambda) K) w = r`, one real and (s - 1)/2 complex.

Symbols: s stages, n coordinates, G axial Gauss points, h step [s], z coordinates, v rates,
a accelerations (and multipliers), N axial forces [N].
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from time import monotonic

import numpy as np

from models.ancf.integrate.radau import RadauIIA, radau
from models.ancf.motion import EquationsOfMotion
from models.arrays import Array
from models.errors import ModelError, require_positive
from models.numerics import interior

_log = logging.getLogger(__name__)

_NEWTON = 0.001  # error of the Newton iteration over the tolerance of the step: it must not show
_ITERATIONS = 12  # a step that takes more is tried again at a quarter of its length
_DIVERGING = 0.9  # ratio of two Newton corrections from which on the step is given up
_KEEPING = 3  # iterations of a step up to which its linearisation serves the next one, too
_FILTERS = 2  # passes that hide modes too fast for the step, which the method then damps
_ROUND_OFF = 1e-14  # change of a coordinate [m] that is noise
_SMALLEST = 1e-10  # step [s] at which the integration is given up
_PROGRESS = 5.0  # seconds of computing between progress messages

# Step control: aim below the tolerance, so that few steps are rejected; change the step by
# bounded factors, as the error estimate is trusted near the step only; leave it where little is
# gained, as a new length costs a factorisation.
_SAFETY = 0.9
_SAFETY_AFTER_REJECTION = 0.8
_LEAST_CHANGE, _GREATEST_CHANGE = 0.3, 4.0
_LEAST_AFTER_REJECTION = 0.2
_WORTH_GROWING = 1.1


@dataclass(frozen=True)
class StepControl:
    """How to integrate.

    Parameters
    ----------
    tolerance : float
        Largest local error of positions [m] and slopes [-] in a step. Under a jump of torque
        every mode of the mesh rings: set `fixed_step`, modes too fast for it are damped.
    stages : int
        3, 5 or 7; the order is twice that less one.
    fixed_step : float or None
        Step [s] without error control; None adapts it.
    max_step : float
        Longest step [s].

    Raises
    ------
    ModelError
        If a value is not finite and positive, or for another number of stages.
    """

    tolerance: float = 1e-7
    stages: int = 5
    fixed_step: float | None = None
    max_step: float = 1.0

    def __post_init__(self) -> None:
        require_positive("StepControl", tolerance=self.tolerance, max_step=self.max_step)
        if self.fixed_step is not None:
            require_positive("StepControl", fixed_step=self.fixed_step)
        radau(self.stages)


@dataclass
class Steps:
    """Accepted steps of a piece: start times, lengths, states and stage accelerations."""

    t: list[float] = field(default_factory=list)
    h: list[float] = field(default_factory=list)
    z: list[Array] = field(default_factory=list)
    v: list[Array] = field(default_factory=list)
    a: list[Array] = field(default_factory=list)
    rejected: int = 0
    iterations: int = 0
    jacobians: int = 0

    def append(self, t: float, h: float, z: Array, v: Array, a: Array) -> None:
        """Record one accepted step."""
        self.t.append(t)
        self.h.append(h)
        self.z.append(z)
        self.v.append(v)
        self.a.append(a)


def integrate(
    form: EquationsOfMotion,
    settings: StepControl,
    window: tuple[float, float],
    z: Array,
    v: Array,
    h: float,
) -> tuple[Steps, tuple[Array, Array, float]]:
    """Integrate a form over a window of time.

    Parameters
    ----------
    form : EquationsOfMotion
    settings : StepControl
    window : tuple of float
        Start and end [s]; forces are evaluated strictly inside, so they may jump at its ends.
    z, v : (n,)
        Coordinates and rates at the start.
    h : float
        First step to try [s].

    Returns
    -------
    steps : Steps
    final : tuple
        Coordinates and rates at the end, and the step to try next [s].

    Raises
    ------
    ModelError
        If the step falls below 1e-10 s, or a fixed step does not converge.
    """
    integrator = _Integrator(form, settings, window)
    final = integrator.run(z, v, h)
    return integrator.steps, final


class _NoConvergence(Exception):
    """The Newton iteration of a step did not converge."""


class _Integrator:
    """State of an integration; `run` is the only entry."""

    def __init__(
        self, form: EquationsOfMotion, settings: StepControl, window: tuple[float, float]
    ) -> None:
        self.form, self.settings, self.window = form, settings, window
        self.table: RadauIIA = radau(settings.stages)
        self.interior = interior(*window)
        self.steps = Steps()
        self.factored = 0.0  # step for which the Newton matrices are factorised; 0 for none
        self.rate = 1.0  # ratio of the last two Newton corrections of the last step
        # of the stage polynomial's continuation, most often for a step of the same length
        self.extrapolated, self.weights = (0.0, 0.0), np.empty((0, 0))

    def run(self, z: Array, v: Array, h: float) -> tuple[Array, Array, float]:
        """Integrate over the window from (z, v) with a first step of about h.

        Returns coordinates and rates at the end, and the step to try next.
        """
        t, end = self.window
        a0, N = self.form.start(self.interior[0], z, v)
        # Stages start from zero accelerations: under a jump of torque a0 belongs to modes that
        # the step will not follow.
        a, N = self._flat(0.0 * a0), self._flat(N)
        linearised = fresh = False
        last_report = monotonic()

        while end - t > 1e-12 * max(1.0, abs(end)):
            h = self._fit(t, h)
            if not linearised:
                self._linearise(t, z)
                linearised = fresh = True

            before = self.steps.iterations
            try:
                new_a, new_N, dz = self._newton(t, z, v, h, a, N)
            except _NoConvergence:
                if not fresh:  # the step may be right, and the linearisation too old
                    linearised = False
                    continue
                self._reject(t, h, "the Newton iteration does not converge")
                h, a, N = h / 4, self._flat(0.0 * a0), self._flat(N[:, 0])
                continue

            # a fixed step stays as it is, whatever its error
            fixed = self.settings.fixed_step is not None
            error = 0.0 if fixed else self._error(v, h, a0, new_a)
            if error > 1.0:
                self._reject(t, h, "the local error stays above the tolerance")
                shrink = self._shrink(error)
                a, N = self._extrapolate(new_a, new_N, shrink, 0.0)
                h *= shrink
                continue

            self.steps.append(t, h, z, v, new_a)
            z, v, a0, t = z + dz, self._last_rate(v, h, new_a), new_a[:, -1], t + h

            # The stage polynomials, continued, are the first guess of the next step.
            growth = self._growth(error)
            a, N = self._extrapolate(new_a, new_N, self._fit(t, h * growth) / h, 1.0)
            # a linearisation serves until the motion has turned so far that it takes iterations
            h, fresh = h * growth, False
            linearised = self.steps.iterations - before <= _KEEPING
            last_report = self._report(t, last_report)

        return z, v, h

    # the step

    def _linearise(self, t: float, z: Array) -> None:
        self.form.linearise(t, z)
        self.steps.jacobians += 1
        self.factored = 0.0

    def _newton(
        self, t: float, z: Array, v: Array, h: float, a: Array, N: Array
    ) -> tuple[Array, Array, Array]:
        """Stage accelerations and axial forces of a step, and its change of z."""
        form, table, n = self.form, self.table, self.form.size
        if h != self.factored:
            form.factor(h * table.values)
            self.factored = h

        times = np.clip(t + h * table.nodes, *self.interior)
        square, matrix = h**2 * table.square.T, h * table.matrix.T
        drift = z[:, None] + v[:, None] * (h * table.nodes)
        a, N, last_size = a.copy(), N.copy(), np.inf
        floor = _ROUND_OFF / self.settings.tolerance

        for _ in range(_ITERATIONS):
            self.steps.iterations += 1
            stages = drift + a[:n] @ square
            rates = v[:, None] + a[:n] @ matrix
            force, gap = form.residual(times, stages, rates, a, N)

            # The axial forces are eliminated from the correction and follow from it.
            da = self._solve(form.axial_load(gap) - force)
            dz = da[:n] @ square
            strained = dz + form.relaxation * (da[:n] @ matrix) if form.relaxation else dz
            a += da
            N += form.axial_force_change(strained) - gap

            # Linear convergence at `ratio` leaves size * ratio / (1 - ratio) to go. In the first
            # iteration the ratio is that of the step before.
            size = float(np.abs(dz).max()) / self.settings.tolerance
            first = not np.isfinite(last_size)
            ratio = self.rate if first else size / last_size
            if not np.isfinite(size) or (not first and ratio > _DIVERGING and size > floor):
                raise _NoConvergence
            if size * ratio < _NEWTON * max(1e-3, 1 - ratio) or size < floor:
                self.rate = min(0.5, max(ratio, 1e-3))
                return a, N, drift[:, -1] - z + a[:n] @ square[:, -1]
            last_size = size

        raise _NoConvergence

    def _solve(self, rhs: Array) -> Array:
        """Simplified Newton correction of all stages."""
        table = self.table
        decoupled = rhs @ table.decoupling
        parts = decoupled.view(complex)  # the same numbers
        parts[:, 0] = self.form.solve(0, parts[:, 0].real)
        for k in range(1, len(table.values)):
            parts[:, k] = self.form.solve(k, parts[:, k])
        return np.asarray(decoupled @ table.joining)

    def _error(self, v: Array, h: float, a0: Array, a: Array) -> float:
        """Local error over the tolerance: filtered misfit of the stage polynomial at the start."""
        n, table = self.form.size, self.table
        rates = v[:, None] + h * (a[:n] @ table.matrix.T)
        step = h * table.values[0].real
        rate_misfit = v - rates @ table.at_start
        acceleration_misfit = a0[:n] - a[:n] @ table.at_start

        # The filter is the real Newton matrix: it leaves slow modes and divides out fast ones.
        error = np.zeros(self.form.unknowns)
        error[:n] = step * rate_misfit + step**2 * acceleration_misfit
        for _ in range(_FILTERS):
            error = self.form.solve(0, self.form.inertia(error))
            error[n:] = 0.0
        return float(np.abs(error[:n]).max()) / self.settings.tolerance

    def _extrapolate(self, a: Array, N: Array, ratio: float, start: float) -> tuple[Array, Array]:
        """Stage values of a step that is `ratio` times as long and begins at `start` of this."""
        if (ratio, start) != self.extrapolated:
            self.extrapolated = ratio, start
            self.weights = self.table.weights(start + ratio * self.table.nodes, 0).T
        return a @ self.weights, N @ self.weights

    def _last_rate(self, v: Array, h: float, a: Array) -> Array:
        return np.asarray(v + h * (a[: self.form.size] @ self.table.matrix[-1]))

    def _flat(self, column: Array) -> Array:
        return np.repeat(column[:, None], self.table.stages, axis=1)

    # its length

    def _fit(self, t: float, h: float) -> float:
        """Step from t that ends on, or well before, the end of the window."""
        h = min(self.settings.fixed_step or h, self.settings.max_step)
        left = self.window[1] - t
        if left <= 0.0:
            return h
        if h >= left * (1 - 1e-9):
            return left

        # two halves instead of a long step and a sliver
        return left / 2 if h > 0.5 * left and self.settings.fixed_step is None else h

    def _shrink(self, error: float) -> float:
        """Factor of a step that was rejected for its error."""
        factor = _SAFETY_AFTER_REJECTION * error ** (-1 / (self.table.stages + 1))
        return max(_LEAST_AFTER_REJECTION, factor)

    def _growth(self, error: float) -> float:
        """Factor from an accepted step to the next."""
        factor = _SAFETY * max(error, 1e-12) ** (-1 / (self.table.stages + 1))
        factor = min(_GREATEST_CHANGE, factor)
        return 1.0 if 1.0 <= factor < _WORTH_GROWING else max(factor, _LEAST_CHANGE)

    def _reject(self, t: float, h: float, reason: str) -> None:
        """Count a rejected step; raise ModelError where a shorter one cannot help."""
        self.steps.rejected += 1
        if self.settings.fixed_step is not None:
            raise ModelError(
                f"simulate: with the fixed step {h:g} s at t = {t:g} s {reason}; "
                "take a smaller fixed_step or leave it None."
            )

        # An adaptive step this small does not meet a tolerance but a force that is not smooth.
        if h < _SMALLEST:
            raise ModelError(
                f"simulate: at t = {t:g} s the step fell to {h:.1e} s because {reason}; "
                "loosen the tolerance, smooth the torque there or declare a breakpoint."
            )

    def _report(self, t: float, last_report: float) -> float:
        """Log the progress every few seconds; the time of the last message."""
        if monotonic() - last_report < _PROGRESS:
            return last_report
        _log.info("t = %.4g of %.4g s, %d steps", t, self.window[1], len(self.steps.t))
        return monotonic()
