"""Solve a sequence of stages as one problem."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PPoly

from models.ancf.joints import Torque
from ocp import Interrupted, OcpError, Solution, Trajectory, solve
from ocp.arrays import Array
from studies.arm.optimal.finished_solves import Solve
from studies.arm.optimal.motion import polynomial, torque_joints
from studies.arm.optimal.phase import ArmPhase
from studies.arm.optimal.solve import in_words
from studies.arm.optimal.solver import sequence_mesh, settings, stage_mesh
from studies.arm.questions.sequence.problem import (
    SMOOTHING,
    Least,
    Sequence,
    SequencePhases,
    StatedSequence,
    sequence_problem,
    stage_alone,
)
from studies.arm.search_limits import (
    BARRIERS,
    ITERATIONS,
    SEQUENCE_INTERVALS,
    SEQUENCE_ITERATIONS,
)
from studies.arm.stage import ELBOW, ROOT
from studies.common.exit_codes import ExitCode, StudyError

Progress = Callable[[str], None]
Aims = tuple[Array, Array]
"""Where both motions end beside rest, see `studies.arm.optimal.aim`."""
Size = tuple[int, int, int]
"""Intervals of big arm, dwell and small arm."""
_DENSE = 40 * 1001  # instants at which a peak is looked for


@dataclass(frozen=True, eq=False)
class SequenceLaw:
    """What is driven in a sequence, and when: all that its replays need.

    Attributes
    ----------
    case : Sequence
    durations : of big arm, dwell and small arm [s].
    torques : of root and elbow over the time since their stage began [N m].
    """

    case: Sequence
    durations: tuple[float, float, float]
    torques: tuple[PPoly, PPoly]

    @property
    def drives(self) -> tuple[Torque, Torque]:
        """The torques as drives of root and elbow."""
        root, elbow = self.torques
        return (
            torque_joints({ROOT: root}, root.x[-1])[ROOT],
            torque_joints({ELBOW: elbow}, elbow.x[-1])[ELBOW],
        )


@dataclass(frozen=True, eq=False)
class OptimalSequence:
    """A solved sequence.

    Attributes
    ----------
    stated : the problem that was solved.
    solution : of the solver.
    weight : of the smoothness in what was minimised.
    """

    stated: StatedSequence
    solution: Solution
    weight: float

    @property
    def case(self) -> Sequence:
        """As it was stated."""
        return self.stated.case

    @property
    def trajectory(self) -> Trajectory:
        """Of the three phases."""
        return self.solution.trajectory

    @property
    def phases(self) -> SequencePhases:
        """With the signals of the trajectory."""
        return self.stated.phases

    @property
    def intervals(self) -> Size:
        """Of the mesh."""
        big, dwell, small = (len(p.breakpoints) - 1 for p in self.trajectory.phases)
        return big, dwell, small

    @property
    def objective(self) -> float:
        """What is least, without the smoothness, over that of the rigid arm or of the guess."""
        if self.stated.least == "time":
            return self.moving_time / self.case.moving_time
        return max(self.peaks) / self.rigid_bound

    @cached_property
    def torques(self) -> tuple[PPoly, PPoly]:
        """Root's and elbow's torque over the time since their stage began."""
        return self._torque(self.phases.first, ROOT), self._torque(self.phases.second, ELBOW)

    def _torque(self, arm: ArmPhase, joint: int) -> PPoly:
        law = polynomial(self.trajectory.phase(arm.phase.name), arm.torque[joint].name)
        return PPoly(law.c, law.x - law.x[0])

    @property
    def law(self) -> SequenceLaw:
        """What is driven and when."""
        return SequenceLaw(self.case, self.durations, self.torques)

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


def solve_sequence(
    case: Sequence,
    least: Least = "peak-torque",
    cap: float | None = None,
    *,
    intervals: Size = SEQUENCE_INTERVALS,
    guess: Trajectory | None = None,
    left: float | None = None,
    smoothing: float = SMOOTHING,
    progress: Progress | None = None,
    solver: Solve = solve,
) -> OptimalSequence:
    """Solve the three phases at once; `left` as in `sequence_problem`.

    `solver` takes the place of `ocp.solve`, see `finished_solves`.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    stated = sequence_problem(case, least, cap, left)
    # the small arm has to calm what the first lock may leave
    iterations = ITERATIONS if left is None else SEQUENCE_ITERATIONS
    aims = np.zeros(2 * case.first.model.size), np.zeros(2 * case.second.model.size)
    return solved_from(stated, smoothing, aims, intervals, guess, progress, iterations, solver)


def solved_from(
    stated: StatedSequence,
    weight: float,
    aims: Aims,
    intervals: Size,
    guess: Solution | Trajectory | None,
    progress: Progress | None,
    iterations: int = ITERATIONS,
    solver: Solve = solve,
) -> OptimalSequence:
    """Solve a stated sequence at a weight of the smoothness and aims.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    failure: StudyError | None = None
    # A guess is near: the adaptive barrier keeps it so. The monotone one begins as if nothing were
    # known, and lightly smoothed torques then go astray, or come back after many iterations.
    for barrier in BARRIERS:
        try:
            with _failures_of("sequence"):
                solution = solver(
                    stated.problem,
                    settings=settings(barrier, iterations),
                    mesh=sequence_mesh(intervals),
                    guess=guess,
                    constants=stated.constants(weight, aims),
                    progress=progress,
                )
        except StudyError as error:
            failure = error
            continue
        return OptimalSequence(stated, solution, weight)

    assert failure is not None
    raise failure


def alone(
    case: Sequence, cap: float, progress: Progress | None = None, solver: Solve = solve
) -> tuple[float, float]:
    """Least durations of both stages under a cap [N m], each a problem of its own [s].

    Raises
    ------
    StudyError
        If the solver finds no motion of a stage.
    """
    durations = []
    stages = (case.first, SEQUENCE_INTERVALS[0]), (case.second, SEQUENCE_INTERVALS[2])
    for stage, intervals in stages:
        stated = stage_alone(stage, cap, case.moving_time)
        mesh = stage_mesh("time", intervals)
        with _failures_of(f"motion of the {stage.name} arm alone"):
            solution = solver(stated, settings=settings(), mesh=mesh, progress=progress)
        durations.append(solution.trajectory.phases[0].end)
    return durations[0], durations[1]


@contextmanager
def _failures_of(what: str) -> Iterator[None]:
    """Say of what a solve has failed, and let Ctrl-C end the study."""
    try:
        yield
    except Interrupted as error:
        raise KeyboardInterrupt from error
    except OcpError as error:
        raise StudyError(f"no {what} was found: {in_words(error)}", ExitCode.NOT_SOLVED) from error
