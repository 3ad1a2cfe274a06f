"""Solve a sequence of stages and replay it on B21 and on the full model, lock by lock."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from models.ancf.analysis import LockedRun, run_and_lock
from models.ancf.joints import Joint
from models.arm.reduced import COORDINATES, ReducedArm
from models.arm.reduced_simulation import lock_reduced, simulate_reduced
from ocp import Mesh, OcpError, Problem, Trajectory, solve
from studies.arm.optimal.mesh import graded
from studies.arm.optimal.phase import ArmPhase, Limits, arm_phase, smoothness, starting_law
from studies.arm.optimal.solve import Progress, polynomial, settings, torque_joints
from studies.arm.questions.sequence.problem import (
    SMOOTHING,
    Least,
    Sequence,
    SequencePhases,
    meshes,
    sequence_problem,
    window,
)
from studies.arm.replay.full import ELEMENTS, SMOOTH
from studies.arm.stage import ELBOW, ROOT
from studies.common.exit_codes import ExitCode, StudyError

Array = NDArray[np.float64]
INTERVALS = (150, 10, 200)  # of the three phases
_TOLERANCE = 1e-10  # of the replay on B21
_SAMPLES = 1001
_LONG = 400  # iterations where the small arm must calm what the first lock leaves


@dataclass(frozen=True, eq=False)
class SolvedSequence:
    """A solved sequence.

    Attributes
    ----------
    case : Sequence
    trajectory : of the three phases.
    phases : SequencePhases
    objective : in units of the rigid bound, or of the moving time of the statement.
    """

    case: Sequence
    trajectory: Trajectory
    phases: SequencePhases
    objective: float

    @cached_property
    def torques(self) -> tuple[PPoly, PPoly]:
        """Root's and elbow's torque over the time since their stage began."""
        return tuple(
            _torque(self.trajectory, arm, k)
            for arm, k in ((self.phases.first, ROOT), (self.phases.second, ELBOW))
        )

    @property
    def durations(self) -> tuple[float, float, float]:
        """Big arm, dwell, small arm [s]."""
        big, dwell, small = (p.end - p.start for p in self.trajectory.phases)
        return big, dwell, small

    @property
    def peaks(self) -> tuple[float, float]:
        """Largest absolute torque of root and elbow, between the points too [N m]."""
        root, elbow = (
            float(np.abs(law(np.linspace(law.x[0], law.x[-1], 40 * _SAMPLES))).max())
            for law in self.torques
        )
        return root, elbow


@dataclass(frozen=True, eq=False)
class SequenceReplay:
    """A sequence on the full model.

    Attributes
    ----------
    first, second : runs of both motions with their locks.
    at_lock, at_end : elastic energy right after the first and the last lock [J].
    reduced : the same on B21 (2,) [J].
    """

    first: LockedRun
    second: LockedRun
    at_lock: float
    at_end: float
    reduced: tuple[float, float]

    @property
    def miss(self) -> float:
        """Largest angle miss at a lock [rad]."""
        runs = self.first, self.second
        return max(abs(x) for run in runs for x in run.engagement.miss.values())


def _torque(trajectory: Trajectory, arm: ArmPhase, joint: int) -> PPoly:
    law = polynomial(trajectory.phase(arm.phase.name), arm.torque[joint].name)
    return PPoly(law.c, law.x - law.x[0])


def solve_sequence(
    case: Sequence, least: Least = "peak-torque", cap: float | None = None, *,
    intervals: tuple[int, int, int] | None = None, guess: Trajectory | None = None,
    left: float | None = None, smoothing: float = SMOOTHING, progress: Progress | None = None,
) -> SolvedSequence:  # fmt: skip
    """Solve the three phases at once; `left` as in `sequence_problem`.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    stated, phases = sequence_problem(case, least, cap, left, smoothing)
    mesh, chosen = meshes(intervals or INTERVALS), settings()
    if left is not None:
        chosen = settings(max_iterations=_LONG)
    try:
        found = solve(stated, settings=chosen, mesh=mesh, guess=guess, progress=progress)
    except OcpError as error:
        raise StudyError(f"no sequence was found: {error}", ExitCode.NOT_SOLVED) from error
    return SolvedSequence(case, found.trajectory, phases, found.objective)


def alone(case: Sequence, cap: float, progress: Progress | None = None) -> tuple[float, float]:
    """Least durations of both stages under a cap, each a problem of its own [s]."""
    out = []
    for stage, count in ((case.first, INTERVALS[0]), (case.second, INTERVALS[2])):
        limits = Limits((cap, cap))
        arm = arm_phase(stage, limits, end=window(stage.duration, stage.duration),
                        law=starting_law(stage, limits))  # fmt: skip
        best = arm.phase.duration / case.moving_time + SMOOTHING * smoothness(arm, stage)
        stated = Problem(f"{stage.name} arm alone", [arm.phase], minimise=best, bounds=arm.bounds)
        found = solve(stated, settings=settings(), mesh=Mesh((graded(count),)),
                             progress=progress)  # fmt: skip
        out.append(found.trajectory.phases[0].end)
    return out[0], out[1]


def replay_sequence(solved: SolvedSequence, elements: int = ELEMENTS) -> SequenceReplay:
    """Both motions on the full model, each from the state that the one before left."""
    case = solved.case
    ends = np.cumsum(solved.durations)
    chain = case.first.arm.chain(elements)
    drives = [torque_joints({k: law}, law.x[-1])[k]
              for k, law in zip((ROOT, ELBOW), solved.torques, strict=True)]  # fmt: skip
    first = run_and_lock(
        chain, case.first.full_joints({ROOT: drives[0]}), case.first.start_state(elements),
        np.linspace(0.0, ends[0], _SAMPLES), [ROOT], targets={ROOT: case.first.end[ROOT]},
        after=np.linspace(ends[0], ends[1], 101), settings=SMOOTH,
    )  # fmt: skip
    assert first.after is not None
    clamp = first.engagement.joints[ROOT]
    joints: list[Joint] = [clamp, drives[1]]
    second = run_and_lock(
        chain, joints, first.after.final, np.linspace(0.0, solved.durations[2], _SAMPLES),
        [ELBOW], targets={ELBOW: case.second.end[ELBOW]}, settings=SMOOTH,
    )  # fmt: skip
    return SequenceReplay(first, second, first.residual_energy, second.residual_energy,
                          replay_reduced(solved))  # fmt: skip


def replay_reduced(solved: SolvedSequence) -> tuple[float, float]:
    """Energies right after both locks on B21, by an explicit method of order 8 [J]."""
    case, (t1, pause, t3) = solved.case, solved.durations
    drive = [torque_joints({k: law}, law.x[-1])[k]
             for k, law in zip((ROOT, ELBOW), solved.torques, strict=True)]  # fmt: skip
    model = case.first.model
    run = simulate_reduced(model, model.at(*case.first.start), np.array([0.0, t1]),
                           root=drive[0], tolerance=_TOLERANCE)  # fmt: skip
    still, q, v = lock_reduced(model, run.q[:, -1], run.v[:, -1], root=True)
    left = sum(float(e) for e in still.energies(q, v))
    run = simulate_reduced(still, q, np.array([0.0, pause]), v=v, tolerance=_TOLERANCE)
    free = ReducedArm(case.second.arm, root_lock=still.root_lock)
    q, v = released(still, free, run.q[:, -1], run.v[:, -1])
    run = simulate_reduced(free, q, np.array([0.0, t3]), v=v, elbow=drive[1],
                           tolerance=_TOLERANCE)  # fmt: skip
    end, q, v = lock_reduced(free, run.q[:, -1], run.v[:, -1], elbow=True)
    return left, sum(float(e) for e in end.energies(q, v))


def released(still: ReducedArm, free: ReducedArm, q: Array, v: Array) -> tuple[Array, Array]:
    """Coordinates and rates with the elbow free, from those with it locked."""
    z, w = ca.SX.sym("z", still.size), ca.SX.sym("w", still.size)
    both = ca.Function("both", [z, w], [still.embed(z), ca.jtimes(still.embed(z), z, w)])
    rows = [COORDINATES.index(name) for name in free.coordinates]
    place, rate = (np.array(x.full())[rows, 0] for x in both(q, v))
    return place, rate
