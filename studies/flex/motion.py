"""The motion of a case: simulated piece by piece, with the locks and latches between the pieces.

A lock acts immediately at the angle reached. Positions are continuous. Of the velocities that all
joints allow, those after a lock are nearest to those before in the sense of the kinetic energy:
`J^T M (J zdot + x_t - v) = 0`, with `x_t` the velocity that driven joints impose.

Symbols: q, v node vectors and rates (size, m); L joints; m instants.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from models.ancf.analysis import project
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation, simulate
from models.ancf.joints import Joint, Locked, joint_angles, joint_rates
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState
from models.errors import ModelError
from ocp.arrays import Array
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.flex.build import FlexChain
from studies.flex.config import Form

APPROACH = 65  # instants between which the path to a latch is interpolated
SAME_TIME = 1e-9  # [s]; events closer than this are simultaneous


@dataclass(frozen=True)
class LockEvent:
    """A joint that locked.

    Attributes
    ----------
    time : [s]
    joint : its place.
    by : "latch" or "time".
    angle : reached [rad].
    lost : kinetic energy that the lock took [J].
    """

    time: float
    joint: int
    by: str
    angle: float
    lost: float


@dataclass(frozen=True, eq=False)
class ChainMotion:
    """The motion of a case in one form of the equations.

    Attributes
    ----------
    chain : Chain
    form : of the equations.
    times : (m,) [s]; an event is there twice, before and after it.
    q, v : (size, m)
    angles, torques, work : of the joints, (L, m) [rad, N m, J].
    kinetic, strain, gravity, dissipated, lost : energies, (m,) [J]; the last two since the start.
    violation : largest gap of the constraints, (m,) [m].
    drift : largest energy defect of all pieces [J].
    events : locks, in order.
    joints : as they are at the end.
    steps : of the integrator.
    """

    chain: Chain
    form: Form
    times: Array
    q: Array
    v: Array
    angles: Array
    torques: Array
    work: Array
    kinetic: Array
    strain: Array
    gravity: Array
    dissipated: Array
    lost: Array
    violation: Array
    drift: float
    events: tuple[LockEvent, ...]
    joints: tuple[Joint, ...]
    steps: int

    @property
    def balance(self) -> Array:
        """Energy that should be constant, (m,) [J]."""
        energy = self.kinetic + self.strain + self.gravity
        return np.asarray(energy - self.work.sum(axis=0) + self.dissipated + self.lost)

    @property
    def scale(self) -> float:
        """The scale of its energy errors: the largest energy of the motion [J]."""
        ranges = [float(self.kinetic.max()), float(np.ptp(self.gravity))]
        return max(*ranges, float(self.strain.max()), 1e-300)

    def end(self, link: int) -> Array:
        """Path (2, m) [m] of a link's end."""
        return self.q[list(self.chain.slots(link, -1)[:2])]


@dataclass
class _Pieces:
    """Pieces of a motion, and the values at the end of the last piece."""

    parts: list[dict[str, Array]] = field(default_factory=list)
    angles: Array = field(default_factory=lambda: np.zeros(0))  # at the end of the last piece
    work: Array = field(default_factory=lambda: np.zeros(0))
    dissipated: float = 0.0
    lost: float = 0.0
    drift: float = 0.0
    steps: int = 0

    def followed(self, run: Simulation) -> Array:
        """Joint angles of a run that continue those before it, (L, m) [rad]."""
        angles = run.joint_angles()
        turns = np.round((self.angles - angles[:, 0]) / (2 * np.pi))
        return np.asarray(angles + 2 * np.pi * turns[:, None])

    def add(self, run: Simulation, until: int | None = None) -> None:
        """Append the instants of a run, all or those before the place `until`."""
        part = slice(0, until)
        angles = self.followed(run)[:, part]
        work = self.work[:, None] + run.work[:, part]
        dissipated = self.dissipated + run.dissipated[part]
        self.parts.append(
            {
                "times": run.times[part],
                "q": run.q[:, part],
                "v": run.v[:, part],
                "angles": angles,
                "torques": run.torque[:, part],
                "work": work,
                "kinetic": run.kinetic[part],
                "strain": run.strain[part],
                "gravity": run.gravity[part],
                "dissipated": dissipated,
                "lost": np.full(angles.shape[1], self.lost),
                "violation": run.violation[part],
            }
        )
        self.angles, self.work = angles[:, -1], work[:, -1]
        self.dissipated = float(dissipated[-1])
        self.drift = max(self.drift, run.drift)
        self.steps += run.statistics.steps

    def joined(self) -> dict[str, Array]:
        """All pieces in order."""
        return {
            name: np.concatenate([part[name] for part in self.parts], axis=-1)
            for name in self.parts[0]
        }


def move(flex: FlexChain, form: Form, console: Console) -> ChainMotion:
    """Simulate a case.

    Raises
    ------
    StudyError
        If a step of the integrator fails.
    """
    try:
        return _Mover(flex, form, console).run()
    except ModelError as error:
        raise StudyError(f"the simulation failed: {error}", ExitCode.NOT_SOLVED) from error


class _Mover:
    """A motion in the making; `run` is the only entry."""

    def __init__(self, flex: FlexChain, form: Form, console: Console) -> None:
        study = flex.study
        self.flex, self.form, self.console = flex, form, console
        self.end = study.time
        self.grid = np.linspace(0.0, self.end, study.samples)
        self.joints = list(flex.joints)
        self.events: list[LockEvent] = []
        self.pieces = _Pieces(angles=flex.angles, work=np.zeros(len(flex.joints)))

        cases = list(enumerate(study.joint))
        self.locks = {k: c.lock_time / study.pace for k, c in cases if c.lock_time is not None}
        self.latches = {k: math.radians(c.latch_deg) for k, c in cases if c.latch_deg is not None}

    def run(self) -> ChainMotion:
        """Simulate to the end."""
        t, state = 0.0, self.flex.state
        while self.end - t > SAME_TIME:
            due = [time for time in self.locks.values() if time < self.end + SAME_TIME]
            until = min([self.end, *due])
            if until - t > SAME_TIME:
                t, state, caught = self._piece(t, until, state)
            else:
                caught = []
            due_now = [k for k, time in self.locks.items() if time - t < SAME_TIME]
            if caught or due_now:
                state = self._lock(t, state, caught, due_now)
        return ChainMotion(
            chain=self.flex.chain,
            form=self.form,
            drift=self.pieces.drift,
            events=tuple(self.events),
            joints=tuple(self.joints),
            steps=self.pieces.steps,
            **self.pieces.joined(),
        )

    def _simulate(self, state: NodalState, times: Array) -> Simulation:
        alpha = self.flex.study.stabilisation
        return simulate(
            self.flex.chain,
            self.joints,
            state,
            times,
            settings=self.flex.settings,
            form=self.form,
            stabilisation=(alpha, alpha),
        )

    def _piece(
        self, t: float, until: float, state: NodalState
    ) -> tuple[float, NodalState, list[int]]:
        """Move until a time or the first latch; time and state then, and the joints caught."""
        self.console.progress(f"{self.form} form from {t:.4g} s")
        inside = self.grid[(self.grid > t + SAME_TIME) & (self.grid < until - SAME_TIME)]
        run = self._simulate(state, np.array([t, *inside, until]))
        first = self._first_catch(run)
        if first is None:
            self.pieces.add(run)
            return until, self._kept(run.final, until), []

        place, joint = first
        before = NodalState(run.q[:, place], run.v[:, place])
        if place:
            self.pieces.add(run, place + 1)
        return self._approach(run, place, joint, before)

    def _first_catch(self, run: Simulation) -> tuple[int, int] | None:
        """The last instant before the first latch, and its joint."""
        angles = self.pieces.followed(run)
        found = []
        for joint, target in self.latches.items():
            side = np.sign(self.flex.angles[joint] - target)
            beyond = np.flatnonzero(side * (angles[joint] - target) <= 0.0)
            if beyond.size:
                found.append((max(int(beyond[0]) - 1, 0), joint))
        return min(found, default=None)

    def _approach(
        self, run: Simulation, place: int, joint: int, state: NodalState
    ) -> tuple[float, NodalState, list[int]]:
        """Find the instant of a latch between two outputs, and move up to it."""
        from scipy.interpolate import CubicHermiteSpline

        t = float(run.times[place])
        near = self._simulate(
            self._kept(state, t), np.linspace(t, float(run.times[place + 1]), APPROACH)
        )
        target = self.latches[joint]
        path = self.pieces.followed(near)[joint] - target
        rates = joint_rates(self.flex.chain, near.q, near.v)[joint]
        roots = CubicHermiteSpline(near.times, path, rates).roots(extrapolate=False)
        caught = float(roots[0]) if len(roots) else float(near.times[-1])

        if caught - t > SAME_TIME:
            last = self._simulate(self._kept(state, t), np.array([t, caught]))
            self.pieces.add(last)
            state = last.final
        return caught, self._kept(state, caught), [joint]

    def _kept(self, state: NodalState, t: float) -> NodalState:
        """A state with the constraints met to rounding, which the form may violate slightly."""
        form = MinimalCoordinates(self.flex.chain, self.joints)
        z, v = form.coordinates(t, state.q, state.v)
        q, rate = form.nodes(np.full(1, t), z[:, None], v[:, None])
        return NodalState(q[:, 0], rate[:, 0])

    def _lock(
        self, t: float, state: NodalState, caught: Iterable[int], due: Iterable[int]
    ) -> NodalState:
        """Lock joints at the angles they have; the state right after."""
        reached = joint_angles(self.flex.chain, state.q[:, None])[:, 0]
        by = {**dict.fromkeys(due, "time"), **dict.fromkeys(caught, "latch")}
        for joint in by:
            self.joints[joint] = Locked(float(reached[joint]))
            self.locks.pop(joint, None)
            self.latches.pop(joint, None)

        form = MinimalCoordinates(self.flex.chain, self.joints)
        mass, instant = dense(form.assembly.mass), np.full(1, t)
        z, _ = form.coordinates(t, state.q, state.v)
        still = np.zeros((z.size, 1))
        imposed = form.motion(instant, z[:, None], still, still)[1][:, 0]
        velocity = form.assembly.gather(state.v)
        after, _ = project(form, state, t, mass @ (velocity - imposed))

        def energy(v: Array) -> float:
            rate = form.assembly.gather(v)
            return float(rate @ mass @ rate) / 2

        lost = energy(state.v) - energy(after.v)
        self.pieces.lost += lost
        for number, (joint, why) in enumerate(by.items()):
            angle = float(self.pieces.angles[joint])
            self.events.append(LockEvent(t, joint, why, angle, lost if number == 0 else 0.0))
        return after
