"""Replay a sequence of stages on B21 and on the full model, lock by lock."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from models.ancf.analysis import run_and_lock
from models.ancf.integrate import StepControl
from models.ancf.joints import Joint, Locked, Torque
from models.arm.lock import lock_reduced, released
from models.arm.reduced_simulation import simulate_reduced
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.questions.sequence.problem import Sequence
from studies.arm.questions.sequence.solve import SequenceLaw
from studies.arm.replay.full_model import (
    ELEMENTS,
    SAMPLES,
    LockedMotion,
    Motion,
    steps_for,
)
from studies.arm.replay.reduced_model import method_for
from studies.arm.stage import ELBOW, ROOT

_TOLERANCE = 1e-10  # of the replay on B21
_DWELL_SAMPLES = 101


@dataclass(frozen=True, eq=False)
class SequenceReplay:
    """A sequence on the full model.

    Attributes
    ----------
    first, second : both motions with their locks; the first is followed through the dwell.
    """

    first: LockedMotion
    second: LockedMotion

    @property
    def at_lock(self) -> float:
        """Elastic energy right after the first lock [J]."""
        return self.first.residual_energy

    @property
    def at_end(self) -> float:
        """The same after the last one [J]."""
        return self.second.residual_energy

    @property
    def left(self) -> float:
        """The larger of both [J]."""
        return max(self.at_lock, self.at_end)

    @property
    def root_miss(self) -> float:
        """Angle miss of the root at its lock [rad]."""
        return self.first.miss

    @property
    def elbow_miss(self) -> float:
        """Angle miss of the elbow at its lock [rad]."""
        return self.second.miss


def replay_sequence(
    law: SequenceLaw, elements: int = ELEMENTS, settings: StepControl | None = None
) -> SequenceReplay:
    """Both motions on the full model, each from the state that the one before left."""
    return replay_drives(law.case, law.durations, law.drives, elements, settings)


def replay_drives(
    case: Sequence,
    durations: tuple[float, float, float],
    drives: tuple[Torque, Torque],
    elements: int = ELEMENTS,
    settings: StepControl | None = None,
) -> SequenceReplay:
    """The same for torques of root and elbow over the time since their motion began."""
    big_time, dwell, small_time = durations
    root, elbow = drives
    chain = case.first.arm.chain(elements)
    settings = settings or steps_for(RESIDUAL)

    # the big arm, locked at the root and followed through the dwell
    first = run_and_lock(
        chain,
        case.first.full_joints({ROOT: root}),
        case.first.start_state(elements),
        np.linspace(0.0, big_time, SAMPLES),
        [ROOT],
        targets={ROOT: case.first.end[ROOT]},
        after=np.linspace(big_time, big_time + dwell, _DWELL_SAMPLES),
        settings=settings,
    )
    assert first.after is not None

    # the small arm, from the state in which the dwell ends
    clamped_root = first.engagement.joints[ROOT]
    assert isinstance(clamped_root, Locked)
    joints: list[Joint] = [clamped_root, elbow]
    second = run_and_lock(
        chain,
        joints,
        first.after.final,
        np.linspace(0.0, small_time, SAMPLES),
        [ELBOW],
        targets={ELBOW: case.second.end[ELBOW]},
        settings=settings,
    )
    stages = case.first.lasting(big_time), case.second.lasting(small_time)
    motions = (
        Motion("big arm", "torque", stages[0], {ROOT: root}),
        Motion("small arm", "torque", stages[1], {ELBOW: elbow}),
    )
    big, small = (
        LockedMotion(motion, run) for motion, run in zip(motions, (first, second), strict=True)
    )
    return SequenceReplay(big, small)


def replay_reduced(law: SequenceLaw) -> tuple[float, float]:
    """Energies right after both locks on B21 [J]."""
    case, (big_time, dwell, small_time) = law.case, law.durations
    root, elbow = law.drives

    # big arm, up to the lock of the root
    model = case.first.model
    run = simulate_reduced(
        model,
        model.at(*case.first.start),
        np.array([0.0, big_time]),
        root=root,
        tolerance=_TOLERANCE,
        method=method_for(model, case.first.start, big_time),
    )
    still, q, v = lock_reduced(model, run.q[:, -1], run.v[:, -1], root=True)
    after_first = sum(float(energy) for energy in still.energies(q, v))

    # locked, then released at the elbow
    run = simulate_reduced(
        still,
        q,
        np.array([0.0, dwell]),
        v=v,
        tolerance=_TOLERANCE,
        method=method_for(still, case.first.end, dwell),
    )
    free = dataclasses.replace(case.second.model, root_lock=still.root_lock)
    q, v = released(still, free, run.q[:, -1], run.v[:, -1])

    # small arm, up to the lock of the elbow
    run = simulate_reduced(
        free,
        q,
        np.array([0.0, small_time]),
        v=v,
        elbow=elbow,
        tolerance=_TOLERANCE,
        method=method_for(free, case.second.start, small_time),
    )
    end, q, v = lock_reduced(free, run.q[:, -1], run.v[:, -1], elbow=True)
    return after_first, sum(float(energy) for energy in end.energies(q, v))
