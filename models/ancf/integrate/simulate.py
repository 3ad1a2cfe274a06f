"""Simulation of a chain: Algorithm 1 of the paper with an implicit integrator.

The motion is integrated piece by piece between the breakpoints of the joints' laws; what is
reported is evaluated afterwards from the stage accelerations that the integrator stored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter
from typing import Literal

import numpy as np

from models.ancf.chain import Chain
from models.ancf.integrate.integrator import StepControl, Steps, integrate
from models.ancf.integrate.radau import radau
from models.ancf.joints import Free, Joint, joint_angles, joint_rates, quarter
from models.ancf.joints.constraints import Constraints
from models.ancf.motion.index1 import Index1
from models.ancf.motion.minimal_coordinates import MinimalCoordinates
from models.ancf.state import NodalState, check_start
from models.arrays import Array, Places
from models.errors import ModelError

_COLUMNS = 4096  # instants evaluated at once


@dataclass(frozen=True)
class Statistics:
    """Cost of a simulation: accepted and rejected steps, Newton iterations, and so on."""

    steps: int
    rejected: int
    iterations: int
    jacobians: int
    factorizations: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Simulation:
    """Motion of a chain at the requested times.

    Attributes
    ----------
    chain : Chain
    times : (m,)
        [s]
    q, v : (size, m)
        Node coordinates and rates [m, -; m/s, 1/s].
    kinetic, strain, gravity : (m,)
        Energies [J]; that of gravity is zero at the root.
    work : (L, m)
        Work done by each joint's torque since the start [J].
    dissipated : (m,)
        Energy lost to damping since the start [J].
    torque : (L, m)
        Joint torques, given or reaction [N m].
    violation : (m,)
        Largest constraint residual [m, or rad at a locked joint].
    drift : float
        Largest energy defect over the ends of all steps [J].
    statistics : Statistics
    """

    chain: Chain
    times: Array
    q: Array
    v: Array
    kinetic: Array
    strain: Array
    gravity: Array
    work: Array
    dissipated: Array
    torque: Array
    violation: Array
    drift: float
    statistics: Statistics

    @property
    def energy(self) -> Array:
        """Mechanical energy, (m,) [J]."""
        return self.kinetic + self.strain + self.gravity

    @property
    def final(self) -> NodalState:
        """State at the last requested time."""
        return NodalState(self.q[:, -1].copy(), self.v[:, -1].copy())

    def position(self, link: int, node: int = -1) -> Array:
        """Path (2, m) [m] of a node; by default the end of the link."""
        return self.q[list(self.chain.slots(link, node)[:2])]

    def joint_angles(self) -> Array:
        """Joint angles followed from the start without jumps, (L, m) [rad]."""
        return np.unwrap(joint_angles(self.chain, self.q), axis=1)


def simulate(
    chain: Chain,
    joints: Sequence[Joint],
    state: NodalState,
    times: Array,
    *,
    settings: StepControl | None = None,
    form: Literal["eliminated", "baumgarte"] = "eliminated",
    stabilisation: tuple[float, float] = (20.0, 20.0),
) -> Simulation:
    """Move a chain from a state at `times[0]` and report it at `times`.

    Parameters
    ----------
    chain : Chain
    joints : sequence of Joint
        What is done at each joint, the root first.
    state : NodalState
        Where it starts.
    times : (m,)
        Increasing instants [s], two at least.
    settings : StepControl, optional
    form : {"eliminated", "baumgarte"}
        Constraints eliminated, or multipliers with (14).
    stabilisation : tuple of float
        alpha, beta of (14) [1/s]; the paper takes 5 to 50.

    Returns
    -------
    Simulation

    Raises
    ------
    ModelError
        If the times do not increase, the state breaks the constraints, or a step diverges.
    """
    clock = perf_counter()
    times = np.asarray(times, dtype=float)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0).all():
        raise ModelError("simulate: times do not increase; give two or more increasing instants.")
    settings = settings or StepControl()
    eliminated = MinimalCoordinates(chain, joints)
    start, end = float(times[0]), float(times[-1])
    z, v = eliminated.state(start, state.q, state.v)
    at = np.full(1, start)
    kept = NodalState(*(y[:, 0] for y in eliminated.nodes(at, z[:, None], v[:, None])))
    check_start(chain, joints, state, kept, start)
    moving = eliminated if form == "eliminated" else Index1(chain, joints, *stabilisation)
    z, v = moving.state(start, kept.q, kept.v)
    h = min(1e-3, (end - start) / 10)
    report = _Report(chain, joints, eliminated, moving, settings)
    edges = sorted({start, end, *(b for j in joints for b in j.breakpoints if start < b < end)})
    for window in pairwise(edges):
        steps, (z, v, h) = integrate(moving, settings, window, z, v, min(h, 1e-2))
        inside = (times >= window[0]) & (times < window[1])
        inside |= (times == end) & (window[1] == end)
        report.add(steps, window, times[inside])
    return report.finish(times, perf_counter() - clock)


class _Report:
    """Collects the evaluated pieces of a simulation."""

    def __init__(
        self,
        chain: Chain,
        joints: Sequence[Joint],
        eliminated: MinimalCoordinates,
        moving: MinimalCoordinates | Index1,
        settings: StepControl,
    ) -> None:
        self.chain, self.joints = chain, joints
        self.eliminated, self.moving = eliminated, moving
        self.table = radau(settings.stages)
        self.constraints = Constraints(chain, joints)
        self.parts: list[dict[str, Array]] = []
        self.pieces: list[Steps] = []
        self.done = np.zeros(len(joints) + 1)
        self.balance: list[Array] = []

    def add(self, steps: Steps, window: tuple[float, float], times: Array) -> None:
        """Evaluate a piece at its output times and at its step ends."""
        self.pieces.append(steps)
        t0, h = np.array(steps.t), np.array(steps.h)
        power = self._stage_power(steps, t0, h, window)
        gained = np.einsum("jks,s,k->jk", power, self.table.matrix[-1], h)
        before = self.done[:, None] + np.cumsum(gained, axis=1) - gained
        self.done = before[:, -1] + gained[:, -1]
        for chunk in np.array_split(times, len(times) // _COLUMNS + 1):
            which = np.clip(np.searchsorted(t0, chunk, side="right") - 1, 0, len(t0) - 1)
            theta = (chunk - t0[which]) / h[which]
            part = self._evaluate(np.clip(chunk, *_open(window)), steps, which, theta, h)
            weights = self.table.weights(theta, 1) * h[which, None]
            part["work"] = before[:, which] + np.einsum("jms,ms->jm", power[:, which], weights)
            self.parts.append(part)
        all_steps = np.arange(len(t0))
        x, rate, _ = self._motion(steps, all_steps, np.ones(len(t0)), h, t0 + h)
        ends = self._energies(x, rate)
        done = before + gained
        self.balance.append(sum(ends) - done[:-1].sum(axis=0) + done[-1])

    def _motion(
        self, steps: Steps, which: Places, theta: Array, h: Array, t: Array
    ) -> tuple[Array, Array, Array]:
        """Merged coordinates x, rates and accelerations at fractions of steps, (n, m)."""
        form, n = self.moving, self.moving.size
        h = h[which]
        a = np.array(steps.a)[which][:, :n]
        z0, v0 = np.array(steps.z)[which].T, np.array(steps.v)[which].T
        once, twice = (np.einsum("mns,ms->nm", a, self.table.weights(theta, i)) for i in (1, 2))
        acc = np.einsum("mns,ms->nm", a, self.table.weights(theta, 0))
        z, v = z0 + theta * h * v0 + h**2 * twice, v0 + h * once
        if isinstance(form, MinimalCoordinates):
            return form.motion(t, z, v, acc)
        gather = self.eliminated.assembly.gather
        self._nodes = z, v
        return gather(z), gather(v), gather(acc)

    def _evaluate(
        self, t: Array, steps: Steps, which: Places, theta: Array, h: Array
    ) -> dict[str, Array]:
        x, rate, acc = self._motion(steps, which, theta, h, t)
        spread = self.eliminated.assembly.spread
        eliminated = self.moving is self.eliminated
        q, v = (spread(x), spread(rate)) if eliminated else self._nodes
        kinetic, strain, gravity = self._energies(x, rate)
        return {
            "q": q,
            "v": v,
            "kinetic": kinetic,
            "strain": strain,
            "gravity": gravity,
            "torque": self._torques(t, x, rate, acc),
            "violation": np.abs(self.constraints.value(t, q)).max(axis=0, initial=0.0),
        }

    def _energies(self, x: Array, rate: Array) -> tuple[Array, Array, Array]:
        asm = self.eliminated.assembly
        kinetic = 0.5 * (rate * (asm.mass @ rate)).sum(axis=0)
        return kinetic, asm.strain_energy(x), -asm.gravity @ x

    def _torques(self, t: Array, x: Array, rate: Array, acc: Array) -> Array:
        """Torques at the joints: given, or what the balance of forces lacks; (L, m)."""
        mechanics, ties = self.eliminated.mechanics, self.eliminated.ties.ties
        out = np.zeros((len(self.joints), len(t)))
        if ties:
            slope = mechanics.slopes(x)
            lack = mechanics.balance(t, x, rate, acc, slope, mechanics.pulls(slope, rate))
        for tie in ties:
            k = next(i for i, joint in enumerate(self.joints) if joint is tie.joint)
            out[k] = (quarter(x[list(tie.b)]) * lack[list(tie.b)]).sum(axis=0)
        for k, joint in enumerate(self.joints):
            if hasattr(joint, "torque"):
                out[k] = joint.torque(t)
        return out

    def _stage_power(self, steps: Steps, t0: Array, h: Array, window: tuple[float, float]) -> Array:
        """Power of each joint and of the damping at all stages, (L + 1, K, s) [W]."""
        s = self.table.stages
        out = np.zeros((len(self.joints) + 1, len(t0), s))
        if not self.moving.relaxation and all(isinstance(j, Free) for j in self.joints):
            return out
        for rows in np.array_split(np.arange(len(t0)), len(t0) * s // _COLUMNS + 1):
            which, theta = np.repeat(rows, s), np.tile(self.table.nodes, len(rows))
            t = np.clip(t0[which] + theta * h[which], *_open(window))
            x, rate, acc = self._motion(steps, which, theta, h, t)
            spread = self.eliminated.assembly.spread
            rates = joint_rates(self.chain, spread(x), spread(rate))
            power = self._torques(t, x, rate, acc) * rates
            lost = self.eliminated.mechanics.dissipation(x, rate)
            out[:, rows] = np.vstack((power, lost)).reshape(-1, len(rows), s)
        return out

    def finish(self, times: Array, seconds: float) -> Simulation:
        """Join the pieces."""
        joined = {k: np.concatenate([p[k] for p in self.parts], axis=-1) for k in self.parts[0]}
        done = joined.pop("work")
        total = np.concatenate(self.balance)
        first = (joined["kinetic"] + joined["strain"] + joined["gravity"])[0]
        statistics = Statistics(
            steps=sum(len(p.t) for p in self.pieces),
            rejected=sum(p.rejected for p in self.pieces),
            iterations=sum(p.iterations for p in self.pieces),
            jacobians=sum(p.jacobians for p in self.pieces),
            factorizations=self.moving.factorizations,
            seconds=seconds,
        )
        return Simulation(
            chain=self.chain,
            times=times,
            work=done[:-1],
            dissipated=done[-1],
            drift=float(np.abs(total - first).max()),
            statistics=statistics,
            **joined,
        )


def _open(window: tuple[float, float]) -> tuple[float, float]:
    """The window without its ends, where the laws may jump."""
    edge = 1e-13 * max(1.0, abs(window[0]), abs(window[1]))
    return window[0] + edge, window[1] - edge
