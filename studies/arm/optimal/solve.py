"""Optimal motions of a stage: solved on B21, replayed on B21 and on the full model, refined.

Two misses are told apart: the mesh error is the residual energy of the replay on B21 by another
integrator (the collocation believes it is zero); the model error is that of the full model
against the replay on B21.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BPoly, PPoly

from models.ancf.joints import Driven, Joint, Torque
from models.arm.reduced import ReducedArm
from models.arm.reduced_simulation import ReducedMotion, lock_reduced, simulate_reduced
from ocp import FixedMesh, Ipopt, OcpError, PhaseTrajectory, Radau, Settings, Trajectory, solve
from ocp.nlp.ipopt import Barrier
from studies.arm.laws.unit_laws import quintic
from studies.arm.optimal.mesh import DEGREE, mesh_for
from studies.arm.optimal.objectives import first_duration, problem
from studies.arm.optimal.phase import ArmPhase, Limits, quasi_static
from studies.arm.replay.ensemble import follow
from studies.arm.replay.full import ELEMENTS, MODES, Drive, Motion, Replay, replay
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.common.exit_codes import ExitCode, StudyError

Array = NDArray[np.float64]
Progress = Callable[[str], None]
MESH = 150
ATTEMPTS: tuple[tuple[float, Barrier], ...] = (
    (1.0, "monotone"),
    (1.5, "adaptive"),
)  # mesh, barrier
PIVOTS = 1e-2  # of the linear solver: with its default the stiff modes spoil every step
_ROUNDING = 1e-5  # of the optimality conditions, whose multipliers the stiff modes make large
_LONGER, _LENGTHEN = 3, 1.15  # durations tried after the first before a least time is given up
ROUNDS = 3  # meshes, each twice as fine as the one before
AGREE = 0.1  # share of the full model's E_res that the mesh may add
FLOOR = 1e-9  # [J] below which both replays count as still
SAMPLES = 2001
BEND = 0.3  # [rad]; slopes of R (1 - psi^2/2, psi) are then right to a per mille
_INSTANTS = 51


@dataclass(frozen=True, eq=False)
class Solved:
    """A solved stage.

    Attributes
    ----------
    name : str
    stage : Stage
    trajectory : of the solver.
    arm : ArmPhase
    """

    name: str
    stage: Stage
    trajectory: Trajectory
    arm: ArmPhase

    @cached_property
    def torques(self) -> dict[int, PPoly]:
        """Torque of each driven joint as the exact piecewise polynomial of the solution."""
        return {
            k: polynomial(self.trajectory.phase(self.arm.phase.name), s.name)
            for k, s in self.arm.torque.items()
        }

    @property
    def peak_torque(self) -> Array:
        """Largest absolute torque of both joints (2,), between the points too [N m]."""
        t = np.linspace(0.0, self.stage.duration, 20 * SAMPLES)
        out = np.zeros(2)
        for k, law in self.torques.items():
            out[k] = np.abs(law(t)).max()
        return out

    @property
    def peak_rate(self) -> Array:
        """Largest absolute torque rate of both joints (2,) [N m/s]."""
        t = np.linspace(0.0, self.stage.duration, 20 * SAMPLES)
        out = np.zeros(2)
        for k, law in self.torques.items():
            out[k] = np.abs(law.derivative()(t)).max()
        return out

    @cached_property
    def reduced(self) -> ReducedMotion:
        """Replay on B21 by another integrator, explicit Runge-Kutta steps."""
        if len(self.stage.moving) > 1:
            return self.on(self.stage.model)
        return follow(self.motion("torque"), SAMPLES)

    def on(self, model: ReducedArm) -> ReducedMotion:
        """Replay on a reduced model by an explicit method of order 8."""
        joints = torque_joints(self.torques, self.stage.duration)
        return simulate_reduced(
            model,
            model.at(*self.stage.start),
            np.linspace(0.0, self.stage.duration, SAMPLES),
            root=joints.get(ROOT),
            elbow=joints.get(ELBOW),
            tolerance=1e-11,
        )

    @property
    def energy_on_B22(self) -> float:
        """E_res of the replay on B22, whose second link bends more freely [J]."""
        return reduced_residual(self.stage, self.on(self.stage.reduced(variant="B22")))

    @property
    def reduced_energy(self) -> float:
        """E_res of the replay on B21 [J]: the mesh error."""
        return reduced_residual(self.stage, self.reduced)

    def motion(self, drive: Drive) -> Motion:
        """The motion for the full model under either drive."""
        joints: dict[int, Joint]
        if drive == "torque":
            joints = dict(torque_joints(self.torques, self.stage.duration))
        else:
            joints = dict(angle_joints(self.reduced, self.torques))
        return Motion(self.name, drive, self.stage, joints)

    def replay(
        self, drive: Drive = "torque", *, elements: int = ELEMENTS, after: Array | None = None,
        modes: int = MODES,
    ) -> Replay:  # fmt: skip
        """On the full model, see `studies.arm.replay.full.replay`."""
        return replay(self.motion(drive), elements=elements, after=after, modes=modes)


def polynomial(own: PhaseTrajectory, state: str) -> PPoly:
    """A state of degree three or less in each interval."""
    x = own.breakpoints
    steps, nodes = np.diff(x), np.linspace(0.0, 1.0, 4)
    count = len(steps)
    table = own.local(np.repeat(np.arange(count), 4), np.tile(nodes, count))
    values = table[:, own.states.index(state)].reshape(count, 4)
    powers = np.linalg.solve(np.vander(nodes), values.T)
    return PPoly(powers / steps ** np.arange(3, -1, -1)[:, None], x)


def torque_joints(torques: dict[int, PPoly], end: float) -> dict[int, Torque]:
    """Torque laws; smooth enough that the integrator need not restart at the mesh."""

    def until_end(law: PPoly) -> Callable[[Array], Array]:
        return lambda t: np.where(t <= end, law(np.clip(t, 0.0, end)), 0.0)

    return {k: Torque(until_end(law)) for k, law in torques.items()}


def angle_joints(motion: ReducedMotion, torques: dict[int, PPoly]) -> dict[int, Driven]:
    """Joint angles of a motion of B21, interpolated with their first two derivatives."""
    model = motion.model
    n = model.size
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    angles = ca.vertcat(model.embed(q)[0], model.elbow_angle(q))
    rates = ca.jtimes(angles, q, v)
    accelerations = ca.jtimes(rates, q, v) + ca.jtimes(angles, q, a)
    f = ca.Function("angles", [q, v, a], [angles, rates, accelerations])
    drive = np.array([torques[k](motion.times) if k in torques else 0 * motion.times
                      for k in (ROOT, ELBOW)])  # fmt: skip
    m = len(motion.times)
    acc = model.dynamics.map(m)(motion.q, motion.v, drive)
    values = [x.full() for x in f.map(m)(motion.q, motion.v, acc)]
    found = {}
    for k in torques:
        table = np.stack([x[k] for x in values], axis=1)
        law = BPoly.from_derivatives(motion.times, table)
        found[k] = _driven(law, float(motion.times[-1]))
    return found


def _driven(law: BPoly, end: float) -> Driven:
    def at(order: int) -> Callable[[Array], Array]:
        curve = law if order == 0 else law.derivative(order)
        return lambda t: np.asarray(curve(np.clip(t, 0.0, end)))

    return Driven(at(0), at(1), at(2))


def reduced_residual(stage: Stage, motion: ReducedMotion) -> float:
    """E_res on B21 after locking the joints that turned [J]."""
    locked, q, v = lock_reduced(
        motion.model, motion.q[:, -1], motion.v[:, -1],
        root=ROOT in stage.moving, elbow=ELBOW in stage.moving,
    )  # fmt: skip
    return sum(float(e) for e in locked.energies(q, v))


def solve_stage(
    stage: Stage,
    *,
    limits: Limits | None = None,
    objective: str = "smoothest",
    intervals: int = MESH,
    guess: Trajectory | None = None,
    name: str = "optimum",
    progress: Progress | None = None,
) -> Solved:
    """Solve one stage on one mesh; the stage solved lasts what the solver chose.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    limits = limits or Limits()
    if objective == "time":
        guess = guess or in_enough_time(stage, limits, intervals, progress)
        stage = stage.lasting(guess.phases[0].end)
    else:
        check_bending(stage)
        check_caps(stage, limits)
    stated, arm = problem(stage, limits, objective)
    failure: OcpError | None = None
    for finer, barrier in ATTEMPTS:
        try:
            found = solve(
                stated, settings=settings(barrier), guess=guess, progress=progress,
                mesh=mesh_for(objective, round(finer * intervals)),
            ).trajectory  # fmt: skip
        except OcpError as error:
            failure = error
            continue
        return Solved(name, stage.lasting(found.phases[0].end), found, arm)
    raise StudyError(
        f"no motion of the stage '{stage.name}' was found: {failure}", ExitCode.NOT_SOLVED
    )


def in_enough_time(
    stage: Stage, limits: Limits, intervals: int, progress: Progress | None = None
) -> Trajectory:
    """The smoothest motion under the caps in a duration that is long enough: least time's start.

    Raises
    ------
    StudyError
        If none is found in the longest duration tried.
    """

    def in_time(at: Stage) -> Trajectory:
        return solve_stage(at, limits=limits, intervals=intervals, progress=progress).trajectory

    longer = stage.lasting(first_duration(stage, limits))
    for _ in range(_LONGER):
        with suppress(StudyError):
            return in_time(longer)
        longer = longer.lasting(_LENGTHEN * longer.duration)
    return in_time(longer)


def settings(barrier: Barrier = "monotone", max_iterations: int = 120) -> Settings:
    """For stiff elastic modes; the mesh is stated beside, the study verifies by its own replays."""
    solver = Ipopt(
        tolerance=1e-8,
        dual_tolerance=_ROUNDING,
        constraint_violation=1e-9,
        max_iterations=max_iterations,
        barrier=barrier,
        pivot_tolerance=PIVOTS,
    )
    return Settings(scheme=Radau(DEGREE), refinement=FixedMesh(), solver=solver, verify=False)


def check_bending(stage: Stage) -> None:
    """Refuse a motion that bends the links beyond what small rotations describe.

    Judged by the quintic step's inertia; links bend as 1/T^2.
    """
    t = np.linspace(0.0, stage.duration, _INSTANTS)
    q, _ = quasi_static(stage, quintic(stage.duration), t)
    lengths = {"delta1": stage.arm.big.length, "delta2": stage.arm.small.length, "psi1": 1.0}
    rows = zip(stage.model.coordinates, q, strict=True)
    bent = max(float(np.abs(x).max()) / lengths[n] for n, x in rows if n in lengths)
    if bent > BEND:
        raise StudyError(
            f"in {stage.duration:g} s the stage '{stage.name}' would bend a link by about "
            f"{bent:.2g} rad, and the reduced model holds up to {BEND:g} rad; give a duration of "
            f"{np.ceil(10 * stage.duration * (bent / BEND) ** 0.5) / 10:g} s, or a stiffer arm",
            ExitCode.INFEASIBLE,
        )


def check_caps(stage: Stage, limits: Limits) -> None:
    """Refuse a torque cap under which even the rigid arm cannot arrive, and say the least."""
    if len(stage.moving) > 1:
        return
    k = stage.moving[0]
    cap, rate = limits.torque[k], limits.rate[k]
    if cap is not None and cap <= 0:
        raise StudyError(f"the torque cap is {cap:g} N m; give a positive one")
    if cap is not None and stage.duration <= stage.least_duration(cap):
        raise StudyError(
            f"the stage '{stage.name}' lasts {stage.duration:g} s, but under {cap:g} N m even a "
            f"rigid arm takes more than {stage.least_duration(cap):.4g} s; give a longer duration "
            f"or a cap above {4 * stage.torque_units[k]:.4g} N m",
            ExitCode.INFEASIBLE,
        )
    least = 32.0 * stage.torque_units[k] / stage.duration
    if rate is not None and rate <= least:
        raise StudyError(
            f"the rate cap is {rate:g} N m/s, but even a rigid arm needs more than {least:.4g} "
            f"N m/s to turn in {stage.duration:g} s; raise the cap or the duration",
            ExitCode.INFEASIBLE,
        )


def capped(stage: Stage, factor: float) -> Limits:
    """Torque caps of a multiple of the joints' units."""
    caps = [factor * float(u) if k in stage.moving else None
            for k, u in enumerate(stage.torque_units)]  # fmt: skip
    return Limits(torque=(caps[0], caps[1]))


@dataclass(frozen=True, eq=False)
class Refined:
    """A motion whose mesh was refined until both replays agree.

    Attributes
    ----------
    solved : Solved
    replay : on the full model, torque drive.
    rounds : (intervals, E_res on B21, E_res on the full model) of each mesh [J].
    agrees : whether the mesh error is a small part of what is left.
    """

    solved: Solved
    replay: Replay
    rounds: tuple[tuple[int, float, float], ...]
    agrees: bool


def refine(
    solved: Solved, limits: Limits, *, objective: str = "smoothest", say: Progress | None = None
) -> Refined:
    """Double the mesh until the replays on B21 and on the full model agree in E_res."""
    rounds: list[tuple[int, float, float]] = []
    for again in range(ROUNDS):
        full = solved.replay()
        intervals = len(solved.trajectory.phases[0].breakpoints) - 1
        reduced = solved.reduced_energy
        rounds.append((intervals, reduced, full.residual_energy))
        if say is not None:
            say(f"{solved.stage.name}: {intervals} intervals leave {reduced:.2e} J on B21, "
                f"{full.residual_energy:.2e} J on the full model")  # fmt: skip
        agrees = reduced <= AGREE * full.residual_energy or (
            max(reduced, full.residual_energy) <= FLOOR
        )
        if agrees or again == ROUNDS - 1:
            break
        try:
            solved = solve_stage(
                solved.stage, limits=limits, objective=objective, intervals=2 * intervals,
                guess=solved.trajectory, name=solved.name,
            )  # fmt: skip
        except StudyError as error:
            if say is not None:
                say(f"the finer mesh was given up: {error}")
            break
    return Refined(solved, full, tuple(rounds), agrees)
