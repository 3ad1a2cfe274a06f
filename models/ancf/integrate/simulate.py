"""Simulation of a chain: Algorithm 1 of the paper with an implicit integrator.

The motion is integrated piece by piece between the breakpoints and the jumps of the joints' laws;
what is reported is evaluated afterwards from the stage accelerations that the integrator stored.

Symbols: q, v node vector and rates (size, m); x coordinates of the assembly; z coordinates of the
form of the equations; L joints; K steps; s stages; m columns (instants); theta fraction of a step.
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
from models.ancf.joints import (
    Free,
    Joint,
    Torque,
    breakpoints,
    joint_angles,
    joint_rates,
    quarter,
)
from models.ancf.joints.constraints import Constraints
from models.ancf.motion import Index1, MinimalCoordinates
from models.ancf.state import NodalState
from models.arrays import Array, Places
from models.errors import require
from models.numerics import interior

# Instants evaluated at once: enough to spread the cost of a call, and a few megabytes of a chain.
_COLUMNS = 4096


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
    form: Literal["minimal", "index-1"] = "minimal",
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
    form : {"minimal", "index-1"}
        Constraints eliminated (minimal coordinates), or multipliers with (14).
    stabilisation : tuple of float
        alpha, beta of (14) [1/s]; the paper takes 5 to 50.

    Returns
    -------
    Simulation

    Raises
    ------
    ModelError
        If the times do not increase, the form is unknown, a law is not finite, the state breaks
        the constraints, or a step diverges.
    """
    clock = perf_counter()
    settings = settings or StepControl()
    times = np.asarray(times, dtype=float)
    require(
        times.ndim == 1 and len(times) >= 2 and bool((np.diff(times) > 0).all()),
        "simulate: times do not increase; give two or more increasing instants.",
    )
    require(
        form in ("minimal", "index-1"),
        f"simulate: form is {form!r}; choose 'minimal' or 'index-1'.",
    )

    # Whatever the form, the start is checked and the report made in minimal coordinates.
    start, end = float(times[0]), float(times[-1])
    minimal = MinimalCoordinates(chain, joints)
    kept = minimal.consistent(state, start)
    moving = minimal if form == "minimal" else Index1(chain, joints, *stabilisation)

    z, v = moving.coordinates(start, kept.q, kept.v)
    h = min(1e-3, (end - start) / 10)  # the step control finds its own within a few steps
    recorder = _Recorder(chain, joints, minimal, moving, settings)
    edges = [start, *breakpoints(joints, start, end), end]
    for window in pairwise(edges):
        # behind a breakpoint the long step before it would only be rejected
        steps, (z, v, h) = integrate(moving, settings, window, z, v, min(h, 1e-2))
        asked = (times >= window[0]) & (times < window[1])
        asked |= (times == end) & (window[1] == end)
        recorder.add(steps, window, times[asked])
    return recorder.finish(times, perf_counter() - clock)


class _Recorder:
    """Collects the evaluated pieces of a simulation."""

    def __init__(
        self,
        chain: Chain,
        joints: Sequence[Joint],
        minimal: MinimalCoordinates,
        moving: MinimalCoordinates | Index1,
        settings: StepControl,
    ) -> None:
        self.chain, self.joints = chain, joints
        self.minimal, self.moving = minimal, moving
        self.table = radau(settings.stages)
        self.constraints = Constraints(chain, joints)
        self.parts: list[dict[str, Array]] = []
        self.pieces: list[Steps] = []
        self.balance: list[Array] = []  # energy that must not change, at the ends of all steps
        self.work = np.zeros(len(joints) + 1)  # so far: of each joint, and lost to damping [J]

    def add(self, steps: Steps, window: tuple[float, float], times: Array) -> None:
        """Evaluate a piece at its output times and at its step ends."""
        self.pieces.append(steps)
        starts, h = np.array(steps.t), np.array(steps.h)

        # Work at the ends of the steps, by the quadrature of the method.
        power = self._stage_power(steps, window)
        gained = np.einsum("jks,s,k->jk", power, self.table.matrix[-1], h)
        before = self.work[:, None] + np.cumsum(gained, axis=1) - gained
        self.work = before[:, -1] + gained[:, -1]

        for chunk in np.array_split(times, len(times) // _COLUMNS + 1):
            which = np.clip(np.searchsorted(starts, chunk, side="right") - 1, 0, len(starts) - 1)
            theta = (chunk - starts[which]) / h[which]
            part = self._evaluate(np.clip(chunk, *interior(*window)), steps, which, theta)
            weights = self.table.weights(theta, 1) * h[which, None]
            part["work"] = before[:, which] + np.einsum("jms,ms->jm", power[:, which], weights)
            self.parts.append(part)

        all_steps, ends = np.arange(len(starts)), np.ones(len(starts))
        x, rate, _ = self._motion(starts + h, steps, all_steps, ends)[:3]
        energy = sum(self.minimal.assembly.energies(x, rate))
        after = before + gained
        self.balance.append(energy - after[:-1].sum(axis=0) + after[-1])

    def _motion(
        self, t: Array, steps: Steps, which: Places, theta: Array
    ) -> tuple[Array, Array, Array, Array, Array]:
        """x, its rates and accelerations (n, m) at fractions of steps, and q, v of the nodes."""
        h = np.array(steps.h)[which]
        a = np.array(steps.a)[which][:, : self.moving.size]
        z0, v0 = np.array(steps.z)[which].T, np.array(steps.v)[which].T

        # The stage polynomial of the accelerations, integrated from the start of each step.
        acc, once, twice = (
            np.einsum("mns,ms->nm", a, self.table.weights(theta, integrals))
            for integrals in (0, 1, 2)
        )
        z, v = z0 + theta * h * v0 + h**2 * twice, v0 + h * once

        asm = self.minimal.assembly
        if isinstance(self.moving, MinimalCoordinates):
            x, rate, x_acc = self.moving.motion(t, z, v, acc)
            return x, rate, x_acc, asm.spread(x), asm.spread(rate)
        return asm.gather(z), asm.gather(v), asm.gather(acc), z, v

    def _evaluate(self, t: Array, steps: Steps, which: Places, theta: Array) -> dict[str, Array]:
        x, rate, acc, q, v = self._motion(t, steps, which, theta)
        kinetic, strain, gravity = self.minimal.assembly.energies(x, rate)
        return {
            "q": q,
            "v": v,
            "kinetic": kinetic,
            "strain": strain,
            "gravity": gravity,
            "torque": self._torques(t, x, rate, acc),
            "violation": np.abs(self.constraints.value(t, q)).max(axis=0, initial=0.0),
        }

    def _torques(self, t: Array, x: Array, rate: Array, acc: Array) -> Array:
        """Torques at the joints: given, or what the balance of forces lacks; (L, m)."""
        mechanics, ties = self.minimal.mechanics, self.minimal.elimination.ties
        torques = np.zeros((len(self.joints), len(t)))

        if ties:
            slope = mechanics.slopes(x)
            N = mechanics.axial_forces(slope, rate)
            lack = mechanics.balance(t, x, rate, acc, slope, N)
        for tie in ties:
            # The generalised force of a torque on a slope b does work when b turns.
            torques[tie.number] = (quarter(x[tie.after]) * lack[tie.after]).sum(axis=0)

        for k, joint in enumerate(self.joints):
            if isinstance(joint, Torque):
                torques[k] = joint.torque(t)
        return torques

    def _stage_power(self, steps: Steps, window: tuple[float, float]) -> Array:
        """Power of each joint and of the damping at all stages, (L + 1, K, s) [W]."""
        s = self.table.stages
        starts, h = np.array(steps.t), np.array(steps.h)
        power = np.zeros((len(self.joints) + 1, len(starts), s))
        if not self.moving.relaxation and all(isinstance(j, Free) for j in self.joints):
            return power

        # all stages of some steps at a time
        for rows in np.array_split(np.arange(len(starts)), len(starts) * s // _COLUMNS + 1):
            which, theta = np.repeat(rows, s), np.tile(self.table.nodes, len(rows))
            t = np.clip(starts[which] + theta * h[which], *interior(*window))
            x, rate, acc, q, v = self._motion(t, steps, which, theta)
            given = self._torques(t, x, rate, acc) * joint_rates(self.chain, q, v)
            lost = self.minimal.mechanics.dissipation(x, rate)
            power[:, rows] = np.vstack((given, lost)).reshape(-1, len(rows), s)
        return power

    def finish(self, times: Array, seconds: float) -> Simulation:
        """Join the pieces."""
        joined = {
            name: np.concatenate([part[name] for part in self.parts], axis=-1)
            for name in self.parts[0]
        }
        work = joined.pop("work")

        # The first instant has done no work, so its energy is what the balance keeps.
        initial = (joined["kinetic"] + joined["strain"] + joined["gravity"])[0]
        drift = float(np.abs(np.concatenate(self.balance) - initial).max())

        statistics = Statistics(
            steps=sum(len(piece.t) for piece in self.pieces),
            rejected=sum(piece.rejected for piece in self.pieces),
            iterations=sum(piece.iterations for piece in self.pieces),
            jacobians=sum(piece.jacobians for piece in self.pieces),
            factorizations=self.moving.factorizations,
            seconds=seconds,
        )
        return Simulation(
            chain=self.chain,
            times=times,
            work=work[:-1],
            dissipated=work[-1],
            drift=drift,
            statistics=statistics,
            **joined,
        )
