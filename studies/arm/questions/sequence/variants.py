"""What a sequence pays for: the smoothness beside its objective, and rest at the first lock."""

from __future__ import annotations

from collections.abc import Callable

from studies.arm.questions.sequence.problem import SMOOTHING, Least
from studies.arm.questions.sequence.solve import SolvedSequence, replay_reduced, solve_sequence

Say = Callable[[str], None]
LIGHTER = (0.1, 0.01)  # of the smoothness's weight


def smoothing_share(solved: SolvedSequence, say: Say) -> dict[str, float]:
    """Common peak torque, and its surcharge, where the smoothness weighs less and less.

    Raises
    ------
    StudyError
        If the solver finds no such motion.
    """
    case, found, out = solved.case, solved, {}
    for part in LIGHTER:
        weight = part * SMOOTHING
        found = solve_sequence(case, guess=found.trajectory, smoothing=weight, progress=say)
        peak = max(found.peaks)
        out[f"peak torque, smoothness at {weight:g} [N m]"] = peak
        over = 100 * (peak / case.rigid_bound - 1)
        out[f"surcharge over the rigid bound, smoothness at {weight:g} [%]"] = over
    return out


def without_rest(
    solved: SolvedSequence, least: Least, cap: float | None, left: float, say: Say
) -> dict[str, float]:
    """The same sequence where the first lock may meet an energy [J], rest only after the last.

    Raises
    ------
    StudyError
        If the solver finds no such motion.
    """
    found = solve_sequence(
        solved.case, least, cap, guess=solved.trajectory, left=left, progress=say
    )
    at_lock, at_end = replay_reduced(found)
    out = {
        "no rest at the first lock: energy it may meet [J]": left,
        "no rest at the first lock: energy after the first lock, B21 [J]": at_lock,
        "no rest at the first lock: energy after the last lock, B21 [J]": at_end,
    }
    if least == "time":
        before, after = (s.durations[0] + s.durations[2] for s in (solved, found))
        out |= {
            "no rest at the first lock: both motions [s]": after,
            "no rest at the first lock: gain [s]": before - after,
        }
    else:
        out |= {
            "no rest at the first lock: peak torque [N m]": max(found.peaks),
            "no rest at the first lock: gain [%]": 100 * (1 - max(found.peaks) / max(solved.peaks)),
        }
    return out
