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
from models.ancf.motion.equations import EquationsOfMotion
from models.arrays import Array
from models.errors import ModelError, require_positive

_log = logging.getLogger(__name__)
_NEWTON = 0.01  # Newton error over the tolerance of the step
_ITERATIONS = 12
_FILTERS = 2  # passes that hide modes too fast for the step, which the method then damps
_ROUND_OFF = 1e-14  # change of a coordinate [m] that is noise
_SMALLEST = 1e-10  # step [s] at which the integration is given up
_PROGRESS = 5.0  # seconds of computing between progress messages


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


class _NoConvergence(Exception):
    """The Newton iteration of a step did not converge."""


class _Integrator:
    """State of an integration; `run` is the only entry."""

    def __init__(
        self, form: EquationsOfMotion, settings: StepControl, window: tuple[float, float]
    ) -> None:
        self.form, self.settings = form, settings
        self.table: RadauIIA = radau(settings.stages)
        edge = 1e-13 * max(1.0, abs(window[0]), abs(window[1]))
        self.inside = window[0] + edge, window[1] - edge
        self.window = window
        self.steps = Steps()
        self.factored = 0.0
        self.rate = 1.0

    def run(self, z: Array, v: Array, h: float) -> Steps:
        """Integrate over the window from (z, v) with a first step of about h."""
        t, end = self.window
        a0, pull = self.form.start(self.inside[0], z, v)
        s = self.table.stages
        a, pull = self._flat(0.0 * a0), self._flat(pull)  # a jump of torque makes a0 useless
        fresh, spoke = False, monotonic()
        while end - t > 1e-12 * max(1.0, abs(end)):
            h = self._fit(t, h)
            if not fresh:
                self._linearise(t, z)
                fresh = True
            try:
                new_a, new_pull, dq = self._newton(t, z, v, h, a, pull)
            except _NoConvergence:
                self._shrunk(t, h, "the Newton iteration does not converge")
                h, a, pull = h / 4, self._flat(0.0 * a0), self._flat(pull[:, 0])
                continue
            error = self._error(z, v, h, a0, new_a)
            if error > 1.0 and self.settings.fixed_step is None:
                self._shrunk(t, h, "the local error stays above the tolerance")
                shrink = max(0.2, 0.8 * error ** (-1 / (s + 1)))
                a, pull = self._extrapolate(new_a, new_pull, shrink, 0.0)
                h *= shrink
                continue
            self._store(t, h, z, v, new_a)
            z, v, a0, t = z + dq, self._last_rate(v, h, new_a), new_a[:, -1], t + h
            grow = self._growth(error)
            a, pull = self._extrapolate(new_a, new_pull, self._fit(t, h * grow) / h, 1.0)
            h, fresh = h * grow, False
            spoke = self._speak(t, spoke)
        self.final = z, v, h
        return self.steps

    def _fit(self, t: float, h: float) -> float:
        """Step from t that ends on, or well before, the end of the window."""
        h = min(self.settings.fixed_step or h, self.settings.max_step)
        left = self.window[1] - t
        if left <= 0.0:
            return h
        if h >= left * (1 - 1e-9):
            return left
        return left / 2 if h > 0.5 * left and self.settings.fixed_step is None else h

    def _linearise(self, t: float, z: Array) -> None:
        self.form.linearise(t, z)
        self.steps.jacobians += 1
        self.factored = 0.0

    def _newton(
        self, t: float, z: Array, v: Array, h: float, a: Array, pull: Array
    ) -> tuple[Array, Array, Array]:
        form, table, n = self.form, self.table, self.form.size
        if h != self.factored:
            form.factor(h * table.values)
            self.factored = h
        at = np.clip(t + h * table.nodes, *self.inside)
        drift = z[:, None] + v[:, None] * (h * table.nodes)
        a, pull, last = a.copy(), pull.copy(), np.inf
        floor = _ROUND_OFF / self.settings.tolerance
        for _ in range(_ITERATIONS):
            self.steps.iterations += 1
            q = drift + h**2 * (a[:n] @ table.square.T)
            rates = v[:, None] + h * (a[:n] @ table.matrix.T)
            force, gap = form.residual(at, q, rates, a, pull)
            da = self._solve(form.pull_force(gap) - force)
            dq = h**2 * (da[:n] @ table.square.T)
            dw = dq
            if form.relaxation:
                dw = dq + form.relaxation * h * (da[:n] @ table.matrix.T)
            a += da
            pull += form.pull_change(dw) - gap
            size = float(np.abs(dq).max()) / self.settings.tolerance
            ratio = size / last if np.isfinite(last) else self.rate
            if not np.isfinite(size) or (np.isfinite(last) and ratio > 0.9 and size > floor):
                raise _NoConvergence
            if size * ratio < _NEWTON * max(1e-3, 1 - ratio) or size < floor:
                self.rate = min(0.5, max(ratio, 1e-3))
                return a, pull, drift[:, -1] - z + h**2 * (a[:n] @ table.square[-1])
            last = size
        raise _NoConvergence

    def _solve(self, rhs: Array) -> Array:
        """Simplified Newton correction of all stages."""
        table = self.table
        mixed = rhs @ table.inverse.T
        mixed[:, 0] = self.form.solve(0, mixed[:, 0].real)
        for k in range(1, len(table.values)):
            mixed[:, k] = self.form.solve(k, mixed[:, k])
        return np.asarray((mixed @ table.joined).real)

    def _error(self, z: Array, v: Array, h: float, a0: Array, a: Array) -> float:
        """Local error over the tolerance: filtered misfit of the stage polynomial at the start."""
        n, table = self.form.size, self.table
        rates = v[:, None] + h * (a[:n] @ table.matrix.T)
        step = h * table.values[0].real
        kick = v - rates @ table.at_start
        jerk = a0[:n] - a[:n] @ table.at_start
        rhs = np.zeros(self.form.unknowns)
        rhs[:n] = step * kick + step**2 * jerk
        error = rhs
        for _ in range(_FILTERS):
            error = self.form.solve(0, self.form.inertia(error))
            error[n:] = 0.0
        return float(np.abs(error[:n]).max()) / self.settings.tolerance

    def _growth(self, error: float) -> float:
        grow = min(4.0, 0.9 * max(error, 1e-12) ** (-1 / (self.table.stages + 1)))
        return 1.0 if 1.0 <= grow < 1.1 else max(grow, 0.3)

    def _extrapolate(
        self, a: Array, pull: Array, ratio: float, start: float
    ) -> tuple[Array, Array]:
        weights = self.table.weights(start + ratio * self.table.nodes, 0).T
        return a @ weights, pull @ weights

    def _last_rate(self, v: Array, h: float, a: Array) -> Array:
        return np.asarray(v + h * (a[: self.form.size] @ self.table.matrix[-1]))

    def _flat(self, column: Array) -> Array:
        return np.repeat(column[:, None], self.table.stages, axis=1)

    def _store(self, t: float, h: float, z: Array, v: Array, a: Array) -> None:
        for name, value in zip("thzva", (t, h, z, v, a), strict=True):
            getattr(self.steps, name).append(value)

    def _shrunk(self, t: float, h: float, reason: str) -> None:
        self.steps.rejected += 1
        if self.settings.fixed_step is not None:
            raise ModelError(
                f"simulate: with the fixed step {h:g} s at t = {t:g} s {reason}; "
                "take a smaller fixed_step or leave it None."
            )
        if h < _SMALLEST:
            raise ModelError(
                f"simulate: at t = {t:g} s the step fell to {h:.1e} s because {reason}; "
                "loosen the tolerance, smooth the torque there or declare a breakpoint."
            )

    def _speak(self, t: float, spoke: float) -> float:
        if monotonic() - spoke < _PROGRESS:
            return spoke
        _log.info("t = %.4g of %.4g s, %d steps", t, self.window[1], len(self.steps.t))
        return monotonic()


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
    work = _Integrator(form, settings, window)
    steps = work.run(z, v, h)
    return steps, work.final
