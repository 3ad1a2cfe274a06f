"""Independent replay: the controls of a solution drive the stated dynamics again.

The replay starts at the initial state; its steps begin anew at the breakpoints, where the controls
may jump.  Where the motion amplifies errors more than `ocp.verification.error_growth.MOST` times,
the replay is
restarted from the solution's state, per phase or within one, and says so.  It uses the integrator
of `ocp.numerics.extrapolation` and its own compiled copy of the dynamics, unscaled and straight
from the
statement.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import signals_of
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.numerics.extrapolation import accumulated, extrapolated_step
from ocp.numerics.schemes import lagrange, scheme
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import time
from ocp.verification.error_growth import MOST, growth, segments, transitions

Array = NDArray[np.float64]
_SAMPLES = 8
_MOST = 4096


@dataclass(frozen=True, eq=False)
class PhaseReplay:
    """Replayed states of one phase.

    Attributes
    ----------
    times : (N, m + 1) times in each interval, both ends included [s].
    states : (N, m + 1, n_x) replayed states.
    miss : (n_x,) replayed end minus the solution's end, the largest of all segments.
    amplification : factor by which an error of the states can grow over the phase.
    restarts : how often the replay was set back to the solution's state for that reason, at the
        start of the phase included.
    worst : (n_x,) largest distance from the solution at any sample.
    error : float
        Largest estimated error of a step relative to the states' sizes.
    """

    name: str
    states_names: tuple[str, ...]
    times: Array
    states: Array
    miss: Array
    worst: Array
    error: float
    amplification: float = 1.0
    restarts: int = 0


@dataclass(frozen=True, eq=False)
class Replay:
    """Replays of all phases."""

    phases: tuple[PhaseReplay, ...]
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def miss(self) -> float:
        """Largest miss of an end state relative to the state's size."""
        return max(self._relative(p, p.miss) for p in self.phases)

    @property
    def worst(self) -> float:
        """Largest distance from the solution relative to the state's size."""
        return max(self._relative(p, p.worst) for p in self.phases)

    @property
    def amplification(self) -> float:
        """Largest factor by which the motion of a phase amplifies errors."""
        return max(p.amplification for p in self.phases)

    @property
    def restarts(self) -> int:
        """How often the replay was set back to the solution because of the amplification."""
        return sum(p.restarts for p in self.phases)

    def _relative(self, phase: PhaseReplay, values: Array) -> float:
        sizes = np.array([self.sizes[name] for name in phase.states_names])
        return float(np.max(np.abs(values) / sizes))


def replay(
    problem: Problem, trajectory: Trajectory, sizes: dict[str, float], tolerance: float = 1e-11
) -> Replay:  # fmt: skip
    """Replay all phases, each from where the one before it arrived.

    A state passes on the miss of the phase before it where the solution is continuous there.
    """
    done: list[PhaseReplay] = []
    grown = 1.0  # by how much an error of the last restart has been amplified since
    for phase in problem.phases:
        own = trajectory.phase(phase.name)
        rate = _dynamics(problem, phase, own, trajectory)
        scale = np.array([sizes[name] for name in own.states])
        phi = transitions(rate, own, scale)
        factor = growth(phi)
        grown *= factor
        restarted = bool(done) and grown > MOST
        if restarted:
            grown = factor
        carried = np.zeros(scale.size) if restarted or not done else _carried(
            own, trajectory, done[-1])  # fmt: skip
        parts = [_replay_segment(rate, own, here, carried if here.start == 0 else 0.0 * carried,
                                 scale, tolerance) for here in segments(phi)]  # fmt: skip
        done.append(_joined(own, parts, factor, restarted))
    return Replay(tuple(done), sizes)


def _carried(own: PhaseTrajectory, trajectory: Trajectory, before: PhaseReplay) -> Array:
    previous = trajectory.phase(before.name)
    last = previous.local(np.array([len(previous.breakpoints) - 2]), np.array([1.0]))[0]
    first = own.local(np.array([0]), np.array([0.0]))[0]
    carried = np.zeros(len(own.states))
    if not np.isclose(previous.end, own.start, rtol=1e-9, atol=1e-12):
        return carried
    for j, name in enumerate(own.states):
        if name in previous.states:
            i = previous.states.index(name)
            if np.isclose(last[i], first[j], rtol=1e-7, atol=1e-9):
                carried[j] = before.miss[i]
    return carried


def _replay_segment(
    rate: ca.Function, own: PhaseTrajectory, here: slice, carried: Array, scale: Array,
    tolerance: float,
) -> PhaseReplay:  # fmt: skip
    """Replay some intervals from the solution's state plus `carried`, in steps as needed."""
    k, n_x = np.arange(here.start, here.stop), len(own.states)
    start = own.local(k[:1], np.array([0.0]))[0, :n_x] + carried
    steps = _SAMPLES
    while True:
        states, error = _march(rate, own, here, start, scale, steps)
        if error <= tolerance or 2 * steps > _MOST:
            break
        steps *= 2
    states = states[:, :: steps // _SAMPLES]
    tau = np.linspace(0.0, 1.0, _SAMPLES + 1)
    times = own.breakpoints[k, None] + tau * np.diff(own.breakpoints)[k, None]
    planned = own.local(np.repeat(k, tau.size), np.tile(tau, k.size))[:, :n_x]
    gap = states - planned.reshape(states.shape)
    worst = np.abs(gap).reshape(-1, n_x).max(axis=0)
    return PhaseReplay(own.name, own.states, times, states, gap[-1, -1], worst, error)


def _joined(
    own: PhaseTrajectory, parts: list[PhaseReplay], factor: float, restarted: bool
) -> PhaseReplay:
    """The segments of one phase as one."""
    misses = np.array([p.miss for p in parts])
    largest = np.argmax(np.abs(misses), axis=0)
    return PhaseReplay(
        own.name, own.states, np.concatenate([p.times for p in parts]),
        np.concatenate([p.states for p in parts]), misses[largest, np.arange(largest.size)],
        np.max([p.worst for p in parts], axis=0), max(p.error for p in parts), factor,
        len(parts) - 1 + restarted,
    )  # fmt: skip


def _dynamics(
    problem: Problem, phase: Phase, own: PhaseTrajectory, trajectory: Trajectory
) -> ca.Function:
    """``(x, u, t) -> f`` with unknowns and constants put in; u are all signals but the states."""
    named = {s.name: s for s in signals_of(problem, phase)}
    x = [named[name].symbol for name in own.states]
    u = [named[name].symbol for name in own.signals[len(own.states) :]]
    fixed = [s.symbol for s in (*problem.unknowns, *problem.constants)]
    values = [trajectory.unknowns[s.name] for s in problem.unknowns]
    values += [trajectory.constants[s.name] for s in problem.constants]
    rates = ca.vertcat(*phase.dynamics.values())
    if fixed:
        rates = ca.substitute(rates, ca.vertcat(*fixed), ca.DM(values))
    empty = ca.SX(0, 1)
    return ca.Function(
        "dynamics", [ca.vertcat(*x), ca.vertcat(*u, empty), time.symbol], ca.cse([rates])
    )


def _march(
    rate: ca.Function, own: PhaseTrajectory, here: slice, start: Array, scale: Array, steps: int
) -> tuple[Array, float]:
    """States (m, steps + 1, n_x) of a march with equal steps in some intervals, and its error."""
    inputs, degree = _inputs(own)
    inputs = inputs[here]
    n_x, n_u, count = len(start), inputs.shape[1], inputs.shape[0]
    step = _step(rate, n_x, n_u, degree)
    per_step = np.repeat(inputs.reshape(count, -1), steps, axis=0)
    lengths = np.repeat(np.diff(own.breakpoints)[here], steps)
    data = np.column_stack([
        per_step, np.repeat(own.breakpoints[:-1][here], steps), lengths,
        np.tile(np.arange(steps) / steps, count), np.full(count * steps, 1.0 / steps),
    ])  # fmt: skip
    with np.errstate(all="ignore"):
        ends, errors = accumulated(step, count * steps)(start, data.T)
    ends, errors = np.array(ends).T, np.array(errors).T
    joints = np.vstack([start, ends])
    states = np.stack([
        joints[i : i + (count - 1) * steps + 1 : steps] for i in range(steps + 1)
    ], axis=1)  # fmt: skip
    relative = np.abs(errors) / scale
    error = float(relative.max()) if np.all(np.isfinite(relative)) else np.inf
    return states, error


def _step(rate: ca.Function, n_x: int, n_u: int, degree: int) -> ca.Function:
    kind = ca.SX if rate.n_instructions() < 2000 else ca.MX
    x, data = kind.sym("x", n_x), kind.sym("data", n_u * degree + 4)
    table = ca.reshape(data[: n_u * degree], degree, n_u)
    t, h, tau, span = ca.vertsplit(data[n_u * degree :])

    def slope(state: object, local: object) -> object:
        u = kind(0, 1)
        if n_u:
            s = tau + local
            value = table[degree - 1, :]
            for i in range(degree - 2, -1, -1):
                value = value * s + table[i, :]
            u = value.T
        return h * rate(state, u, t + (tau + local) * h)

    return ca.Function("step", [x, data], list(extrapolated_step(slope, x, span)))


def _inputs(own: PhaseTrajectory) -> tuple[Array, int]:
    """Power coefficients in local time of all signals but the states, (N, n_u, degree)."""
    count = len(own.breakpoints) - 1
    highest = max(int(own.degrees.max()) if own.polynomial or own.algebraics else 1,
                  2 if own.linear else 1)  # fmt: skip
    n_c, n_l, n_p = len(own.constant), len(own.linear), len(own.polynomial)
    table = np.zeros((count, n_c + n_l + n_p + len(own.algebraics), highest))
    table[:, :n_c, 0] = own.steps
    if n_l:
        table[:, n_c : n_c + n_l, 0] = own.ramps[:, 0]
        table[:, n_c : n_c + n_l, 1] = own.ramps[:, 1] - own.ramps[:, 0]
    if own.polynomial or own.algebraics:
        for piece in own.pieces:
            points = scheme(own.scheme, piece.degree).points
            powers = np.linalg.inv(np.vander(points, increasing=True))
            values = np.concatenate([piece.controls, piece.algebraics], axis=2)
            table[piece.intervals, n_c + n_l :, : piece.degree] = np.einsum(
                "ps,ksn->knp", powers, values)  # fmt: skip
    return table, highest


def replayed(trajectory: Trajectory, replays: Replay) -> Trajectory:
    """The trajectory with the replayed states in place of the solved ones.

    In every interval the states are the polynomial of degree `_SAMPLES` through the replay.
    """
    phases = []
    for own, done in zip(trajectory.phases, replays.phases, strict=True):
        method = scheme("radau", _SAMPLES)
        samples = np.linspace(0.0, 1.0, _SAMPLES + 1)
        states = np.einsum("sm,kmn->ksn", lagrange(samples, method.support), done.states)
        count = len(own.breakpoints) - 1
        k = np.repeat(np.arange(count), _SAMPLES)
        values = own.local(k, np.tile(method.points, count)).reshape(count, _SAMPLES, -1)
        n_s = len(own.states) + len(own.constant) + len(own.linear)
        controls = values[:, :, n_s : n_s + len(own.polynomial)]
        algebraics = values[:, :, n_s + len(own.polynomial) :]
        piece = replace(
            own.pieces[0], degree=_SAMPLES, intervals=np.arange(count), states=states,
            controls=controls, algebraics=algebraics,
        )  # fmt: skip
        phases.append(replace(own, scheme="radau", pieces=(piece,)))
    return replace(trajectory, phases=tuple(phases))
