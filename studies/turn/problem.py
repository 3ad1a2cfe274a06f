"""Stage 2 as an optimal control problem: antenna and drive from rest to rest.

States are the drive's angle, the twist of the arm, by which the antenna lags, and their rates. The
control is the acceleration of the drive, constant between its switches. Dynamics and limits are
linear: in a given duration a local optimum is the global one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.turn import BangTurn, turn_response
from ocp import AdaptiveMesh, Between, Bound, Control, Phase, Problem, Settings, State, peak
from ocp.arrays import Array
from studies.turn.config import TurnStudy

INTERVALS = 24
GUESS_ROWS = 2001
SHORTEST = 0.5  # of the bound, from which the least time is looked for


@dataclass(frozen=True, eq=False)
class TurnStatement:
    """A stated problem, and its signals for who reads the solution.

    Attributes
    ----------
    problem, settings : of the engine.
    acceleration : name of the control.
    """

    problem: Problem
    settings: Settings
    acceleration: str


def state(study: TurnStudy, guess: BangTurn, known: bool) -> TurnStatement:
    """State the study's problem.

    Parameters
    ----------
    guess : a turn to start from, of about the duration.
    known : whether it is the closed form, whose switches then are points of the mesh.
    """
    turn, angle = study.parameters, study.angle
    # the twist is millionths of the angles, whose difference would be exact to parts of these only
    shared, size = study.minimise == "utilisation", study.most_torque / turn.stiffness
    most = math.inf if shared else size
    twist = State("twist", "rad", -most, most, scale=size)
    twist_rate = State("twist rate", "rad/s")
    beta, beta_rate = State("drive angle", "rad"), State("drive rate", "rad/s")
    limit = study.drive_acceleration
    u = Control("drive acceleration", "rad/s^2", lower=-limit, upper=limit, piecewise="constant")

    timed = study.minimise == "time"
    end: Any = study.duration
    if timed:
        end = Between(SHORTEST * guess.duration, study.duration, guess=guess.duration)
    h = study.wheel_momentum
    momentum = turn.inertia * (beta_rate.symbol - twist_rate.symbol)
    bounds = [] if h is None or shared else [Bound("momentum", momentum, "N m s", -h, h)]

    rest = {twist: 0.0, twist_rate: 0.0, beta_rate: 0.0}
    phase = Phase(
        "turn",
        dynamics={
            twist: twist_rate,
            # of the drive less that of the antenna
            twist_rate: u.symbol - turn.frequency**2 * twist.symbol,
            beta: beta_rate,
            beta_rate: u,
        },
        initial={beta: 0.0, **rest},
        final={beta: angle, **rest},
        end=end,
        bounds=bounds,
        guess=dict(
            zip((twist, twist_rate, beta, beta_rate, u), _courses(study, guess), strict=True)
        ),
        breakpoints=guess.switches[1:-1] if known and not timed else (),
    )
    torque = turn.stiffness * twist.symbol
    if timed:
        least: Any = phase.end_time
    elif shared:
        parts = [torque / study.most_torque, *([] if h is None else [momentum / h])]
        least = peak(*((phase, part) for part in parts), name="utilisation", absolute=True)
    else:
        least = peak((phase, torque), name="peak torque", unit="N m", absolute=True)
    return TurnStatement(
        Problem("turn", (phase,), minimise=least),
        # without a budget of time, so that the answer is the same on a slower machine
        Settings(intervals=INTERVALS, refinement=AdaptiveMesh(move_breakpoints=True)),
        u.name,
    )


def _courses(study: TurnStudy, guess: BangTurn) -> list[Callable[[Any], Any]]:
    """States and control of a turn over time."""
    time, before, after = rows_of(guess, GUESS_ROWS)
    moved = turn_response(study.parameters, time, before, after)
    twist = moved.torque / study.parameters.stiffness
    twist_rate = moved.drive_rate - moved.antenna_rate
    histories = (twist, twist_rate, moved.drive_angle, moved.drive_rate)

    def course(values: Array) -> Callable[[Any], Any]:
        return lambda at: np.interp(at, time, values)

    return [*map(course, histories), course(after)]


def rows_of(turn: BangTurn, count: int) -> tuple[Array, Array, Array]:
    """Times of a turn and the drive's acceleration before and after each of them, (m,) each."""
    edges = np.array(turn.switches)
    time = np.union1d(np.linspace(0.0, turn.duration, count), edges)
    u, last = np.array(turn.accelerations), len(turn.accelerations) - 1
    after = u[np.clip(np.searchsorted(edges, time, "right") - 1, 0, last)]
    before = u[np.clip(np.searchsorted(edges, time) - 1, 0, last)]
    return time, before, after
