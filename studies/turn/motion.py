"""The best turn of a study: in closed form where there is one, and as the engine finds it.

Where the cap on the momentum that the wheels take acts, there is no closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.turn import (
    BangTurn,
    least_torque_bound,
    least_torque_turn,
    least_turn_time_bound,
    torque_limited_turn,
    turn_response,
)
from ocp import OcpError, Solution, solve
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.turn.config import TurnStudy
from studies.turn.problem import GUESS_ROWS, TurnStatement, rows_of, state

NARROW = 1e-12  # of the duration: an interval of a mesh that is left out
START = 1.05  # of the bound: duration of a first guess without a closed form


@dataclass(frozen=True, eq=False)
class BestTurn:
    """What was found.

    Attributes
    ----------
    statement, solution : of the engine.
    """

    statement: TurnStatement
    solution: Solution

    def drive(self, solution: Solution | None = None) -> BangTurn:
        """The drive of this or another solution: constant acceleration in each interval."""
        phase = (solution or self.solution).trajectory.phases[0]
        kept = np.flatnonzero(np.diff(phase.breakpoints) > NARROW * phase.end)
        values = phase.polynomial(self.statement.acceleration).powers()[kept, 0, 0]
        edges = np.append(phase.breakpoints[kept], phase.end)
        edges[0] = 0.0

        # arcs of one acceleration, as far as the solver holds it, are one
        arcs = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist()]
        switches = (*edges[arcs].tolist(), float(edges[-1]))
        return BangTurn(switches, tuple(values[arcs].tolist()), math.nan)


def best_turn(study: TurnStudy, console: Console, kept: FinishedSteps = NOTHING_KEPT) -> BestTurn:
    """Solve the study's problem from its closed form, or from the turn of a rigid arm.

    Raises
    ------
    StudyError
        If no turn is found.
    """
    known = closed_form(study)
    guess = known or _without_wheels(study) or _rigid(study)
    statement = state(study, guess, known is not None)
    problem, settings = statement.problem, statement.settings
    try:
        found = kept.step(
            "turn",
            lambda: solve(problem, settings=settings, progress=console.live),
            problem,
            console.progress,
        )
    except OcpError as error:
        raise StudyError(str(error), ExitCode.NOT_SOLVED) from error
    return BestTurn(statement, found)


def closed_form(study: TurnStudy) -> BangTurn | None:
    """The best turn; None where it has no closed form."""
    known, most = _without_wheels(study), study.wheel_momentum
    if known is None or most is None:
        return known
    moved = turn_response(study.parameters, *rows_of(known, GUESS_ROWS))
    handed = study.parameters.inertia * float(np.abs(moved.antenna_rate).max())
    if study.minimise == "utilisation":
        most *= known.peak_torque / study.most_torque
    return known if handed <= most else None


def _without_wheels(study: TurnStudy) -> BangTurn | None:
    """The best turn if the momentum has no cap."""
    turn, limit = study.parameters, study.drive_acceleration
    if study.minimise == "time":
        return torque_limited_turn(turn, study.angle, study.most_torque, limit)
    return least_torque_turn(turn, study.angle, study.duration, limit)


def least_torque(study: TurnStudy) -> float:
    """A bound on the peak torque in the duration [N m], by the closed form if there is one."""
    known = _without_wheels(study)
    if known is not None:
        return known.peak_torque
    return least_torque_bound(study.parameters, study.angle, study.duration)


def least_momentum(study: TurnStudy) -> float:
    """A bound on the peak angular momentum in the duration [N m s]: J D / T."""
    return study.parameters.inertia * study.angle / study.duration


def least_utilisation(study: TurnStudy) -> float:
    """A bound on the largest part of the caps on torque and momentum in the duration."""
    h = study.wheel_momentum
    parts = [least_torque(study) / study.most_torque]
    return max(parts if h is None else [*parts, least_momentum(study) / h])


def least_duration(study: TurnStudy) -> float:
    """A bound on the duration under the caps [s], by the closed form if there is one."""
    known, turn, h = _without_wheels(study), study.parameters, study.wheel_momentum
    limits = (study.most_torque, study.drive_acceleration)
    bound = least_turn_time_bound(turn, study.angle, *limits) if known is None else known.duration
    return bound if h is None else max(bound, turn.inertia * study.angle / h)


def _rigid(study: TurnStudy) -> BangTurn:
    """A first guess where there is no closed form: the drive pushes half of the way, and brakes."""
    duration = study.duration
    if study.minimise == "time":
        duration = min(duration, START * least_duration(study))
    push = 4.0 * study.angle / duration**2
    switches = (0.0, duration / 2, duration)
    return BangTurn(switches, (push, -push), study.parameters.inertia * push)
