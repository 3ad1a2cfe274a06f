"""Solve a sequence of stages and replay it on B21 and on the full model, lock by lock."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PPoly

from models.ancf.analysis import LockedRun, run_and_lock
from models.ancf.joints import Joint, Torque
from models.arm.lock import lock_reduced, released
from models.arm.reduced_simulation import simulate_reduced
from ocp import OcpError, Trajectory, solve
from studies.arm.optimal.motion import polynomial, torque_joints
from studies.arm.optimal.phase import ArmPhase
from studies.arm.optimal.solver import sequence_mesh, settings, stage_mesh
from studies.arm.questions.sequence.problem import (
    SMOOTHING,
    Least,
    Sequence,
    SequencePhases,
    sequence_problem,
    stage_alone,
)
from studies.arm.replay.full_model import ELEMENTS, SMOOTH
from studies.arm.search_limits import (
    ITERATIONS,
    LIGHTER_SMOOTHING,
    SEQUENCE_INTERVALS,
    SEQUENCE_ITERATIONS,
)
from studies.arm.stage import ELBOW, ROOT
from studies.common.exit_codes import ExitCode, StudyError

Progress = Callable[[str], None]
_TOLERANCE = 1e-10  # of the replay on B21
_SAMPLES = 1001  # even instants of a replay
_DENSE = 40 * _SAMPLES  # instants at which a peak is looked for
_DWELL_SAMPLES = 101


@dataclass(frozen=True, eq=False)
class OptimalSequence:
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
        return self._torque(self.phases.first, ROOT), self._torque(self.phases.second, ELBOW)

    def _torque(self, arm: ArmPhase, joint: int) -> PPoly:
        law = polynomial(self.trajectory.phase(arm.phase.name), arm.torque[joint].name)
        return PPoly(law.c, law.x - law.x[0])

    @property
    def drives(self) -> tuple[Torque, Torque]:
        """The same as drives of root and elbow."""
        root, elbow = self.torques
        return (
            torque_joints({ROOT: root}, root.x[-1])[ROOT],
            torque_joints({ELBOW: elbow}, elbow.x[-1])[ELBOW],
        )

    @property
    def durations(self) -> tuple[float, float, float]:
        """Big arm, dwell, small arm [s]."""
        big, dwell, small = (p.end - p.start for p in self.trajectory.phases)
        return big, dwell, small

    @property
    def moving_time(self) -> float:
        """Time of both motions [s]."""
        return self.durations[0] + self.durations[2]

    @property
    def rigid_bound(self) -> float:
        """Least common peak torque of a rigid arm in this time, with the best split [N m]."""
        return self.case.rigid_bound * (self.case.moving_time / self.moving_time) ** 2

    @property
    def peaks(self) -> tuple[float, float]:
        """Largest absolute torque of root and elbow, between the points too [N m]."""
        root, elbow = (
            float(np.abs(law(np.linspace(law.x[0], law.x[-1], _DENSE))).max())
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
    def root_miss(self) -> float:
        """Angle miss of the root at its lock [rad]."""
        return abs(self.first.engagement.miss[ROOT])

    @property
    def elbow_miss(self) -> float:
        """Angle miss of the elbow at its lock [rad]."""
        return abs(self.second.engagement.miss[ELBOW])


def solve_sequence(
    case: Sequence,
    least: Least = "peak-torque",
    cap: float | None = None,
    *,
    intervals: tuple[int, int, int] = SEQUENCE_INTERVALS,
    guess: Trajectory | None = None,
    left: float | None = None,
    smoothing: float = SMOOTHING,
    progress: Progress | None = None,
) -> OptimalSequence:
    """Solve the three phases at once; `left` as in `sequence_problem`.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    stated, phases = sequence_problem(case, least, cap, left, smoothing)

    # the small arm has to calm what the first lock may leave
    iterations = ITERATIONS if left is None else SEQUENCE_ITERATIONS
    try:
        solution = solve(
            stated,
            settings=settings(iterations=iterations),
            mesh=sequence_mesh(intervals),
            guess=guess,
            progress=progress,
        )
    except OcpError as error:
        raise StudyError(f"no sequence was found: {error}", ExitCode.NOT_SOLVED) from error
    return OptimalSequence(case, solution.trajectory, phases, solution.objective)


def alone(case: Sequence, cap: float, progress: Progress | None = None) -> tuple[float, float]:
    """Least durations of both stages under a cap, each a problem of its own [s]."""
    durations = []
    stages = (case.first, SEQUENCE_INTERVALS[0]), (case.second, SEQUENCE_INTERVALS[2])
    for stage, intervals in stages:
        stated = stage_alone(stage, cap, case.moving_time)
        mesh = stage_mesh("time", intervals)
        solution = solve(stated, settings=settings(), mesh=mesh, progress=progress)
        durations.append(solution.trajectory.phases[0].end)
    return durations[0], durations[1]


def replay_sequence(solved: OptimalSequence, elements: int = ELEMENTS) -> SequenceReplay:
    """Both motions on the full model, each from the state that the one before left."""
    case, (big_time, _, small_time) = solved.case, solved.durations
    lock, released_at = np.cumsum(solved.durations)[:2]
    root, elbow = solved.drives

    # the big arm, locked at the root and followed through the dwell
    first = run_and_lock(
        case.first.arm.chain(elements),
        case.first.full_joints({ROOT: root}),
        case.first.start_state(elements),
        np.linspace(0.0, big_time, _SAMPLES),
        [ROOT],
        targets={ROOT: case.first.end[ROOT]},
        after=np.linspace(lock, released_at, _DWELL_SAMPLES),
        settings=SMOOTH,
    )
    assert first.after is not None

    # the small arm, from the state in which the dwell ends
    clamped_root = first.engagement.joints[ROOT]
    joints: list[Joint] = [clamped_root, elbow]
    second = run_and_lock(
        case.first.arm.chain(elements),
        joints,
        first.after.final,
        np.linspace(0.0, small_time, _SAMPLES),
        [ELBOW],
        targets={ELBOW: case.second.end[ELBOW]},
        settings=SMOOTH,
    )
    return SequenceReplay(
        first=first,
        second=second,
        at_lock=first.residual_energy,
        at_end=second.residual_energy,
        reduced=replay_reduced(solved),
    )


def replay_reduced(solved: OptimalSequence) -> tuple[float, float]:
    """Energies right after both locks on B21, by an explicit method of order 8 [J]."""
    case, (big_time, dwell, small_time) = solved.case, solved.durations
    root, elbow = solved.drives

    # big arm, up to the lock of the root
    model = case.first.model
    run = simulate_reduced(
        model,
        model.at(*case.first.start),
        np.array([0.0, big_time]),
        root=root,
        tolerance=_TOLERANCE,
    )
    still, q, v = lock_reduced(model, run.q[:, -1], run.v[:, -1], root=True)
    after_first = sum(float(energy) for energy in still.energies(q, v))

    # locked, then released at the elbow
    run = simulate_reduced(still, q, np.array([0.0, dwell]), v=v, tolerance=_TOLERANCE)
    free = dataclasses.replace(case.second.model, root_lock=still.root_lock)
    q, v = released(still, free, run.q[:, -1], run.v[:, -1])

    # small arm, up to the lock of the elbow
    run = simulate_reduced(
        free, q, np.array([0.0, small_time]), v=v, elbow=elbow, tolerance=_TOLERANCE
    )
    end, q, v = lock_reduced(free, run.q[:, -1], run.v[:, -1], elbow=True)
    return after_first, sum(float(energy) for energy in end.energies(q, v))


def lighter_smoothing(
    solved: OptimalSequence, progress: Progress | None = None
) -> list[tuple[float, OptimalSequence]]:
    """Weights of the smoothness that count less and less, and the sequences that they give.

    Raises
    ------
    StudyError
        If the solver finds no such motion.
    """
    sequences: list[tuple[float, OptimalSequence]] = []
    guess = solved.trajectory
    for part in LIGHTER_SMOOTHING:
        weight = part * SMOOTHING
        lighter = solve_sequence(solved.case, guess=guess, smoothing=weight, progress=progress)
        guess = lighter.trajectory
        sequences.append((weight, lighter))
    return sequences
