"""Laws that are the integral of an acceleration: of a control, or of the engine's replay.

Both are exact to rounding between their rows, so that whoever asks for the motion needs no
expression any more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.laws import Hermite
from ocp import Solution
from ocp.arrays import Array
from studies.truss.config import TrussStudy
from studies.truss.expressions import acceleration_in
from studies.truss.problem import Statement

EXACT_DEGREE = 3  # of an acceleration between two rows that give angle, speed and acceleration
ROWS_AN_INTERVAL = 16  # of a replay: the force is then good to 1e-8 between them
# of Gauss and Legendre between two rows, from 0 to 1; of an order beyond that of the law there
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS_POINTS, GAUSS_WEIGHTS = (1.0 + _POINTS) / 2.0, _WEIGHTS / 2.0
HELD = 1e-8  # of the peak acceleration: what may be added to hold a law to its replay
JOINT = 1e-9  # of the duration: intervals of a replay that are shorter are left out


def integrated_law(study: TrussStudy, acceleration: str, solution: Solution) -> Hermite:
    """The exact integral of an acceleration that is a polynomial in each interval.

    A replay's angles are good to 1e-11, and second differences of close rows would amplify that. So
    do those of rounded angles: there are no more rows than the polynomials need.
    """
    pieces, gains, turns = [], [], []
    shortest = JOINT * solution.trajectory.phases[-1].end
    for phase in solution.trajectory.phases:
        powers = phase.polynomial(acceleration).powers()[:, 0, :]
        for begin, end, coefficients in zip(
            phase.breakpoints[:-1], phase.breakpoints[1:], powers, strict=True
        ):
            width = end - begin
            if width <= shortest:
                continue
            rate = np.polynomial.Polynomial(coefficients)
            degree = int(np.flatnonzero(coefficients).max(initial=0))
            rows = 1 if degree <= EXACT_DEGREE else ROWS_AN_INTERVAL
            tau = np.linspace(0.0, 1.0, rows + 1)
            once, twice = rate.integ()(tau), rate.integ(2)(tau)
            pieces.append(np.column_stack([begin + width * tau, rate(tau)]))
            gains.append(width * np.diff(once))
            turns.append(width**2 * (np.diff(twice) - np.diff(tau) * once[:-1]))
    return _hermite(study, pieces, np.concatenate(gains), np.concatenate(turns))


def replayed_law(study: TrussStudy, statement: Statement, solution: Solution) -> Hermite:
    """The integral of the acceleration of the replay, for a solution whose control is a force.

    The acceleration is computed once, at rows so close that the law between them is as accurate as
    the replay itself. Whoever asks for the motion then needs no expression any more. It is not that
    of the replay's angles, whose second differences between close rows are noise: the force that
    follows from them was off by 1e-5 of its peak.
    """
    signals = statement.signals
    within = (np.arange(ROWS_AN_INTERVAL)[:, None] + np.append(0.0, GAUSS_POINTS)).ravel()
    tau = np.append(within / ROWS_AN_INTERVAL, 1.0)
    shortest = JOINT * solution.replayed.phases[-1].end

    times, values, gains, turns, ends = [], [], [], [], []
    for motion, net in zip(solution.replayed.phases, statement.nets, strict=True):
        kept = np.flatnonzero(np.diff(motion.breakpoints) > shortest)
        dense = solution.evaluator.values(
            solution.replayed,
            motion.name,
            [acceleration_in(signals, net)],
            np.repeat(kept, tau.size),
            np.tile(tau, kept.size),
        ).reshape(kept.size, tau.size)

        # Gauss's rule between rows, for the integral and for the integral of the integral
        width = np.diff(motion.breakpoints)[kept, None] / ROWS_AN_INTERVAL
        inner = dense[:, :-1].reshape(kept.size, ROWS_AN_INTERVAL, -1)[:, :, 1:]
        gains.append(width * (inner @ GAUSS_WEIGHTS))
        turns.append(width**2 * (inner @ (GAUSS_WEIGHTS * (1.0 - GAUSS_POINTS))))

        times.append(motion.breakpoints[kept][:, None] + width * np.arange(ROWS_AN_INTERVAL + 1))
        values.append(dense[:, :: 1 + GAUSS_POINTS.size])
        states = [
            motion.polynomial(s.name).ends()[kept, 1, 0] for s in (signals.angle, signals.speed)
        ]
        ends.append(np.column_stack(states))

    return _hermite(
        study,
        *held(
            study.opening.start,
            np.vstack(times),
            np.vstack(values),
            np.vstack(gains),
            np.vstack(turns),
            np.vstack(ends),
            study.opening.rate,
        ),
    )


def held(
    start: float,
    times: Array,
    values: Array,
    gains: Array,
    turns: Array,
    ends: Array,
    rate: float = 0.0,
) -> tuple[list[Array], Array, Array]:
    """Pieces, gains and turns of an acceleration that is held to the states at `ends`.

    A motion may rest for minutes at an equilibrium that pulls it back. A replay feels that pull, an
    integral of its acceleration does not: what rounding leaves of a speed moves the angle for as
    long as the rest lasts. So each interval brings the law back to the replay, by an acceleration
    linear in time, the speed first. It is never more than noise: what is left the next one does.

    Parameters
    ----------
    start, rate : first angle and speed [rad, rad/s].
    times, values : of the rows [s], and the acceleration there [rad/s^2], (intervals, rows + 1).
    gains, turns : from row to row [rad/s, rad], shape (intervals, rows).
    ends : angle and speed of the replay where each interval ends [rad, rad/s], (intervals, 2).
    """
    # the last row of an interval gives way to the first one of the next
    steps = np.diff(np.append(times[:, :-1], times[-1, -1])).reshape(gains.shape)
    most = HELD * np.abs(values).max()
    tau = np.linspace(0.0, 1.0, values.shape[1])

    angle, speed, added = start, rate, np.zeros_like(values)
    for i, width in enumerate(steps.sum(axis=1)):
        before = speed + np.append(0.0, np.cumsum(gains[i])[:-1])
        angle, speed = angle + (steps[i] * before + turns[i]).sum(), speed + gains[i].sum()

        # a constant part for the speed, and one that changes sign for what the angle still misses
        constant = float(np.clip((ends[i, 1] - speed) / width, -most, most))
        room = most - abs(constant)
        wanted = 6.0 * ((ends[i, 0] - angle) / width**2 - constant / 2.0)
        slope = float(np.clip(wanted, -room, room))
        added[i] = constant + slope * (1.0 - 2.0 * tau)
        angle, speed = angle + width**2 * (constant / 2 + slope / 6), speed + width * constant

    first, last = added[:, :-1], added[:, 1:]
    held_gains = gains + steps * (first + last) / 2.0
    held_turns = turns + steps**2 * (first / 3.0 + last / 6.0)
    pieces = list(np.dstack([times, values + added]))
    return pieces, held_gains.ravel(), held_turns.ravel()


def _hermite(study: TrussStudy, pieces: Sequence[Array], gains: Array, turns: Array) -> Hermite:
    """The law from the start through rows of time and acceleration, (rows, 2) of each interval.

    Parameters
    ----------
    gains, turns : of all steps from row to row, as of `models.laws.Hermite`.
    """
    # the last row of an interval gives way to the first one of the next, but for the acceleration
    times, after = np.vstack([*(rows[:-1] for rows in pieces), pieces[-1][-1]]).T
    before = np.concatenate([pieces[0][:1, 1], *(rows[1:, 1] for rows in pieces)])
    times[0], after[-1] = 0.0, before[-1]

    speeds = np.cumsum(np.append(study.opening.rate, gains))
    steps = np.diff(times) * speeds[:-1] + turns
    angles = np.cumsum(np.append(study.opening.start, steps))
    speeds = np.maximum(speeds, 0.0)  # a bound of the solver leaves a little below
    return Hermite(times, angles, speeds, after, before, gains, turns)
